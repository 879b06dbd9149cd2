//! Scattering of paths at sixteen points: the parts of their materials, with values, densities and random directions.
//!
//! Directions point away from the surface and have unit length. A part is selected at random by its share of the reflected light; the
//! value and density of a direction are the sums over all parts that could have made it.
//!
//! ```text
//!   lambert        diffuse reflection
//!   ggx            rough reflection
//!   albedo         energy of rough reflection, and of diffuse reflection below it
//!   albedo_table   its numbers
//!   fresnel        shares of reflection
//!   smooth         directions of perfectly smooth reflection and refraction
//!   recipe         the numbers of a material
//!   parts          the parts of materials that are more than diffuse surfaces
//! ```
//!
//! The materials of scenes, with F(x) = (x + (1 - x) (1 - v.h)^5) (1 + x (s(v) s(l) - 1)), f1 of `ggx` and s, g and G of `albedo`, and Fx the
//! exact Fresnel share:
//!
//! ```text
//! diffuse              c_d / pi
//! Blinn-Phong          f1 F(c_s) + c_d g(v) g(l) / (pi G), alpha = sqrt(2 / (p + 2)): at most 1 where c_d + c_s is
//! mirror               c_r R, with `fresnel` c_r Fx R; added to the diffuse part, whose colour stays
//! glass                max(c_r, c_t) Fx R + c_t (1 - Fx) T; `thin`: T goes straight through, and Fx is that of a sheet
//! metallic-roughness   m f1 F(base) + (1 - m) (1 - t) (k f1 F(d) + base c(v) c(l) / (pi C)) + (1 - m) t (p Fx + base (1 - Fx) T)
//!                      with alpha = roughness^2 (both roughness and m times their texels), d = ((ior - 1) / (ior + 1))^2,
//!                      k = specular_factor, c = 1 - k E the share that the dielectric leaves, and C its mean
//! ```
//!
//! Surfaces with alpha below 0.001 are perfectly smooth. Rough glass refracts by visible microfacets, each weighted by its own 1 - Fx, and
//! reflects by the density p of visible ones over cos; light
//! behind it is found by being hit alone.

mod albedo;
mod albedo_table;
mod fresnel;
mod ggx;
mod lambert;
mod parts;
mod recipe;
mod smooth;
#[cfg(test)]
mod tests;

pub(crate) use albedo_table::{STEPS, TABLE};

use crate::frame::PreparedFrame;
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, f32x16, mask_of};
use crate::surface::{Materials, Surfaces};
use parts::Parts;
use recipe::Recipe;

/// Scattering at sixteen points.
pub(crate) struct Scattering<S: Simd> {
    /// Shading normals, on the side that the light leaves to.
    normals: Vec3x16<S>,
    diffuse: Vec3x16<S>,
    /// Only where a material of the block is more than a diffuse surface.
    parts: Option<Box<Parts<S>>>,
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
    /// Density over solid angle; infinite where selected lights cannot be: in the only direction of a perfectly smooth
    /// part, and behind rough glass.
    pub density: f32x16<S>,
    /// Bits of the points that scatter light at all.
    pub scattered: u32,
    /// Bits of the directions that go through the surface into or out of a body.
    pub refracted: u32,
}

/// What scattering depends on except the materials.
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
        let diffuse = materials.diffuse;
        let features = &frame.features;
        let more = features.specular || features.bounces || features.metallic_roughness;
        let parts = if more { gather_parts(simd, frame, surfaces, block, &diffuse, setting) } else { None };
        Self { normals: setting.normals, diffuse, parts }
    }

    /// Value and density of directions, without perfectly smooth parts and without light through rough glass.
    #[inline(always)]
    pub(crate) fn eval(&self, simd: S, direction: Vec3x16<S>) -> Evaluated<S> {
        if let Some(parts) = &self.parts {
            return eval_parts(simd, parts, &direction);
        }
        lambert::eval(simd, self.diffuse, self.normals.dot(direction))
    }

    /// Random directions. `part` selects the part of the material, `at` the direction; all numbers are in [0, 1).
    #[inline(always)]
    pub(crate) fn sample(&self, simd: S, part: f32x16<S>, at: [f32x16<S>; 2]) -> Scattered<S> {
        if let Some(parts) = &self.parts {
            return sample_parts(simd, parts, part, at);
        }
        let (direction, density) = lambert::sample(simd, self.normals, at);
        Scattered { direction, weight: self.diffuse, density, scattered: 0xffff, refracted: 0 }
    }
}

/// The parts of a block. Not inlined, nor are the next two: the code of diffuse surfaces stays dense.
#[inline(never)]
fn gather_parts<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    surfaces: &Surfaces,
    block: usize,
    base: &Vec3x16<S>,
    setting: &Setting<S>,
) -> Option<Box<Parts<S>>> {
    simd.vectorize(
        #[inline(always)]
        || {
            let indices = &surfaces.blocks[block].material;
            let recipe_of =
                |index: u32| Recipe::of(&frame.scene().materials[index as usize], frame.features.specular);
            let first = recipe_of(indices.0[0]);
            let mut any = first.is_more_than_diffuse();
            let mut recipe = Recipe::splat(simd, &first);
            let mut rest = 0xffff & !indices.equal(simd, indices.0[0]);
            while rest != 0 {
                let index = indices.0[rest.trailing_zeros() as usize];
                let same = rest & indices.equal(simd, index);
                rest &= !same;
                let next = recipe_of(index);
                any |= next.is_more_than_diffuse();
                recipe.put(simd, mask_of(simd, same), &next);
            }
            if let Some(factors) = surfaces.rough_factors(simd, block) {
                recipe.multiply(factors);
            }
            any.then(|| Box::new(Parts::new(simd, &recipe, *base, setting)))
        },
    )
}

#[inline(never)]
fn eval_parts<S: Simd>(simd: S, parts: &Parts<S>, direction: &Vec3x16<S>) -> Evaluated<S> {
    simd.vectorize(
        #[inline(always)]
        || parts.eval(simd, *direction),
    )
}

#[inline(never)]
fn sample_parts<S: Simd>(simd: S, parts: &Parts<S>, part: f32x16<S>, at: [f32x16<S>; 2]) -> Scattered<S> {
    simd.vectorize(
        #[inline(always)]
        || parts.sample(simd, part, at),
    )
}
