//! Golden bytes of every message. A change of any of them is a change of the protocol and needs a greater
//! `PROTOCOL_VERSION`.

use bytes::Bytes;
use rayfarm_protocol::envelope::{Kind, read_body, read_header};
use rayfarm_protocol::message::Message;
use rayfarm_protocol::peer::{PeerRequest, ShareKey, Token, send_request};
use rayfarm_protocol::{
    AssetId, Encoding, FrameAnnounce, FrameId, Hello, KeyHash, PROTOCOL_VERSION, PixelFormat, PixelsHeader,
    Reconnect, ToMaster, ToWorker, Welcome, codec, limits,
};

use crate::common::{lease, pixels, wire};

const ID: AssetId = AssetId([0xab; 32]);

/// Checks that a message encodes to these bytes, and that these bytes decode to the message.
async fn golden<M: Message + PartialEq + std::fmt::Debug>(message: M, parts: &[&[u8]]) {
    let expected = parts.concat();
    assert_eq!(wire(&message).await, expected);
    let mut rest = expected.as_slice();
    let header = read_header(&mut rest).await.unwrap().unwrap();
    let body = read_body(&mut rest, header).await.unwrap();
    assert_eq!(M::from_body(header.kind, body).unwrap(), message);
    assert!(rest.is_empty());
}

#[test]
fn the_golden_bytes_are_those_of_version_7() {
    assert_eq!(PROTOCOL_VERSION, 7);
}

#[tokio::test]
async fn messages_to_a_worker() {
    let view = Bytes::from_static(b"view");
    let format = PixelFormat::Sums;
    let announce = FrameAnnounce { frame: FrameId(7), scene: ID, width: 640, height: 480, format, view };
    let frame: [&[u8]; 7] = [
        &[56, 0, 0, 0, 0x10, 0, 0, 0],
        &[7, 0, 0, 0, 0, 0, 0, 0],
        &[0xab; 32],
        &[0x80, 2, 0, 0],
        &[0xe0, 1, 0, 0],
        &[2, 0, 0, 0],
        b"view",
    ];
    golden(ToWorker::Frame(announce), &frame).await;

    let segment: [&[u8]; 3] = [
        &[24, 0, 0, 0, 0x11, 0, 0, 0],
        &[4, 0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0, 1, 0, 0, 0],
        &[16, 0, 0, 0, 8, 0, 0, 0],
    ];
    golden(ToWorker::Segment(lease(9)), &segment).await;

    let number = [5, 0, 0, 0, 0, 0, 0, 0];
    golden(ToWorker::Cancel { before: FrameId(5) }, &[&[8, 0, 0, 0, 0x12, 0, 0, 0], &number]).await;
    golden(ToWorker::AssetBegin { id: ID, size: 5 }, &[&[40, 0, 0, 0, 0x13, 0, 0, 0], &ID.0, &number]).await;
    let chunk = ToWorker::AssetChunk { id: ID, offset: 5, bytes: Bytes::from_static(b"xyz") };
    golden(chunk, &[&[43, 0, 0, 0, 0x14, 0, 0, 0], &ID.0, &number, b"xyz"]).await;
    golden(ToWorker::AssetUnknown { id: ID }, &[&[32, 0, 0, 0, 0x15, 0, 0, 0], &ID.0]).await;
    let peer = ([10, 0, 0, 7], 0x1234).into();
    let from = |peer_key| ToWorker::AssetFrom { id: ID, size: 5, peer, peer_key, token: Token([0xcd; 32]) };
    let v4: &[u8] = &[0, 0, 0, 0, 10, 0, 0, 7, 0x34, 0x12];
    golden(from(None), &[&[83, 0, 0, 0, 0x16, 0, 0, 0], &ID.0, &number, v4, &[0], &[0xcd; 32]]).await;
    let head = [115, 0, 0, 0, 0x16, 0, 0, 0];
    let key = Some(KeyHash([0xab; 32]));
    golden(from(key), &[&head, &ID.0, &number, v4, &[1], &[0xab; 32], &[0xcd; 32]]).await;
    let key = ToWorker::ShareKey { key: ShareKey([0xef; 32]), generation: 5 };
    golden(key, &[&[40, 0, 0, 0, 0x17, 0, 0, 0], &[0xef; 32], &number]).await;
    golden(ToWorker::Ping { nonce: 5 }, &[&[8, 0, 0, 0, 0x30, 0, 0, 0], &number]).await;
    golden(ToWorker::Drain, &[&[0, 0, 0, 0, 0x32, 0, 0, 0]]).await;
    let disconnect = ToWorker::Disconnect { reason: "hé".into(), reconnect: Reconnect::Now };
    golden(disconnect, &[&[4, 0, 0, 0, 0x33, 0, 0, 0], &[1], b"h\xc3\xa9"]).await;
    for (reconnect, code) in [(Reconnect::Never, 0), (Reconnect::NextMaster, 2)] {
        let disconnect = ToWorker::Disconnect { reason: "no".into(), reconnect };
        golden(disconnect, &[&[3, 0, 0, 0, 0x33, 0, 0, 0], &[code], b"no"]).await;
    }
}

