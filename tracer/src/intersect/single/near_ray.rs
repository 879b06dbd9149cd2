//! A ray in `f32` that starts near the geometry, with error bounds.

use glam::{DVec3, Vec3};

use crate::rays::Ray;

/// Largest coordinate of an origin, in units of the space, whose geometry is within about [-1, 1]. Rays from farther away are
/// started near the geometry, so that the digits of an `f32` serve there.
const FAR: f32 = 4.0;

/// Error of a sheared coordinate relative to a corner, as a fraction of the largest number that went into it: the sum of ten
/// roundings of at most 2^-24, with a margin.
const ROUNDING: f32 = 0.6875 / (1 << 20) as f32;

/// Range of the largest component of a direction. Others are scaled, so that no product overflows in `f32`.
const USUAL: std::ops::Range<f32> = 1.0 / (1 << 30) as f32..(1 << 30) as f32;

/// Smallest component of a direction, so that no reciprocal overflows. It tilts a ray by less than the error bound of its
/// coordinates.
const LEAST_COMPONENT: f32 = 1.0 / (1_u128 << 75) as f32;

/// Distance from a ray's start to the box: far more than the rounding of the origin to `f32`, which could move it past a flat
/// box, and far less than would cost digits.
const RUN_UP: f64 = 1.0 / (1 << 18) as f64;

/// A ray in `f32` whose direction is within [`USUAL`].
pub(super) struct NearRay {
    /// By axis. The fourth numbers are padding: an index below four needs no bounds check.
    pub origin: [f32; 4],
    pub direction: [f32; 4],
    /// Reciprocals of the direction.
    pub inverse: [f32; 4],
    /// Axis of the direction's largest component.
    pub axis: usize,
    /// Error bound of coordinates.
    pub error: f32,
    /// t = `start` + distance * `scale`, a power of two; `per_t` is its reciprocal.
    start: f64,
    scale: f64,
    per_t: f64,
}

impl NearRay {
    /// Rounds a ray; `None` if it starts far away and misses the box. `drift` is the largest distance of coincident points, on
    /// each axis.
    #[inline(always)]
    pub(super) fn new(ray: Ray, drift: f32, bounds: impl FnOnce() -> (Vec3, Vec3)) -> Option<Self> {
        let mut origin = in_four(ray.origin);
        let mut size = largest(&origin);
        let mut start = 0.0;
        if !(size <= FAR) {
            // Rounding of the origin in `f64`.
            let rounding = ray.origin.abs().max_element() / f64::from(1 << 26);
            start = approach(&ray, bounds())?;
            origin = in_four(ray.origin + ray.direction * start);
            size = largest(&origin) + rounding as f32;
        }
        let mut direction = in_four(ray.direction);
        let (mut scale, mut per_t) = (1.0, 1.0);
        if !USUAL.contains(&largest(&direction)) {
            (scale, per_t) = power_of_two_at(ray.direction.abs().max_element());
            direction = in_four(ray.direction * scale);
        }
        let mut inverse = [0.0; 4];
        for (inverse, component) in inverse.iter_mut().zip(direction) {
            let size = component.abs();
            *inverse =
                1.0 / (if size > LEAST_COMPONENT { size } else { LEAST_COMPONENT }).copysign(component);
        }
        let [x, y, z, _] = direction;
        let (x, y, z) = (x.abs(), y.abs(), z.abs());
        let axis = if x >= y && x >= z { 0 } else { 1 + usize::from(y < z) };
        // A shear adds the drift of two axes.
        let error = (1.0 + size) * ROUNDING + 2.0 * drift;
        Some(Self { origin, direction, inverse, axis, error, start, scale, per_t })
    }

    /// The t at a distance.
    #[inline(always)]
    pub(super) fn t(&self, distance: f32) -> f64 {
        self.start + f64::from(distance) * self.scale
    }

    /// A distance not below that of `t`.
    #[inline(always)]
    pub(super) fn distance(&self, t: f64) -> f32 {
        const UP: f64 = 1.0 + 1.0 / (1 << 22) as f64;
        ((t - self.start) * self.per_t * UP) as f32 + f32::MIN_POSITIVE
    }
}

#[inline(always)]
fn in_four(vector: DVec3) -> [f32; 4] {
    [vector.x as f32, vector.y as f32, vector.z as f32, 1.0]
}

/// The largest magnitude of three. `f32::max` handles NaN, at two more instructions each.
#[inline(always)]
fn largest(&[x, y, z, _]: &[f32; 4]) -> f32 {
    let (x, y, z) = (x.abs(), y.abs(), z.abs());
    let two = if x > y { x } else { y };
    if two > z { two } else { z }
}

/// The power of two that brings `number` into [1, 2), and its reciprocal.
#[cold]
fn power_of_two_at(number: f64) -> (f64, f64) {
    // The exponent of an f64 is above its 52 bits of fraction, with a bias of 1023.
    let exponent = (number.to_bits() >> 52).clamp(1, 2045);
    (f64::from_bits((2046 - exponent) << 52), f64::from_bits(exponent << 52))
}

/// The t at which a ray is started, shortly before it enters a box; 0 if it starts inside or nearby, `None` if it misses.
#[cold]
fn approach(ray: &Ray, (lo, hi): (Vec3, Vec3)) -> Option<f64> {
    let (mut near, mut far) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let inverse = 1.0 / ray.direction[axis];
        let (entry, exit) = if inverse.is_sign_negative() { (hi, lo) } else { (lo, hi) };
        // A NaN (a ray in the plane of a side) changes nothing.
        let t_entry = (f64::from(entry[axis]) - ray.origin[axis]) * inverse;
        let t_exit = (f64::from(exit[axis]) - ray.origin[axis]) * inverse;
        near = if t_entry > near { t_entry } else { near };
        far = if t_exit < far { t_exit } else { far };
    }
    let run_up = RUN_UP / ray.direction.abs().max_element();
    (near <= far * (1.0 + 1e-12)).then_some((near - run_up).max(0.0))
}
