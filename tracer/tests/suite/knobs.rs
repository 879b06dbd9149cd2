//! Quality knobs: reduced features match an oracle without them, and approximations are within known bounds.

use std::path::Path;

use crate::common::{analytic, instanced, render, render_textured};
use rayfarm_tracer::image::{RgbImage, compare};
use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{
    Background, Camera, CameraKind, ColorDepth, ExponentPrecision, Filter, FrameView, LoadedScene, Quality,
    Scene, Shading, load,
};

const FULL: fn() -> Quality = Quality::default;

fn at(scene: &Scene, quality: Quality) -> FrameView {
    FrameView { quality, ..FrameView::of(scene) }
}

/// Number of pixels with a channel that differs by more than `steps`.
fn off_by_more(steps: u8, a: &RgbImage, b: &RgbImage) -> usize {
    let pairs = a.pixels.chunks_exact(3).zip(b.pixels.chunks_exact(3));
    pairs.filter(|(a, b)| a.iter().zip(b.iter()).any(|(a, b)| a.abs_diff(*b) > steps)).count()
}

#[test]
fn pictures_without_shadows_and_highlights_match_the_oracle() {
    let (instances, mesh) = instanced(120, 90);
    let mesh = std::slice::from_ref(&mesh);
    for (scene, meshes) in [(analytic(160, 120), &[][..]), (instances, mesh)] {
        let (full, _) = render(&scene, meshes, &at(&scene, FULL()));
        for shadows in [true, false] {
            for shading in [Shading::Full, Shading::Diffuse] {
                let quality = Quality { shadows, shading, ..FULL() };
                let view = at(&scene, quality);
                let (picture, counts) = render(&scene, meshes, &view);
                let oracle = Oracle::new(&scene, meshes, &[], &view).render();
                assert_eq!(off_by_more(1, &picture, &oracle), 0, "{quality:?}");
                assert_eq!(counts.shadow > 0, shadows);
                assert_eq!(picture == full, quality == FULL(), "{quality:?} can be seen");
            }
        }
    }
}

#[test]
fn the_filter_of_all_textures_matches_the_oracle() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/textured.toml");
    let LoadedScene { scene, meshes, textures, .. } = load(&path).unwrap();
    let pictures = [None, Some(Filter::Nearest), Some(Filter::Bilinear)].map(|filter| {
        let small = FrameView { width: 60, height: 45, samples: 1, ..FrameView::of(&scene) };
        let view = FrameView { quality: Quality { filter, ..FULL() }, ..small };
        let (picture, _) = render_textured(&scene, &meshes, &textures, &view);
        let oracle = Oracle::new(&scene, &meshes, &textures, &view).render();
        // As without the knob: texels with an edge next to a ray.
        assert!(off_by_more(1, &picture, &oracle) <= 6, "{filter:?}");
        picture
    });
    let [_, nearest, bilinear] = pictures;
    assert!(nearest != bilinear);
}

/// The same scene with other exponents.
fn polished(exponents: [f32; 3]) -> Scene {
    let mut scene = analytic(160, 120);
    for (material, exponent) in scene.materials.iter_mut().zip(exponents) {
        (material.exponent, material.specular) = (exponent, glam::Vec3::splat(0.4));
    }
    scene
}

#[test]
fn the_fast_exponent_is_near_the_exact_one() {
    for exponents in [[8.5, 12.3, 20.7], [33.3, 99.9, 255.5], [257.0, 1e3, 1999.5], [2e3 + 1.0, 1e4, 1e6]] {
        let scene = polished(exponents);
        let fast = at(&scene, Quality { exponent: ExponentPrecision::Fast, ..FULL() });
        let (exact, _) = render(&scene, &[], &at(&scene, FULL()));
        let (fast, _) = render(&scene, &[], &fast);
        let difference = compare(&exact, &fast).unwrap();
        // 0.0021 of 0.4 times the lights' 4.0: a step or two of the encoding, more in the dark.
        assert!(difference.max <= 3, "{exponents:?}: {difference:?}");
        assert!(difference.rmse < 0.3, "{exponents:?}: {difference:?}");
    }
}

#[test]
fn squared_exponents_are_the_same_when_fast() {
    let scene = polished([1.0, 40.0, 256.0]);
    let fast = at(&scene, Quality { exponent: ExponentPrecision::Fast, ..FULL() });
    assert!(render(&scene, &[], &fast) == render(&scene, &[], &at(&scene, FULL())));
}

#[test]
fn reduced_colors_are_rounded_to_five_six_and_five_bits() {
    let scene = analytic(160, 120);
    for samples in [1, 4] {
        let full = FrameView { samples, ..at(&scene, FULL()) };
        let reduced = FrameView { quality: Quality { colors: ColorDepth::Reduced, ..FULL() }, ..full };
        let ((full, _), (reduced, _)) = (render(&scene, &[], &full), render(&scene, &[], &reduced));
        assert!(off_by_more(4, &full, &reduced) == 0 && off_by_more(3, &full, &reduced) > 0);
        for pixel in reduced.pixels.chunks_exact(3) {
            assert!(pixel[0] >> 5 == pixel[0] & 7 && pixel[1] >> 6 == pixel[1] & 3, "{pixel:?}");
        }
    }
}

