//! Volumes that scatter light evenly to all directions: free paths before surfaces, scattering, transmittance towards lights.

#[cfg(test)]
mod tests;

use std::f32::consts::PI;

use glam::DVec3;

use super::super::stage::{Stage, Watch};
use super::group::Group;
use super::queue::Path;
use super::selected::{BEFORE_LIGHT, sampled_light};
use super::vertex::{Incoming, ROULETTE_FROM, arrays, vector};
use crate::light::table::{LightSamples, Receivers};
use crate::rays::{Ray, RaySource};
use crate::sampler::{Dimension, Vertex};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, each_bit, splat, three};

/// The phase function: its value, and the density of its samples over solid angle.
const PHASE: f32 = 1.0 / (4.0 * PI);

/// The points of a block where volumes scatter paths.
struct MediumVertices {
    /// Bits of the paths.
    lanes: u32,
    points: [DVec3; LANES],
    /// The points rounded, by axis.
    rounded: [Lanes; 3],
    /// Share of light that is left of each path after the absorption on its way and the scattering.
    share: [Lanes; 3],
}

impl Group<'_> {
    /// Scatters the paths of a block that volumes scatter before their surfaces: adds the light of a selected light, and enqueues the paths in
    /// their next directions. Returns the bits of these paths.
    #[inline(never)]
    pub(super) fn scatter_in_volumes<S: Simd, W: Watch>(
        &mut self,
        simd: S,
        bounce: u32,
        block: usize,
        incoming: &Incoming<S>,
        watch: &mut W,
    ) -> u32 {
        simd.vectorize(
            #[inline(always)]
            || {
                let vertices = self.medium_vertices(simd, bounce, block, incoming);
                if vertices.lanes != 0 && bounce < u32::from(self.frame.view().quality.max_depth) {
                    let weight = incoming.weight.mul(Vec3x16::load(simd, &vertices.share));
                    self.light_medium(simd, bounce, block, &vertices, (incoming, weight), watch);
                    self.leave_medium(simd, bounce, block, &vertices, (incoming, weight));
                }
                vertices.lanes
            },
        )
    }

    /// Multiplies light of some samples by the transmittance of all volumes on the way from their points: exp(-optical depth).
    #[inline(never)]
    pub(super) fn dim_in_volumes<S: Simd>(
        &mut self,
        simd: S,
        (points, lanes): (Vec3x16<S>, u32),
        samples: &LightSamples,
        light: &mut Vec3x16<S>,
    ) {
        let points = arrays(points);
        let mut left = Lanes([1.0; LANES]);
        for lane in each_bit(lanes) {
            let direction = three!(axis => f64::from(samples.direction[axis].0[lane]));
            let ray = Ray { origin: vector(&points, lane), direction: DVec3::from_array(direction) };
            let depth = self.frame.optical_depth(&ray, samples.distance[lane], &mut self.sections);
            left.0[lane] = libm::exp(-depth) as f32;
        }
        *light = light.scale(left.load(simd));
    }

    /// Samples a free path of each path of a block.
    #[inline(always)]
    fn medium_vertices<S: Simd>(
        &mut self,
        simd: S,
        bounce: u32,
        block: usize,
        incoming: &Incoming<S>,
    ) -> MediumVertices {
        let [numbers, _] = self.numbers(simd, incoming, Dimension::of(bounce, Vertex::Medium));
        let numbers = numbers.to_array();
        let mut vertices = MediumVertices {
            lanes: 0,
            points: [DVec3::ZERO; LANES],
            rounded: [Lanes::ZERO; 3],
            share: [Lanes::ZERO; 3],
        };
        for lane in each_bit(self.batch.live(block)) {
            let ray = self.batch.ray(block, lane);
            let end = self.end_of(block, lane, &ray);
            let depth = -libm::log(1.0 - f64::from(numbers[lane]));
            let Some(scattered) = self.frame.scattered_at(&ray, end, depth, &mut self.sections) else {
                continue;
            };
            let point = ray.origin + ray.direction * scattered.t;
            let share = scattered.color * self.left_in_body(block, lane, (point - ray.origin).length());
            vertices.lanes |= 1 << lane;
            vertices.points[lane] = point;
            for axis in 0..3 {
                vertices.rounded[axis].0[lane] = point[axis] as f32;
                vertices.share[axis].0[lane] = share[axis] as f32;
            }
        }
        vertices
    }

    /// The t of the surface that a path hits; if it hits none, the end of its ray.
    fn end_of(&self, block: usize, lane: usize, ray: &Ray) -> f64 {
        let surface = &self.surfaces.blocks[block];
        if surface.hit >> lane & 1 == 0 {
            return self.batch.blocks[block].t_max(lane);
        }
        let point = DVec3::from_array(three!(axis => f64::from(surface.point[axis].0[lane])));
        (point - ray.origin).length() / ray.direction.length()
    }

    /// Share of light that is left after a way of some eye units inside of the transparent body around a path.
    fn left_in_body(&self, block: usize, lane: usize, way: f64) -> DVec3 {
        if !self.frame.features.transparent {
            return DVec3::ONE;
        }
        let materials = &self.frame.scene().materials;
        // As if the way ended at the front of a surface: the path is inside of the body that it entered last.
        let end = (0, true);
        let media = &self.path(block, lane).media;
        media.transmittance(materials, end, way / self.frame.per_unit).unwrap_or(DVec3::ONE)
    }

    /// Adds the light of one light, selected at random, to the paths that volumes scatter.
    #[inline(always)]
    fn light_medium<S: Simd, W: Watch>(
        &mut self,
        simd: S,
        bounce: u32,
        block: usize,
        vertices: &MediumVertices,
        (incoming, weight): (&Incoming<S>, Vec3x16<S>),
        watch: &mut W,
    ) {
        let points = Vec3x16::load(simd, &vertices.rounded);
        let receivers = Receivers { points, normals: Vec3x16::splat(simd, [0.0; 3]), lanes: vertices.lanes };
        let Some(samples) = self.select_light(simd, bounce, &receivers, incoming) else { return };
        let phase = splat(simd, PHASE);
        let (mut light, lit) = sampled_light(simd, &samples, weight.scale(phase), phase);
        let mut visible = vertices.lanes & samples.live & lit;
        let shadowed = visible & samples.shadows;
        if shadowed != 0 {
            watch.enter(Stage::Shadows);
            self.shadow_rays.clear();
            for lane in each_bit(shadowed) {
                let towards = DVec3::from_array(three!(axis => f64::from(samples.direction[axis].0[lane])));
                let distance = samples.distance[lane];
                let (direction, end) = if distance.is_finite() {
                    (towards * distance, BEFORE_LIGHT)
                } else {
                    (towards, f64::INFINITY)
                };
                let origin = DVec3::from_array(three!(axis => f64::from(vertices.rounded[axis].0[lane])));
                self.shadow_rays.set(lane, Ray { origin, direction }, end, None);
            }
            self.counts.shadow += u64::from(shadowed.count_ones());
            visible &= !self.frame.any_hits_of(&self.shadow_rays);
            if self.moving.is_some() {
                visible &= !self.behind_moving(block, visible, false);
            }
            watch.enter(Stage::Shading);
        }
        self.dim_in_volumes(simd, (points, visible), &samples, &mut light);
        self.add(simd, block, visible, bounce + 1, light);
    }

    /// Enqueues the paths that volumes scatter in directions that are uniform over the sphere.
    #[inline(always)]
    fn leave_medium<S: Simd>(
        &mut self,
        simd: S,
        bounce: u32,
        block: usize,
        vertices: &MediumVertices,
        (incoming, weight): (&Incoming<S>, Vec3x16<S>),
    ) {
        let [_, roulette] = self.numbers(simd, incoming, Dimension::of(bounce, Vertex::Lobe));
        let at = self.numbers(simd, incoming, Dimension::of(bounce, Vertex::Direction));
        let (at, roulette) = (at.map(|number| number.to_array()), roulette.to_array());
        let weights = arrays(weight);
        let mut leaving = 0;
        for lane in each_bit(vertices.lanes) {
            let mut weight = three!(channel => weights[channel][lane]);
            let most = weight[0].max(weight[1]).max(weight[2]);
            if self.settings.roulette && bounce >= ROULETTE_FROM {
                let survival = most.sqrt().min(1.0);
                if roulette[lane] >= survival {
                    continue;
                }
                weight = weight.map(|channel| channel / survival);
            }
            if most > 0.0 {
                let path = self.path(block, lane);
                let direction = on_sphere([at[0][lane], at[1][lane]].map(f64::from));
                let next = Path {
                    ray: Ray { origin: vertices.points[lane], direction },
                    starts_on: None,
                    weight,
                    density: PHASE,
                    media: path.media,
                    sample: path.sample,
                };
                self.next.push(next);
                leaving |= 1 << lane;
            }
        }
        if self.keeps_receivers {
            let points = Vec3x16::load(simd, &vertices.rounded);
            self.keep_receivers(points, Vec3x16::splat(simd, [0.0; 3]), leaving);
        }
    }
}

/// A unit vector, uniform over the sphere by two numbers in [0, 1): Archimedes' map of the cylinder.
fn on_sphere([u, v]: [f64; 2]) -> DVec3 {
    let height = 1.0 - 2.0 * u;
    let radius = (1.0 - height * height).max(0.0).sqrt();
    let angle = std::f64::consts::TAU * v;
    DVec3::new(radius * libm::cos(angle), radius * libm::sin(angle), height)
}
