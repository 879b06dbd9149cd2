//! Tests of sessions, with a master at the other end of a pipe.

use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Duration;

use rayfarm_protocol::transport::WorkerSecurity;
use rayfarm_protocol::{FrameId, Reconnect, ToMaster, ToWorker};

use super::{FakeMaster, HEIGHT, LARGE_CACHE, SLOW_SCENE, WIDTH, expected, lease, persistent, scene, until};
use crate::peer::PeerClient;
use crate::session::{SessionConfig, SessionEnd, run_session};
use crate::shutdown::ShutdownHandle;

const MESH: &[u8] = b"mesh of a teapot";

#[tokio::test]
async fn leases_become_pixels_with_any_number_of_threads() {
    let body = scene(1, &[MESH]);
    for threads in [1, 2, 5] {
        let mut master = FakeMaster::start(persistent(threads, LARGE_CACHE).0, &[&body, MESH]);
        master.announce(3, &body, b"v").await;
        // They arrive before the frame is ready, out of order, with limits inside of bands.
        for rows in [17..40, 0..1, 1..17] {
            master.send(ToWorker::Segment(lease(3, rows))).await;
        }
        let mut rows_done = 0;
        while rows_done < HEIGHT {
            let (lease, bytes) = master.receive_pixels().await;
            assert_eq!(bytes, expected(&body, b"v", lease.rows().unwrap()));
            rows_done += lease.row_count;
        }
        assert_eq!(rows_done, HEIGHT);
        master.close().await;
    }
}

#[tokio::test]
async fn the_cost_of_a_lease_is_the_sum_of_its_bands() {
    let body = scene(1, &[]);
    let mut master = FakeMaster::start(persistent(3, LARGE_CACHE).0, &[&body]);
    master.announce(0, &body, b"v").await;
    master.send(ToWorker::Segment(lease(0, 4..30))).await;
    let Some(ToMaster::Pixels { header, .. }) = master.receive().await else { panic!("expected pixels") };
    assert_eq!(header.lease, lease(0, 4..30));
    assert_eq!((header.cost.primary, header.cost.shadow), (u64::from(WIDTH) * 26, 4));
}

#[tokio::test]
async fn a_scene_and_its_meshes_are_requested_once_across_sessions() {
    let body = scene(1, &[MESH, b"mesh 2"]);
    let mut kept = persistent(1, LARGE_CACHE).0;
    for session in 0..2 {
        let mut master = FakeMaster::start(kept, &[&body, MESH, b"mesh 2"]);
        for frame in 0..3 {
            master.announce(frame, &body, &[frame as u8]).await;
            master.send(ToWorker::Segment(lease(frame, 0..8))).await;
            assert_eq!(master.receive_pixels().await.1, expected(&body, &[frame as u8], 0..8));
        }
        assert_eq!(master.requests.len(), if session == 0 { 3 } else { 0 });
        kept = master.close().await.1;
    }
}

#[tokio::test]
async fn a_scene_that_the_master_did_not_have_is_requested_again() {
    let (body, other) = (scene(1, &[]), scene(2, &[]));
    let mut master = FakeMaster::start(persistent(1, LARGE_CACHE).0, &[&other]);
    master.announce(0, &body, b"v").await;
    let reason = master.receive_failure(0).await;
    assert!(reason.contains("does not have"), "{reason}");
    // The scene was replaced before the request arrived, and is shown again when that is undone.
    master.send(ToWorker::Cancel { before: FrameId(1) }).await;
    master.corrupt(&body, &body);
    for (frame, body) in [(1, &other), (2, &body)] {
        master.announce(frame, body, b"v").await;
        master.send(ToWorker::Segment(lease(frame, 0..8))).await;
        assert_eq!(master.receive_pixels().await.1, expected(body, b"v", 0..8));
    }
    assert_eq!(master.requests.len(), 3);
}

#[tokio::test]
async fn a_scene_body_that_arrives_after_its_frame_was_dropped_is_of_use_later() {
    let (body, other) = (scene(1, &[]), scene(2, &[]));
    let mut master = FakeMaster::start(persistent(1, LARGE_CACHE).0, &[&body, &other]);
    master.announce(0, &body, b"v").await;
    let (id, offset, _) = master.receive_request().await;
    // The frame is superseded by one of another scene while its body is on the way, and both scenes are shown later.
    master.send(ToWorker::Cancel { before: FrameId(1) }).await;
    master.announce(1, &other, b"v").await;
    master.send_asset(id, offset).await;
    master.announce(2, &body, b"v").await;
    for (frame, body) in [(1, &other), (2, &body)] {
        master.send(ToWorker::Segment(lease(frame, 0..8))).await;
        assert_eq!(master.receive_pixels().await, (lease(frame, 0..8), expected(body, b"v", 0..8).into()));
    }
    assert_eq!(master.requests.len(), 2, "each body once");
}

