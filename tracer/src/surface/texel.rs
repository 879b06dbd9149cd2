//! Textures at surface points: the place of a point in the texture, and the texels around it, in linear light.
//!
//! Coordinates and weights are computed in lanes with plain operations; texels are fetched lane by lane. The result is a factor
//! of the diffuse colour or of the emission, found once a point for all lights.

use glam::Vec2;

use super::Surfaces;
use super::group::barycentric_mean;
use crate::frame::PreparedFrame;
use crate::mesh::CompiledMesh;
use crate::rays::{BLOCKS, TileColors};
use crate::scene::{Filter, Tiling, Wrap};
use crate::simd::vector::Vec3x16;
use crate::simd::{
    Indices, LANES, Lanes, Simd, SimdBase, SimdFloat, dispatch, each_bit, f32x16, mask_of, select, splat,
    three,
};
use crate::srgb;
use crate::texture::Texture;

/// Texture coordinates at the corners of sixteen triangles, indexed `[corner][u or v]`.
pub(super) struct CornerUvs {
    corners: [[Lanes; 2]; 3],
    /// Whole repeats, to be added for textures whose tiling distinguishes them.
    repeats: Option<[Lanes; 2]>,
}

/// Texture coordinates of sixteen points.
pub(super) struct PointUvs {
    near: [Lanes; 2],
    /// See [`CornerUvs`].
    repeats: Option<[Lanes; 2]>,
}

impl CornerUvs {
    /// One triangle in all lanes.
    pub(super) fn splat(uvs: [Vec2; 3]) -> Self {
        Self { corners: uvs.map(|uv| uv.to_array().map(|c| Lanes([c; LANES]))), repeats: None }
    }

    /// Those of the triangles that lanes hit.
    #[inline(always)]
    pub(super) fn gather(mesh: &CompiledMesh, triangles: &[u32; LANES], lanes: u32) -> Self {
        let all = mesh.uvs();
        let mut uvs = [[Lanes::ZERO; 2]; 3];
        for lane in each_bit(lanes) {
            // `CompiledScene::new` checks that a mesh under a texture has them.
            let corners = all.get(triangles[lane] as usize).copied().unwrap_or_default();
            for (uvs, corner) in uvs.iter_mut().zip(corners) {
                uvs[0].0[lane] = corner.x;
                uvs[1].0[lane] = corner.y;
            }
        }
        let repeats = (!mesh.uv_repeats().is_empty()).then(|| gather_repeats(mesh, triangles, lanes));
        Self { corners: uvs, repeats }
    }

    /// Interpolates between the corners: `weights` are those of the second and the third.
    #[inline(always)]
    pub(super) fn at<S: Simd>(&self, simd: S, weights: [f32x16<S>; 2]) -> PointUvs {
        let [a, b, c] = &self.corners;
        let mut near = [Lanes::ZERO; 2];
        for axis in 0..2 {
            near[axis].store(barycentric_mean(simd, [&a[axis], &b[axis], &c[axis]], weights));
        }
        PointUvs { near, repeats: self.repeats }
    }
}

#[inline(never)]
fn gather_repeats(mesh: &CompiledMesh, triangles: &[u32; LANES], lanes: u32) -> [Lanes; 2] {
    let mut repeats = [Lanes::ZERO; 2];
    for lane in each_bit(lanes) {
        let whole = mesh.whole_repeats(triangles[lane]);
        repeats[0].0[lane] = whole.x;
        repeats[1].0[lane] = whole.y;
    }
    repeats
}

/// Factors of the diffuse colours and the emission of a tile; 1 without a texture.
pub(super) struct Texels {
    diffuse: TileColors,
    /// Only in scenes with emissive materials.
    emission: Option<Box<TileColors>>,
}

const WHITE: [Lanes; 3] = [Lanes([1.0; LANES]); 3];

impl Texels {
    /// Factors for a scene; `None` if it has neither textures nor vertex colours.
    pub(super) fn for_scene(frame: &PreparedFrame) -> Option<Box<Self>> {
        let features = &frame.features;
        (features.textured || features.vertex_colors).then(|| {
            let emission = features.emissive.then(|| Box::new([WHITE; BLOCKS]));
            Box::new(Self { diffuse: [WHITE; BLOCKS], emission })
        })
    }

