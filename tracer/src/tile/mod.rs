//! Rays in tiles: 256 rays that start in one point, traced together.
//!
//! Nearly every ray of a frame starts in one point: the eye, or a point light. Seen from there, sixteen by sixteen
//! neighbouring rays are a small square of a picture, and a triangle is three straight lines in that picture. So what
//! a packet tracer does per ray happens here once per tile, or once per triangle:
//!
//! ```text
//!   Lens     the picture as seen from the point: (x, y) where a ray pierces the plane at depth 1     lens.rs
//!   Walk     the tree; boxes beside the tile or behind all that it sees drop out                     walk.rs, around.rs
//!   Setup    sixteen triangles at once become lines and a depth plane in the picture                 setup.rs
//!   Cover    the triangles that are left against blocks of sixteen rays: inside? nearer?             cover.rs
//! ```
//!
//! [`visible`] asks for the nearest triangle of each ray from the eye, [`shadow`] whether anything lies between a light
//! and each point.
//!
//! **Certain or exact.** All of this is `f32`, with a bound for the error of every number. A ray that is inside all
//! lines, and nearer, by more than the bound is decided. Any other is asked again with [`crate::triangle`], in `f64`.
//! So rounding never decides what is seen: not the level of SIMD, not the place of the tile, not the order of the walk.
//!
//! A tile is sixteen *blocks* of sixteen *lanes*: 4 x 4 blocks of 4 x 4 rays, because small triangles are as high as
//! they are wide.

mod around;
mod blocked;
mod cover;
pub(crate) mod lens;
mod light_lens;
mod points;
mod setup;
pub(crate) mod shadow;
#[cfg(test)]
mod tests;
pub(crate) mod visible;
mod walk;

use crate::simd::{LANES, Lanes, Simd, SimdBase, bits, mask_of, select, splat};

pub(crate) use lens::Affine;
use points::Points;
use setup::Flats;
use walk::{Frontier, WalkStack};

/// Rays along a side of a tile.
pub(crate) const SIDE: usize = 16;

/// Blocks of a tile.
pub(crate) const BLOCKS: usize = 16;

/// A bit for each.
const ALL_BLOCKS: u32 = (1 << BLOCKS) - 1;

/// The rays of a tile where they pierce the picture of a lens, and rectangles around the blocks.
#[derive(Clone)]
pub(crate) struct Rays {
    pub x: [Lanes; BLOCKS],
    pub y: [Lanes; BLOCKS],
    /// Around each block: least and greatest x, least and greatest y. A lane a block.
    pub bounds: [Lanes; 4],
    /// Around all blocks that count.
    pub union: [f32; 4],
    /// How far x and y may be off.
    pub error: f32,
}

/// Room that tiles need while they are traced, kept from tile to tile.
pub(crate) struct Scratch {
    /// The walk through the scene's tree, and that through a mesh's.
    scene_stack: WalkStack,
    mesh_stack: WalkStack,
    /// The same of shadow rays.
    scene_frontier: Frontier,
    mesh_frontier: Frontier,
    flats: Flats,
    /// Of shadow rays, as the light sees them.
    shadow_rays: Rays,
    shadow: Points,
}

impl Scratch {
    pub(crate) fn new() -> Self {
        Self {
            scene_stack: WalkStack::EMPTY,
            mesh_stack: WalkStack::EMPTY,
            scene_frontier: Frontier::EMPTY,
            mesh_frontier: Frontier::EMPTY,
            flats: Flats::EMPTY,
            shadow_rays: Rays::empty(),
            shadow: Points::NONE,
        }
    }
}

/// Column and row of a ray in its tile.
#[inline(always)]
pub(crate) const fn place(block: usize, lane: usize) -> (usize, usize) {
    (block % 4 * 4 + lane % 4, block / 4 * 4 + lane / 4)
}

