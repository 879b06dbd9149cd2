//! Lights of paths: one light at random, and a random point on it.
//!
//! A *source* is an emitting triangle or sphere, a light with a radius, a light without extent, or a sky. Emitters with a texture on
//! their emission, or cut out by alpha, are no sources: paths find them by hitting them.
//!
//! ```text
//!   sources    a list of sources with their power
//!   delta      the light of one light of the scene
//!   select     a source at random, by its power
//!   triangle   points on triangles
//!   ball       directions into the cone of a sphere
//!   sky        directions to a sky, by its radiance
//! ```

mod ball;
mod delta;
mod select;
mod sky;
mod sources;
mod triangle;

use glam::Vec3;

use super::EyeLight;
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, each_bit, f32x16, splat, three};
use ball::Ball;
use select::Choice;
pub(crate) use sky::SkyTable;
pub(crate) use sources::{Sources, SurfaceKey};

use triangle::Triangle;

/// The lights that paths select from, in eye space.
#[derive(Clone, Debug)]
pub(crate) struct LightTable {
    sources: Vec<Source>,
    /// The primitives that are sources, in ascending order, with the index of the source.
    surfaces: Vec<(SurfaceKey, u32)>,
    sky: Option<(SkyTable, u32)>,
    extended: Choice,
    all: Choice,
}

/// A light that may be selected.
#[derive(Clone, Copy, Debug)]
enum Source {
    Triangle(Triangle),
    /// A sphere that emits outwards.
    Sphere(Ball, Vec3),
    /// A light with a radius: its index among the lights of the frame. No path hits it.
    Lamp(Ball, u32),
    /// A light without extent: its index among the lights of the frame.
    Delta(u32),
    Sky,
}

/// What the sources of a frame refer to.
#[derive(Clone, Copy)]
pub(crate) struct LightScene<'a> {
    /// The lights of the scene.
    pub lights: &'a [EyeLight],
    /// Sine and cosine of the rotation of the sky about +Y.
    pub sky_rotation: [f32; 2],
}

/// Which lights are selected from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Selection {
    /// Those with an extent: the others are computed all.
    Extended,
    /// All.
    All,
}

/// Light that one selected light sends to each of sixteen points.
pub(crate) struct LightSamples {
    /// Bits of the points that it may reach.
    pub live: u32,
    /// Bits of the points whose light no path hits: it has no extent, or is a light with a radius.
    pub alone: u32,
    /// Bits of the points whose light casts shadows.
    pub shadows: u32,
    /// Bits of the points whose light is the sky: its radiance is left to the caller.
    pub sky: u32,
    /// Unit vectors to the light.
    pub direction: [Lanes; 3],
    /// Distance of the light, in eye units; infinite for the sky and directional lights.
    pub distance: [f64; LANES],
    /// Radiance, linear RGB; of lights without extent pi times I_j A_j B_j.
    pub radiance: [Lanes; 3],
    /// Density of the direction over solid angle, times the probability of the light; of lights without extent that probability.
    pub density: Lanes,
}

impl LightSamples {
    fn none() -> Self {
        Self {
            live: 0,
            alone: 0,
            shadows: 0,
            sky: 0,
            direction: [Lanes::ZERO; 3],
            distance: [0.0; LANES],
            radiance: [Lanes::ZERO; 3],
            density: Lanes::ZERO,
        }
    }
}

impl LightTable {
    /// Selects a light and a point on it for each of some points (a bit a lane). The first number of `select` selects, those of `at` are
    /// the point; all are in [0, 1).
    #[inline(never)]
    pub(crate) fn sample<S: Simd>(
        &self,
        simd: S,
        scene: &LightScene<'_>,
        (points, lanes): (Vec3x16<S>, u32),
        selection: Selection,
        select: f32x16<S>,
        at: [f32x16<S>; 2],
    ) -> LightSamples {
        let mut samples = LightSamples::none();
        let choice = self.choice(selection);
        if choice.is_empty() {
            return samples;
        }
        let select = select.to_array();
        let mut sources = [0_u32; LANES];
        let mut kinds = Kinds::default();
        for lane in each_bit(lanes) {
            sources[lane] = choice.select(select[lane]);
            kinds.add(&self.sources[sources[lane] as usize], lane);
        }
        simd.vectorize(
            #[inline(always)]
            || {
                if kinds.triangles != 0 {
                    self.sample_triangles(simd, (points, kinds.triangles), &sources, at, &mut samples);
                }
                if kinds.balls != 0 {
                    self.sample_balls(simd, scene.lights, (points, kinds.balls), &sources, at, &mut samples);
                }
                if let Some((sky, _)) = self.sky.as_ref().filter(|_| kinds.sky != 0) {
                    sky.sample(simd, scene.sky_rotation, kinds.sky, at, &mut samples);
                }
                if kinds.delta != 0 {
                    self.add_delta(simd, scene.lights, (points, kinds.delta), &sources, &mut samples);
                }
            },
        );
        for lane in each_bit(samples.live) {
            samples.density.0[lane] *= choice.probability(sources[lane]);
        }
        samples
    }