    /// Resets a block to no textures.
    pub(super) fn clear(&mut self, block: usize) {
        self.diffuse[block] = WHITE;
        if let Some(emission) = &mut self.emission {
            emission[block] = WHITE;
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
            if let Some(map) = material.texture {
                look_up(simd, frame, map, uv, same, &mut self.diffuse[block]);
            }
            if let (Some(map), Some(emission)) = (material.emission_texture, &mut self.emission) {
                look_up(simd, frame, map, uv, same, &mut emission[block]);
            }
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
    let uv = uv.laid(simd, &map.tiling);
    let color = match frame.view().quality.filter.unwrap_or(map.filter) {
        Filter::Nearest => nearest(simd, texture, map.tiling.wrap, uv, lanes),
        Filter::Bilinear | Filter::Trilinear => bilinear(simd, texture, map.tiling.wrap, uv, lanes),
    };
    let (mask, before) = (mask_of(simd, lanes), Vec3x16::load(simd, colors));
    Vec3x16(three!(i => select(mask, color.0[i], before.0[i]))).store(colors);
}

impl PointUvs {
    /// Coordinates with the scale and the offset of a texture's tiling.
    #[inline(always)]
    fn laid<S: Simd>(&self, simd: S, tiling: &Tiling) -> [f32x16<S>; 2] {
        let [u, v] = [self.near[0].load(simd), self.near[1].load(simd)];
        if *tiling == Tiling::default() {
            return [u, v];
        }
        let [u, v] = match &self.repeats {
            Some(repeats) if tiling.distinguishes_repeats() => {
                [u + repeats[0].load(simd), v + repeats[1].load(simd)]
            }
            _ => [u, v],
        };
        let Tiling { scale, offset, .. } = tiling;
        [u * splat(simd, scale.x) + splat(simd, offset.x), v * splat(simd, scale.y) + splat(simd, offset.y)]
    }
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
}

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

/// The texel that contains each point.
#[inline(always)]
fn nearest<S: Simd>(
    simd: S,
    texture: &Texture,
    wrap: Wrap,
    [u, v]: [f32x16<S>; 2],
    lanes: u32,
) -> Vec3x16<S> {
    let [width, height] = [texture.width(), texture.height()];
    let x = position(simd, wrap, u, splat(simd, width as f32)).to_array();
    let y = position(simd, wrap, v, splat(simd, height as f32)).to_array();
    let decoded = srgb::decoded();
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

/// The two texels around a position along one axis, and the weight of the second.
struct Pair<S: Simd> {
    first: [f32; LANES],
    second: [f32; LANES],
    weight: f32x16<S>,
}

impl<S: Simd> Pair<S> {
    /// The pair around a position. Texel centres are at whole numbers plus a half; of a repeated texture the first and the last
    /// texel are neighbours.
    #[inline(always)]
    fn around(simd: S, wrap: Wrap, position: f32x16<S>, size: f32x16<S>) -> Self {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let from_center = position - splat(simd, 0.5);
        let first = from_center.floor();
        let next = first + one;
        let last = size - one;
        let (before, behind) = if wrap == Wrap::Repeat { (last, zero) } else { (zero, last) };
        Self {
            first: select(first.simd_lt(zero), before, first).to_array(),
            second: select(next.simd_lt(size), next, behind).to_array(),
            weight: from_center - first,
        }
    }
}

/// The four texels around each point, weighted by nearness.
#[inline(always)]
fn bilinear<S: Simd>(
    simd: S,
    texture: &Texture,
    wrap: Wrap,
    [u, v]: [f32x16<S>; 2],
    lanes: u32,
) -> Vec3x16<S> {
    let [width, height] = [splat(simd, texture.width() as f32), splat(simd, texture.height() as f32)];
    let columns = Pair::around(simd, wrap, position(simd, wrap, u, width), width);
    let rows = Pair::around(simd, wrap, position(simd, wrap, v, height), height);
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
