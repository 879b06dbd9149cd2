//! Properties: all messages survive a round trip, and arbitrary bytes cause no panic.

use bytes::Bytes;
use proptest::collection::vec;
use proptest::prelude::*;
use rayfarm_protocol::envelope::Kind;
use rayfarm_protocol::message::Message;
use rayfarm_protocol::peer::{ShareKey, Token};
use rayfarm_protocol::session::spawn;
use rayfarm_protocol::{
    AssetId, Cost, Encoding, FrameAnnounce, FrameId, Hello, KeyHash, Lease, PROTOCOL_VERSION, PixelFormat,
    PixelsHeader, ProtocolError, ToMaster, ToWorker, Welcome, codec, handshake, limits,
};
use rayfarm_text::printable;
use tokio::io::{AsyncWriteExt, duplex};

use crate::common::wire;

fn leases() -> impl Strategy<Value = Lease> {
    (any::<u64>(), any::<u32>(), any::<u32>(), 0..16_000u32, 1..16_000u32).prop_map(
        |(frame, segment, attempt, first_row, row_count)| Lease {
            frame: FrameId(frame),
            segment,
            attempt,
            first_row,
            row_count,
        },
    )
}

fn ids() -> impl Strategy<Value = AssetId> {
    any::<[u8; 32]>().prop_map(AssetId)
}

fn bytes(sizes: std::ops::Range<usize>) -> impl Strategy<Value = Bytes> {
    vec(any::<u8>(), sizes).prop_map(Bytes::from)
}

/// Removes flow and scope of an address, which the wire does not carry.
fn without_scope(address: std::net::SocketAddr) -> std::net::SocketAddr {
    (address.ip(), address.port()).into()
}

fn to_worker() -> impl Strategy<Value = ToWorker> {
    let side = 1..=limits::MAX_FRAME_SIDE;
    let format = proptest::sample::select(PixelFormat::ALL.to_vec());
    prop_oneof![
        (any::<u64>(), ids(), side.clone(), side, format, bytes(0..300)).prop_map(
            |(frame, scene, width, height, format, view)| {
                ToWorker::Frame(FrameAnnounce { frame: FrameId(frame), scene, width, height, format, view })
            }
        ),
        leases().prop_map(ToWorker::Segment),
        any::<u64>().prop_map(|before| ToWorker::Cancel { before: FrameId(before) }),
        (ids(), 0..=limits::MAX_ASSET_BYTES).prop_map(|(id, size)| ToWorker::AssetBegin { id, size }),
        (ids(), 0..1u64 << 30, bytes(1..3000)).prop_map(|(id, offset, bytes)| ToWorker::AssetChunk {
            id,
            offset,
            bytes
        }),
        ids().prop_map(|id| ToWorker::AssetUnknown { id }),
        (
            ids(),
            0..=limits::MAX_ASSET_BYTES,
            any::<std::net::SocketAddr>(),
            any::<Option<[u8; 32]>>(),
            any::<[u8; 32]>()
        )
            .prop_map(|(id, size, peer, peer_key, token)| ToWorker::AssetFrom {
                id,
                size,
                peer: without_scope(peer),
                peer_key: peer_key.map(KeyHash),
                token: Token(token)
            }),
        any::<([u8; 32], u64)>()
            .prop_map(|(key, generation)| ToWorker::ShareKey { key: ShareKey(key), generation }),
        any::<u64>().prop_map(|nonce| ToWorker::Ping { nonce }),
        Just(ToWorker::Drain),
    ]
}

fn headers() -> impl Strategy<Value = PixelsHeader> {
    let encodings = prop_oneof![
        Just(Encoding::Raw),
        Just(Encoding::Lz4),
        Just(Encoding::Rgb565),
        Just(Encoding::Rgb565Lz4),
        Just(Encoding::PlanesLz4)
    ];
    (leases(), encodings, any::<[u64; 7]>()).prop_map(|(lease, encoding, numbers)| {
        let [trace_ns, wait_ns, encode_ns, span_ns, primary, shadow, secondary] = numbers;
        let cost = Cost { trace_ns, wait_ns, encode_ns, span_ns, primary, shadow, secondary };
        PixelsHeader { lease, encoding, cost }
    })
}

