//! Sessions over in-memory pipes: order of messages, back pressure, ends.

use std::time::Duration;

use bytes::Bytes;
use rayfarm_protocol::envelope::Kind;
use rayfarm_protocol::session::{
    BodyLimit, ReceiveRoom, Receiver, SendError, Sender, TrySendError, spawn, spawn_limited,
};
use rayfarm_protocol::{AssetId, FrameId, ProtocolError, Reconnect, ToMaster, ToWorker, limits};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};

use crate::common::{lease, pixels, wire};

type Master = (Sender<ToWorker>, Receiver<ToMaster>);
type Worker = (Sender<ToMaster>, Receiver<ToWorker>);

fn pair(pipe_bytes: usize) -> (Master, Worker) {
    let (a, b) = duplex(pipe_bytes);
    let (master_out, master_in, _) = spawn(a);
    let (worker_out, worker_in, _) = spawn(b);
    ((master_out, master_in), (worker_out, worker_in))
}

fn chunk(offset: u64, len: usize) -> ToWorker {
    ToWorker::AssetChunk { id: AssetId([7; 32]), offset, bytes: Bytes::from(vec![offset as u8; len]) }
}

#[tokio::test]
async fn messages_arrive_through_pipes_of_any_width() {
    for pipe_bytes in [1, 2, 7, 64, 1 << 20] {
        let ((master_out, mut master_in), (worker_out, mut worker_in)) = pair(pipe_bytes);
        for segment in 0..20 {
            master_out.send(ToWorker::Segment(lease(segment))).await.unwrap();
            worker_out.send(pixels(segment, 301)).await.unwrap();
        }
        for segment in 0..20 {
            assert_eq!(worker_in.recv().await.unwrap().unwrap(), ToWorker::Segment(lease(segment)));
            assert_eq!(master_in.recv().await.unwrap().unwrap(), pixels(segment, 301));
        }
    }
}

#[tokio::test]
async fn control_overtakes_bulk_and_bulk_never_overtakes_earlier_control() {
    // The peer reads nothing until all messages are queued. Pipe and write buffer hold less than one chunk.
    let (ours, theirs) = duplex(64);
    let (out, _in, _) = spawn::<_, ToWorker, ToMaster>(ours);
    out.send(ToWorker::Ping { nonce: 1 }).await.unwrap();
    for index in 0..4 {
        out.send(chunk(index * 1000, 20_000)).await.unwrap();
    }
    tokio::task::yield_now().await;
    out.send(ToWorker::Cancel { before: FrameId(9) }).await.unwrap();
    out.send(ToWorker::Disconnect { reason: "done".into(), reconnect: Reconnect::Never }).await.unwrap();

    let (_out, mut received, _) = spawn::<_, ToMaster, ToWorker>(theirs);
    let mut order = Vec::new();
    while let Some(message) = received.recv().await {
        order.push(message.unwrap());
    }
    let at = |wanted: &ToWorker| order.iter().position(|message| message == wanted).unwrap();
    assert_eq!(at(&ToWorker::Ping { nonce: 1 }), 0);
    assert!(at(&ToWorker::Cancel { before: FrameId(9) }) < at(&chunk(1000, 20_000)));
    assert!(at(&chunk(1000, 20_000)) < at(&chunk(2000, 20_000)));
    assert_eq!(
        order.last(),
        Some(&ToWorker::Disconnect { reason: "done".into(), reconnect: Reconnect::Never })
    );
    assert_eq!(order.len(), 7);
}

#[tokio::test(start_paused = true)]
async fn a_disconnect_is_flushed_and_closes() {
    let ((master_out, mut master_in), (worker_out, mut worker_in)) = pair(1 << 16);
    worker_out.send(pixels(3, 5000)).await.unwrap();
    worker_out.send(ToMaster::Disconnect { reason: "shutting down".into() }).await.unwrap();
    assert_eq!(master_in.recv().await.unwrap().unwrap(), pixels(3, 5000));
    assert_eq!(
        master_in.recv().await.unwrap().unwrap(),
        ToMaster::Disconnect { reason: "shutting down".into() }
    );
    assert!(master_in.recv().await.is_none());
    // The other direction stays open for `CLOSE_GRACE`, so the master can reply and close.
    master_out
        .send(ToWorker::Disconnect { reason: "bye".into(), reconnect: Reconnect::Never })
        .await
        .unwrap();
    assert_eq!(
        worker_in.recv().await.unwrap().unwrap(),
        ToWorker::Disconnect { reason: "bye".into(), reconnect: Reconnect::Never }
    );
    assert!(worker_in.recv().await.is_none());
    worker_out.closed().await;
    assert!(matches!(worker_out.send(ToMaster::Drain).await, Err(SendError::Closed)));
    assert!(matches!(worker_out.try_send(ToMaster::Drain), Err(TrySendError::Closed)));
}

