//! Terms without a light: the colour of unlit materials, and emission.

use crate::frame::PreparedFrame;
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, dispatch, mask_of, select, three};
use crate::surface::{Materials, Surfaces};

/// Adds emission to the colours of a block, replaces those of unlit points, and clears their bits in `lit`. Dispatched again,
/// and not inlined: few scenes use it.
#[inline(never)]
pub(super) fn add(frame: &PreparedFrame, surfaces: &mut Surfaces, block: usize, colors: &mut [Lanes; 3]) {
    dispatch!(frame.level, simd => add_with(simd, frame, surfaces, block, colors));
}

/// The same, material by material, on one level.
#[inline(always)]
fn add_with<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    surfaces: &mut Surfaces,
    block: usize,
    colors: &mut [Lanes; 3],
) {
    let mut color = Vec3x16::load(simd, colors);
    let mut rest = surfaces.blocks[block].hit;
    while rest != 0 {
        let index = surfaces.blocks[block].material.0[rest.trailing_zeros() as usize];
        let same = rest & surfaces.blocks[block].material.equal(simd, index);
        rest &= !same;
        let material = &frame.scene().materials[index as usize];
        if material.unlit {
            let diffuse = Materials::gather(simd, frame.scene(), surfaces, block).diffuse;
            let mask = mask_of(simd, same);
            color = Vec3x16(three!(i => select(mask, diffuse.0[i], color.0[i])));
            surfaces.blocks[block].lit &= !same;
        }
        let shining = same & surfaces.blocks[block].front;
        if material.is_emissive() && shining != 0 {
            let emission = Vec3x16::splat(simd, material.emission.to_array());
            let brighter = color.add(surfaces.emitted(simd, block, emission));
            let mask = mask_of(simd, shining);
            color = Vec3x16(three!(i => select(mask, brighter.0[i], color.0[i])));
        }
    }
    color.store(colors);
}
