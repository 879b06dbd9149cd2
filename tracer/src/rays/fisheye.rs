//! Batches of a fisheye camera: rays from the origin of eye space, whose picture is not a projection.

use glam::DVec3;

use super::{BLOCKS, Ray, RayBatch, TileSamples};
use crate::frame::{FisheyeRay, FisheyeRays};
use crate::simd::{LANES, each_bit};

/// Upper end of the rays outside of the circle: they hit nothing.
const NOTHING: f64 = -1.0;

impl RayBatch<'_> {
    /// Replaces the rays by those of some samples of a fisheye camera. A ray is a function of its place in the picture alone.
    pub(crate) fn put_fisheye(&mut self, camera: &FisheyeRays, samples: &TileSamples<'_>) {
        self.clear();
        self.of_camera = true;
        self.places.x = samples.rays.x;
        self.places.y = samples.rays.y;
        for block in 0..BLOCKS {
            for lane in each_bit(samples.live[block]) {
                let [across, along] = samples.place(block, lane);
                let FisheyeRay { direction, in_circle } = camera.through(across, along);
                let t_max = if in_circle { f64::INFINITY } else { NOTHING };
                self.set(block * LANES + lane, Ray { origin: DVec3::ZERO, direction }, t_max, None);
            }
        }
    }
}
