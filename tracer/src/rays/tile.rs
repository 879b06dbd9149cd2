//! Tiles: 256 rays of a picture, their places and the rectangles around them.
//!
//! A tile is sixteen *blocks* of sixteen *lanes*: 4 x 4 blocks of 4 x 4 rays, because small triangles are about as high as
//! they are wide.

use crate::frame::PreparedFrame;
use crate::light::extent::place_in_pattern;
use crate::scene::FrameView;
use crate::simd::{LANES, Lanes, Simd, SimdBase, bits, mask_of, select, splat};

/// Rays along a side of a tile.
pub(crate) const SIDE: usize = 16;

/// Blocks of a tile.
pub(crate) const BLOCKS: usize = 16;

/// The bits of all blocks.
pub(crate) const ALL_BLOCKS: u32 = (1 << BLOCKS) - 1;

/// Rows of a tile of a frame with one sample a pixel. Segments that begin and end on multiples of it cut no tile.
pub const TILE_SIZE: u32 = SIDE as u32;

/// Linear RGB of each ray of a tile, indexed `[block][channel]`.
pub(crate) type TileColors = [[Lanes; 3]; BLOCKS];

/// Rows of a band of tiles in frames with this view. Segments that begin and end on multiples of it cut no tile: a tile has
/// the same number of rays at any number of samples, so with more samples it has fewer rows. Bands of adaptive frames have
/// [`TILE_SIZE`] rows.
pub fn tile_rows(view: &FrameView) -> u32 {
    if view.is_adaptive() { TILE_SIZE } else { (TILE_SIZE / view.grid().max(1)).max(1) }
}

impl PreparedFrame {
    /// Rows of a band of its tiles: see [`tile_rows`].
    pub fn tile_rows(&self) -> u32 {
        tile_rows(self.view())
    }
}

/// Column and row of a ray in its tile.
#[inline(always)]
pub(crate) const fn place(block: usize, lane: usize) -> (usize, usize) {
    (block % 4 * 4 + lane % 4, block / 4 * 4 + lane / 4)
}

/// Samples of the camera's picture that are traced together.
#[derive(Clone, Copy)]
pub(crate) struct TileSamples<'a> {
    /// Places of the samples relative to `center`.
    pub rays: &'a TileRays,
    /// Bits of the live samples of each block.
    pub live: [u32; BLOCKS],
    /// The tile's centre, in samples from the top left corner of the picture.
    pub center: [f64; 2],
    /// Samples along a side of a pixel, in the unit of the places.
    pub grid: u32,
}

impl TileSamples<'_> {
    /// Place of a sample, in pixels from the top left corner of the picture.
    #[inline(always)]
    pub(crate) fn place(&self, block: usize, lane: usize) -> [f64; 2] {
        let grid = f64::from(self.grid);
        let x = self.center[0] + f64::from(self.rays.x[block].0[lane]);
        let y = self.center[1] + f64::from(self.rays.y[block].0[lane]);
        [x / grid, y / grid]
    }

    /// Places of the samples of a block in the pattern of soft shadows.
    pub(crate) fn pattern(&self, block: usize) -> [u8; LANES] {
        std::array::from_fn(|lane| {
            let [column, row] = [self.rays.x[block].0[lane], self.rays.y[block].0[lane]];
            place_in_pattern(self.center[0] + f64::from(column), self.center[1] + f64::from(row))
        })
    }

    /// Place of the tile's centre, in pixels from the top left corner of the picture.
    pub(crate) fn middle(&self) -> [f64; 2] {
        self.center.map(|along| along / f64::from(self.grid))
    }

    /// Size of the tile's picture relative to that of a frame with `grid` samples along a side of a pixel.
    pub(crate) fn enlarged(&self, grid: u32) -> f64 {
        f64::from(self.grid) / f64::from(grid)
    }
}

/// The places of a tile's rays in the picture of a projection, and rectangles around its blocks.
#[derive(Clone)]
pub(crate) struct TileRays {
    pub x: [Lanes; BLOCKS],
    pub y: [Lanes; BLOCKS],
    /// Rectangles around the blocks, a lane a block: least and greatest x, least and greatest y.
    pub bounds: [Lanes; 4],
    /// The rectangle around all live rays.
    pub union: [f32; 4],
    /// Error bound of x and y.
    pub error: f32,
    /// Whether all places are on a grid with step 1, at whole numbers plus a half: boxes and triangles between them can be dropped.
    pub on_grid: bool,
}

impl TileRays {
    /// The rays of a square tile of the camera: a regular grid with step 1 around the tile's centre.
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

    /// Rays of the camera in one row with step 1, half a step above the tile's centre.
    pub(crate) fn row<S: Simd>(simd: S, live: &[u32; BLOCKS]) -> Self {
        let position = |index: usize| index as f32 - ((BLOCKS * LANES) as f32 - 1.0) / 2.0;
        let x =
            std::array::from_fn(|block| Lanes(std::array::from_fn(|lane| position(block * LANES + lane))));
        let mut rays = Self { x, y: [Lanes([-0.5; LANES]); BLOCKS], ..Self::empty() };
        rays.bound(simd, live);
        rays
    }

    /// A tile without rays.
    pub(crate) fn empty() -> Self {
        let nowhere = [Lanes::ZERO; BLOCKS];
        Self { x: nowhere, y: nowhere, bounds: [Lanes::ZERO; 4], union: [0.0; 4], error: 0.0, on_grid: true }
    }

    /// Computes the rectangles around the live rays (a bit a lane).
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

    /// Sets the error bound of all places, and widens all rectangles by it.
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

    /// Bits of the rays of a block inside a rectangle, which must already contain the error bound of the rays.
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

    /// Largest coordinate of any live ray.
    pub(crate) fn reach(&self) -> f32 {
        let [x_lo, x_hi, y_lo, y_hi] = self.union;
        x_lo.abs().max(x_hi.abs()).max(y_lo.abs()).max(y_hi.abs())
    }
}