#[tokio::test(start_paused = true)]
async fn a_disconnect_waits_for_the_peer_to_close_for_a_limited_time() {
    let (ours, mut theirs) = duplex(1 << 16);
    let (out, mut received, _) = spawn::<_, ToMaster, ToWorker>(ours);
    let begun = tokio::time::Instant::now();
    out.send(ToMaster::Disconnect { reason: "enough".into() }).await.unwrap();
    out.closed().await;
    assert_eq!(begun.elapsed(), limits::CLOSE_GRACE);
    assert!(received.recv().await.is_none());
    assert!(theirs.write_all(&[0]).await.is_err());
}

#[tokio::test]
async fn a_disconnect_arrives_although_the_master_does_not_read_the_peers_messages() {
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let connecting = tokio::net::TcpStream::connect(listener.local_addr().unwrap());
    let (ours, theirs) = tokio::join!(connecting, listener.accept());
    let (out, received, _) = spawn::<_, ToWorker, ToMaster>(ours.unwrap());
    let (worker_out, mut worker_in, _) = spawn::<_, ToMaster, ToWorker>(theirs.unwrap().0);
    drop(received);
    let busy = tokio::spawn(async move { while worker_out.send(pixels(1, 100_000)).await.is_ok() {} });
    out.send(ToWorker::Disconnect { reason: "the end".into(), reconnect: Reconnect::Never }).await.unwrap();
    out.closed().await;
    // The worker reads after the connection has ended.
    let received = worker_in.recv().await.unwrap().unwrap();
    assert_eq!(received, ToWorker::Disconnect { reason: "the end".into(), reconnect: Reconnect::Never });
    drop(worker_in);
    busy.await.unwrap();
}

#[tokio::test]
async fn queued_messages_are_written_after_the_senders_are_dropped() {
    let ((master_out, _master_in), (_worker_out, mut worker_in)) = pair(16);
    master_out.send(chunk(0, 4000)).await.unwrap();
    master_out.clone().send(ToWorker::Drain).await.unwrap();
    drop(master_out);
    let mut seen = Vec::new();
    while let Some(message) = worker_in.recv().await {
        seen.push(message.unwrap());
    }
    seen.sort_by_key(|message| *message == ToWorker::Drain);
    assert_eq!(seen, [chunk(0, 4000), ToWorker::Drain]);
}

#[tokio::test]
async fn a_full_queue_returns_the_message() {
    let (ours, _theirs) = duplex(16);
    let (out, _in, _) = spawn::<_, ToMaster, ToWorker>(ours);
    let mut sent = 0;
    let returned = loop {
        match out.try_send(pixels(sent, 3000)) {
            Ok(()) => sent += 1,
            Err(TrySendError::Full(message)) => break message,
            Err(other) => panic!("{other}"),
        }
        tokio::task::yield_now().await;
    };
    assert_eq!(returned, pixels(sent, 3000));
    assert!(sent as usize <= limits::BULK_QUEUE + 2, "{sent} messages were taken");
    // Control messages have their own queue.
    out.try_send(ToMaster::Pong { nonce: 1, progressed: false }).unwrap();
}

#[tokio::test]
async fn a_message_out_of_bounds_is_not_sent_and_the_session_continues() {
    let ((master_out, _master_in), (_worker_out, mut worker_in)) = pair(1 << 20);
    let error = master_out.send(chunk(0, limits::MAX_CHUNK_BYTES + 1)).await.unwrap_err();
    let SendError::Invalid(ProtocolError::Malformed { kind: Kind::AssetChunk, why }) = error else {
        panic!("{error}");
    };
    assert!(why.contains("262145 bytes"), "{why}");
    master_out.send(chunk(0, limits::MAX_CHUNK_BYTES)).await.unwrap();
    assert_eq!(worker_in.recv().await.unwrap().unwrap(), chunk(0, limits::MAX_CHUNK_BYTES));
}

#[tokio::test]
async fn abort_ends_both_directions_at_once() {
    let ((master_out, mut master_in), (_worker_out, mut worker_in)) = pair(16);
    master_out.send(chunk(0, 4000)).await.unwrap();
    master_out.abort();
    master_out.closed().await;
    assert!(master_in.recv().await.is_none());
    let end = worker_in.recv().await;
    assert!(matches!(end, None | Some(Err(ProtocolError::Closed { .. }))), "{end:?}");
}

