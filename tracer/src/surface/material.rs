//! The materials of sixteen points.

use super::Surfaces;
use crate::scene::{Material, Scene};
use crate::simd::vector::Vec3x16;
use crate::simd::{Simd, f32x16, mask_of, mask32x16, select, splat};

/// Colours and exponents, lane by lane.
pub(crate) struct Materials<S: Simd> {
    pub diffuse: Vec3x16<S>,
    pub specular: Vec3x16<S>,
    pub exponent: f32x16<S>,
    /// Whether any lane has a specular colour: else the term is skipped.
    pub any_specular: bool,
}

impl<S: Simd> Materials<S> {
    /// Gathers the materials of a block, with its textures: material by material, because most blocks have only one.
    #[inline(always)]
    pub(crate) fn gather(simd: S, scene: &Scene, surfaces: &Surfaces, block: usize) -> Self {
        let indices = &surfaces.blocks[block].material;
        let first = &scene.materials[indices.0[0] as usize];
        let mut materials = Self {
            diffuse: Vec3x16::splat(simd, first.diffuse.to_array()),
            specular: Vec3x16::splat(simd, first.specular.to_array()),
            exponent: splat(simd, first.exponent),
            any_specular: first.is_specular(),
        };
        let mut rest = 0xffff & !indices.equal(simd, indices.0[0]);
        while rest != 0 {
            let index = indices.0[rest.trailing_zeros() as usize];
            let same = rest & indices.equal(simd, index);
            rest &= !same;
            materials.put(simd, mask_of(simd, same), &scene.materials[index as usize]);
        }
        materials.diffuse = surfaces.textured(simd, block, materials.diffuse);
        materials
    }

    #[inline(always)]
    fn put(&mut self, simd: S, lanes: mask32x16<S>, material: &Material) {
        for channel in 0..3 {
            let diffuse = splat(simd, material.diffuse[channel]);
            self.diffuse.0[channel] = select(lanes, diffuse, self.diffuse.0[channel]);
            let specular = splat(simd, material.specular[channel]);
            self.specular.0[channel] = select(lanes, specular, self.specular.0[channel]);
        }
        self.exponent = select(lanes, splat(simd, material.exponent), self.exponent);
        self.any_specular |= material.is_specular();
    }
}