impl Rays {
    /// The rays of the eye: a regular grid with step 1 around the tile's centre.
    #[inline(always)]
    pub(crate) fn grid<S: Simd>(simd: S) -> Self {
        let position = |index: usize| index as f32 - (SIDE as f32 - 1.0) / 2.0;
        let lanes = |of: fn((usize, usize)) -> usize| {
            std::array::from_fn(|block| Lanes(std::array::from_fn(|lane| position(of(place(block, lane))))))
        };
        let mut rays = Self { x: lanes(|(column, _)| column), y: lanes(|(_, row)| row), ..Self::empty() };
        rays.bound(simd, &[0xffff; BLOCKS]);
        rays
    }

    /// Rays of the eye in one row with step 1, half a step above the tile's centre.
    pub(crate) fn row<S: Simd>(simd: S, live: &[u32; BLOCKS]) -> Self {
        let position = |index: usize| index as f32 - ((BLOCKS * LANES) as f32 - 1.0) / 2.0;
        let x =
            std::array::from_fn(|block| Lanes(std::array::from_fn(|lane| position(block * LANES + lane))));
        let mut rays = Self { x, y: [Lanes([-0.5; LANES]); BLOCKS], ..Self::empty() };
        rays.bound(simd, live);
        rays
    }

    /// None yet.
    pub(crate) fn empty() -> Self {
        let nowhere = [Lanes::ZERO; BLOCKS];
        Self { x: nowhere, y: nowhere, bounds: [Lanes::ZERO; 4], union: [0.0; 4], error: 0.0 }
    }

    /// Puts rectangles around the lanes of `live` (a bit a lane).
    #[inline(always)]
    pub(crate) fn bound<S: Simd>(&mut self, simd: S, live: &[u32; BLOCKS]) {
        let infinite = splat(simd, f32::INFINITY);
        for block in 0..BLOCKS {
            let mask = mask_of(simd, live[block]);
            for (axis, at) in [&self.x[block], &self.y[block]].into_iter().enumerate() {
                let at = at.load(simd);
                self.bounds[2 * axis].0[block] = select(mask, at, infinite).reduce_min();
                self.bounds[2 * axis + 1].0[block] = select(mask, at, -infinite).reduce_max();
            }
        }
        for axis in 0..2 {
            self.union[2 * axis] = self.bounds[2 * axis].load(simd).reduce_min();
            self.union[2 * axis + 1] = self.bounds[2 * axis + 1].load(simd).reduce_max();
        }
        self.error = 0.0;
    }

    /// Makes all rectangles wider by the error of the places.
    #[inline(always)]
    pub(crate) fn widen<S: Simd>(&mut self, simd: S, error: f32) {
        self.error = error;
        for side in 0..4 {
            let out = if side % 2 == 0 { -error } else { error };
            self.union[side] += out;
            let wider = self.bounds[side].load(simd) + splat(simd, out);
            self.bounds[side].store(wider);
        }
    }

    /// The rectangle around the rays of a block.
    #[inline(always)]
    pub(crate) fn around(&self, block: usize) -> [f32; 4] {
        let [x_lo, x_hi, y_lo, y_hi] = &self.bounds;
        [x_lo.0[block], x_hi.0[block], y_lo.0[block], y_hi.0[block]]
    }

    /// Rays of a block that stand in a rectangle. Their own error must have been added to it.
    #[inline(always)]
    pub(crate) fn rays_in<S: Simd>(
        &self,
        simd: S,
        block: usize,
        [x_from, x_to, y_from, y_to]: [f32; 4],
    ) -> u32 {
        let (x, y) = (self.x[block].load(simd), self.y[block].load(simd));
        bits(
            x.simd_le(splat(simd, x_to))
                & x.simd_ge(splat(simd, x_from))
                & y.simd_le(splat(simd, y_to))
                & y.simd_ge(splat(simd, y_from)),
        )
    }

    /// Largest coordinate of any ray that counts.
    pub(crate) fn reach(&self) -> f32 {
        let [x_lo, x_hi, y_lo, y_hi] = self.union;
        x_lo.abs().max(x_hi.abs()).max(y_lo.abs()).max(y_hi.abs())
    }
}