#[tokio::test]
async fn a_close_within_an_envelope_is_an_error() {
    let bytes = wire(&ToMaster::Pong { nonce: 5, progressed: false }).await;
    for cut in 0..=bytes.len() {
        let (ours, mut theirs) = duplex(1 << 16);
        let (_out, mut received, _) = spawn::<_, ToWorker, ToMaster>(ours);
        theirs.write_all(&bytes[..cut]).await.unwrap();
        drop(theirs);
        match received.recv().await {
            None => assert_eq!(cut, 0),
            Some(Ok(message)) => {
                assert_eq!((cut, message), (bytes.len(), ToMaster::Pong { nonce: 5, progressed: false }));
            }
            Some(Err(error)) => {
                assert!(matches!(error, ProtocolError::Closed { .. }), "{error}");
                assert!(cut > 0 && cut < bytes.len());
            }
        }
        assert!(received.recv().await.is_none());
    }
}

#[tokio::test]
async fn bytes_of_an_envelope_are_counted_as_they_arrive() {
    let bytes = wire(&ToMaster::Pong { nonce: 5, progressed: true }).await;
    let (ours, mut theirs) = duplex(1 << 16);
    let (_out, mut received, traffic) = spawn::<_, ToWorker, ToMaster>(ours);
    theirs.write_all(&bytes[..12]).await.unwrap();
    let counted = async {
        while traffic.received_bytes() < 12 {
            tokio::task::yield_now().await;
        }
    };
    tokio::time::timeout(Duration::from_secs(10), counted).await.expect("the first part is not counted");
    theirs.write_all(&bytes[12..]).await.unwrap();
    assert_eq!(received.recv().await.unwrap().unwrap(), ToMaster::Pong { nonce: 5, progressed: true });
    assert_eq!(traffic.received_bytes(), bytes.len() as u64);
}

#[tokio::test(start_paused = true)]
async fn silence_is_unlimited_between_envelopes_and_limited_within_one() {
    let bytes = wire(&ToMaster::Pong { nonce: 5, progressed: false }).await;
    for cut in [1, 7, 8, 12] {
        let (ours, mut theirs) = duplex(1 << 16);
        let (_out, mut received, _) = spawn::<_, ToWorker, ToMaster>(ours);
        tokio::time::sleep(Duration::from_secs(3600)).await;
        theirs.write_all(&bytes).await.unwrap();
        assert_eq!(received.recv().await.unwrap().unwrap(), ToMaster::Pong { nonce: 5, progressed: false });
        theirs.write_all(&bytes[..cut]).await.unwrap();
        let error = received.recv().await.unwrap().unwrap_err();
        assert!(matches!(error, ProtocolError::Deadline { .. }), "{error}");
        assert!(received.recv().await.is_none());
    }
}

#[tokio::test(start_paused = true)]
async fn a_peer_that_does_not_read_times_out() {
    let (ours, theirs) = duplex(16);
    let (out, mut received, _) = spawn::<_, ToWorker, ToMaster>(ours);
    out.send(chunk(0, 4000)).await.unwrap();
    let error = received.recv().await.unwrap().unwrap_err();
    assert!(matches!(error, ProtocolError::Deadline { .. }), "{error}");
    assert!(received.recv().await.is_none());
    drop(theirs);
}

#[tokio::test(start_paused = true)]
async fn a_disconnect_is_received_although_the_writer_has_failed() {
    let (ours, mut theirs) = duplex(1 << 16);
    let (out, mut received, _) = spawn::<_, ToMaster, ToWorker>(ours);
    theirs
        .write_all(
            &wire(&ToWorker::Disconnect { reason: "kicked".into(), reconnect: Reconnect::Never }).await,
        )
        .await
        .unwrap();
    drop(theirs);
    let _ = out.send(ToMaster::Drain).await;
    assert_eq!(
        received.recv().await.unwrap().unwrap(),
        ToWorker::Disconnect { reason: "kicked".into(), reconnect: Reconnect::Never }
    );
}

#[tokio::test]
async fn after_an_error_nothing_more_is_delivered() {
    let (ours, mut theirs) = duplex(1 << 16);
    let (_out, mut received, _) = spawn::<_, ToWorker, ToMaster>(ours);
    theirs.write_all(&[0, 0, 0, 0, 0x77, 0, 0, 0]).await.unwrap();
    theirs.write_all(&wire(&ToMaster::Drain).await).await.unwrap();
    let error = received.recv().await.unwrap().unwrap_err();
    assert!(matches!(error, ProtocolError::UnknownKind { kind: 0x77 }), "{error}");
    assert!(received.recv().await.is_none());
}

#[tokio::test]
async fn a_message_of_the_other_direction_is_refused() {
    let (ours, mut theirs) = duplex(1 << 16);
    let (_out, mut received, _) = spawn::<_, ToWorker, ToMaster>(ours);
    theirs.write_all(&wire(&ToWorker::Segment(lease(1))).await).await.unwrap();
    let error = received.recv().await.unwrap().unwrap_err();
    assert!(matches!(error, ProtocolError::Unexpected { kind: Kind::Segment, .. }), "{error}");
}

