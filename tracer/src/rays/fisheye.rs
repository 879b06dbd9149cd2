//! Batches of a fisheye camera: rays from the origin of eye space, whose picture is not a projection.

use glam::DVec3;

use super::{Ray, RayBatch, TileSamples};
use crate::frame::{FisheyeRay, FisheyeRays};

/// Upper end of the rays outside of the circle: they hit nothing.
const NOTHING: f64 = -1.0;

impl RayBatch<'_> {
    /// Replaces the rays by those of some samples of a fisheye camera. A ray is a function of its place in the picture alone.
    pub(crate) fn put_fisheye(&mut self, camera: &FisheyeRays, samples: &TileSamples<'_>) {
        self.put_samples(samples, |across, along| {
            let FisheyeRay { direction, in_circle } = camera.through(across, along);
            let t_max = if in_circle { f64::INFINITY } else { NOTHING };
            (Ray { origin: DVec3::ZERO, direction }, t_max)
        });
    }
}