fn to_master() -> impl Strategy<Value = ToMaster> {
    prop_oneof![
        (ids(), 0..=limits::MAX_ASSET_BYTES, any::<bool>())
            .prop_map(|(id, offset, again)| ToMaster::NeedAsset { id, offset, again }),
        (1..=u16::MAX).prop_map(|port| ToMaster::Sharing { port }),
        ids().prop_map(|id| ToMaster::HaveAsset { id }),
        (headers(), bytes(0..3000)).prop_map(|(header, bytes)| ToMaster::Pixels { header, bytes }),
        any::<(u64, bool)>().prop_map(|(nonce, progressed)| ToMaster::Pong { nonce, progressed }),
        (any::<u64>(), "[!-~äöü][ -~äöü]{0,199}")
            .prop_map(|(frame, reason)| ToMaster::Failed { frame: FrameId(frame), reason }),
        Just(ToMaster::Drain),
    ]
}

fn hellos() -> impl Strategy<Value = Hello> {
    let text = "\\PC{0,20}";
    (text, 1..200u32, text, text, vec("\\PC{0,9}|[\\x00-\\x1f]{1,9}", 0..4))
        .prop_map(|(name, threads, simd, software, tags)| Hello { name, threads, simd, software, tags })
}

/// Fails where the text of an error has characters that a log or a terminal must not receive.
fn expect_printable(error: &ProtocolError) {
    let text = error.to_string();
    assert_eq!(printable(&text), text);
}

/// Sends these bytes to a master, and then to a worker, as a handshake. Returns the worker that the master accepted, if
/// any. An error means that one of the two handshakes did not end within twice its deadline.
async fn shake_hands(input: &[u8]) -> Result<Option<Hello>, tokio::time::error::Elapsed> {
    let (mut ours, mut theirs) = duplex(4096);
    theirs.write_all(input).await.unwrap();
    theirs.shutdown().await.unwrap();
    let accept = |_: &Hello, _: Option<rayfarm_protocol::KeyHash>| Ok(Welcome { worker: 1 });
    let limit = 2 * limits::HANDSHAKE_DEADLINE;
    let accepted = tokio::time::timeout(
        limit,
        handshake::as_master(&mut ours, &rayfarm_protocol::transport::MasterSecurity::Plain, accept),
    )
    .await?;
    let accepted = match accepted {
        Ok((_, hello)) => Some(hello),
        Err(error) => {
            expect_printable(&error);
            None
        }
    };

    let (mut ours, mut theirs) = duplex(4096);
    theirs.write_all(input).await.unwrap();
    theirs.shutdown().await.unwrap();
    let hello = Hello {
        name: String::new(),
        threads: 1,
        simd: String::new(),
        software: String::new(),
        tags: Vec::new(),
    };
    let joined = tokio::time::timeout(
        limit,
        handshake::as_worker(&mut ours, &rayfarm_protocol::transport::WorkerSecurity::Plain, &hello),
    )
    .await?;
    joined.err().iter().for_each(expect_printable);
    Ok(accepted)
}

fn block_on<T>(work: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap().block_on(work)
}

/// Sends bytes to a session in pieces, and returns everything that the session delivers.
async fn receive<In: Message, Out: Message>(input: Vec<u8>, piece: usize) -> Vec<Result<In, String>> {
    let (ours, mut theirs) = duplex(97);
    let (out, mut received, _) = spawn::<_, Out, In>(ours);
    let writer = tokio::spawn(async move {
        for part in input.chunks(piece) {
            if theirs.write_all(part).await.is_err() {
                return;
            }
            tokio::task::yield_now().await;
        }
    });
    let mut received_all = Vec::new();
    while let Some(message) = received.recv().await {
        received_all.push(message.map_err(|error| error.to_string()));
    }
    drop((out, received));
    writer.await.unwrap();
    received_all
}

