//! Farms over 127.0.0.1 with scripted workers.

use std::net::SocketAddr;
use std::time::Duration;

use bytes::Bytes;
use rayfarm_protocol::session;
use rayfarm_protocol::{
    AssetId, Encoding, FrameId, Hello, Lease, PixelsHeader, ToMaster, ToWorker, codec, handshake,
};
use rayfarm_tracer::scene::{FrameView, RenderScale, Scene};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::oneshot;

use crate::error::{FarmError, UnknownWorker};
use crate::farm::Farm;
use crate::farm_scene::FarmScene;
use crate::finished::FinishedFrame;
use crate::options::FarmOptions;
use crate::status::FarmStatus;
use crate::supervisor::LocalWorkerCommand;
use crate::testing::fake_worker::{self, Script, is_picture};
use crate::testing::test_scene::{scene, view};
use crate::view_request::ViewRequest;
use rayfarm_scheduler::{SegmentPolicy, WorkerState};

mod asset_routing;
mod commands;
mod decoding;
mod formats;
mod identity;
mod invalid_peers;
mod scenes;
mod verification;

/// Time limit of a wait, so that a farm that hangs fails its test.
const TIMEOUT: Duration = Duration::from_secs(60);

async fn farm(policy: SegmentPolicy) -> Farm {
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let options = FarmOptions { listen, policy, ..FarmOptions::default() };
    Farm::start(options, FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() })
        .await
        .unwrap()
}

async fn in_time<T>(what: impl Future<Output = T>) -> T {
    tokio::time::timeout(TIMEOUT, what).await.expect("no result within the time limit")
}

async fn finished(farm: &mut Farm) -> FinishedFrame {
    in_time(farm.finished()).await.unwrap()
}

/// Renders a frame and checks every pixel of it.
async fn render(farm: &mut Farm, view: FrameView) -> FinishedFrame {
    let requested = farm.request(view);
    let frame = finished(farm).await;
    assert_eq!(frame.frame, requested);
    assert!(is_picture(&view, &frame.pixels), "the picture is wrong");
    assert_eq!(frame.counts.primary, u64::from(view.height), "every row counts once");
    frame
}

