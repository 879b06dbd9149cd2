//! Selected lights of sixteen points, and their light.

use crate::simd::{LANES, Lanes};

/// The sources that some points select.
pub(super) struct Selected {
    /// Bits of the points that select one.
    pub lanes: u32,
    pub sources: [u32; LANES],
    pub probability: Lanes,
}

impl Selected {
    pub(super) fn none() -> Self {
        Self { lanes: 0, sources: [0; LANES], probability: Lanes::ZERO }
    }

    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, source: u32, probability: f32) {
        self.lanes |= 1 << lane;
        self.sources[lane] = source;
        self.probability.0[lane] = probability;
    }
}

/// Light that one selected light sends to each of sixteen points.
pub(crate) struct LightSamples {
    /// Bits of the points that it may reach.
    pub live: u32,
    /// Bits of the points whose light no path hits: it has no extent, or is a light with a radius.
    pub alone: u32,
    /// Bits of the points whose light casts shadows.
    pub shadows: u32,
    /// Bits of the points whose light is the sky: its radiance is left to the caller.
    pub sky: u32,
    /// Unit vectors to the light.
    pub direction: [Lanes; 3],
    /// Distance of the light, in eye units; infinite for the sky and directional lights.
    pub distance: [f64; LANES],
    /// Radiance, linear RGB; of lights without extent pi times I_j A_j B_j.
    pub radiance: [Lanes; 3],
    /// Density of the direction over solid angle, times the probability of the light; of lights without extent that probability.
    pub density: Lanes,
}

impl LightSamples {
    pub(super) fn none() -> Self {
        Self {
            live: 0,
            alone: 0,
            shadows: 0,
            sky: 0,
            direction: [Lanes::ZERO; 3],
            distance: [0.0; LANES],
            radiance: [Lanes::ZERO; 3],
            density: Lanes::ZERO,
        }
    }
}
