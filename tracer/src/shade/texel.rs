//! Textures at the points of a tile: where a point lies in the picture, and the texels around it, in linear light.
//!
//! Coordinates and weights are lanes of plain operations; the texels themselves are fetched lane by lane. What comes out is a
//! factor of the diffuse colour, found once a point, however many lights shine on it.

use glam::Vec2;

use super::Colors;
use super::surface::Surfaces;
use crate::frame::PreparedFrame;
use crate::mesh::CompiledMesh;
use crate::scene::Filter;
use crate::simd::vector::Vec3x16;
use crate::simd::{
    Indices, LANES, Lanes, Simd, SimdBase, SimdFloat, dispatch, each_bit, f32x16, mask_of, select, splat,
    three,
};
use crate::srgb;
use crate::texture::Texture;
use crate::tile::BLOCKS;

/// Texture coordinates at the corners of sixteen triangles, indexed `[corner][u or v]`.
pub(super) struct CornerUvs([[Lanes; 2]; 3]);

impl CornerUvs {
    /// One triangle in all lanes.
    pub(super) fn splat(uvs: [Vec2; 3]) -> Self {
        Self(uvs.map(|uv| uv.to_array().map(|c| Lanes([c; LANES]))))
    }

    /// Those of the triangles that lanes see.
    #[inline(always)]
    pub(super) fn gather(mesh: &CompiledMesh, triangles: &[u32; LANES], lanes: u32) -> Self {
        let all = mesh.uvs();
        let mut uvs = [[Lanes::ZERO; 2]; 3];
        for lane in each_bit(lanes) {
            // `CompiledScene::new` made sure that a mesh under a texture has them.
            let corners = all.get(triangles[lane] as usize).copied().unwrap_or_default();
            for (uvs, corner) in uvs.iter_mut().zip(corners) {
                uvs[0].0[lane] = corner.x;
                uvs[1].0[lane] = corner.y;
            }
        }
        Self(uvs)
    }

    /// Between the corners: `weights` are those of the second and the third.
    #[inline(always)]
    pub(super) fn at<S: Simd>(&self, simd: S, weights: [f32x16<S>; 2]) -> [Lanes; 2] {
        let [a, b, c] = &self.0;
        let [second, third] = weights;
        let first = splat(simd, 1.0) - second - third;
        let mut uv = [Lanes::ZERO; 2];
        for axis in 0..2 {
            let [a, b, c] = [a[axis].load(simd), b[axis].load(simd), c[axis].load(simd)];
            uv[axis].store(a * first + b * second + c * third);
        }
        uv
    }
}

/// Factors of the diffuse colours of a tile, 1 where there is no texture.
pub(super) struct Texels(Colors);

impl Texels {
    /// `None` for a scene without textures.
    pub(super) fn for_scene(frame: &PreparedFrame) -> Option<Box<Self>> {
        frame.features.textured.then(|| Box::new(Self([[Lanes([1.0; LANES]); 3]; BLOCKS])))
    }

    /// No textures in a block yet.
    pub(super) fn clear(&mut self, block: usize) {
        self.0[block] = [Lanes([1.0; LANES]); 3];
    }

    /// Fills the lanes of a block that have a texture. Dispatched anew: few scenes come here, and the code of all others
    /// should not be spread out by it.
    #[inline(never)]
    pub(super) fn fill(
        &mut self,
        frame: &PreparedFrame,
        block: usize,
        lanes: u32,
        materials: &Indices,
        uv: &[Lanes; 2],
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
        uv: &[Lanes; 2],
    ) {
        let uv = [uv[0].load(simd), uv[1].load(simd)];
        let mut rest = lanes;
        while rest != 0 {
            let material = materials.0[rest.trailing_zeros() as usize];
            let same = rest & materials.equal(simd, material);
            rest &= !same;
            let Some(map) = frame.scene().materials[material as usize].texture else { continue };
            let (texture, filter) = &frame.textures()[map as usize];
            let color = match frame.view().quality.filter.unwrap_or(*filter) {
                Filter::Nearest => nearest(simd, texture, uv, same),
                Filter::Bilinear => bilinear(simd, texture, uv, same),
            };
            let (mask, before) = (mask_of(simd, same), Vec3x16::load(simd, &self.0[block]));
            Vec3x16(three!(i => select(mask, color.0[i], before.0[i]))).store(&mut self.0[block]);
        }
    }
}

