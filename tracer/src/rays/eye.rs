//! Tiles of the camera: rays that start at the origin of eye space.

use glam::DVec3;

use super::{BLOCKS, LocalRays, PrimitiveId, Projection, Ray, RaySource, SurfaceSource, TileRays};
use crate::frame::{Instance, PreparedFrame};
use crate::light::extent::place_in_pattern;
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Simd, three};

/// The rays of one tile of a frame.
pub(crate) struct EyeTile<'a> {
    pub frame: &'a PreparedFrame,
    pub rays: &'a TileRays,
    /// Projection of eye space.
    pub projection: Projection,
    /// Bits of the live rays of each block.
    pub live: [u32; BLOCKS],
    /// Error bounds of coincident surfaces in the tile's picture and in depth: see [`Projection::drift`].
    drift: [f32; 2],
    /// Samples along a side of a pixel, in units of the tile.
    grid: f64,
    /// Size of the tile's picture relative to that of the frame.
    enlarged: f64,
    /// The tile's centre, in samples of the tile from the top left corner of the picture.
    center: [f64; 2],
    /// Direction through the tile's centre, and the steps to the right and down.
    steps: [DVec3; 3],
    rounded_steps: [[f32; 3]; 3],
}

impl<'a> EyeTile<'a> {
    /// Rays around `center`, in samples from the top left corner of the picture; `grid` samples are along a side of a pixel.
    pub(crate) fn new(
        frame: &'a PreparedFrame,
        rays: &'a TileRays,
        live: [u32; BLOCKS],
        center: [f64; 2],
        grid: u32,
    ) -> Self {
        let [right, down] = frame.rays.steps(grid);
        let enlarged = f64::from(grid) / f64::from(frame.rays.grid());
        let grid = f64::from(grid);
        let steps = [frame.rays.through(center[0] / grid, center[1] / grid), right, down];
        let rounded_steps = three!(i => steps[i].as_vec3().to_array());
        let picture = frame.to_picture.enlarged(enlarged).centered(center[0], center[1]);
        let [near, far] = Projection::drift(&picture, frame.coarsest);
        let projection = Projection::new(picture, 1.0, false).drifting([near, far], 2.0 * frame.coarsest);
        let drift = [near, far];
        Self { frame, rays, projection, drift, grid, enlarged, center, live, steps, rounded_steps }
    }

    /// Projection of an instance's mesh.
    #[inline(always)]
    pub(crate) fn projection_of(&self, instance: &Instance) -> Projection {
        let [x, y] = self.center;
        Projection::new(instance.to_picture.enlarged(self.enlarged).centered(x, y), 1.0, false)
            .drifting(self.drift, f64::from(instance.drift))
    }

    /// The place of a ray's sample in the pattern of soft shadows.
    pub(crate) fn place_in_pattern(&self, block: usize, lane: usize) -> u8 {
        let along = |axis: usize, place: f32| self.center[axis] + f64::from(place);
        place_in_pattern(along(0, self.rays.x[block].0[lane]), along(1, self.rays.y[block].0[lane]))
    }
}

impl RaySource for EyeTile<'_> {
    #[inline(always)]
    fn frame(&self) -> &PreparedFrame {
        self.frame
    }

    #[inline(always)]
    fn live(&self, block: usize) -> u32 {
        self.live[block]
    }

    fn ray(&self, block: usize, lane: usize) -> Ray {
        let x = self.center[0] + f64::from(self.rays.x[block].0[lane]);
        let y = self.center[1] + f64::from(self.rays.y[block].0[lane]);
        Ray { origin: DVec3::ZERO, direction: self.frame.rays.through(x / self.grid, y / self.grid) }
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
        combine(simd, &self.rounded_steps, self.rays, block)
    }

    #[inline(always)]
    fn origins<S: Simd>(&self, simd: S, _: usize) -> Vec3x16<S> {
        Vec3x16::splat(simd, [0.0; 3])
    }

    #[inline(always)]
    fn places(&self) -> &TileRays {
        self.rays
    }

    fn pattern(&self, block: usize) -> [u8; LANES] {
        std::array::from_fn(|lane| self.place_in_pattern(block, lane))
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

/// A tile of the camera in the space of a mesh.
pub(crate) struct LocalTile {
    origin: [f32; 3],
    steps: [[f32; 3]; 3],
}

impl LocalRays<EyeTile<'_>> for LocalTile {
    #[inline(always)]
    fn origins<S: Simd>(&self, simd: S, _: usize) -> Vec3x16<S> {
        Vec3x16::splat(simd, self.origin)
    }

    #[inline(always)]
    fn directions<S: Simd>(&self, simd: S, tile: &EyeTile<'_>, block: usize) -> Vec3x16<S> {
        combine(simd, &self.steps, tile.rays, block)
    }
}

/// Directions of the rays of a block, from the direction of the tile's centre and the steps to the right and down.
#[inline(always)]
fn combine<S: Simd>(simd: S, steps: &[[f32; 3]; 3], rays: &TileRays, block: usize) -> Vec3x16<S> {
    let (x, y) = (rays.x[block].load(simd), rays.y[block].load(simd));
    let [center, right, down] = three!(i => Vec3x16::splat(simd, steps[i]));
    center.add(right.scale(x)).add(down.scale(y))
}
