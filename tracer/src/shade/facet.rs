//! Flat triangles as a tile sees them.
//!
//! All rays that see a flat triangle share its plane, normal and material. So these are found once a tile, for sixteen
//! triangles at a time, and a ray has only to meet a plane: n.(t d) = p.

use super::group::Group;
use super::space::{Space, space_of};
use super::surface::Surfaces;
use crate::bvh::WIDTH;
use crate::compile::Item;
use crate::simd::math::to_unit;
use crate::simd::vector::Vec3x16;
use crate::simd::{
    Indices, LANES, Lanes, Simd, SimdBase, SimdFloat, bits, each_bit, mask_of, select, splat, three,
};
use crate::tile::BLOCKS;
use crate::tile::visible::{EyeTile, NOTHING};

/// The flat triangles that a tile sees.
pub(super) struct Facets {
    batches: Vec<Batch>,
    /// Who sees which, block by block.
    views: Vec<View>,
    /// Where the views of each block begin, and where those of the last one end.
    first_view: [usize; BLOCKS + 1],
    /// Where triangles were put lately, by some bits of their index. One that is forgotten is put twice.
    recent: [Recent; RECENT],
}

/// Entries that are remembered: a power of two.
const RECENT: usize = 64;

/// Up to sixteen triangles of one item.
struct Batch {
    item: u32,
    count: usize,
    triangles: [u32; LANES],
    materials: [u32; LANES],
    /// Unit normals in eye space, on either side.
    normal: [Lanes; 3],
    /// Distances of their planes from the eye along the normals.
    distance: Lanes,
    /// Largest coordinate that placed the item.
    reach: f32,
}

/// Rays of a block that see one triangle.
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
    const NONE: Recent = Recent { item: NOTHING, triangle: 0, batch: 0, lane: 0 };
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
    pub(super) fn new() -> Self {
        Self {
            batches: Vec::new(),
            views: Vec::new(),
            first_view: [0; BLOCKS + 1],
            recent: [Recent::NONE; RECENT],
        }
    }

    /// Nothing seen yet.
    pub(super) fn clear(&mut self) {
        self.batches.clear();
        self.views.clear();
        self.recent = [Recent::NONE; RECENT];
    }

    /// Views that are added from now on are those of this block.
    pub(super) fn begin_block(&mut self, block: usize) {
        self.first_view[block] = self.views.len();
        self.first_view[block + 1] = self.views.len();
    }

    /// Some rays of a block see triangles of an item, whose triangle i has material `material_of(i)`.
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

    /// Finds the planes.
    #[inline(always)]
    pub(super) fn find_planes<S: Simd>(&mut self, simd: S, tile: &EyeTile<'_>) {
        let mut kept = None;
        for batch in &mut self.batches {
            batch.find_planes(simd, tile, &mut kept);
        }
    }

    /// Where the rays of a block meet the planes that they see.
    #[inline(always)]
    pub(super) fn fill<S: Simd>(
        &self,
        simd: S,
        tile: &EyeTile<'_>,
        block: usize,
        direction: Vec3x16<S>,
        surfaces: &mut Surfaces,
    ) {
        let views = &self.views[self.first_view[block]..self.first_view[block + 1]];
        if views.is_empty() {
            return;
        }
        let zero = splat(simd, 0.0);
        let (mut normal, mut distance, mut reach) = (Vec3x16([zero; 3]), zero, zero);
        let mut lanes = 0;
        for &View { lanes: seeing, batch, lane } in views {
            let (batch, lane) = (&self.batches[batch as usize], lane as usize % LANES);
            let mask = mask_of(simd, seeing);
            for axis in 0..3 {
                let component = splat(simd, batch.normal[axis].0[lane]);
                normal.0[axis] = select(mask, component, normal.0[axis]);
            }
            distance = select(mask, splat(simd, batch.distance.0[lane]), distance);
            reach = select(mask, splat(simd, batch.reach), reach);
            surfaces.material[block].put(simd, mask, batch.materials[lane]);
            lanes |= seeing;
        }
        let group = Group { tile, block, lanes, alone: lanes == surfaces.hit[block], direction };
        let along = normal.dot(direction);
        let point = direction.scale(distance / along);
        let ng = normal.scale(splat(simd, 1.0).copysign(-along));
        let lift = surfaces.put_plane(simd, &group, point, ng, reach);
        if tile.frame.features.smooth {
            group.keep(simd, ng, &mut surfaces.ns[block]);
        }
        if tile.frame.features.emissive {
            surfaces.face(block, lanes, bits(along.simd_lt(zero)));
        }
        let sound = lift.simd_le(splat(simd, f32::MAX)) & along.abs().simd_le(splat(simd, f32::MAX));
        let unsound = lanes & !bits(sound);
        if unsound != 0 {
            self.repair(tile, block, unsound, surfaces);
        }
    }

    #[inline(never)]
    fn repair(&self, tile: &EyeTile<'_>, block: usize, unsound: u32, surfaces: &mut Surfaces) {
        for &View { lanes, batch, lane } in &self.views[self.first_view[block]..self.first_view[block + 1]] {
            let batch = &self.batches[batch as usize];
            for ray in each_bit(lanes & unsound) {
                surfaces.repair(tile, block, ray, batch.item, batch.triangles[lane as usize % LANES]);
            }
        }
    }
}

impl Batch {
    #[inline(always)]
    fn find_planes<S: Simd>(&mut self, simd: S, tile: &EyeTile<'_>, kept: &mut Option<(u32, Space)>) {
        let frame = tile.frame;
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
                space_of(kept, self.item, || Space::of_instance(tile, instance))
            }
            Item::Triangle(index) => {
                let of_scene = frame.triangles[index].corners;
                corners = three!(k => Vec3x16::splat(simd, of_scene[k].as_vec3().to_array()));
                space_of(kept, self.item, || Space::of_eye(tile))
            }
            // Has no facets.
            Item::Sphere(_) => return,
        };
        let [a, b, c] = corners;
        let to_a = a.sub(Vec3x16::splat(simd, space.origin));
        let normal = b.sub(a).cross(c.sub(a));
        let normal = normal.scale(to_unit(simd, normal.size()));
        // The plane's normal in eye space meets a ray there as the normal in mesh space meets it here.
        let eye_normal = normal.transform(simd, &space.normals);
        let inverse = splat(simd, 1.0) / eye_normal.dot(eye_normal).sqrt();
        eye_normal.scale(inverse).store(&mut self.normal);
        self.distance.store(normal.dot(to_a) * splat(simd, space.normals_scale) * inverse);
        self.reach = space.reach;
    }
}
