//! Factors of the diffuse colour, of the emission, and of roughness and metal at surface points: by textures, vertex colours and patterns.
//! They are found once a point for all lights.

use glam::Vec3;

use super::Surfaces;
use super::filter::{SHARES, bilinear, nearest, trilinear};
use super::uv::PointUvs;
use crate::frame::PreparedFrame;
use crate::rays::{BLOCKS, TileColors};
use crate::scene::Filter;
use crate::simd::vector::Vec3x16;
use crate::simd::{Indices, LANES, Lanes, Simd, dispatch, f32x16, mask_of, select, three};
use crate::srgb;

/// Factors of the diffuse colours, the emission, the roughness and the metal of a tile; 1 without a texture.
pub(super) struct Texels {
    diffuse: TileColors,
    /// Only in scenes with emissive materials.
    emission: Option<Box<TileColors>>,
    /// Green is the factor of the roughness, and blue that of the share of metal. Only in frames with textures of them.
    shares: Option<Box<TileColors>>,
}

const WHITE: [Lanes; 3] = [Lanes([1.0; LANES]); 3];

impl Texels {
    /// Factors for a scene; `None` if it has neither textures nor vertex colours nor patterns.
    pub(super) fn for_scene(frame: &PreparedFrame) -> Option<Box<Self>> {
        let features = &frame.features;
        let colored = features.textured || features.vertex_colors || features.checkered;
        (colored || features.rough_textured).then(|| {
            let emission = features.emissive.then(|| Box::new([WHITE; BLOCKS]));
            let shares = features.rough_textured.then(|| Box::new([WHITE; BLOCKS]));
            Box::new(Self { diffuse: [WHITE; BLOCKS], emission, shares })
        })
    }

    /// Resets a block to no textures.
    pub(super) fn clear(&mut self, block: usize) {
        self.diffuse[block] = WHITE;
        if let Some(emission) = &mut self.emission {
            emission[block] = WHITE;
        }
        if let Some(shares) = &mut self.shares {
            shares[block] = WHITE;
        }
    }

    /// Sets the lanes of a block that have a texture. Dispatched again, and not inlined: the code of scenes without textures
    /// stays dense.
    #[inline(never)]
    pub(super) fn fill(
        &mut self,
        frame: &PreparedFrame,
        block: usize,
        lanes: u32,
        materials: &Indices,
        uv: &PointUvs,
    ) {
        dispatch!(frame.level, simd => self.fill_with(simd, frame, block, lanes, materials, uv));
    }

    /// Texture by texture.
    #[inline(always)]
    fn fill_with<S: Simd>(
        &mut self,
        simd: S,
        frame: &PreparedFrame,
        block: usize,
        lanes: u32,
        materials: &Indices,
        uv: &PointUvs,
    ) {
        let mut rest = lanes;
        while rest != 0 {
            let index = materials.0[rest.trailing_zeros() as usize];
            let same = rest & materials.equal(simd, index);
            rest &= !same;
            let material = &frame.scene().materials[index as usize];
            if let (Some(map), None) = (material.texture, &material.checker) {
                look_up(simd, frame, map, uv, same, &mut self.diffuse[block]);
            }
            if let (Some(map), Some(emission)) = (material.emission_texture, &mut self.emission) {
                look_up(simd, frame, map, uv, same, &mut emission[block]);
            }
            if let (Some(model), Some(shares)) = (&material.metallic_roughness, &mut self.shares)
                && let Some(map) = model.texture
            {
                look_up_shares(frame, map, uv, same, &mut shares[block]);
            }
        }
    }

    /// Multiplies the diffuse factor of a point.
    pub(super) fn multiply(&mut self, block: usize, lane: usize, color: Vec3) {
        for (channel, factor) in color.to_array().into_iter().enumerate() {
            self.diffuse[block][channel].0[lane] *= factor;
        }
    }

