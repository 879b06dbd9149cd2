//! Facets: flat triangles that rays of a tile hit.
//!
//! All rays that hit a flat triangle share its plane, normal and material. These are found once a tile, for sixteen triangles
//! at a time, so that each ray only intersects a plane: n.(t d) = p.

use super::Surfaces;
use super::group::Group;
use super::space::{Space, space_of};
use crate::bvh::WIDTH;
use crate::compile::Item;
use crate::rays::{BLOCKS, LocalRays, NO_ITEM, SurfaceSource};
use crate::simd::math::to_unit;
use crate::simd::vector::Vec3x16;
use crate::simd::{
    Indices, LANES, Lanes, Simd, SimdBase, SimdFloat, bits, each_bit, mask_of, select, splat, three,
};

/// The flat triangles that rays of a tile hit.
pub(super) struct Facets {
    batches: Vec<Batch>,
    /// Rays of each facet, block by block.
    views: Vec<View>,
    /// Start of the views of each block, and end of those of the last one.
    first_view: [usize; BLOCKS + 1],
    /// Cache of recent triangles, by some bits of their index. A triangle that is evicted becomes two facets.
    recent: [Recent; RECENT],
}

/// Entries of the cache: a power of two.
const RECENT: usize = 64;

/// Up to sixteen triangles of one item.
struct Batch {
    item: u32,
    count: usize,
    triangles: [u32; LANES],
    materials: [u32; LANES],
    /// Unit normals in eye space, on either side.
    normal: [Lanes; 3],
    /// Distances of their planes from the origin along the normals.
    distance: Lanes,
    /// Largest coordinate that placed the item.
    reach: f32,
}

/// The rays of a block that hit one facet.
#[derive(Clone, Copy)]
struct View {
    lanes: u32,
    batch: u32,
    lane: u32,
}

#[derive(Clone, Copy)]
struct Recent {
    item: u32,
    triangle: u32,
    batch: u32,
    lane: u32,
}

impl Recent {
    const NONE: Recent = Recent { item: NO_ITEM, triangle: 0, batch: 0, lane: 0 };
}

impl Batch {
    fn new(item: u32) -> Self {
        Self {
            item,
            count: 0,
            triangles: [0; LANES],
            materials: [0; LANES],
            normal: [Lanes::ZERO; 3],
            distance: Lanes::ZERO,
            reach: 0.0,
        }
    }
}

impl Facets {
    /// No facets.
    pub(super) fn new() -> Self {
        Self {
            batches: Vec::new(),
            views: Vec::new(),
            first_view: [0; BLOCKS + 1],
            recent: [Recent::NONE; RECENT],
        }
    }

    /// Removes all facets.
    pub(super) fn clear(&mut self) {
        self.batches.clear();
        self.views.clear();
        self.recent = [Recent::NONE; RECENT];
    }

    /// Starts the views of a block.
    pub(super) fn begin_block(&mut self, block: usize) {
        self.first_view[block] = self.views.len();
        self.first_view[block + 1] = self.views.len();
    }

    /// Adds the triangles of an item that some rays of a block hit; triangle i has material `material_of(i)`.
    #[inline(always)]
    pub(super) fn add<S: Simd>(
        &mut self,
        simd: S,
        block: usize,
        item: u32,
        lanes: u32,
        triangles: &Indices,
        material_of: impl Fn(u32) -> u32,
    ) {
        let mut rest = lanes;
        while rest != 0 {
            let triangle = triangles.0[rest.trailing_zeros() as usize];
            let same = rest & triangles.equal(simd, triangle);
            rest &= !same;
            let recent = &mut self.recent[triangle as usize % RECENT];
            if recent.item != item || recent.triangle != triangle {
                if self.batches.last().is_none_or(|batch| batch.item != item || batch.count == LANES) {
                    self.batches.push(Batch::new(item));
                }
                let index = self.batches.len() - 1;
                let batch = &mut self.batches[index];
                let lane = batch.count;
                batch.triangles[lane] = triangle;
                batch.materials[lane] = material_of(triangle);
                batch.count += 1;
                *recent = Recent { item, triangle, batch: index as u32, lane: lane as u32 };
            }
            self.views.push(View { lanes: same, batch: recent.batch, lane: recent.lane });
        }
        self.first_view[block + 1] = self.views.len();
    }

    /// Finds the planes of all facets, for rays with a common origin.
    #[inline(always)]
    pub(super) fn find_planes<S: Simd, R: SurfaceSource>(&mut self, simd: S, rays: &R) {
        let mut kept = None;
        for batch in &mut self.batches {
            batch.find_planes(simd, rays, &mut kept);
        }
    }
}