#[tokio::test]
async fn a_ping_is_answered_while_all_threads_render() {
    let body = scene(1, &[]);
    let (kept, gate) = persistent(2, LARGE_CACHE);
    let mut master = FakeMaster::start(kept, &[&body]);
    master.announce(0, &body, b"wait").await;
    master.send(ToWorker::Segment(lease(0, 0..40))).await;
    for nonce in 0..3 {
        master.send(ToWorker::Ping { nonce }).await;
        assert!(matches!(master.receive().await, Some(ToMaster::Pong { nonce: n, .. }) if n == nonce));
    }
    gate.open();
    assert_eq!(master.receive_pixels().await.1, expected(&body, b"wait", 0..40));
}

/// Whether the worker's next pong reports progress.
async fn progressed(master: &mut FakeMaster) -> bool {
    master.send(ToWorker::Ping { nonce: 7 }).await;
    match master.receive().await {
        Some(ToMaster::Pong { nonce: 7, progressed }) => progressed,
        other => panic!("expected a pong, not {other:?}"),
    }
}

/// Waits for a pong that reports progress.
async fn until_progressed(master: &mut FakeMaster) {
    while !progressed(master).await {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

#[tokio::test]
async fn a_pong_reports_progress_within_a_lease_and_none_of_a_stuck_thread() {
    let body = scene(1, &[]);
    let (kept, gate) = persistent(1, LARGE_CACHE);
    let calls = Arc::clone(&kept.renderer.calls);
    let mut master = FakeMaster::start(kept, &[&body]);
    assert!(!progressed(&mut master).await, "it has no work");
    master.announce(0, &body, b"steps").await;
    master.serve_request().await;
    master.send(ToWorker::Segment(lease(0, 0..8))).await;
    until(&calls.stepping, 1).await;
    assert!(progressed(&mut master).await, "the frame was prepared");
    for _ in 0..3 {
        for _ in 0..10 {
            assert!(!progressed(&mut master).await, "the thread is stuck in a step");
        }
        calls.steps.fetch_add(1, Relaxed);
        until_progressed(&mut master).await;
    }
    gate.open();
    assert_eq!(master.receive_pixels().await.1, expected(&body, b"steps", 0..8));
}

#[tokio::test]
async fn a_pong_reports_progress_of_a_compilation() {
    let body = scene(SLOW_SCENE, &[]);
    let (kept, gate) = persistent(1, LARGE_CACHE);
    gate.open();
    let calls = Arc::clone(&kept.renderer.calls);
    let mut master = FakeMaster::start(kept, &[&body]);
    master.announce(0, &body, b"v").await;
    master.serve_request().await;
    until(&calls.compiled, 1).await;
    master.send(ToWorker::Segment(lease(0, 0..8))).await;
    // The compilation lasts until it is cancelled, and goes on polling.
    for _ in 0..5 {
        until_progressed(&mut master).await;
    }
    master.close().await;
    until(&calls.cancelled, 1).await;
}

#[tokio::test]
async fn a_cancelled_frame_sends_nothing_and_does_not_delay_the_next() {
    let body = scene(1, &[]);
    let (kept, gate) = persistent(1, LARGE_CACHE);
    let mut master = FakeMaster::start(kept, &[&body]);
    master.announce(0, &body, b"wait").await;
    // The first lease is being rendered when the cancel arrives, the second one is queued.
    master.send(ToWorker::Segment(lease(0, 0..8))).await;
    master.send(ToWorker::Segment(lease(0, 8..16))).await;
    master.send(ToWorker::Ping { nonce: 1 }).await;
    master.receive().await;
    master.send(ToWorker::Cancel { before: FrameId(1) }).await;
    master.announce(1, &body, b"new").await;
    // A lease of a cancelled frame that arrives after the cancel is no error.
    master.send(ToWorker::Segment(lease(0, 16..24))).await;
    master.send(ToWorker::Segment(lease(1, 0..8))).await;
    master.send(ToWorker::Ping { nonce: 2 }).await;
    assert!(matches!(master.receive().await, Some(ToMaster::Pong { nonce: 2, .. })));
    gate.open();
    let (done, bytes) = master.receive_pixels().await;
    assert_eq!((done, bytes), (lease(1, 0..8), expected(&body, b"new", 0..8).into()));
}

#[tokio::test]
async fn a_missing_asset_fails_the_frame_and_later_frames_of_its_scene() {
    let body = scene(1, &[MESH]);
    let mut master = FakeMaster::start(persistent(1, LARGE_CACHE).0, &[&body]);
    master.announce(0, &body, b"v").await;
    master.send(ToWorker::Segment(lease(0, 0..8))).await;
    let reason = master.receive_failure(0).await;
    assert!(reason.contains("the master does not have asset"), "{reason}");
    // The failure is reported again for each frame, without another request.
    master.announce(1, &body, b"v").await;
    assert_eq!(master.receive_failure(1).await, reason);
    assert_eq!(master.requests.len(), 2);
    // Another scene is not affected.
    let other = scene(2, &[]);
    let mut master = FakeMaster::start(master.close().await.1, &[&other]);
    master.announce(0, &other, b"v").await;
    master.send(ToWorker::Segment(lease(0, 0..8))).await;
    assert_eq!(master.receive_pixels().await.1, expected(&other, b"v", 0..8));
}

#[tokio::test]
async fn an_asset_with_wrong_bytes_is_not_used() {
    let body = scene(1, &[MESH]);
    let mut master = FakeMaster::start(persistent(1, LARGE_CACHE).0, &[&body]);
    master.corrupt(MESH, b"mesh of a teacup");
    master.announce(0, &body, b"v").await;
    let reason = master.receive_failure(0).await;
    assert!(reason.contains("arrived damaged"), "{reason}");
}

#[tokio::test]
async fn invalid_scenes_meshes_and_views_are_reported() {
    for (body, mesh, view, part) in [
        (b"toml".to_vec(), MESH, b"v".as_slice(), "this is no scene"),
        (scene(1, &[b"obj"]), b"obj".as_slice(), b"v", "this is no mesh"),
        (
            scene(1, &[b"mesh that panics"]),
            b"mesh that panics",
            b"v",
            "a bug in this worker: this mesh panics",
        ),
        (scene(1, &[]), MESH, b"unpreparable", "this view cannot be prepared"),
        (scene(1, &[]), MESH, b"panic", "a bug in this worker: row 16 panics"),
        (scene(1, &[]), MESH, b"rgb565", "outside RGB 5-6-5"),
    ] {
        let mut master = FakeMaster::start(persistent(1, LARGE_CACHE).0, &[&body, mesh]);
        master.announce(0, &body, view).await;
        master.send(ToWorker::Segment(lease(0, 16..24))).await;
        let reason = master.receive_failure(0).await;
        assert!(reason.contains(part), "{reason}");
        // The worker renders the next scene.
        let good = scene(9, &[]);
        let mut master = FakeMaster::start(master.close().await.1, &[&good]);
        master.announce(1, &good, b"v").await;
        master.send(ToWorker::Segment(lease(1, 0..8))).await;
        assert_eq!(master.receive_pixels().await.1, expected(&good, b"v", 0..8));
    }
}

#[tokio::test]
async fn a_panic_fails_its_frame_once_and_the_threads_continue() {
    let body = scene(1, &[]);
    let mut master = FakeMaster::start(persistent(2, LARGE_CACHE).0, &[&body]);
    master.announce(0, &body, b"panic").await;
    for first in (0..HEIGHT).step_by(8) {
        master.send(ToWorker::Segment(lease(0, first..first + 8))).await;
    }
    assert!(master.receive_failure(0).await.contains("panics"));
    master.announce(1, &body, b"v").await;
    master.send(ToWorker::Segment(lease(1, 0..40))).await;
    assert_eq!(master.receive_pixels().await.1, expected(&body, b"v", 0..40));
}

#[tokio::test]
async fn a_failed_frame_is_retried_when_it_is_announced_again() {
    let body = scene(1, &[]);
    let mut master = FakeMaster::start(persistent(1, LARGE_CACHE).0, &[&body]);
    master.announce(0, &body, b"panic").await;
    master.send(ToWorker::Segment(lease(0, 0..8))).await;
    assert!(master.receive_failure(0).await.contains("panics"));
    // A lease alone is no retry, and the failure is already reported.
    master.send(ToWorker::Segment(lease(0, 0..8))).await;
    // Another view, with which this renderer does not panic.
    master.announce(0, &body, b"v").await;
    master.send(ToWorker::Segment(lease(0, 8..16))).await;
    let (done, bytes) = master.receive_pixels().await;
    assert_eq!((done, bytes), (lease(0, 8..16), expected(&body, b"v", 8..16).into()));
    // A permanent failure is reported again, so that the master need not wait.
    master.announce(1, &body, b"unpreparable").await;
    assert!(master.receive_failure(1).await.contains("cannot be prepared"));
    master.announce(1, &body, b"unpreparable").await;
    assert!(master.receive_failure(1).await.contains("cannot be prepared"));
}

#[tokio::test]
async fn a_scene_larger_than_the_cache_is_refused_with_the_remedy() {
    let large = [b"mesh".as_slice(), &[0; 3000]].concat();
    let body = scene(1, &[&large]);
    let mut master = FakeMaster::start(persistent(1, 3000).0, &[&body, &large]);
    master.announce(0, &body, b"v").await;
    let reason = master.receive_failure(0).await;
    assert!(reason.contains("--asset-cache"), "{reason}");
}

#[tokio::test]
async fn the_cache_evicts_old_scenes_and_never_the_current_one() {
    let meshes: Vec<Vec<u8>> = (0..3).map(|i| [b"mesh".as_slice(), &[i; 1000]].concat()).collect();
    let bodies: Vec<Vec<u8>> = (0..3).map(|i| scene(i, &[&meshes[usize::from(i)]])).collect();
    let assets: Vec<&[u8]> = meshes.iter().chain(&bodies).map(Vec::as_slice).collect();
    // Two of the three scenes fit.
    let mut master = FakeMaster::start(persistent(1, 2300).0, &assets);
    let mut requests = Vec::new();
    for (frame, shown) in (0..).zip([0, 1, 0, 1, 2, 1, 0]) {
        let body = &bodies[shown];
        master.announce(frame, body, b"v").await;
        master.send(ToWorker::Segment(lease(frame, 0..8))).await;
        assert_eq!(master.receive_pixels().await.1, expected(body, b"v", 0..8));
        master.send(ToWorker::Cancel { before: FrameId(frame + 1) }).await;
        requests.push(std::mem::take(&mut master.requests).len());
    }
    // Scene 2 evicts scene 0, the least recently used. Then scene 0 evicts scene 2.
    assert_eq!(requests, [2, 2, 0, 0, 2, 0, 2]);
}

#[tokio::test]
async fn invalid_leases_are_refused() {
    let body = scene(1, &[]);
    let mut master = FakeMaster::start(persistent(1, LARGE_CACHE).0, &[&body]);
    master.send(ToWorker::Segment(lease(7, 0..8))).await;
    assert!(master.receive_failure(7).await.contains("not announced"));
    master.announce(8, &body, b"v").await;
    master.send(ToWorker::Segment(lease(8, 32..41))).await;
    assert!(master.receive_failure(8).await.contains("40"));
}

#[tokio::test]
async fn a_disconnect_ends_the_session_for_good_or_for_a_reconnect() {
    let master = FakeMaster::start(persistent(1, LARGE_CACHE).0, &[]);
    master.send(ToWorker::Disconnect { reason: "end of the run".into(), reconnect: Reconnect::Never }).await;
    assert_eq!(master.worker.await.unwrap().0, SessionEnd::Disconnected("end of the run".into()));
    let master = FakeMaster::start(persistent(1, LARGE_CACHE).0, &[]);
    master.send(ToWorker::Disconnect { reason: "timeout".into(), reconnect: Reconnect::Now }).await;
    assert_eq!(
        master.worker.await.unwrap().0,
        SessionEnd::Lost("the master ended the session: timeout".into())
    );
}

#[tokio::test]
async fn a_stopped_worker_disconnects_while_it_renders() {
    let body = scene(1, &[]);
    let (kept, gate) = persistent(1, LARGE_CACHE);
    let mut master = FakeMaster::start(kept, &[&body]);
    master.announce(0, &body, b"wait").await;
    master.send(ToWorker::Segment(lease(0, 0..8))).await;
    master.send(ToWorker::Ping { nonce: 0 }).await;
    master.receive().await;
    master.shutdown.stop();
    assert!(matches!(master.receive().await, Some(ToMaster::Disconnect { .. })));
    assert!(master.receive().await.is_none());
    assert_eq!(master.worker.await.unwrap().0, SessionEnd::Stopped);
    gate.open();
}

#[tokio::test]
async fn a_drained_worker_finishes_its_leases() {
    let body = scene(1, &[MESH]);
    let mut master = FakeMaster::start(persistent(2, LARGE_CACHE).0, &[&body, MESH]);
    master.announce(0, &body, b"v").await;
    for first in (0..HEIGHT).step_by(8) {
        master.send(ToWorker::Segment(lease(0, first..first + 8))).await;
    }
    master.send(ToWorker::Drain).await;
    for _ in (0..HEIGHT).step_by(8) {
        let (lease, bytes) = master.receive_pixels().await;
        assert_eq!(bytes, expected(&body, b"v", lease.rows().unwrap()));
    }
    assert!(matches!(master.receive().await, Some(ToMaster::Disconnect { .. })));
    assert_eq!(master.worker.await.unwrap().0, SessionEnd::Drained);
}

#[tokio::test]
async fn a_closed_connection_and_invalid_bytes_are_reported() {
    let master = FakeMaster::start(persistent(1, LARGE_CACHE).0, &[]);
    let (end, _) = master.close().await;
    assert_eq!(end, SessionEnd::Lost("the master closed the connection without a disconnect".into()));

    use tokio::io::AsyncWriteExt;
    let (mut ours, theirs) = tokio::io::duplex(1 << 10);
    ours.write_all(b"HTTP/1.1 200 OK\r\n\r\n").await.unwrap();
    let config = SessionConfig {
        compress: false,
        uses_disk: false,
        peer_server: None,
        peer_client: PeerClient { security: WorkerSecurity::Plain, within_machine: true },
        max_segment_bytes: None,
    };
    let end = run_session(theirs, config, &mut persistent(1, LARGE_CACHE).0, &ShutdownHandle::new()).await;
    assert!(matches!(&end, SessionEnd::Lost(why) if why.contains("unknown type")), "{end:?}");
}

#[tokio::test]
async fn unrequested_assets_are_ignored() {
    let body = scene(1, &[]);
    let mut master = FakeMaster::start(persistent(1, LARGE_CACHE).0, &[&body]);
    let id = rayfarm_protocol::AssetId::of(MESH);
    master.send(ToWorker::AssetBegin { id, size: MESH.len() as u64 }).await;
    master.send(ToWorker::AssetChunk { id, offset: 0, bytes: MESH.into() }).await;
    master.announce(0, &body, b"v").await;
    master.send(ToWorker::Segment(lease(0, 0..8))).await;
    assert_eq!(master.receive_pixels().await.1, expected(&body, b"v", 0..8));
}

#[tokio::test]
async fn too_many_frames_drop_the_least_recently_announced() {
    let body = scene(1, &[]);
    let mut master = FakeMaster::start(persistent(1, LARGE_CACHE).0, &[&body]);
    for frame in 0..9 {
        master.announce(frame, &body, b"v").await;
    }
    master.send(ToWorker::Segment(lease(0, 0..8))).await;
    assert!(master.receive_failure(0).await.contains("not announced"));
    master.send(ToWorker::Segment(lease(1, 0..8))).await;
    assert_eq!(master.receive_pixels().await.0, lease(1, 0..8));
}

#[tokio::test]
async fn a_worker_that_requests_a_drain_finishes_its_leases_and_does_not_reconnect() {
    let body = scene(1, &[]);
    let (kept, gate) = persistent(1, LARGE_CACHE);
    let mut master = FakeMaster::start(kept, &[&body]);
    master.announce(0, &body, b"wait").await;
    master.send(ToWorker::Segment(lease(0, 0..8))).await;
    master.shutdown.drain();
    assert_eq!(master.receive().await, Some(ToMaster::Drain));
    // The master sends this lease before it receives the request.
    master.send(ToWorker::Segment(lease(0, 8..16))).await;
    gate.open();
    for rows in [0..8, 8..16] {
        assert_eq!(
            master.receive_pixels().await,
            (lease(0, rows.clone()), expected(&body, b"wait", rows).into())
        );
    }
    master.send(ToWorker::Disconnect { reason: "all done".into(), reconnect: Reconnect::Now }).await;
    assert_eq!(master.worker.await.unwrap().0, SessionEnd::Disconnected("all done".into()));
}

#[tokio::test(start_paused = true)]
async fn a_silent_master_times_out_and_one_that_pings_does_not() {
    let mut master = FakeMaster::start(persistent(1, LARGE_CACHE).0, &[]);
    for nonce in 0..60 {
        master.send(ToWorker::Ping { nonce }).await;
        assert_eq!(master.receive().await, Some(ToMaster::Pong { nonce, progressed: false }));
        tokio::time::sleep(Duration::from_secs(2)).await;
    }
    let (end, _) = master.worker.await.unwrap();
    assert!(matches!(&end, SessionEnd::Lost(why) if why.contains("silent")), "{end:?}");
}
