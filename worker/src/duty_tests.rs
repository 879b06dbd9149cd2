//! Sessions with a master at the other end of a pipe.

use rayfarm_protocol::{FrameId, Reconnect, ToMaster, ToWorker};

use crate::duty::{End, Terms};
use crate::ending::Ending;
use crate::testing::{HEIGHT, Master, WIDTH, expected, keep, lease, scene};

const MESH: &[u8] = b"mesh of a teapot";
const PLENTY: u64 = 1 << 20;

#[tokio::test]
async fn leases_become_pixels_whatever_the_number_of_threads() {
    let body = scene(1, &[MESH]);
    for threads in [1, 2, 5] {
        let mut master = Master::meet(keep(threads, PLENTY).0, &[&body, MESH]);
        master.announce(3, &body, b"v").await;
        // They arrive before the frame is ready, out of order, and touch no tile boundary.
        for rows in [17..40, 0..1, 1..17] {
            master.say(ToWorker::Segment(lease(3, rows))).await;
        }
        let mut rows_done = 0;
        while rows_done < HEIGHT {
            let (lease, bytes) = master.pixels().await;
            assert_eq!(bytes, expected(&body, b"v", lease.rows().unwrap()));
            rows_done += lease.row_count;
        }
        assert_eq!(rows_done, HEIGHT);
        master.part().await;
    }
}

#[tokio::test]
async fn the_cost_of_a_lease_is_that_of_all_its_bands() {
    let body = scene(1, &[]);
    let mut master = Master::meet(keep(3, PLENTY).0, &[&body]);
    master.announce(0, &body, b"v").await;
    master.say(ToWorker::Segment(lease(0, 4..30))).await;
    let Some(ToMaster::Pixels { header, .. }) = master.hear().await else { panic!("pixels were expected") };
    assert_eq!(header.lease, lease(0, 4..30));
    assert_eq!((header.cost.primary, header.cost.shadow), (u64::from(WIDTH) * 26, 4));
}

#[tokio::test]
async fn a_scene_and_its_meshes_are_fetched_once_and_survive_a_new_session() {
    let body = scene(1, &[MESH, b"mesh 2"]);
    let mut kept = keep(1, PLENTY).0;
    for session in 0..2 {
        let mut master = Master::meet(kept, &[&body, MESH, b"mesh 2"]);
        for frame in 0..3 {
            master.announce(frame, &body, &[frame as u8]).await;
            master.say(ToWorker::Segment(lease(frame, 0..8))).await;
            assert_eq!(master.pixels().await.1, expected(&body, &[frame as u8], 0..8));
        }
        assert_eq!(master.asked.len(), if session == 0 { 3 } else { 0 });
        kept = master.part().await.1;
    }
}

#[tokio::test]
async fn a_ping_is_answered_while_every_thread_renders() {
    let body = scene(1, &[]);
    let (kept, gate) = keep(2, PLENTY);
    let mut master = Master::meet(kept, &[&body]);
    master.announce(0, &body, b"wait").await;
    master.say(ToWorker::Segment(lease(0, 0..40))).await;
    for nonce in 0..3 {
        master.say(ToWorker::Ping { nonce }).await;
        assert!(matches!(master.hear().await, Some(ToMaster::Pong { nonce: n }) if n == nonce));
    }
    gate.open();
    assert_eq!(master.pixels().await.1, expected(&body, b"wait", 0..40));
}

#[tokio::test]
async fn cancelled_frames_send_nothing_and_hold_nobody_up() {
    let body = scene(1, &[]);
    let (kept, gate) = keep(1, PLENTY);
    let mut master = Master::meet(kept, &[&body]);
    master.announce(0, &body, b"wait").await;
    // One is being rendered when the cancel arrives, the other waits in the queue.
    master.say(ToWorker::Segment(lease(0, 0..8))).await;
    master.say(ToWorker::Segment(lease(0, 8..16))).await;
    master.say(ToWorker::Ping { nonce: 1 }).await;
    master.hear().await;
    master.say(ToWorker::Cancel { before: FrameId(1) }).await;
    master.announce(1, &body, b"new").await;
    // Leases of a cancelled frame that were on their way are no error.
    master.say(ToWorker::Segment(lease(0, 16..24))).await;
    master.say(ToWorker::Segment(lease(1, 0..8))).await;
    master.say(ToWorker::Ping { nonce: 2 }).await;
    assert!(matches!(master.hear().await, Some(ToMaster::Pong { nonce: 2 })));
    gate.open();
    let (done, bytes) = master.pixels().await;
    assert_eq!((done, bytes), (lease(1, 0..8), expected(&body, b"new", 0..8).into()));
}

