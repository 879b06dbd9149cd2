//! Sixteen paths at the surfaces that they hit.

use super::super::background::background;
use super::super::stage::Watch;
use super::group::Group;
use super::queue::Path;
use crate::bsdf::scattering::{Scattering, Setting};
use crate::rays::{BLOCKS, PrimitiveId, Ray, RaySource, SurfaceSource};
use crate::sampler::{Dimension, Vertex, pair};
use crate::simd::vector::Vec3x16;
use crate::simd::{
    Indices, LANES, Lanes, Simd, SimdBase, SimdFloat, bits, each_bit, f32x16, mask_of, select, splat, three,
};
use crate::surface::Materials;

/// Bounces after which roulette begins.
pub(super) const ROULETTE_FROM: u32 = 3;

/// What sixteen paths bring to their surfaces, lane by lane.
pub(super) struct Incoming<S: Simd> {
    /// T.
    pub weight: Vec3x16<S>,
    /// Densities of their directions.
    pub density: f32x16<S>,
    /// Unit vectors along the rays.
    pub direction: Vec3x16<S>,
    seeds: Indices,
    numbers: Indices,
}

impl Group<'_> {
    /// Shades the current batch: adds the light that arrives to the samples, and enqueues the paths that go on.
    #[inline(never)]
    pub(super) fn shade<S: Simd, W: Watch>(&mut self, simd: S, bounce: u32, watch: &mut W) {
        simd.vectorize(
            #[inline(always)]
            || {
                for block in 0..BLOCKS {
                    if self.batch.live(block) != 0 {
                        self.shade_block(simd, bounce, block, watch);
                    }
                }
                let scatters = bounce < u32::from(self.frame.view().quality.max_depth);
                if bounce == 0 && scatters && self.tiles_lights {
                    self.add_delta_lights(simd, watch);
                }
            },
        );
    }

    #[inline(always)]
    fn shade_block<S: Simd, W: Watch>(&mut self, simd: S, bounce: u32, block: usize, watch: &mut W) {
        let mut live = self.batch.live(block);
        let mut incoming = self.incoming(simd, block, live);
        if self.frame.features.volumes {
            live &= !self.scatter_in_volumes(simd, bounce, block, &incoming, watch);
        }
        let hit = self.surfaces.blocks[block].hit & live;
        if live & !hit != 0 {
            self.add_background(simd, bounce, block, live & !hit, &incoming);
        }
        if hit == 0 {
            return;
        }
        if self.frame.features.transparent {
            self.absorb(simd, block, hit, &mut incoming);
        }
        let mut scattering = hit;
        if self.frame.features.emissive || self.frame.features.unlit {
            scattering &= !self.add_emission(simd, bounce, block, hit, &incoming);
        }
        if bounce < u32::from(self.frame.view().quality.max_depth) && scattering != 0 {
            self.scatter(simd, bounce, block, scattering, &incoming, watch);
        }
    }

    /// The paths of a block.
    #[inline(always)]
    pub(super) fn incoming<S: Simd>(&self, simd: S, block: usize, live: u32) -> Incoming<S> {
        let mut weight = [Lanes::ZERO; 3];
        let mut density = Lanes([1.0; LANES]);
        let (mut seeds, mut numbers) = (Indices::ZERO, Indices::ZERO);
        for lane in each_bit(live) {
            let path = self.path(block, lane);
            for channel in 0..3 {
                weight[channel].0[lane] = path.weight[channel];
            }
            density.0[lane] = path.density;
            (seeds.0[lane], numbers.0[lane]) = self.seed_and_number(path.sample);
        }
        Incoming {
            weight: Vec3x16::load(simd, &weight),
            density: density.load(simd),
            direction: self.batch.directions(simd, block),
            seeds,
            numbers,
        }
    }

    /// Adds light to the samples of some paths of a block. `scattered` is how often the light was scattered.
    #[inline(always)]
    pub(super) fn add<S: Simd>(
        &mut self,
        simd: S,
        block: usize,
        lanes: u32,
        scattered: u32,
        light: Vec3x16<S>,
    ) {
        let limit = self.settings.clamp_indirect;
        let light = if limit > 0.0 && scattered > 1 { limited(simd, light, limit) } else { light };
        let light = three!(channel => Lanes(light.0[channel].to_array()));
        for lane in each_bit(lanes) {
            let sample = self.path(block, lane).sample as usize;
            for channel in 0..3 {
                self.radiance[sample][channel] += light[channel].0[lane];
            }
        }
    }

    /// Adds the background of paths that hit nothing.
    #[inline(always)]
    fn add_background<S: Simd>(
        &mut self,
        simd: S,
        bounce: u32,
        block: usize,
        lanes: u32,
        incoming: &Incoming<S>,
    ) {
        let mut colors = [Lanes::ZERO; 3];
        background(simd, &self.batch, block, &mut colors);
        let mut light = incoming.weight.mul(Vec3x16::load(simd, &colors));
        if let Some(table) = self.table.filter(|_| bounce > 0) {
            let selection = self.selection(bounce - 1);
            let other = table.density_of_sky(simd, self.frame.sky_rotation, selection, incoming.direction);
            light = light.scale(power_heuristic(simd, incoming.density, other));
        }
        if self.frame.features.transparent {
            light = self.absorbed_ahead(simd, (block, lanes), &[f64::INFINITY; LANES], &light);
        }
        self.add(simd, block, lanes, bounce, light);
    }

    /// Adds the emission of surfaces, and the colour of unlit ones. Returns the bits of the paths that end there.
    #[inline(always)]
    fn add_emission<S: Simd>(
        &mut self,
        simd: S,
        bounce: u32,
        block: usize,
        hit: u32,
        incoming: &Incoming<S>,
    ) -> u32 {
        let frame = self.frame;
        let surface = &self.surfaces.blocks[block];
        let mut radiance = Vec3x16::splat(simd, [0.0; 3]);
        let (mut shining, mut ended) = (0, 0);
        let mut rest = hit;
        while rest != 0 {
            let index = surface.material.0[rest.trailing_zeros() as usize];
            let same = rest & surface.material.equal(simd, index);
            rest &= !same;
            let material = &frame.scene().materials[index as usize];
            if material.unlit {
                let diffuse = Materials::gather(simd, frame.scene(), &self.surfaces, block).diffuse;
                let mask = mask_of(simd, same);
                radiance = Vec3x16(three!(i => select(mask, diffuse.0[i], radiance.0[i])));
                ended |= same;
            }
            let front = same & surface.front;
            if material.is_emissive() && front != 0 {
                let emission = Vec3x16::splat(simd, material.emission.to_array());
                let brighter = radiance.add(self.surfaces.emitted(simd, block, emission));
                let mask = mask_of(simd, front);
                radiance = Vec3x16(three!(i => select(mask, brighter.0[i], radiance.0[i])));
                shining |= front;
            }
        }
        if shining | ended == 0 {
            return 0;
        }
        let mut light = incoming.weight.mul(radiance);
        if let Some(table) = self.table.filter(|_| bounce > 0 && shining != 0) {
            let origins = self.batch.origins(simd, block);
            let selection = self.selection(bounce - 1);
            let key_of = |lane: usize| {
                let PrimitiveId { item, triangle } = self.hits[block].slot(lane);
                (item, triangle)
            };
            let other = table.density_of_hits(
                simd,
                selection,
                (origins, incoming.direction),
                &|lane| self.receiver(block, lane),
                (&key_of, shining),
                Vec3x16::load(simd, &surface.point),
            );
            light = light.scale(power_heuristic(simd, incoming.density, other));
        }
        self.add(simd, block, shining | ended, bounce, light);
        ended
    }

    /// Adds the light of a selected light, and enqueues the paths in their next directions.
    #[inline(always)]
    fn scatter<S: Simd, W: Watch>(
        &mut self,
        simd: S,
        bounce: u32,
        block: usize,
        lanes: u32,
        incoming: &Incoming<S>,
        watch: &mut W,
    ) {
        let setting = self.setting(simd, block, lanes, incoming);
        let scattering = Scattering::gather(simd, self.frame, &self.surfaces, block, &setting);
        if self.table.is_some() {
            self.add_selected_light(simd, bounce, block, lanes, (incoming, &setting, &scattering), watch);
        }
        let [part, roulette] = self.numbers(simd, incoming, Dimension::of(bounce, Vertex::Lobe));
        let at = self.numbers(simd, incoming, Dimension::of(bounce, Vertex::Direction));
        let scattered = scattering.sample(simd, part, at);
        let mut weight = incoming.weight.mul(scattered.weight);
        let zero = splat(simd, 0.0);
        let along = setting.geometric.dot(scattered.direction);
        let through = scattered.refracted;
        let right_side = bits(along.simd_gt(zero)) & !through | bits(along.simd_lt(zero)) & through;
        let [r, g, b] = weight.0;
        let most = r.max(g).max(b);
        let mut alive = lanes & scattered.scattered & right_side & bits(most.simd_gt(zero));
        if self.settings.roulette && bounce >= ROULETTE_FROM {
            let survival = most.sqrt().min(splat(simd, 1.0));
            alive &= bits(roulette.simd_lt(survival));
            weight = weight.scale(splat(simd, 1.0) / survival);
        }
        let side = self.surfaces.to_shadow_origins(simd, block, along);
        let points = Vec3x16::load(simd, &self.surfaces.blocks[block].point);
        let origins = points.add(setting.geometric.scale(side));
        let (origins, directions) = (arrays(origins), arrays(scattered.direction));
        let (weights, densities) = (arrays(weight), scattered.density.to_array());
        for lane in each_bit(alive) {
            let path = self.path(block, lane);
            let mut next = Path {
                ray: Ray { origin: vector(&origins, lane), direction: vector(&directions, lane) },
                starts_on: self.hits[block].primitive(lane),
                weight: three!(channel => weights[channel][lane]),
                density: densities[lane],
                media: path.media,
                sample: path.sample,
            };
            if through >> lane & 1 == 1 {
                next.media = self.media_behind(block, lane);
                next.ray.origin = self.refraction_origin(block, lane).unwrap_or(next.ray.origin);
            }
            self.next.push(next);
        }
        if self.keeps_receivers {
            self.keep_receivers(points, setting.geometric, alive);
        }
    }

    /// What scattering at the points of a block depends on.
    #[inline(always)]
    pub(super) fn setting<S: Simd>(
        &self,
        simd: S,
        block: usize,
        lanes: u32,
        incoming: &Incoming<S>,
    ) -> Setting<S> {
        let surface = &self.surfaces.blocks[block];
        let geometric = Vec3x16::load(simd, &surface.ng);
        let shaded = self.frame.features.shaded_normals();
        let normals = if shaded { Vec3x16::load(simd, &surface.ns) } else { geometric };
        let to_viewer = incoming.direction.scale(splat(simd, -1.0));
        let mut eta = Lanes([1.0; LANES]);
        if self.frame.features.bounces {
            for lane in each_bit(lanes) {
                eta.0[lane] = self.eta_at(block, lane);
            }
        }
        Setting { to_viewer, geometric, normals, eta }
    }

    /// Two random numbers of each path.
    #[inline(always)]
    pub(super) fn numbers<S: Simd>(
        &self,
        simd: S,
        incoming: &Incoming<S>,
        dimension: Dimension,
    ) -> [f32x16<S>; 2] {
        let (seeds, numbers) = (incoming.seeds.load(simd), incoming.numbers.load(simd));
        pair(simd, self.settings.sampler, seeds, numbers, dimension)
    }
}

/// Weight of a direction that one strategy finds with `density`, and another with `other`: d^2 / (d^2 + o^2).
#[inline(always)]
pub(super) fn power_heuristic<S: Simd>(simd: S, density: f32x16<S>, other: f32x16<S>) -> f32x16<S> {
    let ratio = other / density;
    splat(simd, 1.0) / (splat(simd, 1.0) + ratio * ratio)
}

/// Light whose brightest channel is at most `limit`.
#[inline(always)]
fn limited<S: Simd>(simd: S, light: Vec3x16<S>, limit: f32) -> Vec3x16<S> {
    let [r, g, b] = light.0;
    let most = r.max(g).max(b);
    let limit = splat(simd, limit);
    light.scale(select(most.simd_gt(limit), limit / most, splat(simd, 1.0)))
}

#[inline(always)]
pub(super) fn arrays<S: Simd>(vectors: Vec3x16<S>) -> [[f32; LANES]; 3] {
    three!(axis => vectors.0[axis].to_array())
}

pub(super) fn vector(lanes: &[[f32; LANES]; 3], lane: usize) -> glam::DVec3 {
    glam::DVec3::new(f64::from(lanes[0][lane]), f64::from(lanes[1][lane]), f64::from(lanes[2][lane]))
}