impl Surfaces {
    /// Sets the points of the rays of a block that hit facets.
    #[inline(always)]
    pub(super) fn put_facets<S: Simd, R: SurfaceSource>(
        &mut self,
        simd: S,
        rays: &R,
        block: usize,
        direction: Vec3x16<S>,
    ) {
        let (facets, surface) = (&self.facets, &mut self.blocks[block]);
        let views = &facets.views[facets.first_view[block]..facets.first_view[block + 1]];
        if views.is_empty() {
            return;
        }
        let frame = rays.frame();
        let zero = splat(simd, 0.0);
        let (mut normal, mut distance, mut reach) = (Vec3x16([zero; 3]), zero, zero);
        let mut lanes = 0;
        for &View { lanes: hitting, batch, lane } in views {
            let (batch, lane) = (&facets.batches[batch as usize], lane as usize % LANES);
            let mask = mask_of(simd, hitting);
            for axis in 0..3 {
                let component = splat(simd, batch.normal[axis].0[lane]);
                normal.0[axis] = select(mask, component, normal.0[axis]);
            }
            distance = select(mask, splat(simd, batch.distance.0[lane]), distance);
            reach = select(mask, splat(simd, batch.reach), reach);
            surface.material.put(simd, mask, batch.materials[lane]);
            lanes |= hitting;
        }
        let group = Group { rays, block, lanes, alone: lanes == surface.hit, direction };
        let along = normal.dot(direction);
        let point = direction.scale(distance / along);
        let ng = normal.scale(splat(simd, 1.0).copysign(-along));
        let bias = surface.put_plane(simd, &group, point, ng, reach);
        if frame.features.shaded_normals() {
            group.put(simd, ng, &mut surface.ns);
        }
        if frame.features.emissive {
            surface.set_front(lanes, bits(along.simd_lt(zero)));
        }
        let sound = bias.simd_le(splat(simd, f32::MAX)) & along.abs().simd_le(splat(simd, f32::MAX));
        let unsound = lanes & !bits(sound);
        if unsound != 0 {
            self.repair_facets(rays, block, unsound);
        }
    }

    #[inline(never)]
    fn repair_facets<R: SurfaceSource>(&mut self, rays: &R, block: usize, unsound: u32) {
        let (facets, surface) = (&self.facets, &mut self.blocks[block]);
        for &View { lanes, batch, lane } in
            &facets.views[facets.first_view[block]..facets.first_view[block + 1]]
        {
            let batch = &facets.batches[batch as usize];
            for ray in each_bit(lanes & unsound) {
                surface.repair(rays, block, ray, batch.item, batch.triangles[lane as usize % LANES]);
            }
        }
    }
}

impl Batch {
    #[inline(always)]
    fn find_planes<S: Simd, R: SurfaceSource>(
        &mut self,
        simd: S,
        rays: &R,
        kept: &mut Option<(u32, Space<R>)>,
    ) {
        let frame = rays.frame();
        let zero = splat(simd, 0.0);
        let mut corners = [Vec3x16([zero; 3]); 3];
        let space = match frame.items.get(self.item) {
            Item::Model(index) => {
                let instance = &frame.instances[index];
                let leaves = instance.mesh.blocks();
                for lane in 0..self.count {
                    let triangle = self.triangles[lane] as usize;
                    let leaf = &leaves[triangle / WIDTH];
                    let mask = mask_of(simd, 1 << lane);
                    for k in 0..3 {
                        for axis in 0..3 {
                            let coordinate = splat(simd, leaf.0[k][axis].0[triangle % WIDTH]);
                            corners[k].0[axis] = select(mask, coordinate, corners[k].0[axis]);
                        }
                    }
                }
                space_of(kept, self.item, || Space::of_instance(rays, instance))
            }
            Item::Triangle(index) => {
                let of_scene = frame.triangles[index].corners;
                corners = three!(k => Vec3x16::splat(simd, of_scene[k].as_vec3().to_array()));
                space_of(kept, self.item, || Space::of_eye(rays))
            }
            // Spheres have no facets.
            Item::Sphere(_) | Item::Disk(_) => return,
        };
        let [a, b, c] = corners;
        let to_a = a.sub(space.rays.origins(simd, rays, 0));
        let normal = b.sub(a).cross(c.sub(a));
        let normal = normal.scale(to_unit(simd, normal.size()));
        // n.d is the same in eye space and in mesh space, up to the scale of the normal.
        let eye_normal = normal.transform(simd, &space.normals);
        let inverse = splat(simd, 1.0) / eye_normal.dot(eye_normal).sqrt();
        eye_normal.scale(inverse).store(&mut self.normal);
        self.distance.store(normal.dot(to_a) * splat(simd, space.normals_scale) * inverse);
        self.reach = space.reach;
    }
}
