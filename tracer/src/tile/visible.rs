//! What each ray of a tile sees first.

use glam::{DVec3, Vec3};

use super::cover::{Question, cover_flat, cover_mesh};
use super::lens::{Frustum, Lens, ROUNDING};
use super::setup::{At, Flat, at, flat_exact};
use super::walk::Interest;
use super::{BLOCKS, Rays, SIDE};
use crate::bvh::Child;
use crate::compile::Item;
use crate::frame::PreparedFrame;
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, bits, each_bit, mask_of, select, splat, three};
use crate::trace::{Hit, PrimitiveId, Ray};

/// No item: a ray that sees nothing.
pub(crate) const NOTHING: u32 = u32::MAX;

/// What the rays of a tile see.
pub(crate) struct Visible {
    /// Index of the item, or [`NOTHING`].
    pub item: [[u32; LANES]; BLOCKS],
    /// Index of the triangle in its mesh.
    pub triangle: [[u32; LANES]; BLOCKS],
    /// Closeness (1 / depth) of what is seen lies between these. Rays that do not count have infinity.
    low: [Lanes; BLOCKS],
    high: [Lanes; BLOCKS],
    /// Least of `low` in each block.
    least: Lanes,
    changed: u32,
}

impl Visible {
    /// Nothing seen yet; rays without their bit in `live` do not count.
    pub(crate) fn new(live: &[u32; BLOCKS]) -> Self {
        let start = live.map(|live| {
            Lanes(std::array::from_fn(|lane| if live >> lane & 1 == 1 { 0.0 } else { f32::INFINITY }))
        });
        Self {
            item: [[NOTHING; LANES]; BLOCKS],
            triangle: [[0; LANES]; BLOCKS],
            low: start,
            high: start,
            least: Lanes(live.map(|live| if live == 0 { f32::INFINITY } else { 0.0 })),
            changed: 0,
        }
    }

    fn see(&mut self, block: usize, lane: usize, hit: &Hit) {
        let closeness = (1.0 / hit.t) as f32;
        self.low[block].0[lane] = closeness * (1.0 - ROUNDING);
        self.high[block].0[lane] = closeness * (1.0 + ROUNDING);
        self.item[block][lane] = hit.primitive.item;
        self.triangle[block][lane] = hit.primitive.triangle;
        self.changed |= 1 << block;
    }
}

/// The rays of one tile of a frame.
pub(crate) struct EyeTile<'a> {
    pub frame: &'a PreparedFrame,
    pub rays: &'a Rays,
    /// From eye space.
    pub lens: Lens,
    /// Which rays count.
    pub live: [u32; BLOCKS],
    /// Column and row of sample (0, 0) of the tile.
    pub corner: (u32, u32),
    /// Direction through the tile's centre, and what a step right and a step down add.
    pub steps: [DVec3; 3],
    rounded_steps: [[f32; 3]; 3],
}

impl<'a> EyeTile<'a> {
    pub(crate) fn new(
        frame: &'a PreparedFrame,
        rays: &'a Rays,
        live: [u32; BLOCKS],
        corner: (u32, u32),
    ) -> Self {
        let half = SIDE as f64 / 2.0;
        let n = f64::from(frame.rays.grid());
        let (across, along) = ((f64::from(corner.0) + half) / n, (f64::from(corner.1) + half) / n);
        let [right, down] = frame.rays.steps();
        let steps = [frame.rays.through(across, along), right, down];
        let rounded_steps = steps.map(|step| step.as_vec3().to_array());
        Self { frame, rays, lens: frame.rays.lens(across, along), live, corner, steps, rounded_steps }
    }

    /// The ray of a lane, exactly.
    pub(crate) fn ray(&self, block: usize, lane: usize) -> Ray {
        let (column, row) = super::place(block, lane);
        let direction = self.frame.rays.of_sample(self.corner.0 + column as u32, self.corner.1 + row as u32);
        Ray { origin: DVec3::ZERO, direction }
    }

    /// Directions of the rays of a block in eye space, rounded.
    #[inline(always)]
    pub(crate) fn directions<S: Simd>(&self, simd: S, block: usize) -> Vec3x16<S> {
        let [center, right, down] = three!(i => Vec3x16::splat(simd, self.rounded_steps[i]));
        let (x, y) = (self.rays.x[block].load(simd), self.rays.y[block].load(simd));
        center.add(right.scale(x)).add(down.scale(y))
    }

    /// Finds what each ray sees.
    #[inline(always)]
    pub(crate) fn visible<S: Simd>(&self, simd: S) -> Visible {
        let mut visible = Visible::new(&self.live);
        let mut items = self.items_in_sight();
        // Nearest first.
        items.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (depth, item) in items {
            let mut nearest = Nearest { tile: self, item, visible: &mut visible };
            if self.lens.z_most(depth) < nearest_least(&nearest) {
                break;
            }
            match self.frame.items.get(item) {
                Item::Model(index) => {
                    let instance = &self.frame.instances[index];
                    let lens = self.lens.of(instance.linear, instance.translation, 1.0);
                    cover_mesh(simd, &instance.mesh, &lens, self.rays, &mut nearest);
                }
                Item::Triangle(index) => {
                    let corners = self.frame.triangles[index].corners.map(|p| self.lens.exact_point(p));
                    if let Some(flat) = flat_exact(false, corners, self.rays) {
                        cover_flat(simd, &flat, 0, self.rays, &mut nearest);
                    }
                }
                Item::Sphere(_) => nearest.ask_every_ray(),
            }
            nearest.settle(simd);
        }
        for plane in 0..self.frame.planes.len() as u32 {
            let item = self.frame.items.first_plane() + plane;
            Nearest { tile: self, item, visible: &mut visible }.ask_every_ray();
        }
        visible
    }

