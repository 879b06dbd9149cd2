//! Surface points: point, normals, material and texture colours at the hits of blocks of rays.
//!
//! ```text
//!   facet          flat triangles of a tile: their planes are found once a tile, sixteen at a time
//!   triangles      triangles with interpolated normals, texture coordinates or vertex colours, and those of rays without
//!                  a common origin
//!   exact          spheres, planes, and triangles too thin for f32, ray by ray in f64
//!   space          the rays in the space of a mesh
//!   group          the lanes of a block that hit one item
//!   terminator     origins of shadow rays on smooth surfaces
//!   uv             texture coordinates
//!   texel          factors of colours by textures, vertex colours and patterns, of roughness and metal by textures
//!   filter         texels around a point
//!   footprint      how much of a texture a sample shows
//!   vertex_color   vertex colours
//!   detail         patterns, normal maps, textures of spheres and planes, ray by ray in f64
//!   place          points in the spaces of objects, the world and textures
//!   pattern        cubes and squares in two colours
//!   normal_map     shading normals tilted by textures
//!   material       colours and exponents of the materials
//!   of_batch       the points of a batch of rays
//!   moved          points of objects that move
//! ```

mod detail;
mod exact;
mod facet;
mod filter;
mod footprint;
mod group;
mod material;
mod moved;
mod normal_map;
mod of_batch;
mod pattern;
mod place;
mod space;
mod terminator;
#[cfg(test)]
mod tests;
mod texel;
mod triangles;
mod uv;
mod vertex_color;

use crate::compile::Item;
use crate::frame::PreparedFrame;
use crate::mesh::CompiledMesh;
use crate::rays::{BLOCKS, HitBlock, SurfaceSource};
use crate::simd::vector::Vec3x16;
use crate::simd::{Indices, Lanes, Simd, SimdFloat, each_bit, f32x16, mask_of, splat};
use facet::Facets;
use footprint::Cone;
use group::Group;
pub(crate) use material::Materials;
use normal_map::Untilted;
use space::Space;
use terminator::Lifts;
use texel::Texels;

/// Distance of the origin of a shadow ray from its surface, relative to the largest coordinates that went into the point: four
/// times the error of a point after a dozen `f32` operations.
const SHADOW_BIAS: f32 = 1.0 / (1 << 20) as f32;

/// Surface points of sixteen rays, lane by lane. Lanes without a hit are undefined.
#[derive(Clone)]
pub(crate) struct SurfaceBlock {
    /// Bits of the lanes that hit something.
    pub hit: u32,
    /// Bits of the hits that lights reach: not those of unlit materials.
    pub lit: u32,
    /// Bits of the lanes that hit the front side. Only set if a material of the scene emits light.
    pub front: u32,
    /// Points in eye space.
    pub point: [Lanes; 3],
    /// Geometric unit normals on the viewer's side.
    pub ng: [Lanes; 3],
    /// Shading unit normals, on the same side as `ng`. Only set if a model of the scene is smooth or a material has a normal map: else
    /// they equal `ng`.
    pub ns: [Lanes; 3],
    /// Unit vectors to the viewer. Only set if a material of the scene is specular.
    pub to_viewer: [Lanes; 3],
    /// Distances of the origins of shadow rays from the surface, along `ng`.
    pub bias: Lanes,
    /// Indices of the scene's materials; in blocks with a hit, lanes without one repeat one of the others.
    pub material: Indices,
}

impl SurfaceBlock {
    const EMPTY: SurfaceBlock = SurfaceBlock {
        hit: 0,
        lit: 0,
        front: 0,
        point: [Lanes::ZERO; 3],
        ng: [Lanes::ZERO; 3],
        ns: [Lanes::ZERO; 3],
        to_viewer: [Lanes::ZERO; 3],
        bias: Lanes::ZERO,
        material: Indices::ZERO,
    };

    /// Sets which of some lanes hit the front side.
    #[inline(always)]
    fn set_front(&mut self, lanes: u32, front: u32) {
        self.front = (self.front & !lanes) | (front & lanes);
    }

