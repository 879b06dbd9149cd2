//! A scene that is replaced between frames, with real workers in this process.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::scene::{Background, Filter, Sphere, TextureMap};
use rayfarm_tracer::texture::Texture;
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};
use rayfarm_worker::{Share, ShutdownHandle, WorkerOptions};

use super::*;
use crate::assets::Assets;

/// Most bytes that a change of the scene may send to three workers, frame announcements included.
const MAX_CHANGE_BYTES: u64 = 10_000;

/// A texture of several chunks that does not compress.
fn texture() -> Arc<Texture> {
    let (width, height) = (700, 500);
    let noise = (0..width * height * 3).map(|n: u32| (n.wrapping_mul(2_654_435_761) >> 13) as u8);
    Arc::new(Texture::new(&RgbImage { width, height, pixels: noise.collect() }).unwrap())
}

/// A ball in front of a sky, `steps` to the right, and a texture that takes far more bytes than the rest.
fn ball(steps: u32) -> FarmScene {
    let texture = texture();
    let sphere = Sphere {
        center: DVec3::X * 0.01 * f64::from(steps),
        radius: 0.1,
        material: 0,
        inside_out: false,
        uv_rotate: DVec3::ZERO,
    };
    let scene = Scene {
        ambient: Vec3::splat(0.5),
        background: Background::Gradient { bottom: Vec3::ZERO, top: Vec3::new(0.1, 0.5, 0.9) },
        textures: vec![TextureMap::new(texture.id(), Filter::Nearest)],
        spheres: vec![sphere],
        ..scene()
    };
    FarmScene { scene, meshes: Vec::new(), textures: vec![texture] }
}

fn assets(steps: u32) -> Arc<Assets> {
    Arc::new(Assets::new(ball(steps)).unwrap())
}

/// The bytes that this process renders.
fn rendered(steps: u32) -> Vec<u8> {
    let FarmScene { scene, meshes, textures } = ball(steps);
    let compiled = Arc::new(CompiledScene::new(scene, meshes, textures).unwrap());
    let frame = PreparedFrame::new(compiled, &view()).unwrap();
    let mut bytes = vec![0; view().format.bytes_of(view().width, view().height)];
    render_rows(&frame, 0..view().height, &mut bytes, &|| false).unwrap();
    bytes
}

async fn farm_of_ball(verify_percent: u8) -> Farm {
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let options = FarmOptions { listen, verify_percent, ..FarmOptions::default() };
    Farm::start(options, ball(0)).await.unwrap()
}

fn add_worker(farm: &Farm, name: &str) {
    let worker = WorkerOptions {
        master: farm.address().to_string(),
        threads: Some(1),
        name: name.to_owned(),
        tags: Vec::new(),
        max_segment_bytes: None,
        reconnect: false,
        once: true,
        asset_cache_bytes: 1 << 24,
        disk_cache: None,
        compress: None,
        share: Share::Off,
        security: Default::default(),
    };
    tokio::spawn(rayfarm_worker::run(worker, ShutdownHandle::new()));
}

/// Renders until each worker has finished a segment, so that all of them have the scene.
async fn until_all_have_rendered(farm: &mut Farm, steps: u32) {
    let expected = rendered(steps);
    while farm.status().workers.iter().any(|worker| worker.segments_done == 0) {
        farm.request(view());
        assert!(finished(farm).await.pixels[..] == expected);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_moved_object_is_in_the_next_frame_and_only_the_scene_body_is_sent() {
    let mut farm = farm_of_ball(0).await;
    ["a", "b", "c"].iter().for_each(|name| add_worker(&farm, name));
    until_workers(&farm, 3).await;
    until_all_have_rendered(&mut farm, 0).await;
    assert_ne!(rendered(0), rendered(1), "the ball is seen to move");
    for steps in 1..=20 {
        let before = farm.status().totals.scene_bytes;
        farm.replace_scene(assets(steps));
        let requested = farm.request(view());
        let frame = finished(&mut farm).await;
        assert_eq!(frame.frame, requested, "the first frame after the change");
        assert!(frame.pixels[..] == rendered(steps), "step {steps}: not the pixels of a fresh render");
        let sent = farm.status().totals.scene_bytes - before;
        assert!(sent > 0 && sent < MAX_CHANGE_BYTES, "step {steps}: {sent} bytes");
    }
    // Back at the first scene, which workers still have: its picture is the first one.
    farm.replace_scene(assets(0));
    farm.request(view());
    assert!(finished(&mut farm).await.pixels[..] == rendered(0));
    assert_eq!(farm.status().workers.len(), 3, "no session has ended");
    farm.shut_down().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_that_joins_later_renders_the_new_scene() {
    let mut farm = farm_of_ball(0).await;
    farm.replace_scene(assets(7));
    farm.request(view());
    add_worker(&farm, "first");
    assert!(finished(&mut farm).await.pixels[..] == rendered(7));
    farm.replace_scene(assets(9));
    add_worker(&farm, "later");
    until_workers(&farm, 2).await;
    until_all_have_rendered(&mut farm, 9).await;
    farm.shut_down().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_show_the_scene_of_their_request_and_the_oldest_one_is_finished() {
    for verify_percent in [0, 100] {
        let mut farm = farm_of_ball(verify_percent).await;
        ["a", "b", "c"].iter().for_each(|name| add_worker(&farm, name));
        until_workers(&farm, 3).await;
        // As a drag does it: changes come faster than frames, and each requests one.
        let mut requested = std::collections::BTreeMap::new();
        let mut shown = Vec::new();
        for steps in 0..60 {
            farm.replace_scene(assets(steps));
            requested.insert(farm.request(view()), steps);
            if steps % 3 == 2 {
                shown.push(finished(&mut farm).await);
            }
        }
        let last = *requested.last_key_value().unwrap().0;
        while shown.last().is_none_or(|frame| frame.frame != last) {
            shown.push(finished(&mut farm).await);
        }
        for frame in &shown {
            let steps = requested[&frame.frame];
            assert!(frame.pixels[..] == rendered(steps), "step {steps}, {verify_percent} %");
        }
        assert!(shown.is_sorted_by_key(|frame| frame.frame));
        in_time(farm.verified()).await;
        if let Some(verification) = farm.status().verification {
            assert!(verification.verified > 0 && verification.mismatches == 0, "{verification:?}");
        }
        assert_eq!(farm.status().workers.len(), 3, "no session has ended");
        farm.shut_down().await;
    }
}
