//! Batches: up to 256 rays of any origins and directions, as sixteen blocks, so that they are shaded as a tile is.

use glam::{DMat3, DVec3};

use super::{BLOCKS, LocalRays, PrimitiveId, Ray, RayBlock, RaySource, SurfaceSource, TileRays, TileSamples};
use crate::frame::{Instance, PreparedFrame};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Simd, each_bit};

/// Most rays of a batch.
pub(crate) const BATCH: usize = BLOCKS * LANES;

/// Up to 256 rays, ray i in lane i % 16 of block i / 16.
pub(crate) struct RayBatch<'a> {
    frame: &'a PreparedFrame,
    pub blocks: Box<[RayBlock<'a>; BLOCKS]>,
    /// Places of the rays in the camera's picture, in any unit and from any origin: shadow tiles follow their rows and columns.
    pub places: TileRays,
    /// Lengths of the ways of light between the rays and the camera, in eye units.
    pub ways: [[f64; LANES]; BLOCKS],
    /// Places of the rays' samples in the pattern of soft shadows. Only set in scenes with such shadows.
    pub patterns: [[u8; LANES]; BLOCKS],
    /// Whether most rays hit points near those of their neighbours.
    pub neighbours: bool,
    /// Whether the rays are those of a camera.
    pub(crate) of_camera: bool,
}

impl<'a> RayBatch<'a> {
    /// A batch without live rays.
    pub(crate) fn new(frame: &'a PreparedFrame) -> Self {
        let blocks = Box::new(std::array::from_fn(|_| RayBlock::new(frame)));
        Self {
            frame,
            blocks,
            places: TileRays::empty(),
            ways: [[0.0; LANES]; BLOCKS],
            patterns: [[0; LANES]; BLOCKS],
            neighbours: true,
            of_camera: false,
        }
    }

    /// Removes all rays.
    pub(crate) fn clear(&mut self) {
        self.blocks.iter_mut().for_each(RayBlock::clear);
    }

    /// Replaces the rays by those of some samples of a camera; `ray` is that of a place of the picture, in pixels from its top left
    /// corner, with its upper end.
    pub(super) fn put_samples(&mut self, samples: &TileSamples<'_>, ray: impl Fn(f64, f64) -> (Ray, f64)) {
        self.clear();
        self.of_camera = true;
        self.places.x = samples.rays.x;
        self.places.y = samples.rays.y;
        for block in 0..BLOCKS {
            self.patterns[block] = samples.pattern(block);
            for lane in each_bit(samples.live[block]) {
                let [across, along] = samples.place(block, lane);
                let (ray, t_max) = ray(across, along);
                self.set(block * LANES + lane, ray, t_max, None);
            }
        }
    }

    /// Sets ray `index`, below [`BATCH`]: hits within 0 < t < `t_max` count, except on the primitive that it starts on.
    pub(crate) fn set(&mut self, index: usize, ray: Ray, t_max: f64, starts_on: Option<PrimitiveId>) {
        self.blocks[index / LANES].set(index % LANES, ray, t_max, starts_on);
    }
}

impl RaySource for RayBatch<'_> {
    fn frame(&self) -> &PreparedFrame {
        self.frame
    }

    #[inline(always)]
    fn live(&self, block: usize) -> u32 {
        self.blocks[block].live(0)
    }

    fn ray(&self, block: usize, lane: usize) -> Ray {
        self.blocks[block].ray(0, lane)
    }

    fn starts_on(&self, block: usize, lane: usize) -> Option<PrimitiveId> {
        self.blocks[block].starts_on(0, lane)
    }
}

impl SurfaceSource for RayBatch<'_> {
    const BLOCKS: usize = BLOCKS;
    const COMMON_ORIGIN: bool = false;
    type Local = LocalBatch;

    #[inline(always)]
    fn directions<S: Simd>(&self, simd: S, block: usize) -> Vec3x16<S> {
        self.blocks[block].directions(simd)
    }

    #[inline(always)]
    fn origins<S: Simd>(&self, simd: S, block: usize) -> Vec3x16<S> {
        self.blocks[block].origins(simd)
    }

    fn local(&self, instance: Option<&Instance>) -> LocalBatch {
        LocalBatch(instance.map(|instance| (instance.inverse, instance.translation)))
    }

    fn are_of_camera(&self) -> bool {
        self.of_camera
    }

    fn are_neighbours(&self) -> bool {
        self.neighbours
    }

    fn places(&self) -> &TileRays {
        &self.places
    }

    fn pattern(&self, block: usize) -> [u8; LANES] {
        self.patterns[block]
    }

    fn way_before(&self, block: usize, lane: usize) -> f64 {
        self.ways[block][lane]
    }
}

/// The map from eye space to the space of a mesh, if that is another one: its linear part, after a shift by the negative of a
/// translation. A block is transformed when a hit of its rays needs it: most rays of a batch hit other meshes.
pub(crate) struct LocalBatch(Option<(DMat3, DVec3)>);

impl LocalRays<RayBatch<'_>> for LocalBatch {
    #[inline(always)]
    fn origins<S: Simd>(&self, simd: S, batch: &RayBatch<'_>, block: usize) -> Vec3x16<S> {
        match &self.0 {
            Some((inverse, translation)) => {
                batch.blocks[block].mapped(simd, |ray| *inverse * (ray.origin - *translation))
            }
            None => batch.blocks[block].origins(simd),
        }
    }

    #[inline(always)]
    fn directions<S: Simd>(&self, simd: S, batch: &RayBatch<'_>, block: usize) -> Vec3x16<S> {
        match &self.0 {
            Some((inverse, _)) => batch.blocks[block].mapped(simd, |ray| *inverse * ray.direction),
            None => batch.blocks[block].directions(simd),
        }
    }
}
