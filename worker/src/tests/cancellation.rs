//! Tests of cancelled work: compilations and preparations whose result is no longer needed.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

use rayfarm_protocol::{FrameId, ToMaster, ToWorker};

use super::{FakeMaster, LARGE_CACHE, SLOW_SCENE, expected, lease, persistent, scene, until};

#[tokio::test]
async fn a_newer_scene_cancels_the_compilation_of_the_older_one() {
    let (old, new) = (scene(SLOW_SCENE, &[]), scene(1, &[]));
    let (worker, gate) = persistent(1, LARGE_CACHE);
    gate.open();
    let calls = Arc::clone(&worker.renderer.calls);
    let mut master = FakeMaster::start(worker, &[&old, &new]);
    master.announce(0, &old, b"v").await;
    master.serve_request().await;
    until(&calls.compiled, 1).await;
    master.send(ToWorker::Cancel { before: FrameId(1) }).await;
    master.announce(1, &new, b"v").await;
    master.send(ToWorker::Segment(lease(1, 0..8))).await;
    // One scene is compiled at a time, so without the cancellation this one would never be.
    assert_eq!(master.receive_pixels().await.1, expected(&new, b"v", 0..8));
    assert_eq!((calls.cancelled.load(Relaxed), calls.most_compiling.load(Relaxed)), (1, 1));
}

#[tokio::test]
async fn a_newer_frame_does_not_cancel_the_compilation_of_its_scene() {
    let body = scene(1, &[b"mesh"]);
    let (worker, _) = persistent(1, LARGE_CACHE);
    let calls = Arc::clone(&worker.renderer.calls);
    let mut master = FakeMaster::start(worker, &[&body, b"mesh"]);
    master.announce(0, &body, b"a").await;
    master.serve_request().await;
    for frame in 1..5 {
        master.send(ToWorker::Cancel { before: FrameId(frame) }).await;
        master.announce(frame, &body, b"b").await;
    }
    master.send(ToWorker::Segment(lease(4, 0..8))).await;
    assert_eq!(master.receive_pixels().await.1, expected(&body, b"b", 0..8));
    assert_eq!((calls.compiled.load(Relaxed), calls.cancelled.load(Relaxed)), (1, 0));
}

#[tokio::test]
async fn the_end_of_a_session_cancels_its_compilation_before_the_next_one_compiles() {
    let (old, new) = (scene(SLOW_SCENE, &[]), scene(1, &[]));
    let (worker, gate) = persistent(2, LARGE_CACHE);
    let calls = Arc::clone(&worker.renderer.calls);
    let mut master = FakeMaster::start(worker, &[&old]);
    master.announce(0, &old, b"v").await;
    master.serve_request().await;
    until(&calls.compiled, 1).await;
    let worker = master.close().await.1;
    until(&calls.cancelled, 1).await;
    // The compilation has noticed its cancellation and has not ended yet.
    let mut master = FakeMaster::start(worker, &[&new]);
    master.announce(0, &new, b"v").await;
    master.send(ToWorker::Segment(lease(0, 0..8))).await;
    master.serve_request().await;
    for nonce in 0..20 {
        master.send(ToWorker::Ping { nonce }).await;
        assert!(matches!(master.receive().await, Some(ToMaster::Pong { .. })));
    }
    assert_eq!(calls.compiled.load(Relaxed), 1, "two scenes are compiled at a time");
    gate.open();
    assert_eq!(master.receive_pixels().await.1, expected(&new, b"v", 0..8));
    assert_eq!((calls.compiled.load(Relaxed), calls.most_compiling.load(Relaxed)), (2, 1));
}

#[tokio::test]
async fn a_cancelled_scene_is_compiled_again_when_it_is_needed() {
    let (old, new) = (scene(SLOW_SCENE, &[]), scene(1, &[]));
    let (worker, gate) = persistent(1, LARGE_CACHE);
    gate.open();
    let calls = Arc::clone(&worker.renderer.calls);
    let mut master = FakeMaster::start(worker, &[&old, &new]);
    for round in 0..3 {
        let frame = 2 * round;
        let before = calls.compiled.load(Relaxed);
        master.announce(frame, &old, b"v").await;
        master.serve_request().await;
        until(&calls.compiled, before + 1).await;
        master.send(ToWorker::Cancel { before: FrameId(frame + 1) }).await;
        master.announce(frame + 1, &new, b"v").await;
        master.send(ToWorker::Segment(lease(frame + 1, 0..8))).await;
        assert_eq!(master.receive_pixels().await.1, expected(&new, b"v", 0..8));
    }
    // The new scene is cached, so its last picture may arrive before the last compilation notices its cancellation.
    until(&calls.cancelled, 3).await;
    assert_eq!(calls.most_compiling.load(Relaxed), 1);
}

#[tokio::test]
async fn a_cancelled_frame_cancels_its_preparation() {
    let body = scene(1, &[]);
    let (worker, _) = persistent(1, LARGE_CACHE);
    let calls = Arc::clone(&worker.renderer.calls);
    let mut master = FakeMaster::start(worker, &[&body]);
    master.announce(0, &body, b"endless").await;
    master.serve_request().await;
    until(&calls.prepared, 1).await;
    master.send(ToWorker::Cancel { before: FrameId(1) }).await;
    until(&calls.cancelled, 1).await;
    // The master receives no failure.
    master.announce(1, &body, b"v").await;
    master.send(ToWorker::Segment(lease(1, 0..8))).await;
    assert_eq!(master.receive_pixels().await.1, expected(&body, b"v", 0..8));
}

#[tokio::test]
async fn scenes_are_built_on_as_many_threads_as_frames_are_rendered() {
    let body = scene(1, &[b"mesh"]);
    for threads in [1, 3] {
        let (worker, _) = persistent(threads, LARGE_CACHE);
        let calls = Arc::clone(&worker.renderer.calls);
        let mut master = FakeMaster::start(worker, &[&body, b"mesh"]);
        master.announce(0, &body, b"v").await;
        master.send(ToWorker::Segment(lease(0, 0..8))).await;
        assert_eq!(master.receive_pixels().await.1, expected(&body, b"v", 0..8));
        assert_eq!(*calls.pool_sizes.lock().unwrap(), BTreeSet::from([threads]));
    }
}
