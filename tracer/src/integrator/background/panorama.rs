//! Panoramas: equirectangular pictures, with the whole turn about +Y from left to right and straight up at the top.

use std::f32::consts::FRAC_1_PI;

use crate::simd::math::atan2;
use crate::simd::vector::Vec3x16;
use crate::simd::{Simd, SimdFloat, splat};
use crate::texture::Texture;
use crate::texture::bilinear::{Axis, mean};

/// Radiance in directions whose largest component is about 1. u = 1/2 + atan2(x, -z) / 2 pi from the left; the angle to +Y is acos(y)
/// of the unit vector, computed as atan2(sqrt(x^2 + z^2), y), which is precise at the poles as well. Left and right border are
/// neighbours; the rows at the poles have none.
#[inline(always)]
pub(super) fn radiance<S: Simd>(simd: S, texture: &Texture, direction: Vec3x16<S>, lanes: u32) -> Vec3x16<S> {
    let [x, y, z] = direction.0;
    let turn = atan2(simd, x, -z) * splat(simd, 0.5 * FRAC_1_PI) + splat(simd, 0.5);
    // The texture's rows begin at the bottom: the angle to -Y, over pi.
    let rise = atan2(simd, (x * x + z * z).sqrt(), -y) * splat(simd, FRAC_1_PI);
    let [width, height] = [splat(simd, texture.width() as f32), splat(simd, texture.height() as f32)];
    let columns = Axis::cyclic(simd, turn * width, width);
    let rows = Axis::clamped(simd, rise * height, height);
    mean(simd, &columns, &rows, lanes, |_, x, y| texture.linear_texel(x, y))
}
