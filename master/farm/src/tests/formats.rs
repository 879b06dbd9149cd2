//! Pixels of every format through a farm of real workers.

use std::sync::Arc;

use glam::Vec3;
use rayfarm_protocol::limits::MAX_PIXELS_BYTES;
use rayfarm_tracer::scene::{Background, Integrator, PathSettings, ToneCurve, ToneMapping};
use rayfarm_tracer::{CompiledScene, PixelFormat, PixelSums, PreparedFrame, develop, render_rows};
use rayfarm_worker::{Share, ShutdownHandle, WorkerOptions};

use super::*;

/// A sky whose colour changes with the direction: with paths, each sample of a pixel differs.
fn colorful() -> Scene {
    Scene {
        background: Background::Gradient { bottom: Vec3::new(0.0, 0.5, 2.5), top: Vec3::new(1.5, 0.1, 0.0) },
        ..scene()
    }
}

/// A farm with two workers of one and two threads.
async fn farm_of_workers(policy: SegmentPolicy, compress: bool, verify_percent: u8) -> Farm {
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let options = FarmOptions { listen, policy, verify_percent, ..FarmOptions::default() };
    let scene = FarmScene { scene: colorful(), meshes: Vec::new(), textures: Vec::new() };
    let farm = Farm::start(options, scene).await.unwrap();
    for threads in [1, 2] {
        let worker = WorkerOptions {
            master: farm.address().to_string(),
            threads: Some(threads),
            name: format!("worker-{threads}"),
            tags: Vec::new(),
            max_segment_bytes: None,
            reconnect: false,
            once: true,
            asset_cache_bytes: 1 << 20,
            disk_cache: None,
            compress: Some(compress),
            share: Share::Off,
            security: Default::default(),
        };
        tokio::spawn(rayfarm_worker::run(worker, ShutdownHandle::new()));
    }
    until_workers(&farm, 2).await;
    farm
}

/// The view of paths.
fn paths() -> FrameView {
    FrameView { integrator: Integrator::Path(PathSettings::default()), ..FrameView::of(&colorful()) }
}

/// The bytes that this process renders.
fn rendered(view: &FrameView) -> Vec<u8> {
    let compiled = Arc::new(CompiledScene::new(colorful(), [], []).unwrap());
    let frame = PreparedFrame::new(compiled, view).unwrap();
    let mut bytes = vec![0; view.format.bytes_of(view.width, view.height)];
    render_rows(&frame, 0..view.height, &mut bytes, &|| false).unwrap();
    bytes
}

#[tokio::test(flavor = "multi_thread")]
async fn every_format_arrives_as_it_is_rendered() {
    for (compress, policy) in [(false, SegmentPolicy::Adaptive), (true, SegmentPolicy::Static(5))] {
        let mut farm = farm_of_workers(policy, compress, 100).await;
        for format in [PixelFormat::Rgb8, PixelFormat::Linear, PixelFormat::Sums] {
            let tone = ToneMapping { exposure: 0.5, curve: ToneCurve::Agx };
            let view = FrameView { format, samples: 4, tone, ..paths() };
            farm.request(view);
            let frame = finished(&mut farm).await;
            assert_eq!(
                (frame.format(), frame.pixels.len()),
                (format, format.bytes_of(view.width, view.height))
            );
            assert!(*frame.pixels == *rendered(&view), "{format:?}");
            assert_eq!(frame.sums().is_some(), format == PixelFormat::Sums);
            assert_eq!(frame.linear().is_some(), format == PixelFormat::Linear);
        }
        in_time(farm.verified()).await;
        assert_eq!(farm.wrong_frames().count(), 0);
        farm.shut_down().await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn passes_add_up_to_the_picture_of_all_samples() {
    let mut farm = farm_of_workers(SegmentPolicy::Adaptive, true, 0).await;
    let whole = FrameView { samples: 16, ..paths() };
    let mut film = vec![PixelSums::default(); (whole.width * whole.height) as usize];
    for first_sample in [8, 0, 12, 4] {
        farm.request(FrameView { first_sample, samples: 4, format: PixelFormat::Sums, ..whole });
        let frame = finished(&mut farm).await;
        assert!(frame.add_sums_to(&mut film));
        assert!(!frame.add_sums_to(&mut film[1..]), "the film has another size");
    }
    for format in [PixelFormat::Rgb8, PixelFormat::Linear] {
        let view = FrameView { format, ..whole };
        farm.request(view);
        let frame = finished(&mut farm).await;
        assert!(!frame.add_sums_to(&mut film), "{format:?} has no sums");
        let mut developed = vec![0; frame.pixels.len()];
        develop(&view, 0, 16, &film, &mut developed);
        assert!(*frame.pixels == *developed, "{format:?}");
    }
    farm.shut_down().await;
}

/// A frame whose sums take more bytes than a message may have.
#[tokio::test]
async fn sums_beyond_a_message_are_leased_in_parts() {
    let mut farm = farm(SegmentPolicy::Static(1024)).await;
    let worker = fake_worker::start(farm.address(), Script::Correct).await;
    until_workers(&farm, 1).await;
    let view = FrameView { width: 2048, height: 700, format: PixelFormat::Sums, ..paths() };
    assert!(view.format.bytes_of(view.width, view.height) > MAX_PIXELS_BYTES);
    farm.request(view);
    assert!(is_picture(&view, &finished(&mut farm).await.pixels));
    farm.shut_down().await;
    assert_eq!(in_time(worker).await.unwrap().leases, 2);
}
