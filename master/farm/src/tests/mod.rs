//! The farm over 127.0.0.1, with workers that follow a script.

use std::net::SocketAddr;
use std::time::Duration;

use bytes::Bytes;
use rayfarm_protocol::session;
use rayfarm_protocol::{
    AssetId, Encoding, FrameId, Hello, Lease, PixelsHeader, ToMaster, ToWorker, codec, handshake,
};
use rayfarm_tracer::scene::{FrameView, Scene};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::oneshot;

use crate::supervisor::LocalWorkerCommand;
use crate::testing::fake_worker::{self, Script, is_picture};
use rayfarm_scheduler::{SegmentPolicy, WorkerState};
use crate::error::{FarmError, UnknownWorker};
use crate::farm::Farm;
use crate::finished::FinishedFrame;
use crate::options::{FarmOptions, FarmScene};
use crate::status::FarmStatus;
use crate::testing::test_scene::{scene, view};

mod asset_routing;
mod identity;
mod service;
mod strangers;
mod verification;

/// Far beyond what any of these tests takes: a farm that hangs fails instead of hanging the tests.
const PATIENCE: Duration = Duration::from_secs(60);

async fn farm(policy: SegmentPolicy) -> Farm {
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let options = FarmOptions { listen, policy, ..FarmOptions::default() };
    Farm::start(options, FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() })
        .await
        .unwrap()
}

async fn patiently<T>(what: impl Future<Output = T>) -> T {
    tokio::time::timeout(PATIENCE, what).await.expect("it never comes to pass")
}

async fn finished(farm: &mut Farm) -> FinishedFrame {
    patiently(farm.finished()).await.unwrap()
}

/// Renders a frame and checks every pixel of it.
async fn render(farm: &mut Farm, view: FrameView) -> FinishedFrame {
    let asked = farm.request(view);
    let frame = finished(farm).await;
    assert_eq!(frame.frame, asked);
    assert!(is_picture(&view, &frame.pixels), "the picture is not the right one");
    assert_eq!(frame.counts.primary, u64::from(view.height), "every row counts once");
    frame
}

async fn until(farm: &Farm, holds: impl Fn(&FarmStatus) -> bool) {
    let wait = async {
        while !holds(&farm.status()) {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    };
    patiently(wait).await;
}

async fn until_workers(farm: &Farm, count: usize) {
    until(farm, |status| status.workers.len() == count).await;
}

fn turned(spin: u32) -> FrameView {
    FrameView { spin: f64::from(spin), ..view() }
}

#[tokio::test]
async fn any_number_of_workers_makes_the_same_pictures() {
    for policy in [SegmentPolicy::Static(5), SegmentPolicy::Smart(7), SegmentPolicy::Adaptive] {
        for count in 1..=3 {
            let mut farm = farm(policy).await;
            for _ in 0..count {
                fake_worker::start(farm.address(), Script::Honest).await;
            }
            until_workers(&farm, count).await;
            for spin in 0..10 {
                let frame = render(&mut farm, turned(spin)).await;
                assert_eq!((frame.workers as usize, frame.threads as usize), (count, count));
            }
            farm.shut_down().await;
        }
    }
}

#[tokio::test]
async fn a_worker_that_vanishes_takes_nothing_with_it() {
    for policy in [SegmentPolicy::Static(4), SegmentPolicy::Adaptive] {
        for lease in 0..3 {
            let mut farm = farm(policy).await;
            let lost = fake_worker::start(farm.address(), Script::VanishAt(lease)).await;
            until_workers(&farm, 1).await;
            farm.request(view());
            patiently(lost).await.unwrap();
            until_workers(&farm, 0).await;
            fake_worker::start(farm.address(), Script::Honest).await;
            let frame = finished(&mut farm).await;
            assert!(is_picture(&view(), &frame.pixels));
            assert_eq!(frame.counts.primary, u64::from(view().height));
            farm.shut_down().await;
        }
    }
}

#[tokio::test]
async fn a_late_answer_does_no_harm() {
    let mut farm = farm(SegmentPolicy::Static(8)).await;
    let (go, late) = oneshot::channel();
    let worker = fake_worker::start(farm.address(), Script::Late(late)).await;
    until_workers(&farm, 1).await;
    fake_worker::start(farm.address(), Script::Honest).await;
    until_workers(&farm, 2).await;
    // The second worker renders what the first one keeps waiting.
    render(&mut farm, turned(1)).await;
    go.send(()).unwrap();
    for spin in 2..10 {
        let frame = render(&mut farm, turned(spin)).await;
        assert_eq!(frame.workers, 2, "a late answer is no reason to dismiss anybody");
    }
    farm.shut_down().await;
    assert_eq!(patiently(worker).await.unwrap().goodbye.as_deref(), Some("the master ends"));
}

#[tokio::test]
async fn workers_whose_answers_do_not_fit_are_dismissed_with_the_reason() {
    for (script, reason) in [(Script::Short, "do not fit"), (Script::Twice, "does not hold")] {
        let mut farm = farm(SegmentPolicy::Static(8)).await;
        let liar = fake_worker::start(farm.address(), script).await;
        until_workers(&farm, 1).await;
        farm.request(view());
        let goodbye = patiently(liar).await.unwrap().goodbye.unwrap();
        assert!(goodbye.contains(reason), "{goodbye}");
        until_workers(&farm, 0).await;
        fake_worker::start(farm.address(), Script::Honest).await;
        assert!(is_picture(&view(), &finished(&mut farm).await.pixels));
        farm.shut_down().await;
    }
}

#[tokio::test]
async fn pixels_of_somebody_elses_lease_are_refused() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    let stream = fake_worker::connect(farm.address(), 1).await;
    let (sender, mut receiver, _) = session::spawn::<_, ToMaster, ToWorker>(stream);
    let lease = Lease { frame: FrameId(1), segment: 7, attempt: 0, first_row: 0, row_count: 1 };
    let header = PixelsHeader { lease, encoding: Encoding::Raw, cost: Default::default() };
    sender.send(ToMaster::Pixels { header, bytes: Bytes::from_static(&[0; 3]) }).await.unwrap();
    let answer = receiver.recv().await.unwrap().unwrap();
    assert!(matches!(answer, ToWorker::Goodbye { reason, .. } if reason.contains("does not hold")));
    fake_worker::start(farm.address(), Script::Honest).await;
    render(&mut farm, view()).await;
}

