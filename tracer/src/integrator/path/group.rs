//! Some samples of all pixels of a tile.

use std::ops::Range;

use super::super::regular::lanes_of;
use super::super::stage::{Stage, Watch};
use super::camera::{EyeLens, LensNumbers, places, put_rays};
use super::moving::MovingHits;
use super::queue::Path;
use crate::bsdf::Media;
use crate::cancel::Cancelled;
use crate::film::{PixelSums, TilePixels};
use crate::frame::{CameraRays, PreparedFrame};
use crate::intersect::{VolumeSections, tile};
use crate::light::table::{LightTable, Receiver, Selection};
use crate::rays::{
    BATCH, BLOCKS, EyeTile, HitBlock, ParallelTile, PictureTile, RayBatch, RayBlock, RayCounts, RaySource,
    SIDE, TileRays, TileSamples, place,
};
use crate::sampler::{Dimension, pair_of, pixel_seed};
use crate::scene::PathSettings;
use crate::simd::{Indices, LANES, Simd};
use crate::surface::Surfaces;

/// Most lights without extent whose light is computed at every first vertex; of more, one is selected.
const MAX_TILED_LIGHTS: usize = 16;

/// Frame, memory and counts of the paths of a band. Kept from tile to tile.
pub(super) struct Group<'a> {
    pub(super) frame: &'a PreparedFrame,
    pub(super) settings: PathSettings,
    cancelled: &'a dyn Fn() -> bool,
    lens: Option<EyeLens>,
    pub(super) table: Option<&'a LightTable>,
    /// Whether the light of all lights without extent is computed at first vertices.
    pub(super) tiles_lights: bool,
    /// Seeds of the pixels of the tile.
    pub(super) seeds: [Indices; BLOCKS],
    /// Bits of the pixels that are traced.
    pub(super) live: [u32; BLOCKS],
    /// Centre of the tile, in pixels.
    center: [f64; 2],
    /// Number of the first sample.
    first: u32,
    rays: TileRays,
    pub(super) batch: RayBatch<'a>,
    pub(super) hits: [HitBlock; BLOCKS],
    pub(super) surfaces: Surfaces,
    pub(super) scratch: tile::Scratch,
    /// The paths of the current generation, and those that go on.
    pub(super) current: Vec<Path>,
    pub(super) next: Vec<Path>,
    /// Whether the points that paths start from are kept: if a tree selects lights.
    pub(super) keeps_receivers: bool,
    /// The points that the current paths started from, and those that go on.
    pub(super) receivers: Vec<Receiver>,
    pub(super) next_receivers: Vec<Receiver>,
    /// Index of the first path of the current batch.
    pub(super) base: usize,
    pub(super) shadow_rays: RayBlock<'a>,
    /// Ways of the current ray inside of volumes.
    pub(super) sections: VolumeSections,
    /// Radiance of each sample, by its number in the group and its place in the tile.
    pub(super) radiance: Vec<[f32; 3]>,
    pub(super) counts: RayCounts,
    /// Only in frames in which something moves.
    pub(super) moving: Option<Box<MovingHits<'a>>>,
}

impl<'a> Group<'a> {
    /// Samples of a pixel that are traced together.
    pub(super) const SAMPLES: u32 = 8;

    /// A group without a tile. `cancelled` is polled once a batch.
    pub(super) fn new(
        frame: &'a PreparedFrame,
        settings: &PathSettings,
        cancelled: &'a dyn Fn() -> bool,
    ) -> Box<Self> {
        let without_extent = frame.lights.iter().filter(|light| light.extent.is_none()).count();
        Box::new(Self {
            frame,
            settings: *settings,
            cancelled,
            lens: EyeLens::of(frame),
            table: frame.light_table.as_ref(),
            tiles_lights: without_extent <= MAX_TILED_LIGHTS && !frame.features.volumes,
            seeds: [Indices::ZERO; BLOCKS],
            live: [0; BLOCKS],
            center: [0.0; 2],
            first: 0,
            rays: TileRays::empty(),
            batch: RayBatch::new(frame),
            hits: std::array::from_fn(|_| HitBlock::NONE),
            surfaces: Surfaces::empty(frame),
            scratch: tile::Scratch::new(),
            current: Vec::new(),
            next: Vec::new(),
            keeps_receivers: frame.light_table.as_ref().is_some_and(LightTable::has_tree),
            receivers: Vec::new(),
            next_receivers: Vec::new(),
            base: 0,
            shadow_rays: RayBlock::new(frame),
            sections: VolumeSections::default(),
            radiance: Vec::new(),
            counts: RayCounts::default(),
            moving: MovingHits::of(frame),
        })
    }

