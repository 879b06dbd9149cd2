//! Tiles of a light: rays from the points of a tile to a point light, or parallel rays to a directional light.

use glam::{DVec3, Vec3};

use super::{BLOCKS, HitBlock, PrimitiveId, Ray, RaySource, TileRays};
use crate::frame::PreparedFrame;
use crate::simd::{Lanes, three};

/// Target of shadow rays, in eye space.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ShadowTarget {
    /// A point.
    Point(DVec3),
    /// A direction.
    Parallel(DVec3),
}

/// Shadow rays from the points of a tile to one light.
pub(crate) struct ShadowTile<'a> {
    pub frame: &'a PreparedFrame,
    pub light: ShadowTarget,
    /// Upper end of the rays, as a fraction of the distance to a point light.
    pub t_max: f64,
    /// Places of the points in the camera's picture.
    pub grid: &'a TileRays,
    /// Origins of the rays in eye space, indexed `[block][axis]`.
    pub points: &'a [[Lanes; 3]; BLOCKS],
    /// The primitives that the points are on.
    pub hits: &'a [HitBlock; BLOCKS],
    /// Bits of the points that are tested, block by block.
    pub live: [u32; BLOCKS],
}

impl RaySource for ShadowTile<'_> {
    #[inline(always)]
    fn frame(&self) -> &PreparedFrame {
        self.frame
    }

    #[inline(always)]
    fn live(&self, block: usize) -> u32 {
        self.live[block]
    }

    /// The ray from a point to the light; a point light is at t = 1.
    fn ray(&self, block: usize, lane: usize) -> Ray {
        let point = Vec3::from_array(three!(axis => self.points[block][axis].0[lane]));
        let origin = point.as_dvec3();
        let direction = match self.light {
            ShadowTarget::Point(light) => light - origin,
            ShadowTarget::Parallel(to_light) => to_light,
        };
        Ray { origin, direction }
    }

    fn starts_on(&self, block: usize, lane: usize) -> Option<PrimitiveId> {
        self.hits[block].primitive(lane)
    }
}