#[tokio::test]
async fn a_worker_that_cannot_render_rests_while_others_do() {
    let mut farm = farm(SegmentPolicy::Static(8)).await;
    fake_worker::start(farm.address(), Script::FailOnce).await;
    until_workers(&farm, 1).await;
    farm.request(view());
    until(&farm, |status| status.workers[0].trouble.as_deref() == Some("out of paint")).await;
    fake_worker::start(farm.address(), Script::Honest).await;
    let frame = finished(&mut farm).await;
    assert!(is_picture(&view(), &frame.pixels));
    assert_eq!(frame.workers, 2);
}

#[tokio::test]
async fn a_lone_worker_that_fails_once_is_tried_again() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    let worker = fake_worker::start(farm.address(), Script::FailOnce).await;
    render(&mut farm, view()).await;
    farm.shut_down().await;
    let leases = patiently(worker).await.unwrap().leases;
    assert!(leases < 40, "{leases} leases for one frame: it was asked again and again without a pause");
}

#[tokio::test]
async fn the_scene_is_fetched_by_hash_and_unknown_assets_are_named() {
    let farm = farm(SegmentPolicy::Adaptive).await;
    let stream = fake_worker::connect(farm.address(), 1).await;
    let (sender, mut receiver, _) = session::spawn::<_, ToMaster, ToWorker>(stream);
    farm.request(view());
    let announce = loop {
        if let ToWorker::Frame(announce) = receiver.recv().await.unwrap().unwrap() {
            break announce;
        }
    };
    assert_eq!((announce.width, announce.height), (view().width, view().height));
    assert_eq!(codec::decode::<FrameView>(&announce.view, 4096).unwrap(), view());

    let unknown = AssetId([7; 32]);
    sender.send(ToMaster::NeedAsset { id: announce.scene, offset: 0, again: false }).await.unwrap();
    sender.send(ToMaster::NeedAsset { id: unknown, offset: 0, again: false }).await.unwrap();
    let mut size_announced = None;
    let mut body = Vec::new();
    loop {
        match receiver.recv().await.unwrap().unwrap() {
            ToWorker::AssetBegin { id, size } if id == announce.scene => size_announced = Some(size),
            ToWorker::AssetChunk { id, offset, bytes } if id == announce.scene => {
                assert_eq!(offset, body.len() as u64);
                body.extend_from_slice(&bytes);
            }
            ToWorker::AssetUnknown { id } if id == unknown => break,
            ToWorker::Segment(_) | ToWorker::Ping { .. } => {}
            other => panic!("unexpected {other:?}"),
        }
        // Control overtakes bulk: the refusal may come first. The body is read to its end all the same.
    }
    while size_announced != Some(body.len() as u64) {
        match receiver.recv().await.unwrap().unwrap() {
            ToWorker::AssetBegin { size, .. } => size_announced = Some(size),
            ToWorker::AssetChunk { bytes, .. } => body.extend_from_slice(&bytes),
            _ => {}
        }
    }
    assert_eq!(AssetId::of(&body), announce.scene);
    assert_eq!(codec::decode::<Scene>(&body, 1 << 20).unwrap(), scene());
}

