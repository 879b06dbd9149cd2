//! Traits of ray sources.
//!
//! A source is blocks of sixteen rays. Its rays are compiled for each kind of source, so that a tile of the camera pays
//! nothing for origins that differ.

use super::{BLOCKS, EyeTile, PrimitiveId, Projection, Ray, TileRays};
use crate::frame::{Instance, PreparedFrame};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, bits, f32x16};

/// Blocks of sixteen rays of one frame.
pub(crate) trait RaySource {
    /// The frame that the rays are traced in.
    fn frame(&self) -> &PreparedFrame;

    /// Bits of the live rays of a block; the others hit nothing.
    fn live(&self, block: usize) -> u32;

    /// A ray in eye space, exactly.
    fn ray(&self, block: usize, lane: usize) -> Ray;

    /// The primitive that a ray starts on. The ray does not hit it again, except for the far side of a sphere.
    fn starts_on(&self, block: usize, lane: usize) -> Option<PrimitiveId>;
}

/// Rays whose hits become surface points: see `surface`.
pub(crate) trait SurfaceSource: RaySource + Sized {
    /// Number of blocks.
    const BLOCKS: usize;

    /// Whether all rays start at the origin of eye space.
    const COMMON_ORIGIN: bool;

    /// Whether the rays are those of the camera, which do not see a background that is not visible.
    fn are_of_camera(&self) -> bool;

    /// The rays in the space of a mesh.
    type Local: LocalRays<Self>;

    /// Directions of the rays of a block in eye space, rounded.
    fn directions<S: Simd>(&self, simd: S, block: usize) -> Vec3x16<S>;

    /// Origins of the rays of a block in eye space, rounded.
    fn origins<S: Simd>(&self, simd: S, block: usize) -> Vec3x16<S>;

    /// Whether most rays hit points near those of their neighbours, so that their shadow rays are worth a tile.
    fn are_neighbours(&self) -> bool {
        true
    }

    /// Places of the rays in the camera's picture.
    fn places(&self) -> &TileRays;

    /// The tile of a pinhole camera that the rays are, if they are one.
    fn eye(&self) -> Option<&EyeTile<'_>> {
        None
    }

    /// Places of the samples of a block's rays in the pattern of soft shadows: see [`crate::light::extent::place_in_pattern`].
    fn pattern(&self, block: usize) -> [u8; LANES];

    /// The rays in the space of an instance's mesh, or in eye space.
    fn local(&self, instance: Option<&Instance>) -> Self::Local;

    /// Length of the way of the light before a ray, in eye units: that of the rays between it and the camera.
    fn way_before(&self, _block: usize, _lane: usize) -> f64 {
        0.0
    }

    /// Points at `t` along the rays of a block. `direction` is that of [`SurfaceSource::directions`].
    #[inline(always)]
    fn points<S: Simd>(&self, simd: S, block: usize, direction: Vec3x16<S>, t: f32x16<S>) -> Vec3x16<S> {
        let along = direction.scale(t);
        if Self::COMMON_ORIGIN { along } else { self.origins(simd, block).add(along) }
    }
}

/// Tiles that are a picture of the scene: their closest hits are found together, see `intersect::tile`. That is compiled for tiles of a
/// pinhole camera, and once more for all others.
pub(crate) trait PictureTile: RaySource {
    /// Whether rays are parallel and start at depth 0, and do not start at a point.
    fn is_parallel(&self) -> bool;

    /// Places of the rays in the picture.
    fn picture(&self) -> &TileRays;

    /// Projection of eye space.
    fn projection(&self) -> &Projection;

    /// Projection of an instance's mesh.
    fn projection_of(&self, instance: &Instance) -> Projection;

    /// Depth of the point at `t` along a ray.
    fn depth(&self, block: usize, lane: usize, t: f64) -> f64;

    /// The primitive and the depths that the rays start at, if these are not the same for all.
    fn starts(&self) -> Option<&Starts>;
}

/// Starts of the rays of a tile: on one primitive, at depths of their own.
pub(crate) struct Starts {
    pub primitive: PrimitiveId,
    /// Bounds of the closeness of the starts.
    pub low: [Lanes; BLOCKS],
    pub high: [Lanes; BLOCKS],
}

impl Starts {
    /// Bits of the rays of a block that start before a closeness with these bounds: those that may, and those that do for certain.
    #[inline(always)]
    pub(crate) fn before<S: Simd>(&self, simd: S, block: usize, low: f32x16<S>, high: f32x16<S>) -> [u32; 2] {
        let [least, most] = [self.low[block].load(simd), self.high[block].load(simd)];
        // All that is not before the start for certain, even if a number is NaN.
        [0xffff & !bits(low.simd_gt(most)), bits(high.simd_lt(least))]
    }
}

/// The rays of a source in another space, rounded.
pub(crate) trait LocalRays<R> {
    /// Origins of the rays of a block.
    fn origins<S: Simd>(&self, simd: S, rays: &R, block: usize) -> Vec3x16<S>;

    /// Directions of the rays of a block.
    fn directions<S: Simd>(&self, simd: S, rays: &R, block: usize) -> Vec3x16<S>;
}
