//! Directions into the cone in which a point sees a ball, uniform over solid angle.

use std::f32::consts::TAU;

use glam::{DVec3, Vec3};

use super::LightSamples;
use super::triangle::put;
use crate::simd::math::sin_cos;
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, SimdFloat, bits, each_bit, f32x16, select, splat};

/// A ball in eye space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    center: Vec3,
    radius: f32,
}

impl Ball {
    pub(super) fn new(center: DVec3, radius: f64) -> Self {
        Self { center: center.as_vec3(), radius: radius as f32 }
    }

    /// Its surface in square eye units.
    pub(super) fn area(&self) -> f64 {
        4.0 * std::f64::consts::PI * f64::from(self.radius) * f64::from(self.radius)
    }

    /// Density over solid angle of the directions from a point; 0 inside.
    pub(super) fn density_from(&self, point: Vec3) -> f32 {
        let way = self.center - point;
        let square = self.radius * self.radius / (way.x * way.x + way.y * way.y + way.z * way.z);
        if square < 1.0 { 1.0 / (TAU * height(square)) } else { 0.0 }
    }
}

/// 1 - cos of an angle, from the square of its sine.
fn height(sine_square: f32) -> f32 {
    sine_square / (1.0 + (1.0 - sine_square).sqrt())
}

/// Samples a direction to the chosen ball of each lane. Returns the lanes that are outside of it.
#[inline(always)]
pub(super) fn sample<'t, S: Simd>(
    simd: S,
    (points, lanes): (Vec3x16<S>, u32),
    chosen: impl Fn(usize) -> Option<&'t Ball>,
    at: [f32x16<S>; 2],
    samples: &mut LightSamples,
) -> u32 {
    let mut center = [Lanes::ZERO; 3];
    let mut radius = Lanes([1.0; LANES]);
    for lane in each_bit(lanes) {
        let Some(ball) = chosen(lane) else { continue };
        for axis in 0..3 {
            center[axis].0[lane] = ball.center[axis];
        }
        radius.0[lane] = ball.radius;
    }
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let way = Vec3x16::load(simd, &center).sub(points);
    let radius = radius.load(simd);
    let square = way.dot(way);
    let sine_square = radius * radius / square;
    let outside = bits(sine_square.simd_lt(one));
    let sine_square = select(sine_square.simd_lt(one), sine_square, splat(simd, 0.5));
    // 1 - cos of the cone, in a form that does not cancel for distant balls.
    let height = sine_square / (one + (one - sine_square).sqrt());
    let part = at[0] * height;
    let cosine = one - part;
    let sine = (part * (one + cosine)).max(zero).sqrt();
    let [turn_sin, turn_cos] = sin_cos(simd, at[1] * splat(simd, TAU));
    let axis = way.normalize(simd);
    let [across, along] = axis.basis(simd);
    let direction = across.scale(sine * turn_cos).add(along.scale(sine * turn_sin)).add(axis.scale(cosine));
    let direction = direction.normalize(simd);
    let distance = square.sqrt();
    let half_chord = (radius * radius - square * sine * sine).max(zero).sqrt();
    let density = one / (splat(simd, TAU) * height);
    let live = lanes & outside;
    put(live, direction, distance * cosine - half_chord, density, samples);
    samples.live |= live;
    live
}
