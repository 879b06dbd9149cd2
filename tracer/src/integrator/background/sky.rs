//! Skies: pictures all around the scene, infinitely far away.

use super::{cubemap, panorama};
use crate::frame::PreparedFrame;
use crate::scene::{Sky, SkyPicture};
use crate::simd::math::to_unit;
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, dispatch, splat};
use crate::texture::Texture;

/// Replaces directions of any length by the radiance that a sky has in them, in some lanes (a bit a lane); the others become black.
/// Dispatched again, and not inlined: the code of scenes without a sky stays dense.
#[inline(never)]
pub(super) fn replace(frame: &PreparedFrame, sky: &Sky, lanes: u32, vectors: &mut [Lanes; 3]) {
    dispatch!(frame.level, simd => replace_with(simd, frame, sky, lanes, vectors));
}

#[inline(always)]
fn replace_with<S: Simd>(simd: S, frame: &PreparedFrame, sky: &Sky, lanes: u32, vectors: &mut [Lanes; 3]) {
    let direction = Vec3x16::load(simd, vectors);
    // The largest component becomes a number in [1, 2): squares neither overflow nor underflow.
    let near_one = direction.scale(to_unit(simd, direction.size()));
    let direction = turned_back(simd, frame.sky_rotation, near_one);
    let texture = |index: u32| -> &Texture { &frame.textures()[index as usize].0 };
    let radiance = match sky.picture {
        SkyPicture::Panorama(index) => panorama::radiance(simd, texture(index), direction, lanes),
        SkyPicture::Cubemap(faces) => cubemap::radiance(simd, faces.map(texture), direction, lanes),
    };
    radiance.scale(splat(simd, sky.strength)).store(vectors);
}

/// Directions as they are in the picture of a sky that is rotated about +Y, by an angle given by its sine and cosine.
#[inline(always)]
fn turned_back<S: Simd>(simd: S, [sin, cos]: [f32; 2], direction: Vec3x16<S>) -> Vec3x16<S> {
    let [x, y, z] = direction.0;
    let (sin, cos) = (splat(simd, sin), splat(simd, cos));
    Vec3x16([cos * x - sin * z, y, sin * x + cos * z])
}
