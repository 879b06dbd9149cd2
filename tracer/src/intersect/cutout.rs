//! Alpha cut-outs: holes where the alpha of a material's texture is below one half, for all rays.
//!
//! The test is `f64` with plain operations, at the point of the exact hit. A filter may reject a triangle with cut-outs, but
//! never accept it: so all levels of SIMD, all tiles and all single rays have the same holes.

use glam::{DVec2, DVec3, Vec2};

use crate::bvh::WIDTH;
use crate::compile::Item;
use crate::frame::PreparedFrame;
use crate::rays::{PrimitiveId, Ray};
use crate::texture::LEAST_ALPHA;

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
        let of_texel = |x, y| [f64::from(texture.alpha(x, y))];
        let [alpha] = texture.filtered(filter, map.tiling.wrap, map.tiling.place(uv), of_texel);
        alpha >= f64::from(LEAST_ALPHA) - 0.5
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