    /// Rays traced so far.
    pub(super) fn counts(&self) -> RayCounts {
        self.counts
    }

    /// Begins a tile.
    pub(super) fn begin(&mut self, pixels: &TilePixels) {
        let half = SIDE as f64 / 2.0;
        self.center = [f64::from(pixels.left) + half, f64::from(pixels.top) + half];
        let rows = pixels.rows.start - pixels.top..pixels.rows.end - pixels.top;
        self.live = lanes_of(pixels.right - pixels.left, rows);
        for (block, seeds) in self.seeds.iter_mut().enumerate() {
            for (lane, seed) in seeds.0.iter_mut().enumerate() {
                let (column, row) = place(block, lane);
                *seed = pixel_seed(pixels.left + column as u32, pixels.top + row as u32, self.settings.seed);
            }
        }
    }

    /// Traces samples of all pixels of the tile: at most [`Group::SAMPLES`].
    ///
    /// # Errors
    /// [`Cancelled`], polled before each batch.
    #[inline(always)]
    pub(super) fn trace<S: Simd, W: Watch>(
        &mut self,
        simd: S,
        numbers: Range<u32>,
        watch: &mut W,
    ) -> Result<(), Cancelled> {
        self.radiance.clear();
        self.radiance.resize(numbers.len() * BATCH, [0.0; 3]);
        self.next.clear();
        self.next_receivers.clear();
        self.first = numbers.start;
        for (sample, number) in numbers.enumerate() {
            self.poll()?;
            watch.enter(Stage::Visible);
            self.find_first_hits(simd, number);
            self.begin_paths(sample);
            watch.enter(Stage::Shading);
            self.shade(simd, 0, watch);
        }
        for bounce in 1..=u32::from(self.frame.view().quality.max_depth) {
            if self.next.is_empty() {
                break;
            }
            std::mem::swap(&mut self.current, &mut self.next);
            self.next.clear();
            std::mem::swap(&mut self.receivers, &mut self.next_receivers);
            self.next_receivers.clear();
            for base in (0..self.current.len()).step_by(BATCH) {
                self.poll()?;
                watch.enter(Stage::Secondary);
                self.find_hits(simd, base);
                watch.enter(Stage::Shading);
                self.shade(simd, bounce, watch);
            }
        }
        Ok(())
    }

    /// Adds the traced samples to the sums of the pixels.
    pub(super) fn add_to(&self, pixels: &TilePixels, width: usize, sums: &mut [PixelSums]) {
        for (sample, radiance) in self.radiance.chunks_exact(BATCH).enumerate() {
            let number = self.first + sample as u32;
            for (index, radiance) in radiance.iter().enumerate() {
                let (block, lane) = (index / LANES, index % LANES);
                if self.live[block] >> lane & 1 == 1 {
                    let (column, row) = place(block, lane);
                    let (x, y) = (pixels.left as usize + column, pixels.top as usize + row);
                    let pixel = &mut sums[(y - pixels.rows.start as usize) * width + x];
                    pixel.add_sample(number, PixelSums::steps(*radiance));
                }
            }
        }
    }

    /// A path of the current batch.
    #[inline(always)]
    pub(super) fn path(&self, block: usize, lane: usize) -> &Path {
        &self.current[self.base + block * LANES + lane]
    }

    /// Number in its pixel, and seed of the pixel, of a sample of the group.
    #[inline(always)]
    pub(super) fn seed_and_number(&self, sample: u32) -> (u32, u32) {
        let (group, index) = (sample as usize / BATCH, sample as usize % BATCH);
        (self.seeds[index / LANES].0[index % LANES], self.first + group as u32)
    }

