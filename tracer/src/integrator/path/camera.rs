//! First rays: a random place in the pixel and on the lens.

use glam::DVec3;

use crate::frame::{Basis, CameraRays, PreparedFrame};
use crate::rays::{BLOCKS, Ray, RayBatch, SIDE, TileRays, TileSamples, place};
use crate::sampler::{Dimension, pair};
use crate::scene::PathSettings;
use crate::simd::{Indices, LANES, Lanes, Simd, SimdBase, each_bit, u32x16};

/// A thin lens in eye space.
#[derive(Clone, Copy)]
pub(super) struct EyeLens {
    radius: f64,
    /// Depth of the sharp plane.
    focus: f64,
    right: DVec3,
    up: DVec3,
}

impl EyeLens {
    /// The lens of a frame with a pinhole camera, unless it has none.
    pub(super) fn of(frame: &PreparedFrame) -> Option<Self> {
        let view = frame.view();
        let CameraRays::Pinhole(_) = frame.rays else { return None };
        if view.lens.aperture == 0.0 {
            return None;
        }
        let Basis { right, up, .. } = Basis::of(&view.camera);
        let distance = (view.camera.look_at - view.camera.position).length();
        let focus = view.lens.focus_distance.unwrap_or(distance) * frame.per_unit;
        Some(Self { radius: view.lens.aperture * frame.per_unit, focus, right, up })
    }

    /// The ray through a point of the lens that meets the ray of a pinhole in the sharp plane; `direction` has depth 1, `at` are two
    /// random numbers.
    fn ray(&self, direction: DVec3, at: [f32; 2]) -> Ray {
        let [x, y] = on_disk(at.map(f64::from));
        let origin = (self.right * x + self.up * y) * self.radius;
        Ray { origin, direction: (direction * self.focus - origin).normalize() }
    }
}

/// A point of the unit disk by the concentric map (Shirley and Chiu 1997).
fn on_disk([u, v]: [f64; 2]) -> [f64; 2] {
    let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if x == 0.0 && y == 0.0 {
        return [0.0, 0.0];
    }
    let quarter = std::f64::consts::FRAC_PI_4;
    let (radius, angle) =
        if x.abs() > y.abs() { (x, quarter * (y / x)) } else { (y, 2.0 * quarter - quarter * (x / y)) };
    [radius * libm::cos(angle), radius * libm::sin(angle)]
}

/// Places of the samples with one number in the pixels of a tile, relative to its centre.
#[inline(always)]
pub(super) fn places<S: Simd>(
    simd: S,
    settings: &PathSettings,
    seeds: &[Indices; BLOCKS],
    number: u32,
    live: &[u32; BLOCKS],
    rays: &mut TileRays,
) {
    let half = SIDE as f32 / 2.0;
    for block in 0..BLOCKS {
        let numbers = u32x16::splat(simd, number);
        let [across, along] =
            pair(simd, settings.sampler, seeds[block].load(simd), numbers, Dimension::PIXEL);
        let corner = |axis: fn((usize, usize)) -> usize| {
            Lanes(std::array::from_fn(|lane| axis(place(block, lane)) as f32 - half)).load(simd)
        };
        rays.x[block].store(corner(|(column, _)| column) + across);
        rays.y[block].store(corner(|(_, row)| row) + along);
    }
    rays.on_grid = false;
    rays.bound(simd, live);
}

/// Two random numbers of a sample, by its block and lane.
pub(super) type LensNumbers<'a> = &'a dyn Fn(usize, usize) -> [f32; 2];

/// Replaces the rays of a batch by those of the samples. `lens` are two random numbers of each sample where the camera has a lens.
pub(super) fn put_rays(
    frame: &PreparedFrame,
    lens: Option<(&EyeLens, LensNumbers<'_>)>,
    samples: &TileSamples<'_>,
    batch: &mut RayBatch<'_>,
) {
    let camera = match &frame.rays {
        CameraRays::Pinhole(camera) => camera,
        CameraRays::Parallel(camera) => return batch.put_parallel(camera, samples),
        CameraRays::Fisheye(camera) => return batch.put_fisheye(camera, samples),
    };
    batch.clear();
    batch.of_camera = true;
    batch.places.x = samples.rays.x;
    batch.places.y = samples.rays.y;
    for block in 0..BLOCKS {
        for lane in each_bit(samples.live[block]) {
            let [across, along] = samples.place(block, lane);
            let direction = camera.through(across, along);
            let ray = match lens {
                None => Ray { origin: DVec3::ZERO, direction: direction.normalize() },
                Some((lens, numbers)) => lens.ray(direction, numbers(block, lane)),
            };
            batch.set(block * LANES + lane, ray, f64::INFINITY, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_concentric_map_covers_the_disk_evenly() {
        let count = 128;
        let mut inside = [0; 2];
        for i in 0..count * count {
            let at = |k: usize| (k as f64 + 0.5) / count as f64;
            let [x, y] = on_disk([at(i % count), at(i / count)]);
            let radius = x.hypot(y);
            assert!(radius <= 1.0 + 1e-12);
            inside[0] += usize::from(radius < 0.5);
            inside[1] += usize::from(x > 0.0 && y > 0.0);
        }
        let quarter = (count * count / 4) as f64;
        assert!(inside.iter().all(|&found| (found as f64 / quarter - 1.0).abs() < 0.02), "{inside:?}");
        assert_eq!(on_disk([0.5, 0.5]), [0.0, 0.0]);
    }

    #[test]
    fn all_points_of_a_lens_meet_in_the_sharp_plane() {
        let lens = EyeLens { radius: 0.1, focus: 3.0, right: DVec3::X, up: DVec3::Y };
        let direction = DVec3::new(0.2, -0.1, -1.0);
        for at in [[0.1, 0.9], [0.5, 0.5], [0.99, 0.3]] {
            let ray = lens.ray(direction, at);
            let t = -3.0 / ray.direction.z;
            assert!((ray.origin + ray.direction * t - direction * 3.0).length() < 1e-12);
            assert!(ray.origin.length() <= 0.1 + 1e-12 && (ray.direction.length() - 1.0).abs() < 1e-12);
        }
    }
}
