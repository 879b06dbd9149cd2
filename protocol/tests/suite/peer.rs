//! Transfer of assets between workers: split streams, arbitrary bytes, corrupted bytes, silent peers.

use bytes::Bytes;
use proptest::collection::vec;
use proptest::prelude::*;
use rayfarm_protocol::peer::{
    PeerReply, PeerRequest, Token, receive_reply, receive_request, send_reply, send_request,
};
use rayfarm_protocol::{AssetId, ProtocolError, limits};
use tokio::io::{AsyncWriteExt, duplex};

const ID: AssetId = AssetId([5; 32]);

fn block_on<T>(work: impl Future<Output = T>) -> T {
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build().unwrap();
    runtime.block_on(work)
}

fn request(offset: u64) -> PeerRequest {
    PeerRequest { id: ID, token: Token([6; 32]), offset }
}

/// Receives all parts of a reply from bytes that arrive in pieces, and the error after the last part.
async fn receive_all(bytes: Vec<u8>, piece_bytes: usize) -> (Vec<PeerReply>, ProtocolError) {
    let (mut ours, mut theirs) = duplex(61);
    let writer = tokio::spawn(async move {
        for piece in bytes.chunks(piece_bytes.max(1)) {
            if theirs.write_all(piece).await.is_err() {
                return;
            }
        }
    });
    let mut received = Vec::new();
    loop {
        match receive_reply(&mut ours, ID).await {
            Ok(reply) => received.push(reply),
            Err(error) => {
                drop(ours);
                writer.await.unwrap();
                return (received, error);
            }
        }
    }
}

fn replies() -> Vec<PeerReply> {
    let chunk = |offset, bytes| PeerReply::Chunk { offset, bytes: Bytes::from_static(bytes) };
    vec![
        PeerReply::Begin { size: 9 },
        chunk(0, b"abcd"),
        PeerReply::Waiting { hops: 3 },
        chunk(4, b"efghi"),
        PeerReply::Unknown,
    ]
}

async fn wire(replies: &[PeerReply]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for reply in replies {
        send_reply(&mut bytes, ID, reply.clone()).await.unwrap();
    }
    bytes
}

proptest! {
    #[test]
    fn requests_and_replies_arrive_in_pieces_of_any_size(offset: u64, piece_bytes in 1..200usize) {
        block_on(async {
            let mut bytes = Vec::new();
            send_request(&mut bytes, &request(offset)).await.unwrap();
            assert_eq!(receive_request(&mut bytes.as_slice()).await.unwrap(), request(offset));
            let (received, error) = receive_all(wire(&replies()).await, piece_bytes).await;
            assert_eq!(received, replies());
            assert!(matches!(error, ProtocolError::Closed { .. }), "{error}");
        });
    }

    #[test]
    fn arbitrary_bytes_end_in_an_error(bytes in vec(any::<u8>(), 0..400), piece_bytes in 1..50usize) {
        block_on(async {
            let _ = receive_request(&mut bytes.as_slice()).await;
            let (received, _) = receive_all(bytes, piece_bytes).await;
            assert!(received.len() < 400);
        });
    }

    #[test]
    fn corrupted_and_cut_streams_end_in_an_error(
        at: prop::sample::Index,
        byte: u8,
        cut: prop::sample::Index,
    ) {
        block_on(async {
            let mut bytes = wire(&replies()).await;
            let place = at.index(bytes.len());
            bytes[place] = byte;
            bytes.truncate(cut.index(bytes.len()));
            let (received, _) = receive_all(bytes, 7).await;
            assert!(received.len() <= replies().len());
        });
    }
}

#[tokio::test(start_paused = true)]
async fn a_silent_peer_times_out() {
    let (mut ours, _theirs) = duplex(64);
    let error = receive_reply(&mut ours, ID).await.unwrap_err();
    assert!(matches!(error, ProtocolError::Deadline { limit: limits::PEER_TIMEOUT, .. }), "{error}");
    let error = receive_request(&mut ours).await.unwrap_err();
    assert!(matches!(error, ProtocolError::Deadline { limit: limits::HANDSHAKE_DEADLINE, .. }), "{error}");
}

#[tokio::test]
async fn other_messages_and_other_assets_are_refused() {
    let mut bytes = Vec::new();
    send_reply(&mut bytes, AssetId([9; 32]), PeerReply::Begin { size: 1 }).await.unwrap();
    let error = receive_reply(&mut bytes.as_slice(), ID).await.unwrap_err();
    assert!(matches!(error, ProtocolError::Unexpected { .. }), "{error}");
    let mut sent = Vec::new();
    send_request(&mut sent, &request(0)).await.unwrap();
    assert!(matches!(receive_reply(&mut sent.as_slice(), ID).await, Err(ProtocolError::Unexpected { .. })));
    assert!(matches!(receive_request(&mut bytes.as_slice()).await, Err(ProtocolError::Unexpected { .. })));
    // A header of eight bytes that announces 4 GiB.
    for kind in [0x13, 0x14, 0x15, 0x30, 0x40] {
        let header = [0xff, 0xff, 0xff, 0xff, kind, 0, 0, 0];
        assert!(matches!(
            receive_reply(&mut header.as_slice(), ID).await,
            Err(ProtocolError::TooLong { .. })
        ));
        assert!(matches!(receive_request(&mut header.as_slice()).await, Err(ProtocolError::TooLong { .. })));
    }
}
