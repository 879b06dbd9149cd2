//! Rays in tiles: 256 rays that start in one point, traced together.
//!
//! Nearly every ray of a frame starts in one point: the eye, or a point light. Seen from there, sixteen by sixteen
//! neighbouring rays are a small square of a picture, and a triangle is three straight lines in that picture. So what
//! a packet tracer does per ray happens here once per tile, or once per triangle:
//!
//! ```text
//!   Lens     the picture as seen from the point: (x, y) where a ray pierces the plane at depth 1     lens.rs
//!   Walk     the tree, nearest first; boxes beside the tile or behind all that it sees drop out      walk.rs
//!   Setup    sixteen triangles at once become lines and a depth plane in the picture                 setup.rs
//!   Cover    each triangle that is left against blocks of sixteen rays: inside? nearer?              cover.rs
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

mod cover;
mod lens;
mod setup;
pub(crate) mod shadow;
pub(crate) mod visible;
mod walk;

use crate::simd::{LANES, Lanes, Simd, SimdBase, bits, splat};

pub(crate) use lens::Lens;

/// Rays along a side of a tile.
pub(crate) const SIDE: usize = 16;

/// Blocks of a tile.
pub(crate) const BLOCKS: usize = 16;

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

/// Column and row of a ray in its tile.
#[inline(always)]
pub(crate) const fn place(block: usize, lane: usize) -> (usize, usize) {
    (block % 4 * 4 + lane % 4, block / 4 * 4 + lane / 4)
}

impl Rays {
    /// The rays of the eye: a regular grid with step 1 around the tile's centre.
    pub(crate) fn grid() -> Self {
        let position = |index: usize| index as f32 - (SIDE as f32 - 1.0) / 2.0;
        let lanes = |of: fn((usize, usize)) -> usize| {
            std::array::from_fn(|block| Lanes(std::array::from_fn(|lane| position(of(place(block, lane))))))
        };
        let mut rays = Self {
            x: lanes(|(column, _)| column),
            y: lanes(|(_, row)| row),
            bounds: [Lanes::ZERO; 4],
            union: [0.0; 4],
            error: 0.0,
        };
        rays.bound([u32::MAX; BLOCKS], (1 << BLOCKS) - 1);
        rays
    }

    /// None yet.
    fn empty() -> Self {
        let nowhere = [Lanes::ZERO; BLOCKS];
        Self { x: nowhere, y: nowhere, bounds: [Lanes::ZERO; 4], union: [0.0; 4], error: 0.0 }
    }

    /// Puts rectangles around the lanes of `live` (a bit a lane), and around the blocks of `blocks` together.
    pub(crate) fn bound(&mut self, live: [u32; BLOCKS], blocks: u32) {
        let empty = [f32::INFINITY, f32::NEG_INFINITY, f32::INFINITY, f32::NEG_INFINITY];
        self.union = empty;
        for block in 0..BLOCKS {
            let mut rectangle = empty;
            for lane in (0..LANES).filter(|lane| live[block] >> lane & 1 == 1) {
                let (x, y) = (self.x[block].0[lane], self.y[block].0[lane]);
                rectangle =
                    [rectangle[0].min(x), rectangle[1].max(x), rectangle[2].min(y), rectangle[3].max(y)];
            }
            for side in 0..4 {
                self.bounds[side].0[block] = rectangle[side];
                if blocks >> block & 1 == 1 {
                    let wider: fn(f32, f32) -> f32 = if side % 2 == 0 { f32::min } else { f32::max };
                    self.union[side] = wider(self.union[side], rectangle[side]);
                }
            }
        }
    }

    /// Blocks with a ray that may stand in a rectangle.
    #[inline(always)]
    pub(crate) fn blocks_in<S: Simd>(&self, simd: S, [x_from, x_to, y_from, y_to]: [f32; 4]) -> u32 {
        let [x_lo, x_hi, y_lo, y_hi] = &self.bounds;
        bits(
            x_lo.load(simd).simd_le(splat(simd, x_to))
                & x_hi.load(simd).simd_ge(splat(simd, x_from))
                & y_lo.load(simd).simd_le(splat(simd, y_to))
                & y_hi.load(simd).simd_ge(splat(simd, y_from)),
        )
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
        self.union.iter().fold(0.0, |reach, side| reach.max(side.abs()))
    }
}
