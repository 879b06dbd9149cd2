//! Tiles of a pinhole camera: rays that start at the origin of eye space.

use glam::DVec3;

use super::{
    BLOCKS, LocalRays, PictureTile, PrimitiveId, Projection, Ray, RaySource, SurfaceSource, TileRays,
    TileSamples,
};
use crate::frame::{Affine, Instance, PinholeRays, PreparedFrame};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Simd, three};

/// The rays of one tile of a frame with a pinhole camera.
pub(crate) struct EyeTile<'a> {
    frame: &'a PreparedFrame,
    camera: &'a PinholeRays,
    samples: TileSamples<'a>,
    /// Projection of eye space.
    projection: Projection,
    /// Error bounds of coincident surfaces in the tile's picture and in depth: see [`Projection::drift`].
    drift: [f32; 2],
    /// Size of the tile's picture relative to that of the frame.
    enlarged: f64,
    /// Direction through the tile's centre, and the steps to the right and down.
    steps: [DVec3; 3],
    rounded_steps: [[f32; 3]; 3],
}

impl<'a> EyeTile<'a> {
    /// The rays of some samples; `camera` is that of the frame.
    pub(crate) fn new(frame: &'a PreparedFrame, camera: &'a PinholeRays, samples: TileSamples<'a>) -> Self {
        let [right, down] = camera.steps(samples.grid);
        let enlarged = samples.enlarged(camera.grid());
        let [across, along] = samples.middle();
        let steps = [camera.through(across, along), right, down];
        let rounded_steps = three!(i => steps[i].as_vec3().to_array());
        let [x, y] = samples.center;
        let picture = frame.to_picture.enlarged(enlarged).centered(x, y);
        let drift = Projection::drift(&picture, frame.coarsest);
        let projection = Projection::new(picture, 1.0, false).drifting(drift, 2.0 * frame.coarsest);
        Self { frame, camera, samples, projection, drift, enlarged, steps, rounded_steps }
    }
}

impl<'a> EyeTile<'a> {
    /// The frame, for as long as it lives.
    pub(super) fn of_frame(&self) -> &'a PreparedFrame {
        self.frame
    }

    /// Map from eye space to the tile's picture.
    pub(super) fn map(&self) -> Affine {
        let [x, y] = self.samples.center;
        self.frame.to_picture.enlarged(self.enlarged).centered(x, y)
    }

    /// Error bounds of coincident surfaces in the tile's picture and in depth.
    pub(super) fn drift(&self) -> [f32; 2] {
        self.drift
    }
}

impl RaySource for EyeTile<'_> {
    #[inline(always)]
    fn frame(&self) -> &PreparedFrame {
        self.frame
    }

    #[inline(always)]
    fn live(&self, block: usize) -> u32 {
        self.samples.live[block]
    }

    fn ray(&self, block: usize, lane: usize) -> Ray {
        let [across, along] = self.samples.place(block, lane);
        Ray { origin: DVec3::ZERO, direction: self.camera.through(across, along) }
    }

    #[inline(always)]
    fn starts_on(&self, _: usize, _: usize) -> Option<PrimitiveId> {
        None
    }
}

impl SurfaceSource for EyeTile<'_> {
    const BLOCKS: usize = BLOCKS;
    const COMMON_ORIGIN: bool = true;
    type Local = LocalTile;

    #[inline(always)]
    fn directions<S: Simd>(&self, simd: S, block: usize) -> Vec3x16<S> {
        combine(simd, &self.rounded_steps, self.samples.rays, block)
    }

    #[inline(always)]
    fn origins<S: Simd>(&self, simd: S, _: usize) -> Vec3x16<S> {
        Vec3x16::splat(simd, [0.0; 3])
    }

    #[inline(always)]
    fn are_of_camera(&self) -> bool {
        true
    }

    #[inline(always)]
    fn places(&self) -> &TileRays {
        self.samples.rays
    }

    fn eye(&self) -> Option<&EyeTile<'_>> {
        Some(self)
    }

    fn pattern(&self, block: usize) -> [u8; LANES] {
        self.samples.pattern(block)
    }

    fn local(&self, instance: Option<&Instance>) -> LocalTile {
        let single = |v: DVec3| v.as_vec3().to_array();
        match instance {
            None => LocalTile { origin: [0.0; 3], steps: three!(i => single(self.steps[i])) },
            Some(instance) => LocalTile {
                origin: single(instance.inverse * -instance.translation),
                steps: three!(i => single(instance.inverse * self.steps[i])),
            },
        }
    }
}

impl PictureTile for EyeTile<'_> {
    const PARALLEL: bool = false;
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
        Projection::new(instance.to_picture.enlarged(self.enlarged).centered(x, y), 1.0, false)
            .drifting(self.drift, f64::from(instance.drift))
    }
}

/// A tile of a pinhole camera in the space of a mesh.
pub(crate) struct LocalTile {
    origin: [f32; 3],
    steps: [[f32; 3]; 3],
}

impl LocalRays<EyeTile<'_>> for LocalTile {
    #[inline(always)]
    fn origins<S: Simd>(&self, simd: S, _: &EyeTile<'_>, _: usize) -> Vec3x16<S> {
        Vec3x16::splat(simd, self.origin)
    }

    #[inline(always)]
    fn directions<S: Simd>(&self, simd: S, tile: &EyeTile<'_>, block: usize) -> Vec3x16<S> {
        combine(simd, &self.steps, tile.samples.rays, block)
    }
}

/// Vectors of the rays of a block (directions, or origins), from that of the tile's centre and the steps to the right and down.
#[inline(always)]
pub(super) fn combine<S: Simd>(simd: S, steps: &[[f32; 3]; 3], rays: &TileRays, block: usize) -> Vec3x16<S> {
    let (x, y) = (rays.x[block].load(simd), rays.y[block].load(simd));
    let [center, right, down] = three!(i => Vec3x16::splat(simd, steps[i]));
    center.add(right.scale(x)).add(down.scale(y))
}