#[tokio::test]
async fn an_asset_that_nobody_has_fails_the_frame_and_those_that_follow() {
    let body = scene(1, &[MESH]);
    let mut master = Master::meet(keep(1, PLENTY).0, &[&body]);
    master.announce(0, &body, b"v").await;
    master.say(ToWorker::Segment(lease(0, 0..8))).await;
    let reason = master.failure(0).await;
    assert!(reason.contains("the master does not have asset"), "{reason}");
    // It is told again for each frame, and not asked for again.
    master.announce(1, &body, b"v").await;
    assert_eq!(master.failure(1).await, reason);
    assert_eq!(master.asked.len(), 2);
    // Another scene is not affected.
    let other = scene(2, &[]);
    let mut master = Master::meet(master.part().await.1, &[&other]);
    master.announce(0, &other, b"v").await;
    master.say(ToWorker::Segment(lease(0, 0..8))).await;
    assert_eq!(master.pixels().await.1, expected(&other, b"v", 0..8));
}

#[tokio::test]
async fn an_asset_with_the_wrong_bytes_is_not_used() {
    let body = scene(1, &[MESH]);
    let mut master = Master::meet(keep(1, PLENTY).0, &[&body]);
    master.corrupt(MESH, b"mesh of a teacup");
    master.announce(0, &body, b"v").await;
    let reason = master.failure(0).await;
    assert!(reason.contains("arrived damaged"), "{reason}");
}

#[tokio::test]
async fn bytes_that_are_no_scene_no_mesh_or_no_view_are_reported() {
    for (body, mesh, view, part) in [
        (b"toml".to_vec(), MESH, b"v".as_slice(), "this is no scene"),
        (scene(1, &[b"obj"]), b"obj".as_slice(), b"v", "this is no mesh"),
        (
            scene(1, &[b"mesh that panics"]),
            b"mesh that panics",
            b"v",
            "a bug in this worker: this mesh is a trap",
        ),
        (scene(1, &[]), MESH, b"unpreparable", "this view cannot be"),
        (scene(1, &[]), MESH, b"panic", "a bug in this worker: row 16 is unlucky"),
        (scene(1, &[]), MESH, b"narrow", "none of the reduced colours"),
    ] {
        let mut master = Master::meet(keep(1, PLENTY).0, &[&body, mesh]);
        master.announce(0, &body, view).await;
        master.say(ToWorker::Segment(lease(0, 16..24))).await;
        let reason = master.failure(0).await;
        assert!(reason.contains(part), "{reason}");
        // The worker lives on.
        let good = scene(9, &[]);
        let mut master = Master::meet(master.part().await.1, &[&good]);
        master.announce(1, &good, b"v").await;
        master.say(ToWorker::Segment(lease(1, 0..8))).await;
        assert_eq!(master.pixels().await.1, expected(&good, b"v", 0..8));
    }
}

#[tokio::test]
async fn a_panic_fails_its_frame_once_and_leaves_the_threads_alive() {
    let body = scene(1, &[]);
    let mut master = Master::meet(keep(2, PLENTY).0, &[&body]);
    master.announce(0, &body, b"panic").await;
    for first in (0..HEIGHT).step_by(8) {
        master.say(ToWorker::Segment(lease(0, first..first + 8))).await;
    }
    assert!(master.failure(0).await.contains("is unlucky"));
    master.announce(1, &body, b"v").await;
    master.say(ToWorker::Segment(lease(1, 0..40))).await;
    assert_eq!(master.pixels().await.1, expected(&body, b"v", 0..40));
}

#[tokio::test]
async fn a_frame_that_failed_is_tried_again_when_it_is_announced_again() {
    let body = scene(1, &[]);
    let mut master = Master::meet(keep(1, PLENTY).0, &[&body]);
    master.announce(0, &body, b"panic").await;
    master.say(ToWorker::Segment(lease(0, 0..8))).await;
    assert!(master.failure(0).await.contains("is unlucky"));
    // A lease alone is no new attempt, and the failure has been told.
    master.say(ToWorker::Segment(lease(0, 0..8))).await;
    // What the frame shows changes only so that this renderer has better luck.
    master.announce(0, &body, b"v").await;
    master.say(ToWorker::Segment(lease(0, 8..16))).await;
    let (done, bytes) = master.pixels().await;
    assert_eq!((done, bytes), (lease(0, 8..16), expected(&body, b"v", 8..16).into()));
    // What failed for good is told again, so that the master need not wait for it.
    master.announce(1, &body, b"unpreparable").await;
    assert!(master.failure(1).await.contains("cannot be"));
    master.announce(1, &body, b"unpreparable").await;
    assert!(master.failure(1).await.contains("cannot be"));
}