    /// Sets points on planes with their normals; `reach` is the largest coordinate that placed the plane. Returns the bias of
    /// shadow rays.
    #[inline(always)]
    fn put_plane<S: Simd, R: SurfaceSource>(
        &mut self,
        simd: S,
        group: &Group<'_, R, S>,
        point: Vec3x16<S>,
        ng: Vec3x16<S>,
        reach: f32x16<S>,
    ) -> f32x16<S> {
        let mut size = point.size() + reach;
        if !R::COMMON_ORIGIN {
            size += group.rays.origins(simd, group.block).size();
        }
        let bias = size * splat(simd, SHADOW_BIAS);
        group.put(simd, point, &mut self.point);
        group.put(simd, ng, &mut self.ng);
        group.put_one(simd, bias, &mut self.bias);
        bias
    }
}

/// Surface points of the blocks of a source of rays. Kept from tile to tile.
pub(crate) struct Surfaces {
    pub blocks: [SurfaceBlock; BLOCKS],
    /// Factors of colours by textures and vertex colours; only in scenes with either.
    texels: Option<Box<Texels>>,
    /// Only in frames with textures that are filtered by footprints.
    cone: Option<Cone>,
    /// Only in frames with shadows on interpolated normals.
    lifts: Option<Box<Lifts>>,
    /// Only in scenes with normal maps.
    untilted: Option<Box<Untilted>>,
    facets: Facets,
}

impl Surfaces {
    /// Surfaces for [`Surfaces::find`] to set. Inlined, and with the steps that may unwind first: they are built in place.
    #[inline(always)]
    pub(crate) fn empty(frame: &PreparedFrame) -> Self {
        let (texels, lifts) = (Texels::for_scene(frame), Lifts::for_frame(frame));
        let (cone, untilted) = (Cone::for_frame(frame), Untilted::for_frame(frame));
        let blocks = std::array::from_fn(|_| SurfaceBlock::EMPTY);
        Self { blocks, texels, cone, lifts, untilted, facets: Facets::new() }
    }

    /// Finds the surface points of the hits of a source's blocks.
    #[inline(always)]
    pub(crate) fn find<S: Simd, R: SurfaceSource>(&mut self, simd: S, rays: &R, hits: &[HitBlock]) {
        let hits = &hits[..R::BLOCKS];
        let frame = rays.frame();
        self.facets.clear();
        let mut space = None;
        for block in 0..R::BLOCKS {
            let mut rest = rays.live(block) & hits[block].hit(simd);
            self.blocks[block].hit = rest;
            self.blocks[block].lit = rest;
            self.facets.begin_block(block);
            if let Some(texels) = &mut self.texels {
                texels.clear(block);
            }
            if let Some(lifts) = &mut self.lifts {
                lifts.clear(block);
            }
            while rest != 0 {
                let item = hits[block].item.0[rest.trailing_zeros() as usize];
                let lanes = rest & hits[block].item.equal(simd, item);
                rest &= !lanes;
                if !(R::COMMON_ORIGIN && self.add_facets(simd, frame, block, item, lanes, &hits[block])) {
                    let alone = lanes == self.blocks[block].hit;
                    let direction = rays.directions(simd, block);
                    let group = Group { rays, block, lanes, alone, direction };
                    self.put_item(simd, &group, &hits[block], item, &mut space);
                }
            }
        }
        self.facets.find_planes(simd, rays);
        for block in 0..R::BLOCKS {
            if self.blocks[block].hit == 0 {
                continue;
            }
            let direction = rays.directions(simd, block);
            self.put_facets(simd, rays, block, direction);
            let surface = &mut self.blocks[block];
            if surface.hit != 0xffff {
                let material = surface.material.0[surface.hit.trailing_zeros() as usize];
                surface.material.put(simd, mask_of(simd, 0xffff & !surface.hit), material);
            }
            if frame.features.specular {
                let backwards = splat(simd, -1.0) / direction.dot(direction).sqrt();
                direction.scale(backwards).store(&mut surface.to_viewer);
            }
        }
        if frame.features.checkered || frame.features.normal_mapped {
            self.add_details(rays, hits);
        }
        if hits.iter().any(|hits| hits.coincident != 0) {
            self.raise_bias_of_coincident(frame, hits);
        }
    }

