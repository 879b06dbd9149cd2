//! Work that is not wanted any more stops, whatever made it so.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

use rayfarm_protocol::{FrameId, ToMaster, ToWorker};

use crate::testing::{ENDLESS, Master, expected, keep, lease, scene, until};

const PLENTY: u64 = 1 << 20;

#[tokio::test]
async fn a_newer_scene_stops_the_compilation_of_the_older_one() {
    let (old, new) = (scene(ENDLESS, &[]), scene(1, &[]));
    let (kept, gate) = keep(1, PLENTY);
    gate.open();
    let seen = Arc::clone(&kept.renderer.seen);
    let mut master = Master::meet(kept, &[&old, &new]);
    master.announce(0, &old, b"v").await;
    master.send_wished().await;
    until(&seen.compiled, 1).await;
    master.say(ToWorker::Cancel { before: FrameId(1) }).await;
    master.announce(1, &new, b"v").await;
    master.say(ToWorker::Segment(lease(1, 0..8))).await;
    // One scene is compiled at a time: this one would wait for ever.
    assert_eq!(master.pixels().await.1, expected(&new, b"v", 0..8));
    assert_eq!((seen.cancelled.load(Relaxed), seen.most_compiling.load(Relaxed)), (1, 1));
}

#[tokio::test]
async fn a_camera_that_moves_does_not_stop_the_compilation_of_its_scene() {
    let body = scene(1, &[b"mesh"]);
    let (kept, _) = keep(1, PLENTY);
    let seen = Arc::clone(&kept.renderer.seen);
    let mut master = Master::meet(kept, &[&body, b"mesh"]);
    master.announce(0, &body, b"a").await;
    master.send_wished().await;
    for frame in 1..5 {
        master.say(ToWorker::Cancel { before: FrameId(frame) }).await;
        master.announce(frame, &body, b"b").await;
    }
    master.say(ToWorker::Segment(lease(4, 0..8))).await;
    assert_eq!(master.pixels().await.1, expected(&body, b"b", 0..8));
    assert_eq!((seen.compiled.load(Relaxed), seen.cancelled.load(Relaxed)), (1, 0));
}

#[tokio::test]
async fn the_scene_of_a_master_that_left_stops_before_the_next_session_compiles() {
    let (old, new) = (scene(ENDLESS, &[]), scene(1, &[]));
    let (kept, gate) = keep(2, PLENTY);
    let seen = Arc::clone(&kept.renderer.seen);
    let mut master = Master::meet(kept, &[&old]);
    master.announce(0, &old, b"v").await;
    master.send_wished().await;
    until(&seen.compiled, 1).await;
    let kept = master.part().await.1;
    until(&seen.cancelled, 1).await;
    // It has noticed, and takes its time to end.
    let mut master = Master::meet(kept, &[&new]);
    master.announce(0, &new, b"v").await;
    master.say(ToWorker::Segment(lease(0, 0..8))).await;
    master.send_wished().await;
    for nonce in 0..20 {
        master.say(ToWorker::Ping { nonce }).await;
        assert!(matches!(master.hear().await, Some(ToMaster::Pong { .. })));
    }
    assert_eq!(seen.compiled.load(Relaxed), 1, "the next scene does not wait for its turn");
    gate.open();
    assert_eq!(master.pixels().await.1, expected(&new, b"v", 0..8));
    assert_eq!((seen.compiled.load(Relaxed), seen.most_compiling.load(Relaxed)), (2, 1));
}

#[tokio::test]
async fn a_scene_that_is_wanted_again_is_compiled_again() {
    let (old, new) = (scene(ENDLESS, &[]), scene(1, &[]));
    let (kept, gate) = keep(1, PLENTY);
    gate.open();
    let seen = Arc::clone(&kept.renderer.seen);
    let mut master = Master::meet(kept, &[&old, &new]);
    for round in 0..3 {
        let frame = 2 * round;
        let before = seen.compiled.load(Relaxed);
        master.announce(frame, &old, b"v").await;
        master.send_wished().await;
        until(&seen.compiled, before + 1).await;
        master.say(ToWorker::Cancel { before: FrameId(frame + 1) }).await;
        master.announce(frame + 1, &new, b"v").await;
        master.say(ToWorker::Segment(lease(frame + 1, 0..8))).await;
        assert_eq!(master.pixels().await.1, expected(&new, b"v", 0..8));
    }
    // The new scene is kept: its last picture may be there before the old one's compilation has noticed.
    until(&seen.cancelled, 3).await;
    assert_eq!(seen.most_compiling.load(Relaxed), 1);
}

#[tokio::test]
async fn a_cancelled_frame_is_not_prepared_to_its_end() {
    let body = scene(1, &[]);
    let (kept, _) = keep(1, PLENTY);
    let seen = Arc::clone(&kept.renderer.seen);
    let mut master = Master::meet(kept, &[&body]);
    master.announce(0, &body, b"endless").await;
    master.send_wished().await;
    until(&seen.prepared, 1).await;
    master.say(ToWorker::Cancel { before: FrameId(1) }).await;
    until(&seen.cancelled, 1).await;
    // The master hears nothing of it.
    master.announce(1, &body, b"v").await;
    master.say(ToWorker::Segment(lease(1, 0..8))).await;
    assert_eq!(master.pixels().await.1, expected(&body, b"v", 0..8));
}

#[tokio::test]
async fn scenes_are_built_by_as_many_threads_as_frames_are_rendered() {
    let body = scene(1, &[b"mesh"]);
    for threads in [1, 3] {
        let (kept, _) = keep(threads, PLENTY);
        let seen = Arc::clone(&kept.renderer.seen);
        let mut master = Master::meet(kept, &[&body, b"mesh"]);
        master.announce(0, &body, b"v").await;
        master.say(ToWorker::Segment(lease(0, 0..8))).await;
        assert_eq!(master.pixels().await.1, expected(&body, b"v", 0..8));
        assert_eq!(*seen.threads.lock().unwrap(), BTreeSet::from([threads]));
    }
}
