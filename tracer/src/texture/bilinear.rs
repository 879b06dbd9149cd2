//! The four texels around each of sixteen places, weighted by nearness in linear light.

use super::Wrap;
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, SimdFloat, each_bit, f32x16, select, splat, three};

/// The two texels around each of sixteen places along one axis of a picture, and the weight of the second.
pub(crate) struct Axis<S: Simd> {
    first: [f32; LANES],
    second: [f32; LANES],
    weight: f32x16<S>,
}

impl<S: Simd> Axis<S> {
    /// Places in [0, `size`], in texels: centres of texels are at whole numbers plus a half. The last texel and the first are
    /// neighbours.
    #[inline(always)]
    pub(crate) fn cyclic(simd: S, place: f32x16<S>, size: f32x16<S>) -> Self {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let (below, weight) = below(simd, place);
        let next = below + one;
        Self {
            first: select(below.simd_lt(zero), size - one, below).to_array(),
            second: select(next.simd_lt(size), next, zero).to_array(),
            weight,
        }
    }

    /// [`Axis::cyclic`] for a repeated texture, [`Axis::clamped`] for others.
    #[inline(always)]
    pub(crate) fn wrapped(simd: S, wrap: Wrap, place: f32x16<S>, size: f32x16<S>) -> Self {
        if wrap == Wrap::Repeat { Self::cyclic(simd, place, size) } else { Self::clamped(simd, place, size) }
    }

    /// The same as [`Axis::cyclic`] without neighbours across the border, where the nearest texel continues.
    #[inline(always)]
    pub(crate) fn clamped(simd: S, place: f32x16<S>, size: f32x16<S>) -> Self {
        let one = splat(simd, 1.0);
        let (below, weight) = below(simd, place);
        Self {
            first: below.max(splat(simd, 0.0)).to_array(),
            second: (below + one).min(size - one).to_array(),
            weight,
        }
    }
}

/// The index of the texel whose centre is next below a place, -1 before the first one, and the distance from it.
#[inline(always)]
fn below<S: Simd>(simd: S, place: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
    let from_center = place - splat(simd, 0.5);
    let below = from_center.floor();
    (below, from_center - below)
}

/// Weighted means of linear texels, in some lanes (a bit a lane); black in the others. `texel` returns the texel of a lane in a column,
/// from the left, of a row, from the bottom; it is defined outside of the picture as well.
#[inline(always)]
pub(crate) fn mean<S: Simd>(
    simd: S,
    columns: &Axis<S>,
    rows: &Axis<S>,
    lanes: u32,
    texel: impl Fn(usize, u32, u32) -> [f32; 3],
) -> Vec3x16<S> {
    let mut colors = [[Lanes::ZERO; 3]; 4];
    for lane in each_bit(lanes) {
        // The conversion maps NaN to 0.
        let [x0, x1] = [columns.first[lane] as u32, columns.second[lane] as u32];
        let [y0, y1] = [rows.first[lane] as u32, rows.second[lane] as u32];
        for (corner, (x, y)) in [(x0, y0), (x1, y0), (x0, y1), (x1, y1)].into_iter().enumerate() {
            let color = texel(lane, x, y);
            for channel in 0..3 {
                colors[corner][channel].0[lane] = color[channel];
            }
        }
    }
    let one = splat(simd, 1.0);
    let [x1, y1] = [columns.weight, rows.weight];
    let [x0, y0] = [one - x1, one - y1];
    Vec3x16(three!(i => {
        let lower = colors[0][i].load(simd) * x0 + colors[1][i].load(simd) * x1;
        let upper = colors[2][i].load(simd) * x0 + colors[3][i].load(simd) * x1;
        lower * y0 + upper * y1
    }))
}