    /// Multiplies the diffuse factors of a block by vertex colours, in lanes whose materials use them.
    #[inline(always)]
    pub(super) fn tint<S: Simd>(
        &mut self,
        simd: S,
        frame: &PreparedFrame,
        block: usize,
        lanes: u32,
        materials: &Indices,
        colors: Vec3x16<S>,
    ) {
        let mut tinted = 0;
        let mut rest = lanes;
        while rest != 0 {
            let index = materials.0[rest.trailing_zeros() as usize];
            let same = rest & materials.equal(simd, index);
            rest &= !same;
            tinted |= if frame.scene().materials[index as usize].vertex_colors { same } else { 0 };
        }
        let (mask, before) = (mask_of(simd, tinted), Vec3x16::load(simd, &self.diffuse[block]));
        let after = before.mul(colors);
        Vec3x16(three!(i => select(mask, after.0[i], before.0[i]))).store(&mut self.diffuse[block]);
    }
}

/// Looks up one texture for some lanes of a block.
#[inline(always)]
fn look_up<S: Simd>(
    simd: S,
    frame: &PreparedFrame,
    map: u32,
    uv: &PointUvs,
    lanes: u32,
    colors: &mut [Lanes; 3],
) {
    let (texture, map) = &frame.textures()[map as usize];
    let (at, wrap) = (uv.laid(simd, &map.tiling), map.tiling.wrap);
    let color = match (frame.filter_of(map), uv.footprint()) {
        (Filter::Nearest, _) => nearest(simd, texture, wrap, at, lanes, srgb::decoded()),
        (Filter::Trilinear, Some(footprint)) => {
            let mut stored = [Lanes::ZERO; 2];
            stored[0].store(at[0]);
            stored[1].store(at[1]);
            let color = trilinear(frame.level, (texture, &map.tiling), &stored, footprint, lanes);
            Vec3x16::load(simd, &color)
        }
        (Filter::Bilinear | Filter::Trilinear, _) => {
            bilinear(simd, texture, wrap, at, lanes, srgb::decoded())
        }
    };
    put(simd, lanes, color, colors);
}

/// Looks up one texture of shares for some lanes of a block. Smaller pictures are made of colours and are not used: the trilinear filter
/// is the bilinear one. Dispatched again, and not inlined: the code of colours stays dense.
#[inline(never)]
fn look_up_shares(frame: &PreparedFrame, map: u32, uv: &PointUvs, lanes: u32, shares: &mut [Lanes; 3]) {
    let (texture, map) = &frame.textures()[map as usize];
    let wrap = map.tiling.wrap;
    dispatch!(frame.level, simd => {
        let at = uv.laid(simd, &map.tiling);
        let found = match frame.filter_of(map) {
            Filter::Nearest => nearest(simd, texture, wrap, at, lanes, &SHARES),
            Filter::Bilinear | Filter::Trilinear => bilinear(simd, texture, wrap, at, lanes, &SHARES),
        };
        put(simd, lanes, found, shares);
    });
}

/// Puts numbers into some lanes.
#[inline(always)]
fn put<S: Simd>(simd: S, lanes: u32, new: Vec3x16<S>, stored: &mut [Lanes; 3]) {
    let (mask, before) = (mask_of(simd, lanes), Vec3x16::load(simd, stored));
    Vec3x16(three!(i => select(mask, new.0[i], before.0[i]))).store(stored);
}

impl Surfaces {
    /// The diffuse colours of a block, times its textures.
    #[inline(always)]
    pub(super) fn textured<S: Simd>(&self, simd: S, block: usize, diffuse: Vec3x16<S>) -> Vec3x16<S> {
        match &self.texels {
            None => diffuse,
            Some(texels) => diffuse.mul(Vec3x16::load(simd, &texels.diffuse[block])),
        }
    }

    /// An emission in a block, times its textures.
    #[inline(always)]
    pub(crate) fn emitted<S: Simd>(&self, simd: S, block: usize, emission: Vec3x16<S>) -> Vec3x16<S> {
        match self.texels.as_ref().and_then(|texels| texels.emission.as_ref()) {
            None => emission,
            Some(texels) => emission.mul(Vec3x16::load(simd, &texels[block])),
        }
    }
    /// Factors of the roughness and of the share of metal in a block; `None` in frames without textures of them.
    #[inline(always)]
    pub(crate) fn rough_factors<S: Simd>(&self, simd: S, block: usize) -> Option<[f32x16<S>; 2]> {
        let shares = self.texels.as_ref()?.shares.as_ref()?;
        let [_, roughness, metal] = &shares[block];
        Some([roughness.load(simd), metal.load(simd)])
    }
}