    /// The lights that vertices after a number of bounces select from.
    pub(super) fn selection(&self, bounce: u32) -> Selection {
        if bounce == 0 && self.tiles_lights { Selection::Extended } else { Selection::All }
    }

    fn poll(&self) -> Result<(), Cancelled> {
        if (self.cancelled)() { Err(Cancelled) } else { Ok(()) }
    }

    /// Finds the hits and surface points of the first rays of the samples with a number.
    #[inline(never)]
    fn find_first_hits<S: Simd>(&mut self, simd: S, number: u32) {
        let frame = self.frame;
        simd.vectorize(
            #[inline(always)]
            || places(simd, &self.settings, &self.seeds, number, &self.live, &mut self.rays),
        );
        let samples = TileSamples { rays: &self.rays, live: self.live, center: self.center, grid: 1 };
        let (sampler, seeds) = (self.settings.sampler, &self.seeds);
        let numbers =
            |block: usize, lane: usize| pair_of(sampler, seeds[block].0[lane], number, Dimension::LENS);
        let lens = self.lens.as_ref().map(|lens| (lens, &numbers as LensNumbers<'_>));
        put_rays(frame, lens, &samples, &mut self.batch);
        self.batch.neighbours = true;
        self.hits.iter_mut().for_each(|hits| *hits = HitBlock::NONE);
        match &frame.rays {
            CameraRays::Pinhole(camera) if self.lens.is_none() => {
                let tile = EyeTile::new(frame, camera, samples);
                find_closest(simd, &tile, &mut self.hits, &mut self.scratch);
            }
            CameraRays::Parallel(camera) => {
                let tile = ParallelTile::new(frame, camera, samples);
                find_closest(simd, &tile, &mut self.hits, &mut self.scratch);
            }
            CameraRays::Pinhole(_) | CameraRays::Fisheye(_) => {
                for (block, hits) in self.hits.iter_mut().enumerate() {
                    frame.closest_hits_of(&self.batch.blocks[block], self.batch.live(block), hits);
                }
            }
        }
        self.counts.primary += self.live_rays();
        if self.moving.is_some() {
            self.set_first_times(number);
            self.find_moving_surfaces(simd);
        } else {
            self.surfaces.find_of_batch(simd, &self.batch, &self.hits);
        }
    }

    /// Makes the paths of the first rays; `sample` is their number in the group.
    fn begin_paths(&mut self, sample: usize) {
        self.base = 0;
        self.current.clear();
        self.current.extend((0..BATCH).map(|index| Path {
            ray: self.batch.ray(index / LANES, index % LANES),
            starts_on: None,
            weight: [1.0; 3],
            density: f32::INFINITY,
            media: Media::default(),
            sample: (sample * BATCH + index) as u32,
        }));
    }

    /// Finds the hits and surface points of paths that go on.
    fn find_hits<S: Simd>(&mut self, simd: S, base: usize) {
        self.base = base;
        self.batch.clear();
        self.batch.of_camera = false;
        self.batch.neighbours = false;
        for (index, path) in self.current[base..].iter().take(BATCH).enumerate() {
            self.batch.set(index, path.ray, f64::INFINITY, path.starts_on);
        }
        for (block, hits) in self.hits.iter_mut().enumerate() {
            *hits = HitBlock::NONE;
            let live = self.batch.live(block);
            if live != 0 {
                self.frame.closest_hits_of(&self.batch.blocks[block], live, hits);
            }
        }
        self.counts.secondary += self.live_rays();
        if self.moving.is_some() {
            self.set_times();
            self.find_moving_surfaces(simd);
        } else {
            self.surfaces.find_of_batch(simd, &self.batch, &self.hits);
        }
    }

    fn live_rays(&self) -> u64 {
        (0..BLOCKS).map(|block| u64::from(self.batch.live(block).count_ones())).sum()
    }
}

/// Finds the closest hits of a tile of the camera.
fn find_closest<S: Simd>(
    simd: S,
    tile: &dyn PictureTile,
    hits: &mut [HitBlock; BLOCKS],
    scratch: &mut tile::Scratch,
) {
    simd.vectorize(
        #[inline(always)]
        || tile::find_closest::<S, dyn PictureTile>(simd, tile, hits, scratch),
    );
}
