//! Tiles of an orthographic camera: parallel rays that start on the plane through the origin of eye space.

use glam::DVec3;

use super::eye::combine;
use super::{
    BLOCKS, CameraTile, LocalRays, PictureTile, PrimitiveId, Projection, Ray, RaySource, SurfaceSource,
    TileRays, TileSamples,
};
use crate::frame::{Instance, ParallelRays, PreparedFrame};
use crate::simd::vector::Vec3x16;
use crate::simd::{Simd, three};

/// The rays of one tile of a frame with an orthographic camera.
pub(crate) struct ParallelTile<'a> {
    frame: &'a PreparedFrame,
    camera: &'a ParallelRays,
    samples: TileSamples<'a>,
    /// Projection of eye space.
    projection: Projection,
    /// Error bounds of coincident surfaces in the tile's picture and in depth: see [`Projection::drift`].
    drift: [f32; 2],
    /// Size of the tile's picture relative to that of the frame.
    enlarged: f64,
    /// Origin of the tile's centre, and the steps of origins to the right and down.
    steps: [DVec3; 3],
    rounded_steps: [[f32; 3]; 3],
    direction: [f32; 3],
}

impl<'a> ParallelTile<'a> {
    /// The rays of some samples; `camera` is that of the frame.
    pub(crate) fn new(frame: &'a PreparedFrame, camera: &'a ParallelRays, samples: TileSamples<'a>) -> Self {
        let [right, down] = camera.steps(samples.grid);
        let enlarged = samples.enlarged(camera.grid());
        let [across, along] = samples.middle();
        let steps = [camera.origin(across, along), right, down];
        let rounded_steps = three!(i => steps[i].as_vec3().to_array());
        let [x, y] = samples.center;
        let picture = frame.to_picture.enlarged(enlarged).shifted(x, y);
        let drift = Projection::drift(&picture, frame.coarsest);
        let projection = Projection::new(picture, 1.0, true).drifting(drift, 2.0 * frame.coarsest);
        let direction = camera.direction().as_vec3().to_array();
        Self { frame, camera, samples, projection, drift, enlarged, steps, rounded_steps, direction }
    }
}

impl RaySource for ParallelTile<'_> {
    fn frame(&self) -> &PreparedFrame {
        self.frame
    }

    #[inline(always)]
    fn live(&self, block: usize) -> u32 {
        self.samples.live[block]
    }

    fn ray(&self, block: usize, lane: usize) -> Ray {
        let [across, along] = self.samples.place(block, lane);
        Ray { origin: self.camera.origin(across, along), direction: self.camera.direction() }
    }

    #[inline(always)]
    fn starts_on(&self, _: usize, _: usize) -> Option<PrimitiveId> {
        None
    }
}

impl SurfaceSource for ParallelTile<'_> {
    const BLOCKS: usize = BLOCKS;
    const COMMON_ORIGIN: bool = false;
    type Local = LocalParallel;

    #[inline(always)]
    fn directions<S: Simd>(&self, simd: S, _: usize) -> Vec3x16<S> {
        Vec3x16::splat(simd, self.direction)
    }

    #[inline(always)]
    fn origins<S: Simd>(&self, simd: S, block: usize) -> Vec3x16<S> {
        combine(simd, &self.rounded_steps, self.samples.rays, block)
    }

    #[inline(always)]
    fn are_of_camera(&self) -> bool {
        true
    }

    #[inline(always)]
    fn places(&self) -> &TileRays {
        self.samples.rays
    }

    fn local(&self, instance: Option<&Instance>) -> LocalParallel {
        let single = |v: DVec3| v.as_vec3().to_array();
        let direction = self.camera.direction();
        let (direction, steps) = match instance {
            None => (direction, self.steps),
            Some(instance) => {
                let [center, right, down] = self.steps;
                let center = instance.inverse * (center - instance.translation);
                (instance.inverse * direction, [center, instance.inverse * right, instance.inverse * down])
            }
        };
        LocalParallel { direction: single(direction), steps: three!(i => single(steps[i])) }
    }
}

/// A tile of an orthographic camera in the space of a mesh.
pub(crate) struct LocalParallel {
    direction: [f32; 3],
    steps: [[f32; 3]; 3],
}

impl LocalRays<ParallelTile<'_>> for LocalParallel {
    #[inline(always)]
    fn origins<S: Simd>(&self, simd: S, tile: &ParallelTile<'_>, block: usize) -> Vec3x16<S> {
        combine(simd, &self.steps, tile.samples.rays, block)
    }

    #[inline(always)]
    fn directions<S: Simd>(&self, simd: S, _: &ParallelTile<'_>, _: usize) -> Vec3x16<S> {
        Vec3x16::splat(simd, self.direction)
    }
}

impl CameraTile for ParallelTile<'_> {
    #[inline(always)]
    fn samples(&self) -> &TileSamples<'_> {
        &self.samples
    }
}

impl PictureTile for ParallelTile<'_> {
    const PARALLEL: bool = true;
    const STARTS: bool = false;

    #[inline(always)]
    fn picture(&self) -> &TileRays {
        self.samples.rays
    }

    #[inline(always)]
    fn projection(&self) -> &Projection {
        &self.projection
    }

    #[inline(always)]
    fn projection_of(&self, instance: &Instance) -> Projection {
        let [x, y] = self.samples.center;
        Projection::new(instance.to_picture.enlarged(self.enlarged).shifted(x, y), 1.0, true)
            .drifting(self.drift, f64::from(instance.drift))
    }
}