async fn stream(messages: &[impl Message]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for message in messages {
        bytes.extend(wire(message).await);
    }
    bytes
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn messages_to_a_worker_round_trip(messages in vec(to_worker(), 1..8), piece in 1..200usize) {
        let received = block_on(async { receive::<ToWorker, ToMaster>(stream(&messages).await, piece).await });
        prop_assert_eq!(received, messages.into_iter().map(Ok).collect::<Vec<_>>());
    }

    #[test]
    fn messages_to_a_master_round_trip(messages in vec(to_master(), 1..8), piece in 1..200usize) {
        let received = block_on(async { receive::<ToMaster, ToWorker>(stream(&messages).await, piece).await });
        prop_assert_eq!(received, messages.into_iter().map(Ok).collect::<Vec<_>>());
    }

    #[test]
    fn arbitrary_bytes_end_in_at_most_one_error(input in vec(any::<u8>(), 0..400)) {
        let received = block_on(receive::<ToMaster, ToWorker>(input, 64));
        prop_assert!(received.iter().filter(|message| message.is_err()).count() <= 1);
        prop_assert!(received.iter().rev().skip(1).all(Result::is_ok), "a message follows an error");
    }

    #[test]
    fn a_corrupted_stream_to_a_worker_ends_in_at_most_one_error(
        messages in vec(to_worker(), 1..5),
        hits in vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let received = block_on(async {
            let mut bytes = stream(&messages).await;
            for (at, value) in hits {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            receive::<ToWorker, ToMaster>(bytes, 64).await
        });
        prop_assert!(received.iter().rev().skip(1).all(Result::is_ok), "a message follows an error");
    }

    #[test]
    fn a_corrupted_stream_to_a_master_ends_in_at_most_one_error(
        messages in vec(to_master(), 1..5),
        hits in vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let received = block_on(async {
            let mut bytes = stream(&messages).await;
            for (at, value) in hits {
                let at = at.index(bytes.len());
                bytes[at] = value;
            }
            receive::<ToMaster, ToWorker>(bytes, 64).await
        });
        prop_assert!(received.iter().rev().skip(1).all(Result::is_ok), "a message follows an error");
    }

    #[test]
    fn a_handshake_with_arbitrary_bytes_is_refused(input in vec(any::<u8>(), 0..200), is_rayfarm: bool) {
        let input = if is_rayfarm { [b"RAYFARM\n".as_slice(), &input].concat() } else { input };
        prop_assert!(block_on(shake_hands(&input)).is_ok());
    }

    #[test]
    fn a_corrupted_handshake_is_refused_or_valid(
        hello in hellos(),
        hits in vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        cut in prop::option::weighted(0.2, any::<prop::sample::Index>()),
    ) {
        let mut bytes = [b"RAYFARM\n".as_slice(), &PROTOCOL_VERSION.to_le_bytes(), &[2, 0]].concat();
        let body = codec::encode(&hello).unwrap();
        bytes.extend((body.len() as u32).to_le_bytes());
        bytes.extend([0x01, 0, 0, 0]);
        bytes.extend(body);
        for (at, value) in hits {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if let Some(cut) = cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok(Some(hello)) = block_on(shake_hands(&bytes)) {
            let texts = [&hello.name, &hello.simd, &hello.software];
            prop_assert!(hello.threads > 0);
            prop_assert!(texts.into_iter().chain(&hello.tags).all(|text| printable(text) == text.as_str()));
        }
    }

    #[test]
    fn errors_of_arbitrary_bodies_are_printable(body in bytes(0..300), text in "[\\x00-\\x1f]{0,99}") {
        for kind in Kind::ALL {
            for body in [body.clone(), Bytes::from(text.clone())] {
                ToMaster::from_body(kind, body.clone()).err().iter().for_each(expect_printable);
                ToWorker::from_body(kind, body).err().iter().for_each(expect_printable);
            }
        }
    }

    #[test]
    fn reasons_of_any_content_arrive_bounded_and_printable(reason in "\\PC{0,40}|[\\x00-\\x1f]{0,9}|(ä){3000}") {
        let sent = ToMaster::Disconnect { reason: reason.clone() };
        let received = block_on(async { receive::<ToMaster, ToWorker>(wire(&sent).await, 1000).await });
        let Some(Ok(ToMaster::Disconnect { reason: arrived })) = received.into_iter().next() else {
            return Err(TestCaseError::fail("no disconnect"));
        };
        prop_assert!(arrived.len() <= limits::MAX_REASON_BYTES && printable(&arrived) == arrived);
        prop_assert!(!arrived.is_empty());
        if reason.len() <= limits::MAX_REASON_BYTES {
            prop_assert_eq!(arrived, printable(&reason));
        }
    }
}
