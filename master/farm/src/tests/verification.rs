//! Workers that lie, over 127.0.0.1, and a master that finds out.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use rayfarm_protocol::{Hello, handshake};
use rayfarm_tracer::scene::FrameView;
use tokio::net::TcpStream;
use tokio_util::sync::CancellationToken;

use crate::testing::fake_worker::{self, Script, is_picture};
use rayfarm_scheduler::{SegmentPolicy, Verification};
use crate::farm::Farm;
use crate::options::{FarmOptions, FarmScene};
use crate::status::FarmStatus;
use crate::verification::arbiter;
use crate::testing::test_scene::{scene, view};

/// Far beyond what any of these tests takes.
const PATIENCE: Duration = Duration::from_secs(60);

async fn farm(policy: SegmentPolicy, verify_percent: u8) -> Farm {
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let options = FarmOptions { listen, policy, verify_percent, ..FarmOptions::default() };
    let scene = FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() };
    let trace = Arc::new(|view: &FrameView, rows| Ok(fake_worker::pixels(view, rows)));
    Farm::start_with(options, scene, Some(trace), CancellationToken::new()).await.unwrap()
}

async fn patiently<T>(what: impl Future<Output = T>) -> T {
    tokio::time::timeout(PATIENCE, what).await.expect("it never comes to pass")
}

async fn until(farm: &Farm, holds: impl Fn(&FarmStatus) -> bool) {
    patiently(async {
        while !holds(&farm.status()) {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    })
    .await;
}

fn counts(farm: &Farm) -> Verification {
    farm.status().verification.unwrap()
}

/// Renders until a worker has been expelled, and some more: those pictures must be right.
async fn render_past_the_lie(farm: &mut Farm, honest: usize) {
    let mut spin = 0.0;
    let mut after = 0;
    while after < 5 {
        let found = counts(farm).mismatches > 0;
        let asked = FrameView { spin, ..view() };
        farm.request(asked);
        let frame = patiently(farm.finished()).await.unwrap();
        assert!(!found || is_picture(&asked, &frame.pixels), "a wrong picture after the liar was found");
        after += usize::from(found && farm.status().workers.len() == honest);
        spin += 1.0;
    }
}

#[tokio::test]
async fn the_one_who_lies_is_named_sent_away_and_kept_out() {
    for policy in [SegmentPolicy::Adaptive, SegmentPolicy::Static(8)] {
        for honest in [1, 2] {
            let mut farm = farm(policy, 30).await;
            let liar = fake_worker::start_named(farm.address(), "liar", Script::Lie).await;
            for n in 0..honest {
                fake_worker::start_named(farm.address(), &format!("honest-{n}"), Script::Honest).await;
            }
            until(&farm, |status| status.workers.len() == honest + 1).await;
            render_past_the_lie(&mut farm, honest).await;
            let goodbye = patiently(liar).await.unwrap().goodbye.unwrap();
            assert!(goodbye.contains("wrong pixels"), "{goodbye}");
            let kicked = farm.status().kicked;
            assert_eq!(kicked.iter().map(|kicked| kicked.name.as_str()).collect::<Vec<_>>(), ["liar"]);
            let mut again = TcpStream::connect(farm.address()).await.unwrap();
            let hello =
                Hello { name: "liar".into(), threads: 1, simd: String::new(), software: String::new() };
            let refusal = handshake::as_worker(&mut again, &hello).await.unwrap_err().to_string();
            assert!(refusal.contains("kept out"), "{refusal}");
            farm.shut_down().await;
        }
    }
}

#[tokio::test]
async fn honest_workers_are_verified_and_stay() {
    for policy in [SegmentPolicy::Adaptive, SegmentPolicy::Smart(8)] {
        let mut farm = farm(policy, 100).await;
        for _ in 0..2 {
            fake_worker::start(farm.address(), Script::Honest).await;
        }
        until(&farm, |status| status.workers.len() == 2).await;
        for _ in 0..20 {
            farm.request(view());
            assert!(is_picture(&view(), &patiently(farm.finished()).await.unwrap().pixels));
        }
        patiently(farm.verified()).await;
        let Verification { picked, verified, mismatches, open, .. } = counts(&farm);
        assert!(verified > 0 && verified <= picked, "{verified} of {picked}");
        assert_eq!((mismatches, open, farm.status().workers.len()), (0, 0, 2));
        farm.shut_down().await;
    }
}

#[tokio::test]
async fn a_lone_worker_is_verified_by_the_master() {
    let farm = farm(SegmentPolicy::Static(16), 100).await;
    let liar = fake_worker::start(farm.address(), Script::Lie).await;
    until(&farm, |status| status.workers.len() == 1).await;
    farm.request(view());
    let goodbye = patiently(liar).await.unwrap().goodbye.unwrap();
    assert!(goodbye.contains("wrong pixels"), "{goodbye}");
    assert_eq!(counts(&farm).mismatches, 1);
    farm.shut_down().await;
}

#[tokio::test]
async fn complete_pictures_with_rows_of_a_liar_are_named() {
    // One segment a picture: it is complete when its pixels are here, and shown before they are verified.
    let mut farm = farm(SegmentPolicy::Static(64), 100).await;
    let liar = fake_worker::start(farm.address(), Script::Lie).await;
    until(&farm, |status| status.workers.len() == 1).await;
    let wrong = farm.request(view());
    assert!(!is_picture(&view(), &patiently(farm.finished()).await.unwrap().pixels));
    patiently(liar).await.unwrap();
    until(&farm, |status| status.wrong_frames == 1).await;
    fake_worker::start_named(farm.address(), "honest", Script::Honest).await;
    let right = farm.request(view());
    assert!(is_picture(&view(), &patiently(farm.finished()).await.unwrap().pixels));
    patiently(farm.verified()).await;
    let named = farm.wrong_frames();
    assert!(named.contains(wrong) && !named.contains(right) && farm.status().wrong_frames == 1);
    farm.shut_down().await;
}

#[tokio::test]
async fn what_does_not_fit_is_refused_in_a_verification_as_well() {
    let mut farm = farm(SegmentPolicy::Static(64), 100).await;
    fake_worker::start(farm.address(), Script::Honest).await;
    until(&farm, |status| status.workers.len() == 1).await;
    fake_worker::start(farm.address(), Script::Short).await;
    until(&farm, |status| status.workers.len() == 2).await;
    // Whoever gets the picture's only segment, the other one gets the same rows again, or the master does.
    farm.request(view());
    assert!(is_picture(&view(), &patiently(farm.finished()).await.unwrap().pixels));
    until(&farm, |status| status.workers.len() == 1).await;
    patiently(farm.verified()).await;
    assert_eq!(counts(&farm).mismatches, 0);
    farm.shut_down().await;
}

/// The real tracer: what the master traces is what workers would.
#[test]
fn the_master_traces_what_a_worker_would() {
    let drawn = FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() };
    let trace = arbiter::tracer(drawn, CancellationToken::new());
    let whole = trace(&view(), 0..view().height).unwrap();
    let row_bytes = view().width as usize * 3;
    assert_eq!(whole.len(), row_bytes * view().height as usize);
    assert_eq!(trace(&view(), 8..11).unwrap(), whole[8 * row_bytes..11 * row_bytes]);
    let stopped = CancellationToken::new();
    stopped.cancel();
    let drawn = FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() };
    assert!(arbiter::tracer(drawn, stopped)(&view(), 0..8).is_err());
}
