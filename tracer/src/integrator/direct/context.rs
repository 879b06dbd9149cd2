//! The tiles of a band: what they share, and the way of each from rays to colours.

use super::super::stage::{Stage, Watch};
use super::bounce::{self, Bounces};
use super::{Scratch, shade};
use crate::cancel::Cancelled;
use crate::frame::PreparedFrame;
use crate::intersect::tile::{self, PictureTile};
use crate::rays::{BLOCKS, EyeTile, HitBlock, RayCounts};
use crate::simd::Simd;
use crate::surface::Surfaces;

/// Frame, memory, counts and callbacks of the tiles of a band. Kept from tile to tile.
pub(crate) struct TileContext<'a, W> {
    pub frame: &'a PreparedFrame,
    /// Rays traced so far.
    pub counts: RayCounts,
    /// Receives stage changes.
    pub watch: &'a mut W,
    cancelled: &'a dyn Fn() -> bool,
    /// Hits of the current tile.
    pub hits: [HitBlock; BLOCKS],
    /// Surface points of the current tile.
    pub surfaces: Surfaces,
    /// Memory of intersections and of shading.
    pub tile: tile::Scratch,
    pub direct: Scratch,
    /// Only in scenes with materials that reflect or transmit.
    pub(super) bounces: Option<Box<Bounces<'a>>>,
}

impl<'a, W: Watch> TileContext<'a, W> {
    /// A context without a tile. `cancelled` is polled once a tile.
    pub(crate) fn new(frame: &'a PreparedFrame, cancelled: &'a dyn Fn() -> bool, watch: &'a mut W) -> Self {
        Self {
            frame,
            counts: RayCounts::default(),
            watch,
            cancelled,
            hits: std::array::from_fn(|_| HitBlock::NONE),
            surfaces: Surfaces::empty(frame),
            tile: tile::Scratch::new(),
            direct: Scratch::new(),
            bounces: Bounces::for_frame(frame),
        }
    }

    /// Whether the work is cancelled.
    pub(super) fn is_cancelled(&self) -> bool {
        (self.cancelled)()
    }

    /// Traces and shades the rays of a tile. The result is `direct.colors`. A function of its own on each level: all kinds of bands
    /// call the same one, because it takes long to compile.
    ///
    /// # Errors
    /// [`Cancelled`], polled before the tile is traced.
    #[inline(never)]
    pub(crate) fn trace<S: Simd>(&mut self, simd: S, tile: &EyeTile<'_>) -> Result<(), Cancelled> {
        if (self.cancelled)() {
            return Err(Cancelled);
        }
        self.watch.enter(Stage::Visible);
        for lanes in tile.live {
            self.counts.primary += u64::from(lanes.count_ones());
        }
        simd.vectorize(
            #[inline(always)]
            || {
                tile.find_closest(simd, &mut self.hits, &mut self.tile);
                self.watch.enter(Stage::Surfaces);
                self.surfaces.find(simd, tile, &self.hits);
                self.watch.enter(Stage::Shading);
                shade(simd, tile, self);
            },
        );
        if self.bounces.is_some() { bounce::add(simd, tile, self) } else { Ok(()) }
    }
}
