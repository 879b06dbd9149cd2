//! Adaptive anti-aliasing through the public API: savings and errors.

use crate::common::{analytic, empty, instanced, render};
use rayfarm_tracer::RayCounts;
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::mesh::CompiledMesh;
use rayfarm_tracer::scene::{FrameView, Quality, Scene};
use std::sync::Arc;

fn shot(scene: &Scene, meshes: &[Arc<CompiledMesh>], samples: u32, adaptive: bool) -> (RgbImage, RayCounts) {
    let quality = Quality { adaptive, ..Quality::default() };
    render(scene, meshes, &FrameView { samples, quality, ..FrameView::of(scene) })
}

/// Root mean square of the differences, in steps.
fn rmse(a: &RgbImage, b: &RgbImage) -> f64 {
    let squares = a.pixels.iter().zip(&b.pixels).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
    (squares.sum::<f64>() / a.pixels.len() as f64).sqrt()
}

#[test]
fn a_part_of_the_rays_removes_most_of_the_error() {
    let (toruses, mesh) = instanced(200, 150);
    for (scene, meshes) in [(analytic(200, 150), vec![]), (toruses, vec![mesh])] {
        let (reference, _) = shot(&scene, &meshes, 64, false);
        let error_and_rays = |samples, adaptive| {
            let (image, counts) = shot(&scene, &meshes, samples, adaptive);
            (rmse(&image, &reference), counts.primary + counts.shadow)
        };
        let (one, _) = error_and_rays(1, false);
        let (regular, all_rays) = error_and_rays(16, false);
        let (adaptive, rays) = error_and_rays(16, true);
        let share = (one - adaptive) / (one - regular);
        assert!(share > 0.9, "{share} of the error is gone: {one} {adaptive} {regular}");
        assert!(rays * 3 < all_rays, "{rays} of {all_rays} rays");
    }
}

#[test]
fn a_picture_without_edges_takes_one_ray_per_corner() {
    let scene = empty(70, 48);
    let (regular, _) = shot(&scene, &[], 16, false);
    let (adaptive, counts) = shot(&scene, &[], 16, true);
    // Each band of 16 rows traces the corners below its last row itself.
    assert_eq!(counts, RayCounts { primary: 71 * 17 * 3, ..RayCounts::default() });
    let worst = regular.pixels.iter().zip(&adaptive.pixels).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(worst <= Some(1), "{worst:?}");
}

#[test]
fn one_sample_per_pixel_leaves_nothing_to_adapt() {
    let scene = analytic(60, 40);
    assert_eq!(shot(&scene, &[], 1, true), shot(&scene, &[], 1, false));
}
