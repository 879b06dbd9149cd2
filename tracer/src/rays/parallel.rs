//! Tiles of an orthographic camera: parallel rays that start on the plane through the origin of eye space. Their hits are found
//! as a tile, and shaded as a batch.

use super::{PictureTile, PrimitiveId, Projection, Ray, RayBatch, RaySource, TileRays, TileSamples};
use crate::frame::{Instance, ParallelRays, PreparedFrame};

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
}

impl<'a> ParallelTile<'a> {
    /// The rays of some samples; `camera` is that of the frame.
    pub(crate) fn new(frame: &'a PreparedFrame, camera: &'a ParallelRays, samples: TileSamples<'a>) -> Self {
        let enlarged = samples.enlarged(camera.grid());
        let [x, y] = samples.center;
        let picture = frame.to_picture.enlarged(enlarged).shifted(x, y);
        let drift = Projection::drift(&picture, frame.coarsest);
        let projection = Projection::new(picture, 1.0, true).drifting(drift, 2.0 * frame.coarsest);
        Self { frame, camera, samples, projection, drift, enlarged }
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

impl RayBatch<'_> {
    /// Replaces the rays by those of some samples of an orthographic camera.
    pub(crate) fn put_parallel(&mut self, camera: &ParallelRays, samples: &TileSamples<'_>) {
        self.put_samples(samples, |across, along| {
            (Ray { origin: camera.origin(across, along), direction: camera.direction() }, f64::INFINITY)
        });
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
