//! The tiles of a band: what they share, and the way of each from rays to colours.

use super::super::stage::{Stage, Watch};
use super::bounce::{self, Bounces};
use super::{Scratch, shade};
use crate::cancel::Cancelled;
use crate::frame::{CameraRays, FisheyeRays, ParallelRays, PreparedFrame};
use crate::intersect::tile;
use crate::rays::{
    BLOCKS, CameraTile, EyeTile, HitBlock, ParallelTile, RayBatch, RayCounts, RaySource, TileSamples,
};
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
    /// Rays of a fisheye camera, from its first tile on.
    fisheye: Option<Box<RayBatch<'a>>>,
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
            fisheye: None,
        }
    }

    /// Whether the work is cancelled.
    pub(super) fn is_cancelled(&self) -> bool {
        (self.cancelled)()
    }

    /// Traces and shades the samples of a tile. The result is `direct.colors`.
    ///
    /// # Errors
    /// [`Cancelled`], polled before the tile is traced.
    #[inline(always)]
    pub(crate) fn trace<S: Simd>(&mut self, simd: S, samples: TileSamples<'_>) -> Result<(), Cancelled> {
        let frame = self.frame;
        match &frame.rays {
            CameraRays::Pinhole(camera) => self.trace_tile(simd, &EyeTile::new(frame, camera, samples)),
            CameraRays::Parallel(camera) => self.trace_parallel(simd, camera, samples),
            CameraRays::Fisheye(camera) => self.trace_fisheye(simd, camera, &samples),
        }
    }

    /// Traces and shades samples of an orthographic camera.
    #[inline(never)]
    fn trace_parallel<S: Simd>(
        &mut self,
        simd: S,
        camera: &ParallelRays,
        samples: TileSamples<'_>,
    ) -> Result<(), Cancelled> {
        self.trace_tile(simd, &ParallelTile::new(self.frame, camera, samples))
    }

    /// Traces and shades the rays of a tile of a camera with a projection. A function of its own on each level: all kinds of bands
    /// call the same one, because it takes long to compile.
    #[inline(never)]
    fn trace_tile<S: Simd, T: CameraTile>(&mut self, simd: S, tile: &T) -> Result<(), Cancelled> {
        self.begin_tile(&tile.samples().live)?;
        simd.vectorize(
            #[inline(always)]
            || {
                tile::find_closest(simd, tile, &mut self.hits, &mut self.tile);
                self.watch.enter(Stage::Surfaces);
                self.surfaces.find(simd, tile, &self.hits);
                self.watch.enter(Stage::Shading);
                shade(simd, tile, self);
            },
        );
        if self.bounces.is_some() { bounce::add(simd, tile, self) } else { Ok(()) }
    }

    /// Traces and shades samples of a fisheye camera, ray by ray.
    #[inline(never)]
    fn trace_fisheye<S: Simd>(
        &mut self,
        simd: S,
        camera: &FisheyeRays,
        samples: &TileSamples<'_>,
    ) -> Result<(), Cancelled> {
        self.begin_tile(&samples.live)?;
        let mut batch = self.fisheye.take().unwrap_or_else(|| Box::new(RayBatch::new(self.frame)));
        batch.put_fisheye(camera, samples);
        self.hits.iter_mut().for_each(|hits| *hits = HitBlock::NONE);
        self.trace_batch(simd, &batch, [0; BLOCKS]);
        let result = if self.bounces.is_some() { bounce::add(simd, &*batch, self) } else { Ok(()) };
        self.fisheye = Some(batch);
        result
    }

    /// Begins a tile with these live rays of the camera.
    #[inline(always)]
    fn begin_tile(&mut self, live: &[u32; BLOCKS]) -> Result<(), Cancelled> {
        if (self.cancelled)() {
            return Err(Cancelled);
        }
        self.watch.enter(Stage::Visible);
        for lanes in live {
            self.counts.primary += u64::from(lanes.count_ones());
        }
        Ok(())
    }

    /// Traces and shades a batch of rays. The result is `direct.colors`. `hits` already has the hits of the rays in `known`, and none
    /// of the others. A function of its own on each level, as [`TileContext::trace_tile`].
    #[inline(never)]
    pub(super) fn trace_batch<S: Simd>(&mut self, simd: S, batch: &RayBatch<'_>, known: [u32; BLOCKS]) {
        for (block, hits) in self.hits.iter_mut().enumerate() {
            let lanes = batch.live(block) & !known[block];
            if lanes != 0 {
                self.frame.closest_hits_of(&batch.blocks[block], lanes, hits);
            }
        }
        self.watch.enter(Stage::Surfaces);
        simd.vectorize(
            #[inline(always)]
            || {
                self.surfaces.find(simd, batch, &self.hits);
                self.watch.enter(Stage::Shading);
                shade(simd, batch, self);
            },
        );
    }
}
