//! Adaptive pictures of paths: the same bits however they are rendered, fewer rays, and the same light.

use proptest::prelude::*;

use super::super::tests::{ball, compiled, floor, furnished, path_view};
use super::*;
use crate::frame::PreparedFrame;
use crate::integrator::render_rows;
use crate::rays::RayCounts;
use crate::scene::{Background, Integrator, PixelFormat, Scene};
use crate::simd;

/// A view of linear light whose cells end at an error.
fn limited(scene: &Scene, side: u32, samples: u32, max_noise: f32) -> FrameView {
    let integrator = Integrator::Path(PathSettings { max_noise, ..PathSettings::default() });
    FrameView { integrator, format: PixelFormat::Linear, ..path_view(scene, side, samples, 4) }
}

fn rendered(frame: &PreparedFrame, rows: Range<u32>) -> (Vec<u8>, RayCounts) {
    let mut bytes = vec![0xa5; rows.len() * frame.row_bytes()];
    let counts = render_rows(frame, rows, &mut bytes, &|| false).unwrap();
    (bytes, counts)
}

fn picture(scene: &Scene, view: &FrameView) -> (Vec<u8>, RayCounts) {
    rendered(&PreparedFrame::new(compiled(scene), view).unwrap(), 0..view.height)
}

/// Mean of all channels of linear pixels.
fn mean(bytes: &[u8]) -> f64 {
    let numbers = bytes.as_chunks().0;
    numbers.iter().map(|bytes| f64::from(f32::from_le_bytes(*bytes))).sum::<f64>() / numbers.len() as f64
}

/// The furnished room with an empty background around it.
fn room() -> Scene {
    let mut scene = furnished();
    scene.camera.fov = 80.0;
    scene
}

#[test]
fn a_flat_picture_ends_at_the_first_checkpoint_with_the_same_light() {
    let scene = Scene { background: Background::Color(glam::Vec3::new(0.25, 0.5, 3.0)), ..Scene::default() };
    // Neither side is a multiple of the cells.
    let all = FrameView { width: 19, ..limited(&scene, 21, 256, 0.0) };
    let some = FrameView { integrator: limited(&scene, 21, 256, 0.001).integrator, ..all };
    let (expected, every_ray) = picture(&scene, &all);
    let (found, rays) = picture(&scene, &some);
    assert!(found == expected);
    assert_eq!((every_ray.primary, rays.primary), (19 * 21 * 256, 19 * 21 * 64));
}

#[test]
fn a_noisy_picture_has_all_samples() {
    let mut scene = floor();
    scene.spheres = vec![ball(glam::DVec3::new(2.0, 1.5, 0.0), 0.5, 1)];
    scene.camera.fov = 0.5;
    let all = limited(&scene, 8, 160, 0.0);
    let some = limited(&scene, 8, 160, 1e-7);
    let (expected, every_ray) = picture(&scene, &all);
    let (found, rays) = picture(&scene, &some);
    assert!(found == expected && rays.primary == every_ray.primary);
    assert_eq!(rays.primary, 8 * 8 * 160);
}

#[test]
fn all_levels_and_cuts_have_the_same_pixels() {
    let scene = room();
    let view = FrameView { width: 12, height: 11, ..limited(&scene, 1, 68, 1e-4) };
    let mut frame = PreparedFrame::new(compiled(&scene), &view).unwrap();
    let (expected, rays) = rendered(&frame, 0..11);
    // The background has no noise; the walls have.
    assert!(rays.primary > 12 * 11 * 64 && rays.primary < 12 * 11 * 68, "{rays:?}");
    for level in simd::all() {
        frame.level = level;
        assert!(rendered(&frame, 0..11).0 == expected, "{}", simd::name(level));
    }
    frame.level = simd::best();
    let row = frame.row_bytes();
    for (top, bottom) in [(0, 1), (1, 6), (6, 11)] {
        let bytes = top as usize * row..bottom as usize * row;
        assert!(rendered(&frame, top..bottom).0 == expected[bytes], "rows {top} to {bottom}");
    }
}

#[test]
fn fewer_rays_show_the_same_light() {
    let scene = room();
    let (full, every_ray) = picture(&scene, &limited(&scene, 24, 256, 0.0));
    let (limited, rays) = picture(&scene, &limited(&scene, 24, 256, 0.1));
    assert!(rays.primary < every_ray.primary && rays.primary >= 24 * 24 * 64, "{rays:?}, {every_ray:?}");
    let (found, expected) = (mean(&limited), mean(&full));
    // Pixels end at an error of up to 10 % of their own; their mean over hundreds of pixels is closer.
    assert!((found / expected - 1.0).abs() < 0.05, "{found}, not {expected}");
}

/// Sums of 64 samples, of which those with an even number differ from the others.
fn halves(even: f32, odd: f32) -> PixelSums {
    let mut sums = PixelSums::default();
    (0..64).for_each(|number| {
        let value = if number % 2 == 0 { even } else { odd };
        sums.add_sample(number, PixelSums::steps([value; 3]));
    });
    sums
}

#[test]
fn the_error_is_half_the_difference_of_the_halves_in_parts_of_the_mean() {
    assert_eq!(error(&halves(0.5, 0.5), 64), 0.0);
    assert_eq!(error(&halves(0.75, 0.25), 64), 0.5);
    assert_eq!(error(&halves(0.25, 0.75), 64), 0.5);
    assert_eq!(error(&PixelSums::default(), 64), 0.0);
    // Below 1/64 the error is absolute: half of 1/256 is an eighth of 1/64.
    assert_eq!(error(&halves(1.0 / 256.0, 0.0), 64), 0.125);
}

#[test]
fn one_noisy_pixel_keeps_its_cell() {
    let limit = NoiseLimit { max_noise: 0.1, width: 4, counts: Vec::new() };
    let one = |error| (0..16).map(move |pixel| if pixel == 5 { error } else { 0.0 });
    assert!(limit.is_reached(one(0.19)) && !limit.is_reached(one(0.21)));
    assert!(limit.is_reached((0..16).map(|_| 0.099)) && !limit.is_reached((0..16).map(|_| 0.101)));
}

proptest! {
    #[test]
    fn rows_of_cells_are_whole_cells_in_the_tile(height in 1_u32..100, top in 0_u32..100, rows in 1_u32..17) {
        let top = top % height;
        let bottom = (top + rows).min((top + 1).next_multiple_of(16)).min(height);
        let traced = rows_of_cells(&(top..bottom), height);
        prop_assert!(traced.start <= top && traced.end >= bottom && traced.end <= height);
        prop_assert_eq!(traced.start / 16, top / 16);
        prop_assert!(traced.end <= (top + 1).next_multiple_of(16));
        prop_assert!(traced.start.is_multiple_of(CELL) && (traced.end.is_multiple_of(CELL) || traced.end == height));
    }
}
