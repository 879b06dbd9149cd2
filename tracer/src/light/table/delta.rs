//! The light of one light of the scene at one point.

use std::f32::consts::PI;

use super::{LightSamples, LightTable};
use crate::light::{Emitter, EyeLight};
use crate::simd::vector::Vec3x16;
use crate::simd::{Simd, three};

impl LightTable {
    /// Sets the radiance of a lane to pi times I_j A_j B_j of a light at its point, and clears the lane where that does not reach. Returns
    /// the direction and distance of the light's centre.
    #[inline(always)]
    pub(super) fn add_light<S: Simd>(
        &self,
        simd: S,
        light: &EyeLight,
        (points, lane): (Vec3x16<S>, usize),
        samples: &mut LightSamples,
    ) -> ([f32; 3], f64) {
        let incidence = light.incidence(simd, points);
        if incidence.reached >> lane & 1 == 0 {
            samples.live &= !(1 << lane);
        }
        if light.shadows {
            samples.shadows |= 1 << lane;
        }
        for channel in 0..3 {
            samples.radiance[channel].0[lane] = PI * incidence.radiance.0[channel][lane];
        }
        let distance = match light.emitter {
            Emitter::Directional { .. } => f64::INFINITY,
            Emitter::Point { position } | Emitter::Spot { position, .. } => {
                let point = three!(axis => f64::from(points.0[axis][lane]));
                (position - glam::DVec3::from_array(point)).length()
            }
        };
        (three!(axis => incidence.direction.0[axis][lane]), distance)
    }
}
