//! Filters of textures: texels around sixteen points, as colours in linear light or as shares.

use super::footprint::Footprint;
use crate::scene::{Tiling, Wrap};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Level, Simd, SimdBase, SimdFloat, bits, dispatch, each_bit, f32x16, splat};
use crate::srgb;
use crate::texture::Texture;
use crate::texture::bilinear::{Axis, mean};

/// The place of a coordinate in a texture: in texels, from 0 to `size`, which rounding may reach.
#[inline(always)]
fn position<S: Simd>(simd: S, wrap: Wrap, coordinate: f32x16<S>, size: f32x16<S>) -> f32x16<S> {
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let share = match wrap {
        Wrap::Repeat => coordinate - coordinate.floor(),
        Wrap::Clamp => coordinate.max_precise(zero).min_precise(one),
        Wrap::Mirror => {
            let two = splat(simd, 2.0);
            let pair = coordinate - (coordinate * splat(simd, 0.5)).floor() * two;
            pair.min_precise(two - pair)
        }
    };
    share * size
}

/// The numbers of the bytes of a texel: a colour in linear light by [`srgb::decoded`], or [`SHARES`].
pub(super) type Decoded = [f32; 256];

/// The shares that the bytes of a texel without a colour are.
pub(super) static SHARES: Decoded = {
    let mut shares = [0.0; 256];
    let mut byte = 0;
    while byte < 256 {
        shares[byte] = byte as f32 / 255.0;
        byte += 1;
    }
    shares
};

/// The texel that contains each point.
#[inline(always)]
pub(super) fn nearest<S: Simd>(
    simd: S,
    texture: &Texture,
    wrap: Wrap,
    [u, v]: [f32x16<S>; 2],
    lanes: u32,
    decoded: &Decoded,
) -> Vec3x16<S> {
    let [width, height] = [texture.width(), texture.height()];
    let x = position(simd, wrap, u, splat(simd, width as f32)).to_array();
    let y = position(simd, wrap, v, splat(simd, height as f32)).to_array();
    let mut color = [Lanes::ZERO; 3];
    for lane in each_bit(lanes) {
        // The conversion rounds down, and maps NaN to 0.
        let texel = texture.texel((x[lane] as u32).min(width - 1), (y[lane] as u32).min(height - 1));
        for channel in 0..3 {
            color[channel].0[lane] = decoded[usize::from(texel[channel])];
        }
    }
    Vec3x16::load(simd, &color)
}

/// The four texels around each point, weighted by nearness.
#[inline(always)]
pub(super) fn bilinear<S: Simd>(
    simd: S,
    texture: &Texture,
    wrap: Wrap,
    uv: [f32x16<S>; 2],
    lanes: u32,
    decoded: &Decoded,
) -> Vec3x16<S> {
    let size = [splat(simd, texture.width() as f32), splat(simd, texture.height() as f32)];
    around(simd, size, (wrap, uv), lanes, decoded, |_, x, y| texture.texel(x, y))
}

/// The four texels around each point in pictures of the given sizes, weighted by nearness; `texel` has the lane, the column and
/// the row.
#[inline(always)]
fn around<S: Simd>(
    simd: S,
    [width, height]: [f32x16<S>; 2],
    (wrap, [u, v]): (Wrap, [f32x16<S>; 2]),
    lanes: u32,
    decoded: &Decoded,
    texel: impl Fn(usize, u32, u32) -> [u8; 3],
) -> Vec3x16<S> {
    let columns = Axis::wrapped(simd, wrap, position(simd, wrap, u, width), width);
    let rows = Axis::wrapped(simd, wrap, position(simd, wrap, v, height), height);
    mean(simd, &columns, &rows, lanes, |lane, x, y| texel(lane, x, y).map(|code| decoded[usize::from(code)]))
}

/// The means of the four texels around each point in the two levels of the texture's pyramid next to the size of the footprint,
/// weighted by nearness. Dispatched again, and not inlined: few textures have this filter.
#[inline(never)]
pub(super) fn trilinear(
    level: Level,
    (texture, tiling): (&Texture, &Tiling),
    uv: &[Lanes; 2],
    footprint: &Footprint,
    lanes: u32,
) -> [Lanes; 3] {
    dispatch!(level, simd => trilinear_with(simd, (texture, tiling), uv, footprint, lanes))
}

/// The same on one level of SIMD.
#[inline(always)]
fn trilinear_with<S: Simd>(
    simd: S,
    (texture, tiling): (&Texture, &Tiling),
    uv: &[Lanes; 2],
    footprint: &Footprint,
    lanes: u32,
) -> [Lanes; 3] {
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let uv = [uv[0].load(simd), uv[1].load(simd)];
    let level = footprint.level(simd, [texture.width(), texture.height()], tiling.scale);
    let level = level.max(zero).min(splat(simd, (texture.levels() - 1) as f32));
    let lower = level.floor();
    let share = level - lower;
    let mut color = of_levels(simd, texture, tiling.wrap, uv, lower, lanes);
    if bits(share.simd_gt(zero)) & lanes != 0 {
        let coarse = of_levels(simd, texture, tiling.wrap, uv, lower + one, lanes);
        color = color.scale(one - share).add(coarse.scale(share));
    }
    let mut stored = [Lanes::ZERO; 3];
    color.store(&mut stored);
    stored
}

/// Bilinear in one level for each lane.
#[inline(always)]
fn of_levels<S: Simd>(
    simd: S,
    texture: &Texture,
    wrap: Wrap,
    uv: [f32x16<S>; 2],
    level: f32x16<S>,
    lanes: u32,
) -> Vec3x16<S> {
    let levels = level.to_array();
    let mut size = [Lanes([1.0; LANES]); 2];
    for lane in each_bit(lanes) {
        let [width, height] = texture.size_of_level(levels[lane] as u32);
        size[0].0[lane] = width as f32;
        size[1].0[lane] = height as f32;
    }
    let size = [size[0].load(simd), size[1].load(simd)];
    around(simd, size, (wrap, uv), lanes, srgb::decoded(), |lane, x, y| {
        texture.texel_of_level(levels[lane] as u32, x, y)
    })
}
