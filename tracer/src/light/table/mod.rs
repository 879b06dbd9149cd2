//! Lights of paths: one light at random, and a random point on it.
//!
//! A *source* is an emitting triangle or sphere, a light with a radius, a light without extent, or a sky. Emitters with a texture on
//! their emission, or cut out by alpha, are no sources: paths find them by hitting them.
//!
//! ```text
//!   sources    a list of sources with their power
//!   delta      the light of one light of the scene
//!   select     a source at random, by its power
//!   tree       many sources: one at random, by its power and place
//!   selector   the sources that sixteen points select
//!   samples    the light of selected sources
//!   triangle   points on triangles
//!   ball       directions into the cone of a sphere
//!   sky        directions to a sky, by its radiance
//!   cube       those to a cube map
//! ```

mod ball;
mod cube;
mod delta;
mod samples;
mod select;
mod selector;
mod sky;
mod sources;
mod tree;
mod triangle;

use glam::Vec3;

use super::EyeLight;
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, each_bit, f32x16, splat, three};
use ball::Ball;
pub(crate) use samples::LightSamples;
use samples::Selected;
use select::Choice;
use selector::Many;
pub(crate) use sky::SkyTable;
pub(crate) use sources::{Beam, Sources, SurfaceKey};
pub(crate) use tree::{LEAST_COSINE, LEAST_DISTANCE, Layout, MIN_LIGHTS, Receiver};
use triangle::Triangle;

/// The lights that paths select from, in eye space.
#[derive(Clone, Debug)]
pub(crate) struct LightTable {
    sources: Vec<Source>,
    /// The primitives that are sources, in ascending order, with the index of the source.
    surfaces: Vec<(SurfaceKey, u32)>,
    sky: Option<(SkyTable, u32)>,
    /// Probabilities of the sources that are not in the tree.
    extended: Choice,
    all: Choice,
    /// The tree of the sources that have a place, if these are many.
    many: Option<Box<Many>>,
}

/// Sixteen points that get light, in eye space.
#[derive(Clone, Copy)]
pub(crate) struct Receivers<S: Simd> {
    pub points: Vec3x16<S>,
    /// Unit normals of their surfaces: light from behind is not reflected. Normals of 0 are none.
    pub normals: Vec3x16<S>,
    /// Bits of the points.
    pub lanes: u32,
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

impl LightTable {
    /// Selects a light and a point on it for each of some points. The first number of `select` selects, those of `at` are
    /// the point; all are in [0, 1).
    #[inline(never)]
    pub(crate) fn sample<S: Simd>(
        &self,
        simd: S,
        scene: &LightScene<'_>,
        receivers: &Receivers<S>,
        selection: Selection,
        select: f32x16<S>,
        at: [f32x16<S>; 2],
    ) -> LightSamples {
        let mut samples = LightSamples::none();
        let Selected { lanes, sources, probability } =
            self.select(simd, receivers, selection, select.to_array());
        if lanes == 0 {
            return samples;
        }
        let points = receivers.points;
        let mut kinds = Kinds::default();
        for lane in each_bit(lanes) {
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
            samples.density.0[lane] *= probability.0[lane];
        }
        samples
    }

    /// Density, over solid angle, with which [`LightTable::sample`] selects the points of sources that rays hit: from their origins, along
    /// unit vectors, to `points` on `surfaces`. 0 where those are no sources. `receivers` are the points and normals that lights were
    /// selected for: of use if [`LightTable::has_tree`].
    #[inline(never)]
    pub(crate) fn density_of_hits<S: Simd>(
        &self,
        simd: S,
        selection: Selection,
        (origins, direction): (Vec3x16<S>, Vec3x16<S>),
        receivers: &dyn Fn(usize) -> Receiver,
        (surfaces, lanes): (&dyn Fn(usize) -> SurfaceKey, u32),
        points: Vec3x16<S>,
    ) -> f32x16<S> {
        let mut probability = Lanes::ZERO;
        let (mut normal, mut area) = ([Lanes::ZERO; 3], Lanes([1.0; LANES]));
        let mut cones = Lanes::ZERO;
        let (mut listed, mut sources) = (0, [0; LANES]);
        let starts = three!(axis => origins.0[axis].to_array());
        let choice = self.choice(selection);
        for lane in each_bit(lanes) {
            let Ok(place) = self.surfaces.binary_search_by_key(&surfaces(lane), |(key, _)| *key) else {
                continue;
            };
            let source = self.surfaces[place].1;
            listed |= 1 << lane;
            sources[lane] = source;
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
        if let Some(many) = &self.many {
            probability = many.probabilities(simd, selection, &sources, receivers, listed);
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
        let probability = self.choice(selection).probability(*source) * self.share_outside(selection);
        let probability = splat(simd, probability);
        simd.vectorize(
            #[inline(always)]
            || sky.density(simd, sky_rotation, direction) * probability,
        )
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
