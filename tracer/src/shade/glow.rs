//! What surfaces show without a light on them: the colour of unlit ones, and what others emit.

use super::material::Materials;
use super::surface::Surfaces;
use crate::frame::PreparedFrame;
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, dispatch, mask_of, select, three};

/// Adds it to the ambient term of a block, and takes unlit points out of those that lights shine on. Dispatched anew: few
/// scenes come here.
#[inline(never)]
pub(super) fn glow(frame: &PreparedFrame, surfaces: &mut Surfaces, block: usize, colors: &mut [Lanes; 3]) {
    dispatch!(frame.level, simd => glow_with(simd, frame, surfaces, block, colors));
}

/// Material by material.
#[inline(always)]
fn glow_with<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    surfaces: &mut Surfaces,
    block: usize,
    colors: &mut [Lanes; 3],
) {
    let mut color = Vec3x16::load(simd, colors);
    let mut rest = surfaces.hit[block];
    while rest != 0 {
        let index = surfaces.material[block].0[rest.trailing_zeros() as usize];
        let same = rest & surfaces.material[block].equal(simd, index);
        rest &= !same;
        let material = &frame.scene().materials[index as usize];
        if material.unlit {
            let diffuse = Materials::gather(simd, frame.scene(), surfaces, block).diffuse;
            let mask = mask_of(simd, same);
            color = Vec3x16(three!(i => select(mask, diffuse.0[i], color.0[i])));
            surfaces.lit[block] &= !same;
        }
        let shining = same & surfaces.front[block];
        if material.is_emissive() && shining != 0 {
            let emission = Vec3x16::splat(simd, material.emission.to_array());
            let brighter = color.add(surfaces.glowing_texels(simd, block, emission));
            let mask = mask_of(simd, shining);
            color = Vec3x16(three!(i => select(mask, brighter.0[i], color.0[i])));
        }
    }
    color.store(colors);
}
