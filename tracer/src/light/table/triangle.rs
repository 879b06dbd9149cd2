//! Points on emitting triangles, uniform over their area.

use glam::{DVec3, Vec3};

use super::LightSamples;
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, SimdFloat, bits, each_bit, f32x16, select, splat, three};

/// A triangle in eye space that emits on its front side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    corner: [f32; 3],
    /// Edges from the corner.
    edges: [[f32; 3]; 2],
    /// Unit normal on the front.
    pub(super) normal: [f32; 3],
    /// Area in square eye units.
    pub(super) area: f32,
    /// Linear RGB.
    emission: [f32; 3],
}

impl Triangle {
    /// The triangle with these corners, front, and emission; `None` without an area.
    pub(super) fn new([a, b, c]: [DVec3; 3], front: DVec3, emission: Vec3) -> Option<Self> {
        let area = (b - a).cross(c - a).length() / 2.0;
        let single = |v: DVec3| v.as_vec3().to_array();
        (area as f32 > 0.0 && front != DVec3::ZERO).then(|| Self {
            corner: single(a),
            edges: [single(b - a), single(c - a)],
            normal: single(front),
            area: area as f32,
            emission: emission.to_array(),
        })
    }

    /// Its area in square eye units.
    pub(super) fn area(&self) -> f64 {
        f64::from(self.area)
    }
}

/// Samples a point of the chosen triangle of each lane.
#[inline(always)]
pub(super) fn sample<'t, S: Simd>(
    simd: S,
    (points, lanes): (Vec3x16<S>, u32),
    chosen: impl Fn(usize) -> Option<&'t Triangle>,
    at: [f32x16<S>; 2],
    samples: &mut LightSamples,
) {
    let nothing = [Lanes::ZERO; 3];
    let (mut corner, mut right, mut up, mut normal) = (nothing, nothing, nothing, nothing);
    let mut area = Lanes([1.0; LANES]);
    for lane in each_bit(lanes) {
        let Some(triangle) = chosen(lane) else { continue };
        for axis in 0..3 {
            corner[axis].0[lane] = triangle.corner[axis];
            right[axis].0[lane] = triangle.edges[0][axis];
            up[axis].0[lane] = triangle.edges[1][axis];
            normal[axis].0[lane] = triangle.normal[axis];
            samples.radiance[axis].0[lane] = triangle.emission[axis];
        }
        area.0[lane] = triangle.area;
    }
    // Uniform barycentric coordinates (Turk 1990).
    let root = at[0].sqrt();
    let (b, c) = (root * (splat(simd, 1.0) - at[1]), root * at[1]);
    let load = |lanes: &[Lanes; 3]| Vec3x16::load(simd, lanes);
    let on_light = load(&corner).add(load(&right).scale(b)).add(load(&up).scale(c));
    let way = on_light.sub(points);
    let distance = way.dot(way).sqrt();
    let direction = way.scale(splat(simd, 1.0) / select_positive(simd, distance));
    let density = density(simd, way, direction, load(&normal), area.load(simd));
    let live = lanes & bits(density.simd_gt(splat(simd, 0.0)));
    put(live, direction, distance, density, samples);
    samples.live |= live;
    samples.shadows |= live;
}

/// Density over solid angle of the points at the ends of `way` along unit vectors, on triangles with these normals and areas: r^2 / (A
/// cos). 0 behind triangles.
#[inline(always)]
pub(super) fn density<S: Simd>(
    simd: S,
    way: Vec3x16<S>,
    direction: Vec3x16<S>,
    normal: Vec3x16<S>,
    area: f32x16<S>,
) -> f32x16<S> {
    let zero = splat(simd, 0.0);
    let cosine = zero - normal.dot(direction);
    let seen = cosine.simd_gt(zero);
    let cosine = select(seen, cosine, splat(simd, 1.0));
    select(seen, way.dot(way) / (area * cosine), zero)
}

/// Puts directions, distances and densities into some lanes.
#[inline(always)]
pub(super) fn put<S: Simd>(
    lanes: u32,
    direction: Vec3x16<S>,
    distance: f32x16<S>,
    density: f32x16<S>,
    samples: &mut LightSamples,
) {
    let direction = three!(axis => direction.0[axis].to_array());
    let (distance, density) = (distance.to_array(), density.to_array());
    for lane in each_bit(lanes) {
        for axis in 0..3 {
            samples.direction[axis].0[lane] = direction[axis][lane];
        }
        samples.distance[lane] = f64::from(distance[lane]);
        samples.density.0[lane] = density[lane];
    }
}

/// The numbers above 0, and 1 in place of others.
#[inline(always)]
fn select_positive<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    select(x.simd_gt(splat(simd, 0.0)), x, splat(simd, 1.0))
}