#[tokio::test]
async fn traffic_counts_whole_envelopes() {
    let (a, b): (DuplexStream, DuplexStream) = duplex(1 << 20);
    let (out, _in, traffic) = spawn::<_, ToWorker, ToMaster>(a);
    let mut b = b;
    out.send(ToWorker::Ping { nonce: 1 }).await.unwrap();
    out.send(chunk(0, 1000)).await.unwrap();
    out.send(ToWorker::Disconnect { reason: "end".into(), reconnect: Reconnect::Never }).await.unwrap();
    let mut all = Vec::new();
    b.read_to_end(&mut all).await.unwrap();
    assert_eq!(traffic.sent_bytes(), all.len() as u64);
    assert_eq!(traffic.scene_sent_bytes(), 8 + 40 + 1000);

    let (c, mut d) = duplex(1 << 20);
    let (_out, mut received, traffic) = spawn::<_, ToWorker, ToMaster>(c);
    let bytes = wire(&pixels(1, 999)).await;
    d.write_all(&bytes).await.unwrap();
    received.recv().await.unwrap().unwrap();
    assert_eq!(traffic.received_bytes(), bytes.len() as u64);
}

#[tokio::test]
async fn a_full_inbox_stops_the_reader() {
    let (ours, mut theirs) = duplex(1 << 20);
    let (_out, mut received, traffic) = spawn::<_, ToWorker, ToMaster>(ours);
    let bytes = wire(&pixels(1, limits::MAX_PIXELS_BYTES)).await;
    let peer = tokio::spawn(async move {
        for _ in 0..5 {
            theirs.write_all(&bytes).await.unwrap();
        }
        theirs
    });
    let message = received.recv().await.unwrap().unwrap();
    assert_eq!(message, pixels(1, limits::MAX_PIXELS_BYTES));
    // One message was delivered. At most two more fit before the next one is.
    for _ in 0..1000 {
        tokio::task::yield_now().await;
    }
    assert!(traffic.received_bytes() <= 3 * (limits::MAX_PIXELS_BYTES as u64 + 96));
    for _ in 0..4 {
        received.recv().await.unwrap().unwrap();
    }
    drop(peer.await.unwrap());
    assert!(received.recv().await.is_none());
}

/// A session that receives pixels within a room, and the peer's end of its connection.
fn receiving(room: &ReceiveRoom) -> (Sender<ToWorker>, Receiver<ToMaster>, BodyLimit, DuplexStream) {
    let (ours, theirs) = duplex(1 << 16);
    let limit = BodyLimit::closed(room.clone());
    let (out, received, _) = spawn_limited::<_, ToWorker, ToMaster>(ours, limit.clone());
    (out, received, limit, theirs)
}

#[tokio::test(start_paused = true)]
async fn pixels_are_accepted_up_to_the_limit_that_is_set() {
    let room = ReceiveRoom::new(1 << 20);
    let (_out, mut received, limit, mut peer) = receiving(&room);
    limit.set(Some(1000));
    peer.write_all(&wire(&pixels(1, 1000)).await).await.unwrap();
    assert_eq!(received.recv().await.unwrap().unwrap(), pixels(1, 1000));
    assert_eq!(room.free_bytes(), 1 << 20, "a message that is delivered takes no room");
    limit.set(None);
    peer.write_all(&wire(&pixels(2, 1)).await).await.unwrap();
    let error = received.recv().await.unwrap().unwrap_err();
    assert!(matches!(error, ProtocolError::NotLeased { limit: 0, .. }), "{error}");
    assert!(received.recv().await.is_none());
}

#[tokio::test(start_paused = true)]
async fn a_session_that_stalls_within_its_pixels_ends_when_others_need_its_room() {
    let room = ReceiveRoom::new(100_000);
    let (_slow_out, mut slow, slow_limit, mut slow_peer) = receiving(&room);
    slow_limit.set(Some(90_000));
    let bytes = wire(&pixels(1, 90_000)).await;
    slow_peer.write_all(&bytes[..100]).await.unwrap();
    // No session waits for room: the deadline of its size applies, which is above ten seconds.
    tokio::time::sleep(Duration::from_secs(9)).await;
    let begun = tokio::time::Instant::now();
    let (_out, mut received, limit, mut peer) = receiving(&room);
    limit.set(Some(20_000));
    peer.write_all(&wire(&pixels(2, 20_000)).await).await.unwrap();
    assert_eq!(received.recv().await.unwrap().unwrap(), pixels(2, 20_000));
    assert!(begun.elapsed() < Duration::from_secs(1), "{:?}", begun.elapsed());
    let error = slow.recv().await.unwrap().unwrap_err();
    assert!(matches!(error, ProtocolError::Deadline { .. }), "{error}");
    assert!(error.to_string().contains("other workers wait"), "{error}");
    assert_eq!(room.free_bytes(), 100_000);
}
