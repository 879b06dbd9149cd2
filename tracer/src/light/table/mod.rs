//! Lights of paths: random points on the lights that have an extent, and one of all lights at random.
//!
//! A *source* is an emitting triangle or sphere, a light with a radius, or the sky. Lights without extent (*delta* lights) are only
//! selected where not all of them are computed.

use crate::frame::PreparedFrame;
use crate::rays::{HitBlock, PrimitiveId};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, f32x16, splat};

/// The lights that paths select from, in eye space.
#[derive(Clone, Debug)]
pub(crate) struct LightTable {}

/// Which lights are selected from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Selection {
    /// Those with an extent: the others are computed all.
    Extended,
    /// All.
    All,
}

/// Light that one selected light sends to each of sixteen points.
pub(crate) struct LightSamples {
    /// Bits of the points that it may reach.
    pub live: u32,
    /// Bits of the points whose light no path hits: it has no extent, or is a light with a radius.
    pub alone: u32,
    /// Bits of the points whose light casts shadows.
    pub shadows: u32,
    /// Unit vectors to the light.
    pub direction: [Lanes; 3],
    /// Distance of the light, in eye units; infinite for the sky and directional lights.
    pub distance: [f64; LANES],
    /// Radiance, linear RGB; of delta lights pi times the irradiance that [`crate::light::EyeLight`] gives, already divided by the
    /// cosine.
    pub radiance: [Lanes; 3],
    /// Density of the direction over solid angle, times the probability of the light; of delta lights that probability alone.
    pub density: Lanes,
    /// The primitives that emit the light.
    pub primitive: [Option<PrimitiveId>; LANES],
}

impl LightTable {
    /// The lights of a frame; `None` if the scene has no source and no light.
    pub(crate) fn of(_frame: &PreparedFrame) -> Option<Self> {
        None
    }

    /// Selects a light and a point on it for each of some points (a bit a lane). `select` has two numbers, `at` two more, in [0, 1).
    #[inline(never)]
    pub(crate) fn sample<S: Simd>(
        &self,
        simd: S,
        _frame: &PreparedFrame,
        (_points, _lanes): (Vec3x16<S>, u32),
        _selection: Selection,
        _select: [f32x16<S>; 2],
        _at: [f32x16<S>; 2],
    ) -> LightSamples {
        let _ = simd;
        LightSamples {
            live: 0,
            alone: 0,
            shadows: 0,
            direction: [Lanes::ZERO; 3],
            distance: [0.0; LANES],
            radiance: [Lanes::ZERO; 3],
            density: Lanes::ZERO,
            primitive: [None; LANES],
        }
    }

    /// Density, over solid angle, with which [`LightTable::sample`] selects the points of sources that rays hit: from their origins, along
    /// unit vectors, to `points` on the primitives of `hits`.
    #[inline(never)]
    pub(crate) fn density_of_hits<S: Simd>(
        &self,
        simd: S,
        _frame: &PreparedFrame,
        _selection: Selection,
        (_origins, _direction): (Vec3x16<S>, Vec3x16<S>),
        _hits: &HitBlock,
        _points: Vec3x16<S>,
    ) -> f32x16<S> {
        splat(simd, 0.0)
    }

    /// Density, over solid angle, with which [`LightTable::sample`] selects directions to the sky.
    #[inline(never)]
    pub(crate) fn density_of_sky<S: Simd>(
        &self,
        simd: S,
        _frame: &PreparedFrame,
        _selection: Selection,
        _direction: Vec3x16<S>,
    ) -> f32x16<S> {
        splat(simd, 0.0)
    }
}
