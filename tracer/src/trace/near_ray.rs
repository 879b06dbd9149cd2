//! A ray in `f32`, near what it may hit, and what the rounding may cost.

use glam::{DVec3, Vec3};

use super::Ray;

/// Rays that start farther out than this, in units of their space (what is traced lies within [-1, 1] or so), are started
/// where they come near: then the digits of an `f32` are spent there, however far the ray comes from.
pub(super) const FAR: f32 = 4.0;

/// Error of a coordinate relative to a corner, sheared, in shares of the largest number that went into it: the sum of
/// ten roundings of at most 2^-24, and room.
const ROUNDING: f32 = 0.6875 / (1 << 20) as f32;

/// Directions whose largest component is not within these are scaled, so that no product overflows in `f32`.
const USUAL: std::ops::Range<f32> = 1.0 / (1 << 30) as f32..(1 << 30) as f32;

/// Components of directions are at least this large: the ray is tilted by less than the error that its coordinates have
/// anyhow, and no reciprocal overflows.
const LEAST_COMPONENT: f32 = 1.0 / (1_u128 << 75) as f32;

/// How far before a box a ray is started: far more than the rounding of its origin to `f32` may carry it past a flat box,
/// and far less than would cost digits.
const RUN_UP: f64 = 1.0 / (1 << 18) as f64;

/// A ray with a direction of no unusual length.
pub(super) struct NearRay {
    /// By axis. The fourth numbers of all are idle: a number below four is an index that needs no check.
    pub origin: [f32; 4],
    pub direction: [f32; 4],
    /// Reciprocals of the direction.
    pub inverse: [f32; 4],
    /// The axis of the largest component of the direction.
    pub axis: usize,
    /// Bound for the error of coordinates.
    pub error: f32,
    /// t = `start` + distance * `scale`, a power of two; and its reciprocal.
    start: f64,
    scale: f64,
    per_t: f64,
}

impl NearRay {
    /// `None` if the ray misses the box by far. `drift`: how far, on each axis, what coincides may be apart.
    #[inline(always)]
    pub(super) fn new(ray: Ray, drift: f32, bounds: impl FnOnce() -> (Vec3, Vec3)) -> Option<Self> {
        let mut origin = in_four(ray.origin);
        let mut size = largest(&origin);
        let mut start = 0.0;
        if !(size <= FAR) {
            // The last part is the rounding of the origin in `f64`.
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
        // Sheared, a drift counts on two axes.
        let error = (1.0 + size) * ROUNDING + 2.0 * drift;
        Some(Self { origin, direction, inverse, axis, error, start, scale, per_t })
    }

    /// The t of a distance.
    #[inline(always)]
    pub(super) fn t(&self, distance: f32) -> f64 {
        self.start + f64::from(distance) * self.scale
    }

    /// A distance that a `t` does not exceed.
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

/// The magnitude of the largest of three. `f32::max` takes care of NaN, which costs two instructions more each.
#[inline(always)]
fn largest(&[x, y, z, _]: &[f32; 4]) -> f32 {
    let (x, y, z) = (x.abs(), y.abs(), z.abs());
    let two = if x > y { x } else { y };
    if two > z { two } else { z }
}

/// Two powers of two: one that brings `number` into [1, 2), and its reciprocal.
#[cold]
fn power_of_two_at(number: f64) -> (f64, f64) {
    // The exponents of f64 stand above its 52 bits of fraction, biased by 1023.
    let exponent = (number.to_bits() >> 52).clamp(1, 2045);
    (f64::from_bits((2046 - exponent) << 52), f64::from_bits(exponent << 52))
}

/// Where to start a ray so that it enters a box soon, 0 if it starts inside or close by; `None` if it misses the box.
#[cold]
fn approach(ray: &Ray, (lo, hi): (Vec3, Vec3)) -> Option<f64> {
    let (mut near, mut far) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let inverse = 1.0 / ray.direction[axis];
        let (entry, exit) = if inverse.is_sign_negative() { (hi, lo) } else { (lo, hi) };
        // Written so that a NaN (a ray inside the plane of a side) changes nothing.
        let t_entry = (f64::from(entry[axis]) - ray.origin[axis]) * inverse;
        let t_exit = (f64::from(exit[axis]) - ray.origin[axis]) * inverse;
        near = if t_entry > near { t_entry } else { near };
        far = if t_exit < far { t_exit } else { far };
    }
    let run_up = RUN_UP / ray.direction.abs().max_element();
    (near <= far * (1.0 + 1e-12)).then_some((near - run_up).max(0.0))
}
