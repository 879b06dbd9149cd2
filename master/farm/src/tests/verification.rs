//! Verification over 127.0.0.1, with workers that send wrong pixels.

use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use glam::Vec3;
use rayfarm_protocol::{AssetId, Hello, handshake};
use rayfarm_tracer::scene::{Background, FrameView, Scene};
use tokio::net::TcpStream;
use tokio_util::sync::CancellationToken;

use crate::assets::Assets;
use crate::assets::scene_table::SceneTable;
use crate::farm::Farm;
use crate::farm_scene::FarmScene;
use crate::options::FarmOptions;
use crate::status::FarmStatus;
use crate::testing::fake_worker::{self, Script, is_picture};
use crate::testing::test_scene::{scene, view};
use crate::verification::arbiter;
use rayfarm_scheduler::{SegmentPolicy, Verification};

/// Time limit of a wait, so that a farm that hangs fails its test.
const TIMEOUT: Duration = Duration::from_secs(60);

async fn farm(policy: SegmentPolicy, verify_percent: u8) -> Farm {
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let options = FarmOptions { listen, policy, verify_percent, ..FarmOptions::default() };
    let scene = FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() };
    let scenes = Arc::new(SceneTable::new(Arc::new(Assets::new(scene).unwrap())));
    let renderer = Arc::new(|_, view: &FrameView, rows| Ok(fake_worker::pixels(view, rows)));
    Farm::start_with(options, scenes, Some(renderer), CancellationToken::new()).await.unwrap()
}

async fn in_time<T>(what: impl Future<Output = T>) -> T {
    tokio::time::timeout(TIMEOUT, what).await.expect("no result within the time limit")
}

