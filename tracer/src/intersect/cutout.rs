//! Alpha cut-outs: holes where the alpha of a material's texture is below one half, for all rays.
//!
//! The test is `f64` with plain operations, at the point of the exact hit. A filter may reject a triangle with cut-outs, but
//! never accept it: so all levels of SIMD, all tiles and all single rays have the same holes.

use glam::{DVec2, DVec3, Vec2};

use crate::bvh::WIDTH;
use crate::compile::Item;
use crate::frame::PreparedFrame;
use crate::rays::{PrimitiveId, Ray};
use crate::scene::{Filter, Wrap};
use crate::texture::{LEAST_ALPHA, Texture};

/// The bits of a single triangle with a cut-out.
const SINGLE: [u16; 1] = [1];

/// The bits of the block of sixteen triangles that starts at `first`.
#[inline(always)]
pub(crate) fn bits_at(cutouts: &[u16], first: u32) -> u32 {
    cutouts.get(first as usize / WIDTH).map_or(0, |&bits| u32::from(bits))
}

impl PreparedFrame {
    /// Bits of the triangles of an item that alpha cuts out, in blocks of sixteen; empty if there are none.
    pub(crate) fn cutouts_of(&self, item: u32) -> &[u16] {
        if item >= self.items.first_plane() {
            return &[];
        }
        match self.items.get(item) {
            Item::Model(index) => &self.instances[index].cutouts,
            Item::Triangle(index) if self.triangles[index].cut => &SINGLE,
            Item::Triangle(_) | Item::Sphere(_) | Item::Disk(_) => &[],
        }
    }

    /// Whether a triangle with a cut-out is opaque where a ray hits it at `t`. Ray and corners are in the same space.
    #[cold]
    #[inline(never)]
    pub(crate) fn is_opaque(&self, primitive: PrimitiveId, ray: &Ray, corners: &[DVec3; 3], t: f64) -> bool {
        let PrimitiveId { item, triangle } = primitive;
        let scene = self.scene();
        let (material, uvs, repeats) = match self.items.get(item) {
            Item::Model(index) => {
                let mesh = &self.instances[index].mesh;
                let material = scene.models[index].materials[usize::from(mesh.slot(triangle))];
                (material, mesh.corner_uvs(triangle), mesh.whole_repeats(triangle))
            }
            Item::Triangle(index) => {
                (scene.triangles[index].material, scene.triangles[index].uvs, Vec2::ZERO)
            }
            Item::Sphere(_) | Item::Disk(_) => return true,
        };
        let (Some(map), Some(uvs)) = (scene.materials[material as usize].cutout, uvs) else { return true };
        let (texture, map) = &self.textures()[map as usize];
        let uv = at_point(&uvs, corners, ray.origin + ray.direction * t) + repeats.as_dvec2();
        let filter = self.view().quality.filter.unwrap_or(map.filter);
        alpha(texture, filter, map.tiling.wrap, map.tiling.place(uv)) >= f64::from(LEAST_ALPHA) - 0.5
    }
}

/// Texture coordinates at a point of a triangle, by barycentric weights.
fn at_point(uvs: &[Vec2; 3], &[a, b, c]: &[DVec3; 3], point: DVec3) -> DVec2 {
    let (ab, ac, at) = (b - a, c - a, point - a);
    let full = ab.cross(ac);
    let whole = full.dot(full);
    let u = (at.cross(ac).dot(full) / whole).clamp(0.0, 1.0);
    let v = (ab.cross(at).dot(full) / whole).clamp(0.0, 1.0 - u);
    let [a, b, c] = uvs.map(Vec2::as_dvec2);
    a * (1.0 - u - v) + b * u + c * v
}

/// Alpha from 0 to 255 at a place of the texture, both coordinates from 0 to 1.
fn alpha(texture: &Texture, filter: Filter, wrap: Wrap, place: DVec2) -> f64 {
    let [width, height] = [texture.width(), texture.height()];
    let (x, y) = (place.x * f64::from(width), place.y * f64::from(height));
    match filter {
        // The conversion rounds down, and maps NaN to 0.
        Filter::Nearest => f64::from(texture.alpha((x as u32).min(width - 1), (y as u32).min(height - 1))),
        Filter::Bilinear | Filter::Trilinear => {
            let (columns, right) = pair(x, width, wrap);
            let (rows, up) = pair(y, height, wrap);
            let row = |y: u32| {
                let [left, next] = columns.map(|x| f64::from(texture.alpha(x, y)));
                left * (1.0 - right) + next * right
            };
            row(rows[0]) * (1.0 - up) + row(rows[1]) * up
        }
    }
}

/// The two texels around a position along one axis, and the weight of the second.
fn pair(position: f64, size: u32, wrap: Wrap) -> ([u32; 2], f64) {
    let from_center = position - 0.5;
    let first = from_center.floor();
    let texel = |index: f64| match wrap {
        Wrap::Repeat => index.rem_euclid(f64::from(size)) as u32,
        Wrap::Clamp | Wrap::Mirror => (index as u32).min(size - 1),
    };
    ([texel(first), texel(first + 1.0)], from_center - first)
}
