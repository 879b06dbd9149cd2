//! Blocks of any sixteen rays: the rays of bounces, which have no origin in common.

use glam::DVec3;

use super::{PrimitiveId, Ray, RaySource};
use crate::frame::PreparedFrame;
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd};

/// Up to sixteen rays of any origins and directions.
#[derive(Clone)]
pub(crate) struct RayBlock<'a> {
    frame: &'a PreparedFrame,
    rays: [Ray; LANES],
    /// Upper ends of the rays.
    t_max: [f64; LANES],
    /// The primitives that rays start on.
    starts_on: [Option<PrimitiveId>; LANES],
    /// Bits of the live rays.
    live: u32,
    /// Origins and directions in eye space, rounded, by axis.
    origin: [Lanes; 3],
    direction: [Lanes; 3],
}

impl<'a> RayBlock<'a> {
    /// A block without live rays.
    pub(crate) fn new(frame: &'a PreparedFrame) -> Self {
        let along = Ray { origin: DVec3::ZERO, direction: DVec3::X };
        Self {
            frame,
            rays: [along; LANES],
            t_max: [0.0; LANES],
            starts_on: [None; LANES],
            live: 0,
            origin: [Lanes::ZERO; 3],
            direction: [Lanes([1.0; LANES]), Lanes::ZERO, Lanes::ZERO],
        }
    }

    /// Sets the ray of a lane: hits within 0 < t < `t_max` count, except on the primitive that it starts on.
    pub(crate) fn set(&mut self, lane: usize, ray: Ray, t_max: f64, starts_on: Option<PrimitiveId>) {
        self.rays[lane] = ray;
        self.t_max[lane] = t_max;
        self.starts_on[lane] = starts_on;
        self.live |= 1 << lane;
        put(&mut self.origin, lane, ray.origin);
        put(&mut self.direction, lane, ray.direction);
    }

    /// Removes all rays.
    pub(crate) fn clear(&mut self) {
        self.live = 0;
    }

    /// Upper end of a ray.
    pub(crate) fn t_max(&self, lane: usize) -> f64 {
        self.t_max[lane]
    }

    /// Directions in eye space, rounded.
    #[inline(always)]
    pub(crate) fn directions<S: Simd>(&self, simd: S) -> Vec3x16<S> {
        Vec3x16::load(simd, &self.direction)
    }

    /// Origins in eye space, rounded.
    #[inline(always)]
    pub(crate) fn origins<S: Simd>(&self, simd: S) -> Vec3x16<S> {
        Vec3x16::load(simd, &self.origin)
    }

    /// A vector of each ray, rounded; undefined for rays that are not live.
    #[inline(always)]
    pub(crate) fn mapped<S: Simd>(&self, simd: S, of: impl Fn(&Ray) -> DVec3) -> Vec3x16<S> {
        let mut lanes = [Lanes::ZERO; 3];
        for (lane, ray) in self.rays.iter().enumerate() {
            put(&mut lanes, lane, of(ray));
        }
        Vec3x16::load(simd, &lanes)
    }
}

impl RaySource for RayBlock<'_> {
    fn frame(&self) -> &PreparedFrame {
        self.frame
    }

    fn live(&self, _: usize) -> u32 {
        self.live
    }

    fn ray(&self, _: usize, lane: usize) -> Ray {
        self.rays[lane]
    }

    fn starts_on(&self, _: usize, lane: usize) -> Option<PrimitiveId> {
        self.starts_on[lane]
    }
}

#[inline(always)]
fn put(lanes: &mut [Lanes; 3], lane: usize, vector: DVec3) {
    for axis in 0..3 {
        lanes[axis].0[lane] = vector[axis] as f32;
    }
}