#[tokio::test]
async fn a_camera_move_costs_each_worker_less_than_a_kilobyte() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    for _ in 0..3 {
        fake_worker::start(farm.address(), Script::Honest).await;
    }
    until_workers(&farm, 3).await;
    for spin in 0..20 {
        let frame = render(&mut farm, turned(spin)).await;
        // What a frame is charged may include a message of the frame before that was written late.
        assert!(frame.scene_bytes < 2 * 3 * 1000, "{} bytes", frame.scene_bytes);
        assert!(frame.received_bytes >= frame.pixels.len() as u64);
        assert!(frame.sent_bytes >= frame.scene_bytes);
    }
}

#[tokio::test]
async fn two_open_requests_are_both_served_and_a_third_replaces_the_second() {
    let mut farm = farm(SegmentPolicy::Static(8)).await;
    let asked = [1, 2, 3].map(|spin| farm.request(turned(spin)));
    fake_worker::start(farm.address(), Script::Honest).await;
    let first = finished(&mut farm).await;
    let second = finished(&mut farm).await;
    assert_eq!([first.frame, second.frame], [asked[0], asked[2]]);
    assert!(is_picture(&turned(1), &first.pixels) && is_picture(&turned(3), &second.pixels));

    let asked = [4, 5].map(|spin| farm.request(turned(spin)));
    assert_eq!([finished(&mut farm).await.frame, finished(&mut farm).await.frame], asked);
}

#[tokio::test]
async fn what_is_given_up_is_not_finished() {
    let mut farm = farm(SegmentPolicy::Static(8)).await;
    farm.request(view());
    farm.give_up();
    let large = FrameView { width: 50, height: 70, ..view() };
    let asked = farm.request(large);
    fake_worker::start(farm.address(), Script::Honest).await;
    let frame = finished(&mut farm).await;
    assert_eq!(frame.frame, asked);
    assert!(is_picture(&large, &frame.pixels));
}

/// A size that changes with every frame starves none of them.
#[tokio::test]
async fn every_frame_may_have_another_size() {
    for policy in [SegmentPolicy::Static(8), SegmentPolicy::Adaptive] {
        let mut farm = farm(policy).await;
        for _ in 0..2 {
            fake_worker::start(farm.address(), Script::Honest).await;
        }
        let sized = |side: u32| FrameView { width: side, height: 2 * side, ..view() };
        farm.request(sized(20));
        for next in (3..12).map(|step| if step % 2 == 0 { 20 } else { 20 + step }) {
            let asked = farm.request(sized(next));
            let frame = finished(&mut farm).await;
            assert_eq!(frame.frame.0 + 1, asked.0, "the oldest is finished, whatever comes after it");
            assert!(is_picture(&frame.view, &frame.pixels));
        }
    }
}

#[tokio::test]
async fn a_frame_that_nobody_can_render_is_an_error_and_the_next_one_is_not() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    fake_worker::start(farm.address(), Script::Honest).await;
    for bad in [FrameView { width: 0, ..view() }, FrameView { height: u32::MAX, ..view() }] {
        farm.request(bad);
        assert!(matches!(farm.finished().await, Err(FarmError::View(_))));
    }
    render(&mut farm, view()).await;
}

#[tokio::test]
async fn a_taken_port_is_named_with_a_way_out() {
    let taken = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = taken.local_addr().unwrap();
    let options = FarmOptions { listen: Some(address), ..FarmOptions::default() };
    let refused =
        Farm::start(options, FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() }).await;
    let message = refused.err().unwrap().to_string();
    assert!(message.contains(&address.port().to_string()) && message.contains("--listen"), "{message}");
}

#[tokio::test]
async fn the_usual_port_gives_way_when_nobody_asked_for_it() {
    let scene = || FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() };
    let first = Farm::start(FarmOptions::default(), scene()).await.unwrap();
    let second = Farm::start(FarmOptions::default(), scene()).await.unwrap();
    assert_ne!(first.address(), second.address());
    assert!(second.address().ip().is_loopback());
}

#[tokio::test]
async fn a_farm_that_is_dropped_lets_go_of_its_workers() {
    let farm = farm(SegmentPolicy::Adaptive).await;
    let worker = fake_worker::start(farm.address(), Script::Honest).await;
    until_workers(&farm, 1).await;
    drop(farm);
    patiently(worker).await.unwrap();
}

#[cfg(unix)]
#[tokio::test]
async fn local_workers_that_cannot_live_end_the_waiting() {
    tokio::time::pause();
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let local_worker =
        LocalWorkerCommand { program: "/nonexistent/worker".into(), ..LocalWorkerCommand::default() };
    let options = FarmOptions { listen, local_workers: 2, local_worker, ..FarmOptions::default() };
    let scene = FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() };
    let mut farm = Farm::start(options, scene).await.unwrap();
    farm.request(view());
    let message = farm.finished().await.unwrap_err().to_string();
    assert!(message.contains("/nonexistent/worker") && message.contains("--master 127.0.0.1:"), "{message}");
    farm.shut_down().await;
}
