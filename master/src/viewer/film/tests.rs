//! Films of frames that a renderer of this process renders.

use std::sync::Arc;
use std::time::Duration;

use glam::DVec3;
use rayfarm_farm::accounting::FrameAccount;
use rayfarm_farm::testing::test_scene;
use rayfarm_farm::{FrameCounts, FrameId};
use rayfarm_tracer::scene::{
    ColorDepth, Integrator, PathSettings, Quality, Scene, Sphere, ToneCurve, ToneMapping,
};
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};

use super::*;

/// A sphere in a white sky, which bounces light between itself and the sky.
pub(in crate::viewer) fn scene() -> Scene {
    let sphere = Sphere {
        center: DVec3::new(0.1, 0.0, -2.0),
        radius: 0.6,
        material: 0,
        inside_out: false,
        uv_rotate: DVec3::ZERO,
    };
    Scene { spheres: vec![sphere], ..test_scene::scene() }
}

pub(in crate::viewer) fn view(samples: u32) -> FrameView {
    let integrator = Integrator::Path(PathSettings { seed: 3, ..PathSettings::default() });
    FrameView { integrator, samples, ..FrameView::of(&scene()) }
}

/// Pixels of a view of [`scene`], in its format.
pub(in crate::viewer) fn rendered(view: &FrameView) -> Vec<u8> {
    let scene = CompiledScene::new(scene(), Vec::new(), Vec::new()).unwrap();
    let frame = PreparedFrame::new(Arc::new(scene), view).unwrap();
    let mut pixels = vec![0; view.format.bytes_of(view.width, view.height)];
    render_rows(&frame, 0..view.height, &mut pixels, &|| false).unwrap();
    pixels
}

/// The frame of a pass.
pub(super) fn frame(number: u64, view: &FrameView) -> FinishedFrame {
    FinishedFrame {
        frame: FrameId(number),
        request: (*view).into(),
        view: *view,
        pixels: rendered(view).into(),
        counts: FrameCounts::default(),
        elapsed: Duration::ZERO,
        latency: Duration::ZERO,
        workers: 1,
        threads: 1,
        sent_bytes: 0,
        received_bytes: 0,
        scene_bytes: 0,
        account: FrameAccount::default(),
    }
}

/// The film of a view after all of its passes.
fn filmed(view: &FrameView) -> Film {
    let mut film = Film::new(view);
    while let Some(samples) = passes::next(film.samples(), view.samples) {
        film.add(&frame(u64::from(samples.start), &passes::pass(view, samples))).unwrap();
    }
    film
}

#[test]
fn the_picture_of_passes_is_the_picture_of_all_samples_at_once() {
    let tones = [ToneMapping::default(), ToneMapping { exposure: -1.0, curve: ToneCurve::Agx }];
    let dithered = Quality { dither: true, ..Quality::default() };
    let pale = Quality { colors: ColorDepth::Reduced, ..dithered };
    for (samples, tone, quality) in [
        (1, tones[0], Quality::default()),
        (7, tones[1], Quality::default()),
        (16, tones[0], dithered),
        (21, tones[0], pale),
    ] {
        let view = FrameView { tone, quality, ..view(samples) };
        let film = filmed(&view);
        assert_eq!(film.samples(), samples);
        for format in [PixelFormat::Rgb8, PixelFormat::Linear, PixelFormat::Sums] {
            let whole = rendered(&FrameView { format, ..view });
            assert!(whole.iter().any(|byte| *byte != whole[0]), "a picture of something");
            assert!(film.develop(format) == whole, "{samples} samples as {format:?}");
        }
    }
}

#[test]
fn only_the_next_pass_of_the_same_picture_is_added() {
    let view = view(8);
    let mut film = Film::new(&view);
    film.add(&frame(1, &passes::pass(&view, 0..1))).unwrap();
    let before = film.sums().to_vec();
    let moved = FrameView { spin: 1.0, ..view };
    for (other, expected) in [
        (passes::pass(&view, 0..1), PassError::OtherSamples { first: 0, samples: 1 }),
        (passes::pass(&view, 2..4), PassError::OtherSamples { first: 2, samples: 1 }),
        (passes::pass(&moved, 1..2), PassError::OtherView),
        (FrameView { format: PixelFormat::Rgb8, ..passes::pass(&view, 1..2) }, PassError::OtherView),
    ] {
        assert_eq!(film.add(&frame(2, &other)), Err(expected));
    }
    assert!(film.sums() == before && film.samples() == 1);
    film.add(&frame(3, &passes::pass(&view, 1..2))).unwrap();
    assert_eq!((film.samples(), film.frames()), (2, &[FrameId(1), FrameId(3)][..]));
}

#[test]
fn the_error_of_a_film_falls_with_its_samples() {
    let errors = [2, 16, 64].map(|samples| filmed(&view(samples)).error().unwrap());
    assert!(errors[0] > errors[1] && errors[1] > errors[2] && errors[2] > 0.0, "{errors:?}");
    assert_eq!(filmed(&view(1)).error(), None);
}
