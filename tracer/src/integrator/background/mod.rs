//! The background of rays without a hit.
//!
//! ```text
//!   sky        a picture all around: rotation and strength
//!   panorama   directions to places in an equirectangular picture
//!   cubemap    directions to places on the faces of a cube
//! ```

mod cubemap;
mod panorama;
mod sky;
#[cfg(test)]
mod tests;

use crate::frame::PreparedFrame;
use crate::rays::SurfaceSource;
use crate::scene::Background;
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, splat};

/// Sets the colours of the rays of a block to the background in their directions: one colour, a gradient over the elevation of the
/// ray, linear in (d.y + 1) / 2 of its unit direction, or a sky. Rays of the camera see black if the background is not visible.
#[inline(always)]
pub(super) fn background<S: Simd, R: SurfaceSource>(
    simd: S,
    rays: &R,
    block: usize,
    colors: &mut [Lanes; 3],
) {
    let frame = rays.frame();
    let background = if rays.are_of_camera() { &frame.seen_background } else { &frame.scene().background };
    match background {
        Background::Color(color) => Vec3x16::splat(simd, color.to_array()).store(colors),
        Background::Gradient { bottom, top } => {
            let direction = rays.directions(simd, block).normalize(simd);
            let share = (direction.0[1] + splat(simd, 1.0)) * splat(simd, 0.5);
            let rise = Vec3x16::splat(simd, (*top - *bottom).to_array()).scale(share);
            Vec3x16::splat(simd, bottom.to_array()).add(rise).store(colors);
        }
        Background::Sky(sky) => {
            rays.directions(simd, block).store(colors);
            sky::replace(frame, sky, rays.live(block), colors);
        }
    }
}

/// Replaces directions of any length by the radiance of the scene's sky in them, in some lanes (a bit a lane).
pub(super) fn sky_radiance(frame: &PreparedFrame, lanes: u32, vectors: &mut [Lanes; 3]) {
    if let Background::Sky(sky) = &frame.scene().background {
        sky::replace(frame, sky, lanes, vectors);
    }
}
