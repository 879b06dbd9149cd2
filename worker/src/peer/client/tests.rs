use std::sync::Arc;
use std::time::Duration;

use rayfarm_protocol::limits::PEER_STALL_LIMIT;
use rayfarm_protocol::peer::{ShareKey, receive_request, send_reply};
use tokio::io::DuplexStream;
use tokio::time::Instant;

use super::*;

const ID: AssetId = AssetId([7; 32]);
const SIZE: u64 = 3 * MAX_CHUNK_BYTES as u64 + 5;

fn fetch() -> Fetch {
    let token = Token::new(&ShareKey([1; 32]), ID, None, 0);
    let source = PeerSource { address: "10.0.0.1:7118".parse().unwrap(), key: None, token };
    Fetch { id: ID, size: SIZE, source }
}

/// Starts a transfer over a pipe whose other end has received the request. The chunks are read and dropped.
async fn begin(clock: &Arc<StallClock>) -> (DuplexStream, tokio::task::JoinHandle<Result<(), String>>) {
    let (mut ours, theirs) = tokio::io::duplex(1 << 20);
    let clock = Arc::clone(clock);
    let transfer = tokio::spawn(async move {
        let (events, mut received) = mpsc::channel(1);
        tokio::spawn(async move { while received.recv().await.is_some() {} });
        fetch_over(theirs, fetch(), &clock, &events).await
    });
    assert_eq!(receive_request(&mut ours).await.unwrap().id, ID);
    (ours, transfer)
}

fn chunk(offset: u64, bytes: usize) -> PeerReply {
    PeerReply::Chunk { offset, bytes: Bytes::from(vec![0; bytes]) }
}

#[tokio::test(start_paused = true)]
async fn a_source_that_only_sends_keepalives_fails_after_seconds() {
    let (begun, clock) = (Instant::now(), Arc::default());
    let (mut source, transfer) = begin(&clock).await;
    tokio::spawn(async move {
        while send_reply(&mut source, ID, PeerReply::Waiting { hops: 1 }).await.is_ok() {
            tokio::time::sleep(Duration::from_millis(500)).await;
        }
    });
    let why = transfer.await.unwrap().unwrap_err();
    assert!(why.contains("no chunk arrived"), "{why}");
    let elapsed = begun.elapsed();
    assert!((PEER_STALL_LIMIT..Duration::from_secs(4)).contains(&elapsed), "{elapsed:?}");
}

#[tokio::test(start_paused = true)]
async fn a_source_that_waits_while_other_assets_arrive_keeps_its_transfer() {
    let (begun, clock) = (Instant::now(), Arc::<StallClock>::default());
    let (mut source, transfer) = begin(&clock).await;
    for _ in 0..20 {
        send_reply(&mut source, ID, PeerReply::Waiting { hops: 1 }).await.unwrap();
        tokio::time::sleep(Duration::from_millis(500)).await;
        clock.note_chunk();
    }
    send_reply(&mut source, ID, PeerReply::Begin { size: SIZE }).await.unwrap();
    let mut offset = 0;
    while offset < SIZE {
        let bytes = (SIZE - offset).min(MAX_CHUNK_BYTES as u64);
        send_reply(&mut source, ID, chunk(offset, bytes as usize)).await.unwrap();
        offset += bytes;
    }
    assert_eq!(transfer.await.unwrap(), Ok(()));
    assert!(begun.elapsed() >= Duration::from_secs(10));
}

#[tokio::test(start_paused = true)]
async fn small_chunks_are_refused() {
    let clock = Arc::default();
    let (mut source, transfer) = begin(&clock).await;
    send_reply(&mut source, ID, PeerReply::Begin { size: SIZE }).await.unwrap();
    send_reply(&mut source, ID, chunk(0, 1)).await.unwrap();
    let why = transfer.await.unwrap().unwrap_err();
    assert!(why.contains("1 bytes at byte 0"), "{why}");
}
