//! Scattering of paths at sixteen points: the parts of their materials, with values, densities and random directions.
//!
//! Directions point away from the surface and have unit length. A part is selected at random by its share of the reflected light; the
//! value and density of a direction are the sums over all parts that could have made it.
//!
//! ```text
//!   lambert   diffuse reflection
//! ```

mod lambert;

use crate::frame::PreparedFrame;
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, f32x16};
use crate::surface::{Materials, Surfaces};

/// Scattering at sixteen points.
pub(crate) struct Scattering<S: Simd> {
    /// Shading normals, on the side that the light leaves to.
    normals: Vec3x16<S>,
    diffuse: Vec3x16<S>,
}

/// Value and density of directions.
pub(crate) struct Evaluated<S: Simd> {
    /// f cos, linear RGB.
    pub value: Vec3x16<S>,
    /// Density over solid angle with which [`Scattering::sample`] returns the direction.
    pub density: f32x16<S>,
}

/// Random directions.
pub(crate) struct Scattered<S: Simd> {
    /// Unit vectors.
    pub direction: Vec3x16<S>,
    /// f cos / density, linear RGB.
    pub weight: Vec3x16<S>,
    /// Density over solid angle; infinite for the only direction of a perfectly smooth part.
    pub density: f32x16<S>,
    /// Bits of the points that scatter light at all.
    pub scattered: u32,
    /// Bits of the directions that go through the surface into or out of a body.
    pub refracted: u32,
}

/// What scattering depends on beside the materials.
pub(crate) struct Setting<S: Simd> {
    /// Unit vectors to where the light goes.
    pub to_viewer: Vec3x16<S>,
    /// Geometric and shading unit normals on that side.
    pub geometric: Vec3x16<S>,
    pub normals: Vec3x16<S>,
    /// n_from / n_to for a path that enters the surface at the point; 1 for all but transparent bodies.
    pub eta: Lanes,
}

impl<S: Simd> Scattering<S> {
    /// The scattering at the points of a block.
    #[inline(always)]
    pub(crate) fn gather(
        simd: S,
        frame: &PreparedFrame,
        surfaces: &Surfaces,
        block: usize,
        setting: &Setting<S>,
    ) -> Self {
        let materials = Materials::gather(simd, frame.scene(), surfaces, block);
        Self { normals: setting.normals, diffuse: materials.diffuse }
    }

    /// Value and density of directions, without perfectly smooth parts.
    #[inline(always)]
    pub(crate) fn eval(&self, simd: S, direction: Vec3x16<S>) -> Evaluated<S> {
        lambert::eval(simd, self.diffuse, self.normals.dot(direction))
    }

    /// Random directions. `part` selects the part of the material, `at` the direction; all numbers are in [0, 1).
    #[inline(always)]
    pub(crate) fn sample(&self, simd: S, _part: f32x16<S>, at: [f32x16<S>; 2]) -> Scattered<S> {
        let (direction, density) = lambert::sample(simd, self.normals, at);
        Scattered { direction, weight: self.diffuse, density, scattered: 0xffff, refracted: 0 }
    }
}
