//! The tiles of a band: what they share, and the way of each from rays to colours.

use super::super::stage::{Stage, Watch};
use super::bounce::{BatchShader, Bounces, Shaded};
use super::{Scratch, shade};
use crate::cancel::Cancelled;
use crate::frame::{CameraRays, FisheyeRays, ParallelRays, PreparedFrame};
use crate::intersect::tile;
use crate::rays::{
    BLOCKS, EyeTile, HitBlock, ParallelTile, PictureTile, RayBatch, RayCounts, RaySource, SurfaceSource,
    TileSamples,
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
    /// Rays of a camera without an eye, from its first tile on.
    batch: Option<Box<RayBatch<'a>>>,
}

impl<'a, W: Watch> TileContext<'a, W> {
    /// A context without a tile. `cancelled` is polled once a tile. Inlined: it is too large to be copied for each band.
    #[inline(always)]
    pub(crate) fn new(frame: &'a PreparedFrame, cancelled: &'a dyn Fn() -> bool, watch: &'a mut W) -> Self {
        // First: what is built before a step that may unwind is built elsewhere, and copied.
        let bounces = Bounces::for_frame(frame);
        Self {
            surfaces: Surfaces::empty(frame),
            frame,
            counts: RayCounts::default(),
            watch,
            cancelled,
            hits: std::array::from_fn(|_| HitBlock::NONE),
            tile: tile::Scratch::new(),
            direct: Scratch::new(),
            bounces,
            batch: None,
        }
    }

    /// Traces and shades the samples of a tile. The result is `direct.colors`.
    ///
    /// # Errors
    /// [`Cancelled`], polled before the tile is traced.
    #[inline(always)]
    pub(crate) fn trace<S: Simd>(&mut self, simd: S, samples: TileSamples<'_>) -> Result<(), Cancelled> {
        let frame = self.frame;
        match &frame.rays {
            CameraRays::Pinhole(camera) => self.trace_eye(simd, &EyeTile::new(frame, camera, samples)),
            CameraRays::Parallel(camera) => self.trace_parallel(simd, camera, samples),
            CameraRays::Fisheye(camera) => self.trace_fisheye(simd, camera, &samples),
        }
    }

    /// Traces and shades the rays of a tile of a pinhole camera. A function of its own on each level: all kinds of bands call the
    /// same one, because it takes long to compile.
    #[inline(never)]
    fn trace_eye<S: Simd>(&mut self, simd: S, tile: &EyeTile<'_>) -> Result<(), Cancelled> {
        simd.vectorize(
            #[inline(always)]
            || -> Result<(), Cancelled> {
                self.begin_tile(tile)?;
                tile::find_closest(simd, tile, &mut self.hits, &mut self.tile);
                self.watch.enter(Stage::Surfaces);
                self.surfaces.find(simd, tile, &self.hits);
                self.watch.enter(Stage::Shading);
                shade(simd, tile, self);
                Ok(())
            },
        )?;
        self.add_bounces(simd, tile)
    }

    /// Traces and shades samples of an orthographic camera: their hits are found as a tile, and shaded as a batch.
    #[inline(never)]
    fn trace_parallel<S: Simd>(
        &mut self,
        simd: S,
        camera: &ParallelRays,
        samples: TileSamples<'_>,
    ) -> Result<(), Cancelled> {
        let tile = ParallelTile::new(self.frame, camera, samples);
        self.begin_tile(&tile)?;
        simd.vectorize(
            #[inline(always)]
            || tile::find_closest::<S, dyn PictureTile>(simd, &tile, &mut self.hits, &mut self.tile),
        );
        let mut batch = self.batch.take().unwrap_or_else(|| Box::new(RayBatch::new(self.frame)));
        batch.put_parallel(camera, &samples);
        self.shade_batch(simd, &batch);
        let result = self.add_bounces(simd, &*batch);
        self.batch = Some(batch);
        result
    }

    /// Traces and shades samples of a fisheye camera, ray by ray.
    #[inline(never)]
    fn trace_fisheye<S: Simd>(
        &mut self,
        simd: S,
        camera: &FisheyeRays,
        samples: &TileSamples<'_>,
    ) -> Result<(), Cancelled> {
        let mut batch = self.batch.take().unwrap_or_else(|| Box::new(RayBatch::new(self.frame)));
        batch.put_fisheye(camera, samples);
        let mut result = self.begin_tile(&*batch);
        if result.is_ok() {
            self.hits.iter_mut().for_each(|hits| *hits = HitBlock::NONE);
            self.trace_batch(simd, &batch, [0; BLOCKS]);
            result = self.add_bounces(simd, &*batch);
        }
        self.batch = Some(batch);
        result
    }

    /// Adds what the surfaces of a shaded tile reflect and transmit.
    #[inline(always)]
    fn add_bounces<S: Simd, R: SurfaceSource>(&mut self, simd: S, tile: &R) -> Result<(), Cancelled> {
        let Some(mut bounces) = self.bounces.take() else { return Ok(()) };
        let result = bounces.add(simd, tile, self);
        self.bounces = Some(bounces);
        result
    }

    /// Begins a tile of the camera.
    #[inline(always)]
    fn begin_tile(&mut self, rays: &impl RaySource) -> Result<(), Cancelled> {
        if (self.cancelled)() {
            return Err(Cancelled);
        }
        self.watch.enter(Stage::Visible);
        for block in 0..BLOCKS {
            self.counts.primary += u64::from(rays.live(block).count_ones());
        }
        Ok(())
    }

    /// Traces and shades a batch of rays. The result is `direct.colors`. `hits` already has the hits of the rays in `known`, and none
    /// of the others.
    fn trace_batch<S: Simd>(&mut self, simd: S, batch: &RayBatch<'_>, known: [u32; BLOCKS]) {
        for (block, hits) in self.hits.iter_mut().enumerate() {
            let lanes = batch.live(block) & !known[block];
            if lanes != 0 {
                self.frame.closest_hits_of(&batch.blocks[block], lanes, hits);
            }
        }
        self.shade_batch(simd, batch);
    }

    /// Shades the hits of a batch of rays. A function of its own on each level, as [`TileContext::trace_eye`].
    #[inline(never)]
    fn shade_batch<S: Simd>(&mut self, simd: S, batch: &RayBatch<'_>) {
        self.watch.enter(Stage::Surfaces);
        self.surfaces.find_of_batch(simd, batch, &self.hits);
        self.watch.enter(Stage::Shading);
        simd.vectorize(
            #[inline(always)]
            || shade(simd, batch, self),
        );
    }
}

impl<'a, W: Watch> BatchShader<'a> for TileContext<'a, W> {
    fn frame(&self) -> &'a PreparedFrame {
        self.frame
    }

    fn shaded(&mut self) -> Shaded<'_> {
        Shaded { hits: &mut self.hits, surfaces: &self.surfaces, colors: &mut self.direct.colors }
    }

    fn scratch(&mut self) -> &mut tile::Scratch {
        &mut self.tile
    }

    fn shade<S: Simd>(
        &mut self,
        simd: S,
        batch: &RayBatch<'_>,
        known: [u32; BLOCKS],
    ) -> Result<(), Cancelled> {
        if (self.cancelled)() {
            return Err(Cancelled);
        }
        self.watch.enter(Stage::Secondary);
        self.watch.secondary_rays(self.frame.segments_of(batch));
        let live: u32 = (0..BLOCKS).map(|block| batch.live(block).count_ones()).sum();
        self.counts.secondary += u64::from(live);
        self.trace_batch(simd, batch, known);
        Ok(())
    }
}