#[tokio::test]
async fn messages_to_a_master() {
    let number = [5, 0, 0, 0, 0, 0, 0, 0];
    let need = ToMaster::NeedAsset { id: ID, offset: 5, again: true };
    golden(need, &[&[41, 0, 0, 0, 0x20, 0, 0, 0], &ID.0, &number, &[1]]).await;
    golden(ToMaster::Sharing { port: 0x1234 }, &[&[2, 0, 0, 0, 0x23, 0, 0, 0], &[0x34, 0x12]]).await;
    golden(ToMaster::HaveAsset { id: ID }, &[&[32, 0, 0, 0, 0x24, 0, 0, 0], &ID.0]).await;
    let rows: [&[u8]; 12] = [
        &[90, 0, 0, 0, 0x21, 0, 0, 0],
        &[4, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0],
        &[16, 0, 0, 0, 8, 0, 0, 0],
        &[0; 8],
        &number,
        &[9, 0, 0, 0, 0, 0, 0, 0],
        &[10, 0, 0, 0, 0, 0, 0, 0],
        &[11, 0, 0, 0, 0, 0, 0, 0],
        &[6, 0, 0, 0, 0, 0, 0, 0],
        &[7, 0, 0, 0, 0, 0, 0, 0],
        &[8, 0, 0, 0, 0, 0, 0, 0],
        &[2, 2],
    ];
    golden(pixels(2, 2), &rows).await;
    let ToMaster::Pixels { header, bytes } = pixels(2, 2) else { panic!("`pixels` makes another message") };
    let encodings = [Encoding::Lz4, Encoding::Rgb565, Encoding::Rgb565Lz4, Encoding::PlanesLz4];
    for (encoding, code) in encodings.into_iter().zip(1..) {
        let mut rows = rows;
        let code = [code, 0, 0, 0, 0, 0, 0, 0];
        rows[3] = &code;
        let (header, bytes) = (PixelsHeader { encoding, ..header }, bytes.clone());
        golden(ToMaster::Pixels { header, bytes }, &rows).await;
    }
    for (progressed, code) in [(false, 0), (true, 1)] {
        let pong = ToMaster::Pong { nonce: 5, progressed };
        golden(pong, &[&[9, 0, 0, 0, 0x31, 0, 0, 0], &number, &[code]]).await;
    }
    let failed = ToMaster::Failed { frame: FrameId(5), reason: "no".into() };
    golden(failed, &[&[10, 0, 0, 0, 0x22, 0, 0, 0], &number, b"no"]).await;
    golden(ToMaster::Drain, &[&[0, 0, 0, 0, 0x32, 0, 0, 0]]).await;
    golden(ToMaster::Disconnect { reason: "x".into() }, &[&[1, 0, 0, 0, 0x33, 0, 0, 0], b"x"]).await;
}

#[tokio::test]
async fn a_request_of_a_worker_and_its_token() {
    let mut bytes = Vec::new();
    let request = PeerRequest { id: ID, token: Token([0xcd; 32]), offset: 5 };
    send_request(&mut bytes, &request).await.unwrap();
    let parts: [&[u8]; 4] = [&[72, 0, 0, 0, 0x40, 0, 0, 0], &ID.0, &[0xcd; 32], &[5, 0, 0, 0, 0, 0, 0, 0]];
    assert_eq!(bytes, parts.concat());
    let key = ShareKey([0; 32]);
    let token = Token::new(&key, ID, None, 3);
    let hashed = |requester: [u8; 32]| [&ID.0[..], &requester, &[3, 0, 0, 0, 0, 0, 0, 0]].concat();
    assert_eq!(token, Token(blake3::keyed_hash(&key.0, &hashed([0; 32])).into()));
    let requester = Some(KeyHash([7; 32]));
    let bound = Token::new(&key, ID, requester, 3);
    assert_eq!(bound, Token(blake3::keyed_hash(&key.0, &hashed([7; 32])).into()));
    for other in [
        Token::new(&ShareKey([1; 32]), ID, requester, 3),
        Token::new(&key, AssetId([0; 32]), requester, 3),
        Token::new(&key, ID, Some(KeyHash([8; 32])), 3),
        Token::new(&key, ID, requester, 4),
        token,
    ] {
        assert_ne!(bound, other);
    }
    assert_eq!(format!("{token:?} {:?}", ShareKey([1; 32])), "Token(..) ShareKey(..)");
}

#[test]
fn hello_and_welcome() {
    let hello = Hello {
        name: "a".into(),
        threads: 2,
        simd: "bc".into(),
        software: "d".into(),
        tags: vec!["t".into()],
    };
    let bytes: [&[u8]; 7] = [
        &[1, 0, 0, 0, 0, 0, 0, 0, b'a'],
        &[2, 0, 0, 0],
        &[2, 0, 0, 0, 0, 0, 0, 0],
        b"bc",
        &[1, 0, 0, 0, 0, 0, 0, 0],
        b"d",
        &[1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, b't'],
    ];
    assert_eq!(codec::encode(&hello).unwrap(), bytes.concat());
    assert_eq!(codec::decode::<Hello>(&bytes.concat(), limits::MAX_CONTROL_BYTES).unwrap(), hello);
    assert_eq!(codec::encode(&Welcome { worker: 3 }).unwrap(), [3, 0, 0, 0, 0, 0, 0, 0]);
}

#[test]
fn an_asset_id_is_the_blake3_hash_of_the_bytes() {
    let name = "af1349b9f5f9a1a6a0404dea36dcc9499bcb25c9adc112b7cc9a93cae41f3262";
    assert_eq!(AssetId::of(b"").to_string(), name);
}

#[test]
fn only_bulk_messages_have_large_limits() {
    for kind in Kind::ALL {
        let bulk = matches!(kind, Kind::Pixels | Kind::AssetChunk);
        assert_eq!(kind.limit_bytes() > 2 * limits::MAX_CONTROL_BYTES, bulk, "{kind}");
    }
}