#[tokio::test]
async fn a_scene_beyond_the_cache_is_refused_with_the_remedy() {
    let large = [b"mesh".as_slice(), &[0; 3000]].concat();
    let body = scene(1, &[&large]);
    let mut master = Master::meet(keep(1, 3000).0, &[&body, &large]);
    master.announce(0, &body, b"v").await;
    let reason = master.failure(0).await;
    assert!(reason.contains("--asset-cache"), "{reason}");
}

#[tokio::test]
async fn the_cache_drops_old_scenes_and_never_the_current_one() {
    let meshes: Vec<Vec<u8>> = (0..3).map(|i| [b"mesh".as_slice(), &[i; 1000]].concat()).collect();
    let bodies: Vec<Vec<u8>> = (0..3).map(|i| scene(i, &[&meshes[usize::from(i)]])).collect();
    let assets: Vec<&[u8]> = meshes.iter().chain(&bodies).map(Vec::as_slice).collect();
    // Room for two scenes of three.
    let mut master = Master::meet(keep(1, 2300).0, &assets);
    let mut asked = Vec::new();
    for (frame, shown) in (0..).zip([0, 1, 0, 1, 2, 1, 0]) {
        let body = &bodies[shown];
        master.announce(frame, body, b"v").await;
        master.say(ToWorker::Segment(lease(frame, 0..8))).await;
        assert_eq!(master.pixels().await.1, expected(body, b"v", 0..8));
        master.say(ToWorker::Cancel { before: FrameId(frame + 1) }).await;
        asked.push(std::mem::take(&mut master.asked).len());
    }
    // 2 displaces 0, which was not used for longest; 0 then displaces 2.
    assert_eq!(asked, [2, 2, 0, 0, 2, 0, 2]);
}

#[tokio::test]
async fn leases_that_make_no_sense_are_refused() {
    let body = scene(1, &[]);
    let mut master = Master::meet(keep(1, PLENTY).0, &[&body]);
    master.say(ToWorker::Segment(lease(7, 0..8))).await;
    assert!(master.failure(7).await.contains("does not hold"));
    master.announce(8, &body, b"v").await;
    master.say(ToWorker::Segment(lease(8, 32..41))).await;
    assert!(master.failure(8).await.contains("outside a frame of 40 rows"));
}

#[tokio::test]
async fn a_goodbye_ends_the_worker_unless_it_may_come_back() {
    let master = Master::meet(keep(1, PLENTY).0, &[]);
    master.say(ToWorker::Disconnect { reason: "closing time".into(), reconnect: Reconnect::Never }).await;
    assert_eq!(master.worker.await.unwrap().0, End::Goodbye("closing time".into()));
    let master = Master::meet(keep(1, PLENTY).0, &[]);
    master.say(ToWorker::Disconnect { reason: "you were silent".into(), reconnect: Reconnect::Now }).await;
    assert_eq!(master.worker.await.unwrap().0, End::Lost("it ends this session: you were silent".into()));
}

#[tokio::test]
async fn a_worker_that_is_told_to_stop_says_goodbye_though_it_renders() {
    let body = scene(1, &[]);
    let (kept, gate) = keep(1, PLENTY);
    let mut master = Master::meet(kept, &[&body]);
    master.announce(0, &body, b"wait").await;
    master.say(ToWorker::Segment(lease(0, 0..8))).await;
    master.say(ToWorker::Ping { nonce: 0 }).await;
    master.hear().await;
    master.ending.stop();
    assert!(matches!(master.hear().await, Some(ToMaster::Disconnect { .. })));
    assert!(master.hear().await.is_none());
    assert_eq!(master.worker.await.unwrap().0, End::Stopped);
    gate.open();
}