    /// Where surfaces coincide, shadow rays start clear of all of them: they are apart by at most twice the error of one, and
    /// the origin of the ray is off by as much again.
    #[cold]
    #[inline(never)]
    fn raise_bias_of_coincident(&mut self, frame: &PreparedFrame, hits: &[HitBlock]) {
        let least = (4.0 * frame.coarsest) as f32;
        for (surface, hits) in self.blocks.iter_mut().zip(hits) {
            for lane in each_bit(hits.coincident) {
                let bias = &mut surface.bias.0[lane];
                *bias = bias.max(least);
            }
        }
    }

    /// Adds the triangles that some lanes of a block hit to the facets; `false` if their item has more than flat normals and
    /// one colour a triangle.
    #[inline(always)]
    fn add_facets<S: Simd>(
        &mut self,
        simd: S,
        frame: &PreparedFrame,
        block: usize,
        item: u32,
        lanes: u32,
        hits: &HitBlock,
    ) -> bool {
        if item >= frame.items.first_plane() {
            return false;
        }
        let (facets, triangles) = (&mut self.facets, &hits.triangle);
        match frame.items.get(item) {
            Item::Model(index) if frame.instances[index].is_bare() => {
                let slots = &frame.scene().models[index].materials;
                let mesh = &frame.instances[index].mesh;
                facets.add(simd, block, item, lanes, triangles, |triangle| match slots.as_slice() {
                    &[slot] => slot,
                    _ => material_of(mesh, slots, triangle),
                });
                true
            }
            Item::Triangle(index) if frame.scene().triangles[index].uvs.is_none() => {
                let material = frame.scene().triangles[index].material;
                facets.add(simd, block, item, lanes, triangles, |_| material);
                true
            }
            Item::Model(_) | Item::Triangle(_) | Item::Sphere(_) | Item::Disk(_) => false,
        }
    }

    /// Sets the surface points of the lanes of a block that hit one item without facets. `space` is kept for the next block.
    #[inline(always)]
    fn put_item<S: Simd, R: SurfaceSource>(
        &mut self,
        simd: S,
        group: &Group<'_, R, S>,
        hits: &HitBlock,
        item: u32,
        space: &mut Option<(u32, Space<R>)>,
    ) {
        let frame = group.rays.frame();
        if item >= frame.items.first_plane() {
            let index = (item - frame.items.first_plane()) as usize;
            let (normal, material) = (frame.planes[index].normal, frame.scene().planes[index].material);
            self.blocks[group.block].put_analytic(group, item, (material, false), |_| normal);
            return self.texture_of(group, hits, material);
        }
        match frame.items.get(item) {
            Item::Sphere(index) => {
                let sphere = frame.spheres[index];
                let described = &frame.scene().spheres[index];
                let material = (described.material, described.inside_out);
                self.blocks[group.block].put_analytic(group, item, material, |point| sphere.normal(point));
                self.texture_of(group, hits, described.material);
            }
            Item::Disk(index) => {
                let (normal, material) =
                    (frame.disks[index].plane.normal, frame.scene().disks[index].material);
                self.blocks[group.block].put_analytic(group, item, (material, false), |_| normal);
            }
            Item::Triangle(index) => self.put_single_triangle(simd, group, hits, item, index, space),
            Item::Model(index) => self.put_model(simd, group, hits, item, index, space),
        }
    }

    /// Sets the texture factors of lanes that hit a sphere or a plane of a material.
    #[inline(always)]
    fn texture_of<S: Simd, R: SurfaceSource>(
        &mut self,
        group: &Group<'_, R, S>,
        hits: &HitBlock,
        material: u32,
    ) {
        let frame = group.rays.frame();
        let features = &frame.features;
        if !(features.textured || features.rough_textured) {
            return;
        }
        let material = &frame.scene().materials[material as usize];
        if material.texture.is_some() || material.emission_texture.is_some() || material.has_rough_texture() {
            let footprint = self.footprint(group, hits);
            self.texture_exactly(group.rays, (group.block, group.lanes), hits, footprint);
        }
    }
}

/// The material of a triangle of a mesh; `CompiledScene::new` checks that each slot has one.
fn material_of(mesh: &CompiledMesh, slots: &[u32], triangle: u32) -> u32 {
    slots[mesh.slot(triangle) as usize]
}