    /// Density, over solid angle, with which [`LightTable::sample`] selects the points of sources that rays hit: from their origins, along
    /// unit vectors, to `points` on `surfaces`. 0 where those are no sources.
    #[inline(never)]
    pub(crate) fn density_of_hits<S: Simd>(
        &self,
        simd: S,
        selection: Selection,
        (origins, direction): (Vec3x16<S>, Vec3x16<S>),
        (surfaces, lanes): (&dyn Fn(usize) -> SurfaceKey, u32),
        points: Vec3x16<S>,
    ) -> f32x16<S> {
        let mut probability = Lanes::ZERO;
        let (mut normal, mut area) = ([Lanes::ZERO; 3], Lanes([1.0; LANES]));
        let mut cones = Lanes::ZERO;
        let starts = three!(axis => origins.0[axis].to_array());
        let choice = self.choice(selection);
        for lane in each_bit(lanes) {
            let Ok(place) = self.surfaces.binary_search_by_key(&surfaces(lane), |(key, _)| *key) else {
                continue;
            };
            let source = self.surfaces[place].1;
            probability.0[lane] = choice.probability(source);
            match &self.sources[source as usize] {
                Source::Triangle(triangle) => {
                    for axis in 0..3 {
                        normal[axis].0[lane] = triangle.normal[axis];
                    }
                    area.0[lane] = triangle.area;
                }
                Source::Sphere(ball, _) => {
                    cones.0[lane] =
                        ball.density_from(Vec3::new(starts[0][lane], starts[1][lane], starts[2][lane]));
                }
                Source::Lamp(..) | Source::Delta(_) | Source::Sky => {}
            }
        }
        simd.vectorize(
            #[inline(always)]
            || {
                let way = points.sub(origins);
                let normal = Vec3x16::load(simd, &normal);
                let of_triangle = triangle::density(simd, way, direction, normal, area.load(simd));
                (of_triangle + cones.load(simd)) * probability.load(simd)
            },
        )
    }

    /// Density, over solid angle, with which [`LightTable::sample`] selects directions to the sky.
    #[inline(never)]
    pub(crate) fn density_of_sky<S: Simd>(
        &self,
        simd: S,
        sky_rotation: [f32; 2],
        selection: Selection,
        direction: Vec3x16<S>,
    ) -> f32x16<S> {
        let Some((sky, source)) = &self.sky else { return splat(simd, 0.0) };
        let probability = splat(simd, self.choice(selection).probability(*source));
        simd.vectorize(
            #[inline(always)]
            || sky.density(simd, sky_rotation, direction) * probability,
        )
    }

    fn choice(&self, selection: Selection) -> &Choice {
        match selection {
            Selection::Extended => &self.extended,
            Selection::All => &self.all,
        }
    }

    #[inline(always)]
    fn sample_triangles<S: Simd>(
        &self,
        simd: S,
        (points, lanes): (Vec3x16<S>, u32),
        sources: &[u32; LANES],
        at: [f32x16<S>; 2],
        samples: &mut LightSamples,
    ) {
        let chosen = |lane: usize| match &self.sources[sources[lane] as usize] {
            Source::Triangle(triangle) => Some(triangle),
            _ => None,
        };
        triangle::sample(simd, (points, lanes), chosen, at, samples);
    }

    #[inline(always)]
    fn sample_balls<S: Simd>(
        &self,
        simd: S,
        lights: &[EyeLight],
        (points, lanes): (Vec3x16<S>, u32),
        sources: &[u32; LANES],
        at: [f32x16<S>; 2],
        samples: &mut LightSamples,
    ) {
        let chosen = |lane: usize| match &self.sources[sources[lane] as usize] {
            Source::Sphere(ball, _) | Source::Lamp(ball, _) => Some(ball),
            _ => None,
        };
        let live = ball::sample(simd, (points, lanes), chosen, at, samples);
        for lane in each_bit(live) {
            match &self.sources[sources[lane] as usize] {
                Source::Lamp(_, light) => {
                    samples.alone |= 1 << lane;
                    self.add_light(simd, &lights[*light as usize], (points, lane), samples);
                    // The light of its centre, over all of the ball.
                    let density = samples.density.0[lane];
                    for channel in 0..3 {
                        samples.radiance[channel].0[lane] *= density;
                    }
                }
                Source::Sphere(_, emission) => {
                    samples.shadows |= 1 << lane;
                    for channel in 0..3 {
                        samples.radiance[channel].0[lane] = emission[channel];
                    }
                }
                Source::Triangle(_) | Source::Delta(_) | Source::Sky => {}
            }
        }
    }

    /// Adds the light of lights without extent.
    #[inline(always)]
    fn add_delta<S: Simd>(
        &self,
        simd: S,
        lights: &[EyeLight],
        (points, lanes): (Vec3x16<S>, u32),
        sources: &[u32; LANES],
        samples: &mut LightSamples,
    ) {
        for lane in each_bit(lanes) {
            let Source::Delta(light) = self.sources[sources[lane] as usize] else { continue };
            samples.live |= 1 << lane;
            samples.alone |= 1 << lane;
            samples.density.0[lane] = 1.0;
            let (direction, distance) =
                self.add_light(simd, &lights[light as usize], (points, lane), samples);
            samples.distance[lane] = distance;
            for axis in 0..3 {
                samples.direction[axis].0[lane] = direction[axis];
            }
        }
    }
}

/// Which kinds of source are selected, a bit a lane.
#[derive(Default)]
struct Kinds {
    triangles: u32,
    balls: u32,
    delta: u32,
    sky: u32,
}

impl Kinds {
    fn add(&mut self, source: &Source, lane: usize) {
        let lanes = match source {
            Source::Triangle(_) => &mut self.triangles,
            Source::Sphere(..) | Source::Lamp(..) => &mut self.balls,
            Source::Delta(_) => &mut self.delta,
            Source::Sky => &mut self.sky,
        };
        *lanes |= 1 << lane;
    }
}
