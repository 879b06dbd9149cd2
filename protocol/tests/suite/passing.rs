//! What one worker says to another: torn, hostile, damaged.

use bytes::Bytes;
use proptest::collection::vec;
use proptest::prelude::*;
use rayfarm_protocol::passing::{Fetch, Passed, Token, ask, hear, next, pass};
use rayfarm_protocol::{AssetId, ProtocolError, limits};
use tokio::io::{AsyncWriteExt, duplex};

const ID: AssetId = AssetId([5; 32]);

fn block_on<T>(work: impl Future<Output = T>) -> T {
    let runtime =
        tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build().unwrap();
    runtime.block_on(work)
}

fn fetch(offset: u64) -> Fetch {
    Fetch { id: ID, token: Token([6; 32]), offset }
}

/// All that was answered, from bytes that come in pieces; the error that ended it, if one did.
async fn answers(bytes: Vec<u8>, piece: usize) -> (Vec<Passed>, ProtocolError) {
    let (mut ours, mut theirs) = duplex(61);
    let feed = tokio::spawn(async move {
        for part in bytes.chunks(piece.max(1)) {
            if theirs.write_all(part).await.is_err() {
                return;
            }
        }
    });
    let mut heard = Vec::new();
    loop {
        match next(&mut ours, ID).await {
            Ok(passed) => heard.push(passed),
            Err(error) => {
                drop(ours);
                feed.await.unwrap();
                return (heard, error);
            }
        }
    }
}

fn parts() -> Vec<Passed> {
    let chunk = |offset, bytes| Passed::Chunk { offset, bytes: Bytes::from_static(bytes) };
    vec![Passed::Begin { size: 9 }, chunk(0, b"abcd"), Passed::Waits, chunk(4, b"efghi"), Passed::Unknown]
}

async fn wire(parts: &[Passed]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for part in parts {
        pass(&mut bytes, ID, part.clone()).await.unwrap();
    }
    bytes
}

proptest! {
    #[test]
    fn what_is_asked_and_answered_arrives_however_it_is_torn(offset: u64, piece in 1..200usize) {
        block_on(async {
            let mut asked = Vec::new();
            ask(&mut asked, &fetch(offset)).await.unwrap();
            assert_eq!(hear(&mut asked.as_slice()).await.unwrap(), fetch(offset));
            let (heard, error) = answers(wire(&parts()).await, piece).await;
            assert_eq!(heard, parts());
            assert!(matches!(error, ProtocolError::Closed { .. }), "{error}");
        });
    }

    #[test]
    fn arbitrary_bytes_come_to_an_end(bytes in vec(any::<u8>(), 0..400), piece in 1..50usize) {
        block_on(async {
            let _ = hear(&mut bytes.as_slice()).await;
            let (heard, _) = answers(bytes, piece).await;
            assert!(heard.len() < 400);
        });
    }

    #[test]
    fn changed_and_cut_streams_come_to_an_end(at: prop::sample::Index, byte: u8, cut: prop::sample::Index) {
        block_on(async {
            let mut bytes = wire(&parts()).await;
            let place = at.index(bytes.len());
            bytes[place] = byte;
            bytes.truncate(cut.index(bytes.len()));
            let (heard, _) = answers(bytes, 7).await;
            assert!(heard.len() <= parts().len());
        });
    }
}

#[tokio::test(start_paused = true)]
async fn who_is_silent_is_not_waited_for_for_ever() {
    let (mut ours, _theirs) = duplex(64);
    let error = next(&mut ours, ID).await.unwrap_err();
    assert!(matches!(error, ProtocolError::Deadline { limit: limits::PEER_PATIENCE, .. }), "{error}");
    let error = hear(&mut ours).await.unwrap_err();
    assert!(matches!(error, ProtocolError::Deadline { limit: limits::HANDSHAKE_DEADLINE, .. }), "{error}");
}

#[tokio::test]
async fn other_messages_and_other_assets_are_refused() {
    let mut bytes = Vec::new();
    pass(&mut bytes, AssetId([9; 32]), Passed::Begin { size: 1 }).await.unwrap();
    let error = next(&mut bytes.as_slice(), ID).await.unwrap_err();
    assert!(matches!(error, ProtocolError::Unexpected { .. }), "{error}");
    let mut asked = Vec::new();
    ask(&mut asked, &fetch(0)).await.unwrap();
    assert!(matches!(next(&mut asked.as_slice(), ID).await, Err(ProtocolError::Unexpected { .. })));
    assert!(matches!(hear(&mut bytes.as_slice()).await, Err(ProtocolError::Unexpected { .. })));
    // Four gibibytes, announced in a header of eight bytes.
    for kind in [0x13, 0x14, 0x15, 0x30, 0x40] {
        let header = [0xff, 0xff, 0xff, 0xff, kind, 0, 0, 0];
        assert!(matches!(next(&mut header.as_slice(), ID).await, Err(ProtocolError::TooLong { .. })));
        assert!(matches!(hear(&mut header.as_slice()).await, Err(ProtocolError::TooLong { .. })));
    }
}