async fn until(farm: &Farm, holds: impl Fn(&FarmStatus) -> bool) {
    let wait = async {
        while !holds(&farm.status()) {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    };
    in_time(wait).await;
}

async fn until_workers(farm: &Farm, count: usize) {
    until(farm, |status| status.workers.len() == count).await;
}

fn turned(spin: u32) -> FrameView {
    FrameView { spin: f64::from(spin), ..view() }
}

#[tokio::test]
async fn any_number_of_workers_renders_the_same_pictures() {
    for policy in [SegmentPolicy::Static(5), SegmentPolicy::Smart(7), SegmentPolicy::Adaptive] {
        for count in 1..=3 {
            let mut farm = farm(policy).await;
            for _ in 0..count {
                fake_worker::start(farm.address(), Script::Correct).await;
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
async fn a_frame_survives_a_lost_worker() {
    for policy in [SegmentPolicy::Static(4), SegmentPolicy::Adaptive] {
        for lease in 0..3 {
            let mut farm = farm(policy).await;
            let lost = fake_worker::start(farm.address(), Script::DisconnectAt(lease)).await;
            until_workers(&farm, 1).await;
            farm.request(view());
            in_time(lost).await.unwrap();
            until_workers(&farm, 0).await;
            fake_worker::start(farm.address(), Script::Correct).await;
            let frame = finished(&mut farm).await;
            assert!(is_picture(&view(), &frame.pixels));
            assert_eq!(frame.counts.primary, u64::from(view().height));
            farm.shut_down().await;
        }
    }
}

#[tokio::test]
async fn a_late_reply_is_ignored() {
    let mut farm = farm(SegmentPolicy::Static(8)).await;
    let (go, late) = oneshot::channel();
    let worker = fake_worker::start(farm.address(), Script::Late(late)).await;
    until_workers(&farm, 1).await;
    fake_worker::start(farm.address(), Script::Correct).await;
    until_workers(&farm, 2).await;
    // The second worker renders the rows that the first one holds back.
    render(&mut farm, turned(1)).await;
    go.send(()).unwrap();
    for spin in 2..10 {
        let frame = render(&mut farm, turned(spin)).await;
        assert_eq!(frame.workers, 2, "a late reply does not end its session");
    }
    farm.shut_down().await;
    assert_eq!(in_time(worker).await.unwrap().disconnect_reason.as_deref(), Some("the master ends"));
}

#[tokio::test]
async fn workers_whose_replies_do_not_fit_are_disconnected_with_the_reason() {
    for (script, reason) in [(Script::Short, "do not fit"), (Script::Twice, "does not hold")] {
        let mut farm = farm(SegmentPolicy::Static(8)).await;
        let worker = fake_worker::start(farm.address(), script).await;
        until_workers(&farm, 1).await;
        farm.request(view());
        let received = in_time(worker).await.unwrap().disconnect_reason.unwrap();
        assert!(received.contains(reason), "{received}");
        until_workers(&farm, 0).await;
        fake_worker::start(farm.address(), Script::Correct).await;
        assert!(is_picture(&view(), &finished(&mut farm).await.pixels));
        farm.shut_down().await;
    }
}

#[tokio::test]
async fn pixels_of_another_workers_lease_are_refused() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    let stream = fake_worker::connect(farm.address(), 1).await;
    let (sender, mut receiver, _) = session::spawn::<_, ToMaster, ToWorker>(stream);
    let lease = Lease { frame: FrameId(1), segment: 7, attempt: 0, first_row: 0, row_count: 1 };
    let header = PixelsHeader { lease, encoding: Encoding::Raw, cost: Default::default() };
    sender.send(ToMaster::Pixels { header, bytes: Bytes::from_static(&[0; 3]) }).await.unwrap();
    let answer = receiver.recv().await.unwrap().unwrap();
    // Without any lease no pixels may be announced: they are refused before their lease is known.
    assert!(matches!(answer, ToWorker::Disconnect { reason, .. } if reason.contains("need at most 0")));
    fake_worker::start(farm.address(), Script::Correct).await;
    render(&mut farm, view()).await;
}

#[tokio::test]
async fn a_worker_that_cannot_render_is_replaced_by_others() {
    let mut farm = farm(SegmentPolicy::Static(8)).await;
    fake_worker::start(farm.address(), Script::FailOnce).await;
    until_workers(&farm, 1).await;
    farm.request(view());
    until(&farm, |status| status.workers[0].last_failure.as_deref() == Some("out of memory")).await;
    fake_worker::start(farm.address(), Script::Correct).await;
    let frame = finished(&mut farm).await;
    assert!(is_picture(&view(), &frame.pixels));
    assert_eq!(frame.workers, 2);
}

#[tokio::test]
async fn a_lone_worker_that_fails_once_is_retried() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    let worker = fake_worker::start(farm.address(), Script::FailOnce).await;
    render(&mut farm, view()).await;
    farm.shut_down().await;
    let leases = in_time(worker).await.unwrap().leases;
    assert!(leases < 40, "{leases} leases for one frame: there is no delay between retries");
}

#[tokio::test]
async fn the_scene_is_fetched_by_hash_and_unknown_assets_are_refused() {
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
        // Control messages overtake bulk: the refusal may arrive first, and the body is read to its end below.
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
        fake_worker::start(farm.address(), Script::Correct).await;
    }
    until_workers(&farm, 3).await;
    for spin in 0..20 {
        let frame = render(&mut farm, turned(spin)).await;
        // A message of the previous frame that was written late counts for this one.
        assert!(frame.scene_bytes < 2 * 3 * 1000, "{} bytes", frame.scene_bytes);
        assert!(frame.received_bytes >= frame.pixels.len() as u64);
        assert!(frame.sent_bytes >= frame.scene_bytes);
    }
}

#[tokio::test]
async fn a_third_open_request_replaces_the_second() {
    let mut farm = farm(SegmentPolicy::Static(8)).await;
    let requested = [1, 2, 3].map(|spin| farm.request(turned(spin)));
    fake_worker::start(farm.address(), Script::Correct).await;
    let first = finished(&mut farm).await;
    let second = finished(&mut farm).await;
    assert_eq!([first.frame, second.frame], [requested[0], requested[2]]);
    assert!(is_picture(&turned(1), &first.pixels) && is_picture(&turned(3), &second.pixels));

    let requested = [4, 5].map(|spin| farm.request(turned(spin)));
    assert_eq!([finished(&mut farm).await.frame, finished(&mut farm).await.frame], requested);
}

#[tokio::test]
async fn dropped_requests_are_not_finished() {
    let mut farm = farm(SegmentPolicy::Static(8)).await;
    farm.request(view());
    farm.drop_requests();
    let large = FrameView { width: 50, height: 70, ..view() };
    let requested = farm.request(large);
    fake_worker::start(farm.address(), Script::Correct).await;
    let frame = finished(&mut farm).await;
    assert_eq!(frame.frame, requested);
    assert!(is_picture(&large, &frame.pixels));
}

#[tokio::test]
async fn a_finished_frame_carries_the_request_that_it_answers() {
    let mut farm = farm(SegmentPolicy::Static(8)).await;
    fake_worker::start(farm.address(), Script::Correct).await;
    for scale in RenderScale::ALL {
        let mut request = ViewRequest { view: turned(1), scale };
        request.view.quality.shadows = false;
        farm.request(request);
        // A later request, changes nothing about the frame in flight.
        farm.request(turned(2));
        let [first, second] = [finished(&mut farm).await, finished(&mut farm).await];
        assert_eq!((first.request, first.view), (request, request.rendered()));
        assert_eq!(second.request, turned(2).into());
    }
}

#[tokio::test]
async fn each_frame_may_have_its_own_size() {
    for policy in [SegmentPolicy::Static(8), SegmentPolicy::Adaptive] {
        let mut farm = farm(policy).await;
        for _ in 0..2 {
            fake_worker::start(farm.address(), Script::Correct).await;
        }
        let sized = |side: u32| FrameView { width: side, height: 2 * side, ..view() };
        farm.request(sized(20));
        for next in (3..12).map(|step| if step % 2 == 0 { 20 } else { 20 + step }) {
            let requested = farm.request(sized(next));
            let frame = finished(&mut farm).await;
            assert_eq!(frame.frame.0 + 1, requested.0, "the oldest request is finished");
            assert!(is_picture(&frame.view, &frame.pixels));
        }
    }
}

#[tokio::test]
async fn an_invalid_view_is_an_error_and_the_next_frame_is_rendered() {
    let mut farm = farm(SegmentPolicy::Adaptive).await;
    fake_worker::start(farm.address(), Script::Correct).await;
    for bad in [FrameView { width: 0, ..view() }, FrameView { height: u32::MAX, ..view() }] {
        farm.request(bad);
        assert!(matches!(farm.finished().await, Err(FarmError::View(_))));
    }
    render(&mut farm, view()).await;
}

#[tokio::test]
async fn a_taken_port_is_reported_with_a_remedy() {
    let taken = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = taken.local_addr().unwrap();
    let options = FarmOptions { listen: Some(address), ..FarmOptions::default() };
    let refused =
        Farm::start(options, FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() }).await;
    let message = refused.err().unwrap().to_string();
    assert!(message.contains(&address.port().to_string()) && message.contains("--listen"), "{message}");
}

#[tokio::test]
async fn a_free_port_replaces_the_default_port_when_it_is_taken() {
    let scene = || FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() };
    let first = Farm::start(FarmOptions::default(), scene()).await.unwrap();
    let second = Farm::start(FarmOptions::default(), scene()).await.unwrap();
    assert_ne!(first.address(), second.address());
    assert!(second.address().ip().is_loopback());
}

#[tokio::test]
async fn a_dropped_farm_disconnects_its_workers() {
    let farm = farm(SegmentPolicy::Adaptive).await;
    let worker = fake_worker::start(farm.address(), Script::Correct).await;
    until_workers(&farm, 1).await;
    drop(farm);
    in_time(worker).await.unwrap();
}

#[cfg(unix)]
#[tokio::test]
async fn local_workers_that_cannot_start_end_the_wait_for_a_frame() {
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
