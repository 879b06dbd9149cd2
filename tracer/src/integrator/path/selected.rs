//! The light of one light that is selected at random, at sixteen vertices.

use super::super::background::sky_radiance;
use super::super::stage::{Stage, Watch};
use super::group::Group;
use super::vertex::{Incoming, arrays, power_heuristic, vector};
use crate::bsdf::scattering::{Evaluated, Scattering, Setting};
use crate::light::table::{LightSamples, LightScene, Receiver, Receivers};
use crate::rays::Ray;
use crate::sampler::{Dimension, Vertex};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Simd, SimdBase, bits, each_bit, f32x16, mask_of, select, splat, three};

/// Upper end of shadow rays, as a share of the way to the light: far enough before a surface that emits for it to be no candidate of the
/// filters of `intersect::block`.
pub(super) const BEFORE_LIGHT: f64 = 1.0 - 1.0 / (1 << 13) as f64;

impl Group<'_> {
    /// Selects a light for each of some points, and a point on it; `None` if no light reaches any.
    #[inline(always)]
    pub(super) fn select_light<S: Simd>(
        &self,
        simd: S,
        bounce: u32,
        receivers: &Receivers<S>,
        incoming: &Incoming<S>,
    ) -> Option<LightSamples> {
        let [select_by, _] = self.numbers(simd, incoming, Dimension::of(bounce, Vertex::Light));
        let at = self.numbers(simd, incoming, Dimension::of(bounce, Vertex::LightPoint));
        let scene = LightScene { lights: &self.frame.lights, sky_rotation: self.frame.sky_rotation };
        let mut samples = self.table?.sample(simd, &scene, receivers, self.selection(bounce), select_by, at);
        if samples.live == 0 {
            return None;
        }
        if samples.sky != 0 {
            let mut radiance = samples.direction;
            sky_radiance(self.frame, samples.sky, &mut radiance);
            for lane in each_bit(samples.sky) {
                for channel in 0..3 {
                    samples.radiance[channel].0[lane] = radiance[channel].0[lane];
                }
            }
        }
        Some(samples)
    }

    /// Adds the light of one light, selected at random, where nothing is before it.
    #[inline(always)]
    pub(super) fn add_selected_light<S: Simd, W: Watch>(
        &mut self,
        simd: S,
        bounce: u32,
        block: usize,
        lanes: u32,
        (incoming, setting, scattering): (&Incoming<S>, &Setting<S>, &Scattering<S>),
        watch: &mut W,
    ) {
        let points = Vec3x16::load(simd, &self.surfaces.blocks[block].point);
        let receivers = Receivers { points, normals: setting.geometric, lanes };
        let Some(samples) = self.select_light(simd, bounce, &receivers, incoming) else { return };
        let to_light = Vec3x16::load(simd, &samples.direction);
        let Evaluated { value, density } = scattering.eval(simd, to_light);
        let along = setting.geometric.dot(to_light);
        let (light, lit) = sampled_light(simd, &samples, incoming.weight.mul(value), density);
        let lit = lit & bits(along.simd_gt(splat(simd, 0.0)));
        let light = if self.frame.features.transparent {
            self.absorbed_ahead(simd, (block, samples.live), &samples.distance, &light)
        } else {
            light
        };
        let mut visible = lanes & samples.live & lit;
        let shadowed = visible & samples.shadows;
        if shadowed != 0 {
            watch.enter(Stage::Shadows);
            let side = self.surfaces.to_shadow_origins(simd, block, along);
            let origins = arrays(points.add(setting.geometric.scale(side)));
            let (points, to_light) = (arrays(points), arrays(to_light));
            self.shadow_rays.clear();
            for lane in each_bit(shadowed) {
                let origin = vector(&origins, lane);
                let way = vector(&to_light, lane) * samples.distance[lane];
                let (ray, end) = if samples.distance[lane].is_finite() {
                    // To the same point, from another origin. The light itself is no occluder: near lights end earlier.
                    let direction = vector(&points, lane) + way - origin;
                    let margin =
                        2.0 * f64::from(self.surfaces.blocks[block].bias.0[lane]) / direction.length();
                    (Ray { origin, direction }, BEFORE_LIGHT - margin)
                } else {
                    (Ray { origin, direction: vector(&to_light, lane) }, f64::INFINITY)
                };
                self.shadow_rays.set(lane, ray, end, self.hits[block].primitive(lane));
            }
            self.counts.shadow += u64::from(shadowed.count_ones());
            visible &= !self.frame.occluded_of(&self.shadow_rays);
            if self.moving.is_some() {
                visible &= !self.behind_moving(block, visible, true);
            }
            watch.enter(Stage::Shading);
        }
        let mut light = light;
        if self.frame.features.volumes {
            self.dim_in_volumes(simd, (points, visible), &samples, &mut light);
        }
        self.add(simd, block, visible, bounce + 1, light);
    }

    /// Keeps the points that paths of a block go on from, with the normals of their surfaces: the probabilities of lights that these
    /// paths hit depend on them.
    #[inline(never)]
    pub(super) fn keep_receivers<S: Simd>(&mut self, points: Vec3x16<S>, normals: Vec3x16<S>, lanes: u32) {
        let (points, normals) = (arrays(points), arrays(normals));
        self.next_receivers.extend(each_bit(lanes).map(|lane| Receiver {
            point: three!(axis => points[axis][lane]),
            normal: three!(axis => normals[axis][lane]),
        }));
    }

    /// The point that a path of the current batch started from.
    pub(super) fn receiver(&self, block: usize, lane: usize) -> Receiver {
        self.receivers[self.base + block * LANES + lane]
    }
}

/// Light of samples that are scattered by `value`, in directions that the material samples with `density`: weighted by the power heuristic,
/// over the density of the samples. Also the bits of the samples with any light.
#[inline(always)]
pub(super) fn sampled_light<S: Simd>(
    simd: S,
    samples: &LightSamples,
    value: Vec3x16<S>,
    density: f32x16<S>,
) -> (Vec3x16<S>, u32) {
    let zero = splat(simd, 0.0);
    let chosen = samples.density.load(simd);
    let alone = select(mask_of(simd, samples.alone), zero, density);
    let share = power_heuristic(simd, chosen, alone);
    let light = value.mul(Vec3x16::load(simd, &samples.radiance));
    let light = light.scale(share / select(chosen.simd_gt(zero), chosen, splat(simd, 1.0)));
    let [r, g, b] = light.0;
    (light, bits(r.max(g).max(b).simd_gt(zero)) & bits(chosen.simd_gt(zero)))
}
