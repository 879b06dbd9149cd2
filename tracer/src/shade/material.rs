//! The materials of sixteen points.

use super::surface::Surfaces;
use crate::scene::Scene;
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd};

/// Colours and exponents, lane by lane.
pub(super) struct Materials<S: Simd> {
    pub diffuse: Vec3x16<S>,
    pub specular: Vec3x16<S>,
    pub exponent: Lanes,
    /// Whether any of them has a specular colour: else the term is not computed.
    pub any_specular: bool,
}

impl<S: Simd> Materials<S> {
    /// Most often all points of a block share one material.
    #[inline(always)]
    pub(super) fn gather(simd: S, scene: &Scene, surfaces: &Surfaces, block: usize) -> Self {
        let indices = &surfaces.material[block];
        let first = &scene.materials[indices[0] as usize];
        if indices.iter().all(|&index| index == indices[0]) {
            return Self {
                diffuse: Vec3x16::splat(simd, first.diffuse.to_array()),
                specular: Vec3x16::splat(simd, first.specular.to_array()),
                exponent: Lanes([first.exponent; LANES]),
                any_specular: first.specular != glam::Vec3::ZERO,
            };
        }
        let mut lanes = [[Lanes::ZERO; 3]; 2];
        let mut exponent = Lanes::ZERO;
        let mut any_specular = false;
        for (lane, &index) in indices.iter().enumerate() {
            let material = &scene.materials[index as usize];
            for axis in 0..3 {
                lanes[0][axis].0[lane] = material.diffuse[axis];
                lanes[1][axis].0[lane] = material.specular[axis];
            }
            exponent.0[lane] = material.exponent;
            any_specular |= material.specular != glam::Vec3::ZERO;
        }
        let (diffuse, specular) = (Vec3x16::load(simd, &lanes[0]), Vec3x16::load(simd, &lanes[1]));
        Self { diffuse, specular, exponent, any_specular }
    }
}