impl Surfaces {
    /// The diffuse colours of a block with its textures.
    #[inline(always)]
    pub(super) fn textured<S: Simd>(&self, simd: S, block: usize, diffuse: Vec3x16<S>) -> Vec3x16<S> {
        match &self.texels {
            None => diffuse,
            Some(texels) => diffuse.mul(Vec3x16::load(simd, &texels.0[block])),
        }
    }
}

/// Where a coordinate lies in a picture that repeats once a unit: in texels, from 0 up to `size`, which rounding may reach.
#[inline(always)]
fn position<S: Simd>(coordinate: f32x16<S>, size: f32x16<S>) -> f32x16<S> {
    (coordinate - coordinate.floor()) * size
}

/// The texel that each point lies in.
#[inline(always)]
fn nearest<S: Simd>(simd: S, texture: &Texture, [u, v]: [f32x16<S>; 2], lanes: u32) -> Vec3x16<S> {
    let [width, height] = [texture.width(), texture.height()];
    let x = position(u, splat(simd, width as f32)).to_array();
    let y = position(v, splat(simd, height as f32)).to_array();
    let decoded = srgb::decoded();
    let mut color = [Lanes::ZERO; 3];
    for lane in each_bit(lanes) {
        // The conversion rounds down, and takes NaN for 0.
        let texel = texture.texel((x[lane] as u32).min(width - 1), (y[lane] as u32).min(height - 1));
        for channel in 0..3 {
            color[channel].0[lane] = decoded[usize::from(texel[channel])];
        }
    }
    Vec3x16::load(simd, &color)
}

/// The two texels around a position along one axis, and the weight of the second.
struct Pair<S: Simd> {
    first: [f32; LANES],
    second: [f32; LANES],
    weight: f32x16<S>,
}

impl<S: Simd> Pair<S> {
    /// Texel centres lie at half numbers; the first and the last texel are neighbours.
    #[inline(always)]
    fn around(simd: S, position: f32x16<S>, size: f32x16<S>) -> Self {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let from_center = position - splat(simd, 0.5);
        let first = from_center.floor();
        let next = first + one;
        Self {
            first: select(first.simd_lt(zero), size - one, first).to_array(),
            second: select(next.simd_lt(size), next, zero).to_array(),
            weight: from_center - first,
        }
    }
}

/// The four texels around each point, weighted by nearness.
#[inline(always)]
fn bilinear<S: Simd>(simd: S, texture: &Texture, [u, v]: [f32x16<S>; 2], lanes: u32) -> Vec3x16<S> {
    let [width, height] = [splat(simd, texture.width() as f32), splat(simd, texture.height() as f32)];
    let columns = Pair::around(simd, position(u, width), width);
    let rows = Pair::around(simd, position(v, height), height);
    let decoded = srgb::decoded();
    let mut colors = [[Lanes::ZERO; 3]; 4];
    for lane in each_bit(lanes) {
        let [x0, x1] = [columns.first[lane] as u32, columns.second[lane] as u32];
        let [y0, y1] = [rows.first[lane] as u32, rows.second[lane] as u32];
        for (corner, (x, y)) in [(x0, y0), (x1, y0), (x0, y1), (x1, y1)].into_iter().enumerate() {
            let texel = texture.texel(x, y);
            for channel in 0..3 {
                colors[corner][channel].0[lane] = decoded[usize::from(texel[channel])];
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