async fn until(farm: &Farm, holds: impl Fn(&FarmStatus) -> bool) {
    in_time(async {
        while !holds(&farm.status()) {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    })
    .await;
}

fn counts(farm: &Farm) -> Verification {
    farm.status().verification.unwrap()
}

/// Renders until a worker is banned, and five frames more, whose pictures must be right.
async fn render_past_the_ban(farm: &mut Farm, correct: usize) {
    let mut spin = 0.0;
    let mut after = 0;
    while after < 5 {
        let found = counts(farm).mismatches > 0;
        let requested = FrameView { spin, ..view() };
        farm.request(requested);
        let frame = in_time(farm.finished()).await.unwrap();
        assert!(!found || is_picture(&requested, &frame.pixels), "a wrong picture after the mismatch");
        after += usize::from(found && farm.status().workers.len() == correct);
        spin += 1.0;
    }
}

#[tokio::test]
async fn a_worker_that_sends_wrong_pixels_is_banned() {
    for policy in [SegmentPolicy::Adaptive, SegmentPolicy::Static(8)] {
        for correct in [1, 2] {
            let mut farm = farm(policy, 30).await;
            let wrong_worker = fake_worker::start_named(farm.address(), "wrong", Script::WrongPixels).await;
            for n in 0..correct {
                fake_worker::start_named(farm.address(), &format!("correct-{n}"), Script::Correct).await;
            }
            until(&farm, |status| status.workers.len() == correct + 1).await;
            render_past_the_ban(&mut farm, correct).await;
            let reason = in_time(wrong_worker).await.unwrap().disconnect_reason.unwrap();
            assert!(reason.contains("wrong pixels"), "{reason}");
            let banned = farm.status().banned;
            assert_eq!(banned.iter().map(|banned| banned.name.as_str()).collect::<Vec<_>>(), ["wrong"]);
            let mut again = TcpStream::connect(farm.address()).await.unwrap();
            let hello = Hello {
                name: "wrong".into(),
                threads: 1,
                simd: String::new(),
                software: String::new(),
                tags: Vec::new(),
            };
            let refusal =
                handshake::as_worker(&mut again, &rayfarm_protocol::transport::WorkerSecurity::Plain, &hello)
                    .await
                    .unwrap_err()
                    .to_string();
            assert!(refusal.contains("is banned"), "{refusal}");
            farm.shut_down().await;
        }
    }
}

#[tokio::test]
async fn correct_workers_pass_the_verification() {
    for policy in [SegmentPolicy::Adaptive, SegmentPolicy::Smart(8)] {
        let mut farm = farm(policy, 100).await;
        for _ in 0..2 {
            fake_worker::start(farm.address(), Script::Correct).await;
        }
        until(&farm, |status| status.workers.len() == 2).await;
        for _ in 0..20 {
            farm.request(view());
            assert!(is_picture(&view(), &in_time(farm.finished()).await.unwrap().pixels));
        }
        in_time(farm.verified()).await;
        let Verification { picked, verified, mismatches, open, .. } = counts(&farm);
        assert!(verified > 0 && verified <= picked, "{verified} of {picked}");
        assert_eq!((mismatches, open, farm.status().workers.len()), (0, 0, 2));
        farm.shut_down().await;
    }
}

#[tokio::test]
async fn a_lone_worker_is_verified_by_the_master() {
    let farm = farm(SegmentPolicy::Static(16), 100).await;
    let wrong_worker = fake_worker::start(farm.address(), Script::WrongPixels).await;
    until(&farm, |status| status.workers.len() == 1).await;
    farm.request(view());
    let reason = in_time(wrong_worker).await.unwrap().disconnect_reason.unwrap();
    assert!(reason.contains("wrong pixels"), "{reason}");
    assert_eq!(counts(&farm).mismatches, 1);
    farm.shut_down().await;
}

#[tokio::test]
async fn finished_frames_with_rows_of_a_banned_worker_are_listed() {
    // One segment a picture: the frame is finished before its segment is verified.
    let mut farm = farm(SegmentPolicy::Static(64), 100).await;
    let wrong_worker = fake_worker::start(farm.address(), Script::WrongPixels).await;
    until(&farm, |status| status.workers.len() == 1).await;
    let wrong = farm.request(view());
    assert!(!is_picture(&view(), &in_time(farm.finished()).await.unwrap().pixels));
    in_time(wrong_worker).await.unwrap();
    until(&farm, |status| status.wrong_frames == 1).await;
    fake_worker::start_named(farm.address(), "correct", Script::Correct).await;
    let right = farm.request(view());
    assert!(is_picture(&view(), &in_time(farm.finished()).await.unwrap().pixels));
    in_time(farm.verified()).await;
    let named = farm.wrong_frames();
    assert!(named.contains(wrong) && !named.contains(right) && farm.status().wrong_frames == 1);
    farm.shut_down().await;
}

#[tokio::test]
async fn a_second_rendering_that_does_not_fit_is_refused() {
    let mut farm = farm(SegmentPolicy::Static(64), 100).await;
    fake_worker::start(farm.address(), Script::Correct).await;
    until(&farm, |status| status.workers.len() == 1).await;
    fake_worker::start(farm.address(), Script::Short).await;
    until(&farm, |status| status.workers.len() == 2).await;
    // One worker gets the picture's only segment; the other one, or the master, renders it a second time.
    farm.request(view());
    assert!(is_picture(&view(), &in_time(farm.finished()).await.unwrap().pixels));
    until(&farm, |status| status.workers.len() == 1).await;
    in_time(farm.verified()).await;
    assert_eq!(counts(&farm).mismatches, 0);
    farm.shut_down().await;
}

/// The assets of the scene with another background.
fn gray(background: f32) -> Arc<Assets> {
    let scene = Scene { background: Background::Color(Vec3::splat(background)), ..scene() };
    Arc::new(Assets::new(FarmScene { scene, meshes: Vec::new(), textures: Vec::new() }).unwrap())
}

#[test]
fn the_renderer_of_the_master_uses_the_real_tracer() {
    let scenes = Arc::new(SceneTable::new(gray(1.0)));
    let white = scenes.current();
    let render = arbiter::row_renderer(scenes.clone(), CancellationToken::new());
    let whole = render(white, &view(), 0..view().height).unwrap();
    let row_bytes = view().width as usize * 3;
    assert_eq!(whole.len(), row_bytes * view().height as usize);
    assert_eq!(render(white, &view(), 8..11).unwrap(), whole[8 * row_bytes..11 * row_bytes]);
    scenes.replace(gray(0.0), &BTreeSet::new());
    let black = scenes.current();
    assert_eq!(render(black, &view(), 0..1).unwrap(), vec![0; row_bytes]);
    assert_eq!(render(white, &view(), 0..1).unwrap(), whole[..row_bytes], "each frame in its own scene");
    assert!(render(AssetId([7; 32]), &view(), 0..1).is_err(), "a scene that the table does not have");
    let stopped = CancellationToken::new();
    stopped.cancel();
    assert!(arbiter::row_renderer(scenes, stopped)(white, &view(), 0..8).is_err());
}