    /// Items whose boxes may be in sight, with a depth that nothing in them is nearer than.
    fn items_in_sight(&self) -> Vec<(f32, u32)> {
        let frustum = Frustum::new(&self.lens, self.rays.union);
        let mut found = Vec::new();
        let mut pending = vec![0_u32];
        while let Some(index) = pending.pop() {
            let node = &self.frame.nodes[index as usize];
            for side in 0..2 {
                let Some(depth) = depth_in_sight(&frustum, node.child_bounds(side)) else { continue };
                match node.child(side) {
                    Child::Empty => {}
                    Child::Inner(inner) => pending.push(inner),
                    Child::Leaf { first, count } => {
                        found.extend((first..first + count).map(|at| (depth, self.frame.item_at(at))));
                    }
                }
            }
        }
        found
    }
}

fn nearest_least(nearest: &Nearest<'_, '_>) -> f32 {
    nearest.visible.least.0.iter().fold(f32::INFINITY, |least, &of_block| least.min(of_block))
}

/// Least depth of a box, or `None` if it is out of sight.
pub(super) fn depth_in_sight(frustum: &Frustum, (lo, hi): (Vec3, Vec3)) -> Option<f32> {
    if !(lo.x <= hi.x) {
        return None;
    }
    let corner = |plane: [f32; 4], opposite: bool| {
        (0..3).fold(plane[3], |sum, axis| {
            let at = if (plane[axis] < 0.0) != opposite { hi[axis] } else { lo[axis] };
            sum + plane[axis] * at
        })
    };
    let outside = (0..4).any(|side| corner(frustum.planes[side], false) > frustum.error[side]);
    let farthest = corner(frustum.planes[4], true) + frustum.error[4];
    let behind = !frustum.parallel && farthest < 0.0;
    (!outside && !behind).then(|| corner(frustum.planes[4], false) - frustum.error[4])
}

/// Asks for the nearest triangle.
struct Nearest<'a, 'b> {
    tile: &'a EyeTile<'a>,
    item: u32,
    visible: &'b mut Visible,
}

impl Nearest<'_, '_> {
    /// Blocks with a ray that sees nothing closer than `z_most`.
    #[inline(always)]
    fn open_blocks<S: Simd>(&self, simd: S, z_most: f32) -> u32 {
        bits(self.visible.least.load(simd).simd_le(splat(simd, z_most)))
    }

    /// Items without lines in the picture: exactly, ray by ray.
    fn ask_every_ray(&mut self) {
        for block in 0..BLOCKS {
            for lane in each_bit(self.tile.live[block]) {
                self.ask(block, lane, 0);
            }
        }
    }

    /// Whether a primitive is what a ray sees, to the last digit.
    #[inline(never)]
    fn ask(&mut self, block: usize, lane: usize, triangle: u32) {
        let ray = self.tile.ray(block, lane);
        let frame = self.tile.frame;
        let Some(hit) = frame.hit_of(&ray, PrimitiveId { item: self.item, triangle }, None) else { return };
        let seen = self.visible.item[block][lane];
        let best = (seen != NOTHING)
            .then(|| PrimitiveId { item: seen, triangle: self.visible.triangle[block][lane] })
            .and_then(|seen| frame.hit_of(&ray, seen, None));
        if best.is_none_or(|best| hit.wins_over(&best)) {
            self.visible.see(block, lane, &hit);
        }
    }
}

impl<S: Simd> Interest<S> for Nearest<'_, '_> {
    #[inline(always)]
    fn wants(&self, simd: S, around: [f32; 4], z_most: f32) -> bool {
        let [x_from, x_to, y_from, y_to] = around;
        // Rays stand at whole numbers and a half.
        (x_to - 0.5).floor() >= x_from - 0.5
            && (y_to - 0.5).floor() >= y_from - 0.5
            && self.tile.rays.blocks_in(simd, around) & self.open_blocks(simd, z_most) != 0
    }
}

impl<S: Simd> Question<S> for Nearest<'_, '_> {
    const ON_GRID: bool = true;

    fn least_closeness(&self) -> f32 {
        nearest_least(self)
    }

    #[inline(always)]
    fn open_blocks(&self, simd: S, z_most: f32) -> u32 {
        self.open_blocks(simd, z_most)
    }

    #[inline(always)]
    fn cover(&mut self, simd: S, flat: &Flat, triangle: u32, block: usize) {
        let Some(At { maybe, certain, z }) =
            at(simd, flat, self.tile.rays.x[block].load(simd), self.tile.rays.y[block].load(simd))
        else {
            return;
        };
        let error = splat(simd, flat.z_error);
        let (z_low, z_high) = (z - error, z + error);
        let (low, high) = (self.visible.low[block].load(simd), self.visible.high[block].load(simd));
        // What is not certain to be farther, even where a number is NaN.
        let maybe = maybe & !bits(z_high.simd_lt(low));
        if maybe == 0 {
            return;
        }
        let certain = maybe & certain & bits(z_low.simd_gt(high));
        if certain != 0 {
            let mask = mask_of(simd, certain);
            self.visible.low[block].store(select(mask, z_low, low));
            self.visible.high[block].store(select(mask, z_high, high));
            for lane in each_bit(certain) {
                self.visible.item[block][lane] = self.item;
                self.visible.triangle[block][lane] = triangle;
            }
            self.visible.changed |= 1 << block;
        }
        for lane in each_bit(maybe & !certain) {
            self.ask(block, lane, triangle);
        }
    }

    #[inline(always)]
    fn settle(&mut self, simd: S) {
        for block in each_bit(self.visible.changed) {
            self.visible.least.0[block] = self.visible.low[block].load(simd).reduce_min();
        }
        self.visible.changed = 0;
    }
}