#[tokio::test]
async fn a_drained_worker_finishes_what_it_holds() {
    let body = scene(1, &[MESH]);
    let mut master = Master::meet(keep(2, PLENTY).0, &[&body, MESH]);
    master.announce(0, &body, b"v").await;
    for first in (0..HEIGHT).step_by(8) {
        master.say(ToWorker::Segment(lease(0, first..first + 8))).await;
    }
    master.say(ToWorker::Drain).await;
    for _ in (0..HEIGHT).step_by(8) {
        let (lease, bytes) = master.pixels().await;
        assert_eq!(bytes, expected(&body, b"v", lease.rows().unwrap()));
    }
    assert!(matches!(master.hear().await, Some(ToMaster::Disconnect { .. })));
    assert_eq!(master.worker.await.unwrap().0, End::Drained);
}

#[tokio::test]
async fn a_master_that_vanishes_or_babbles_is_lost_with_the_reason() {
    let master = Master::meet(keep(1, PLENTY).0, &[]);
    let (end, _) = master.part().await;
    assert_eq!(end, End::Lost("the master closed the connection without a goodbye".into()));

    use tokio::io::AsyncWriteExt;
    let (mut ours, theirs) = tokio::io::duplex(1 << 10);
    ours.write_all(b"HTTP/1.1 200 OK\r\n\r\n").await.unwrap();
    let terms = Terms { compress: false, uses_disk: false, sharing: None };
    let end = crate::duty::serve(theirs, terms, &mut keep(1, PLENTY).0, &Ending::new()).await;
    assert!(matches!(&end, End::Lost(why) if why.contains("unknown type")), "{end:?}");
}

#[tokio::test]
async fn assets_that_were_not_asked_for_are_not_kept() {
    let body = scene(1, &[]);
    let mut master = Master::meet(keep(1, PLENTY).0, &[&body]);
    let id = rayfarm_protocol::AssetId::of(MESH);
    master.say(ToWorker::AssetBegin { id, size: MESH.len() as u64 }).await;
    master.say(ToWorker::AssetChunk { id, offset: 0, bytes: MESH.into() }).await;
    master.announce(0, &body, b"v").await;
    master.say(ToWorker::Segment(lease(0, 0..8))).await;
    assert_eq!(master.pixels().await.1, expected(&body, b"v", 0..8));
}

#[tokio::test]
async fn of_many_frames_the_oldest_gives_way() {
    let body = scene(1, &[]);
    let mut master = Master::meet(keep(1, PLENTY).0, &[&body]);
    for frame in 0..9 {
        master.announce(frame, &body, b"v").await;
    }
    master.say(ToWorker::Segment(lease(0, 0..8))).await;
    assert!(master.failure(0).await.contains("does not hold"));
    master.say(ToWorker::Segment(lease(1, 0..8))).await;
    assert_eq!(master.pixels().await.0, lease(1, 0..8));
}

#[tokio::test]
async fn a_worker_that_is_to_leave_finishes_what_it_holds_and_does_not_come_back() {
    let body = scene(1, &[]);
    let (kept, gate) = keep(1, PLENTY);
    let mut master = Master::meet(kept, &[&body]);
    master.announce(0, &body, b"wait").await;
    master.say(ToWorker::Segment(lease(0, 0..8))).await;
    master.ending.drain();
    assert_eq!(master.hear().await, Some(ToMaster::Drain));
    // One more was on its way when the master heard of it.
    master.say(ToWorker::Segment(lease(0, 8..16))).await;
    gate.open();
    for rows in [0..8, 8..16] {
        assert_eq!(master.pixels().await, (lease(0, rows.clone()), expected(&body, b"wait", rows).into()));
    }
    master.say(ToWorker::Disconnect { reason: "all done".into(), reconnect: Reconnect::Now }).await;
    assert_eq!(master.worker.await.unwrap().0, End::Goodbye("all done".into()));
}

#[tokio::test(start_paused = true)]
async fn a_master_that_falls_silent_is_lost_and_one_that_pings_is_not() {
    let mut master = Master::meet(keep(1, PLENTY).0, &[]);
    for nonce in 0..60 {
        master.say(ToWorker::Ping { nonce }).await;
        assert_eq!(master.hear().await, Some(ToMaster::Pong { nonce }));
        tokio::time::sleep(std::time::Duration::from_secs(2)).await;
    }
    let (end, _) = master.worker.await.unwrap();
    assert!(matches!(&end, End::Lost(why) if why.contains("silent")), "{end:?}");
}
