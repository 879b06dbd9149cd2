//! The background of rays without a hit.

use crate::rays::SurfaceSource;
use crate::scene::Background;
use crate::simd::vector::Vec3x16;
use crate::simd::{Simd, splat};

/// One colour, or a gradient over the elevation of the ray: linear in (d.y + 1) / 2 of its unit direction.
#[inline(always)]
pub(super) fn background<S: Simd, R: SurfaceSource>(
    simd: S,
    background: &Background,
    rays: &R,
    block: usize,
) -> Vec3x16<S> {
    match *background {
        Background::Color(color) => Vec3x16::splat(simd, color.to_array()),
        Background::Gradient { bottom, top } => {
            let direction = rays.directions(simd, block).normalize(simd);
            let share = (direction.0[1] + splat(simd, 1.0)) * splat(simd, 0.5);
            let rise = Vec3x16::splat(simd, (top - bottom).to_array()).scale(share);
            Vec3x16::splat(simd, bottom.to_array()).add(rise)
        }
        Background::Sky(_) => Vec3x16::splat(simd, [0.0; 3]),
    }
}