/// A slow gradient in the dark, and nothing else.
fn dusk() -> Scene {
    let mut scene = analytic(320, 240);
    (scene.spheres, scene.planes, scene.triangles) = (Vec::new(), Vec::new(), Vec::new());
    let (position, look_at, up) = (glam::DVec3::ZERO, glam::DVec3::NEG_Z, glam::DVec3::Y);
    scene.camera = Camera { position, look_at, up, fov: 10.0, zoom: 1.0, kind: CameraKind::PINHOLE };
    let [bottom, top] = [0.0, DUSK].map(glam::Vec3::splat);
    scene.background = Background::Gradient { bottom, top };
    scene
}

/// Radiance of a ray straight up in that scene.
const DUSK: f32 = 0.03;

/// Encoded value of a row of it without rounding: the mean of its pixels.
fn dusk_row(y: u32) -> f64 {
    let half = 5.0_f64.to_radians().tan();
    let pixel = |x: u32| {
        let along = |index: u32, count: f64| (f64::from(index) + 0.5) / count * 2.0 - 1.0;
        let (u, v) = (along(x, 320.0) * half * 320.0 / 240.0, -along(y, 240.0) * half);
        let rise = v / (u * u + v * v + 1.0).sqrt();
        let light = f64::from(DUSK) * (rise + 1.0) / 2.0;
        (1.055 * light.powf(1.0 / 2.4) - 0.055) * 255.0
    };
    (0..320).map(pixel).sum::<f64>() / 320.0
}

/// Means of the bytes of each row of 8 x 8 pixels.
fn means(picture: &RgbImage) -> Vec<f64> {
    let rows = picture.pixels.chunks_exact(8 * 3 * picture.width as usize);
    rows.map(|row| row.iter().map(|&byte| f64::from(byte)).sum::<f64>() / row.len() as f64).collect()
}

#[test]
fn dithering_removes_the_bands_of_a_dark_gradient() {
    let scene = dusk();
    for (samples, adaptive) in [(1, false), (4, false), (4, true), (16, true)] {
        let picture = |dither| {
            let quality = Quality { dither, adaptive, ..FULL() };
            render(&scene, &[], &FrameView { samples, ..at(&scene, quality) }).0
        };
        let (plain, dithered) = (picture(false), picture(true));
        assert_eq!(off_by_more(1, &plain, &dithered), 0, "no pixel is off by more than a step");
        let even = |means: &[f64]| means.windows(2).filter(|pair| pair[0] == pair[1]).count();
        assert!(even(&means(&plain)) > 8, "bands many pixels high: {:?}", means(&plain));
        let smooth = means(&dithered);
        assert_eq!(even(&smooth), 0, "{smooth:?}");
        // The perceived value is the light itself.
        for (row, mean) in smooth.iter().enumerate() {
            let exact = (0..8).map(|y| dusk_row(row as u32 * 8 + y)).sum::<f64>() / 8.0;
            assert!((mean - exact).abs() < 0.1, "row {row}: {mean}, and the light {exact}");
        }
        let grey = dithered.pixels.chunks_exact(3).all(|pixel| pixel[0] == pixel[1] && pixel[1] == pixel[2]);
        assert!(grey, "grey stays grey");
    }
}

#[test]
fn dithering_keeps_colours_that_are_bytes() {
    let mut scene = dusk();
    let color = [3_u8, 130, 251];
    let linear = color.map(|code| rayfarm_tracer::srgb::decode(code) as f32);
    scene.background = Background::Color(linear.into());
    let (picture, _) = render(&scene, &[], &at(&scene, Quality { dither: true, ..FULL() }));
    assert!(picture.pixels.chunks_exact(3).all(|pixel| *pixel == color));
}

#[test]
fn reduced_colours_are_dithered_too() {
    let scene = dusk();
    let quality = Quality { dither: true, colors: ColorDepth::Reduced, ..FULL() };
    let (picture, _) = render(&scene, &[], &at(&scene, quality));
    for pixel in picture.pixels.chunks_exact(3) {
        assert!(pixel[0] >> 5 == pixel[0] & 7 && pixel[1] >> 6 == pixel[1] & 3, "{pixel:?}");
    }
    let (full, _) = render(&scene, &[], &at(&scene, Quality { dither: true, ..FULL() }));
    for (fewer, all) in means(&picture).into_iter().zip(means(&full)) {
        assert!((fewer - all).abs() < 0.8, "{fewer} for {all}");
    }
}
