//! The knobs of a frame's quality: what is left out is what the oracle leaves out, and what is rougher is so within known bounds.

use std::path::Path;

use crate::common::{analytic, instanced, render, render_textured};
use rayfarm_tracer::image::{RgbImage, compare};
use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{
    ColorDepth, ExponentPrecision, Filter, FrameView, LoadedScene, Quality, Scene, Shading, load,
};

const FULL: fn() -> Quality = Quality::default;

fn at(scene: &Scene, quality: Quality) -> FrameView {
    FrameView { quality, ..FrameView::of(scene) }
}

/// Pixels with a channel that is off by more than so many steps.
fn off_by_more(steps: u8, a: &RgbImage, b: &RgbImage) -> usize {
    let pairs = a.pixels.chunks_exact(3).zip(b.pixels.chunks_exact(3));
    pairs.filter(|(a, b)| a.iter().zip(b.iter()).any(|(a, b)| a.abs_diff(*b) > steps)).count()
}

#[test]
fn shadows_and_highlights_are_left_out_as_the_oracle_leaves_them_out() {
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
fn the_filter_of_all_textures_is_the_oracles() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/textured.toml");
    let LoadedScene { scene, meshes, textures, .. } = load(&path).unwrap();
    let pictures = [None, Some(Filter::Nearest), Some(Filter::Bilinear)].map(|filter| {
        let small = FrameView { width: 60, height: 45, samples: 1, ..FrameView::of(&scene) };
        let view = FrameView { quality: Quality { filter, ..FULL() }, ..small };
        let (picture, _) = render_textured(&scene, &meshes, &textures, &view);
        let oracle = Oracle::new(&scene, &meshes, &textures, &view).render();
        // As without the knob: texels whose edge lies next to a ray.
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
        // 0.0021 of 0.4 times the lights' 4.0: a step or two of the encoding, more where it is darkest.
        assert!(difference.max <= 3, "{exponents:?}: {difference:?}");
        assert!(difference.rmse < 0.3, "{exponents:?}: {difference:?}");
    }
}

#[test]
fn exponents_that_are_powers_by_squaring_are_the_same_when_fast() {
    let scene = polished([1.0, 40.0, 256.0]);
    let fast = at(&scene, Quality { exponent: ExponentPrecision::Fast, ..FULL() });
    assert!(render(&scene, &[], &fast) == render(&scene, &[], &at(&scene, FULL())));
}

#[test]
fn reduced_colors_are_the_nearest_of_five_six_and_five_bits() {
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
