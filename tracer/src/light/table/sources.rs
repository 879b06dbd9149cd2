//! A list of sources with their power.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::ball::Ball;
use super::select::Choice;
use super::selector::Many;
use super::tree::{Bound, LightTree, Strength};
use super::triangle::Triangle;
use super::{LightTable, SkyTable, Source};

/// A primitive: the index of its item, and of the triangle in a mesh.
pub(crate) type SurfaceKey = (u32, u32);

/// Sources with their power: the light that they would send to the scene, red, green and blue averaged, in square eye units.
pub(crate) struct Sources {
    list: Vec<(Source, Option<SurfaceKey>)>,
    powers: Vec<f64>,
    /// Where the sources are; skies and directional lights have no place.
    bounds: Vec<Option<Bound>>,
    sky: Option<(SkyTable, u32)>,
    /// Half of the diagonal of the scene, in eye units.
    reach: f64,
}

/// The place of a light of the scene, and the part of space that it lights.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Beam {
    /// In eye space.
    pub position: DVec3,
    /// Unit vector in the middle of the beam, and the angle up to its edge; pi for light to all sides.
    pub axis: DVec3,
    pub half_angle: f64,
    /// Whether far light falls with the square of the distance.
    pub falls: bool,
}

impl Sources {
    /// No sources yet; `reach` is half of the diagonal of the scene, in eye units.
    pub(crate) fn new(reach: f64) -> Self {
        Self { list: Vec::new(), powers: Vec::new(), bounds: Vec::new(), sky: None, reach }
    }

    /// Adds light number `index` of the scene, whose I_j A_j is `strength` at the far end of the scene. With a radius, in eye units, it is
    /// a ball. Directional lights have no beam.
    pub(crate) fn add_light(&mut self, index: u32, beam: Option<Beam>, radius: f64, strength: Vec3) {
        let power = PI * self.scene_area() * mean(strength);
        let source = match beam.filter(|_| radius > 0.0) {
            Some(beam) => Source::Lamp(Ball::new(beam.position, radius), index),
            None => Source::Delta(index),
        };
        let bound = beam.map(|beam| {
            let irradiance = PI * mean(strength);
            let strength = if beam.falls {
                Strength { inverse_square: irradiance * self.reach * self.reach, constant: 0.0 }
            } else {
                Strength { inverse_square: 0.0, constant: irradiance }
            };
            Bound::of_beam(Bound::of_ball(beam.position, radius, strength), beam.axis, beam.half_angle)
        });
        self.add(source, None, power, bound);
    }

    /// Adds a sphere that emits outwards.
    pub(crate) fn add_sphere(&mut self, key: SurfaceKey, center: DVec3, radius: f64, emission: Vec3) {
        let ball = Ball::new(center, radius);
        let strength = Strength { inverse_square: PI * mean(emission) * radius * radius, constant: 0.0 };
        let bound = Bound::of_ball(center, radius, strength);
        self.add(Source::Sphere(ball, emission), Some(key), PI * mean(emission) * ball.area(), Some(bound));
    }

    /// Adds a triangle that emits to its front.
    pub(crate) fn add_triangle(
        &mut self,
        key: SurfaceKey,
        corners: [DVec3; 3],
        front: DVec3,
        emission: Vec3,
    ) {
        if let Some(triangle) = Triangle::new(corners, front, emission) {
            let strength = Strength { inverse_square: mean(emission) * triangle.area(), constant: 0.0 };
            let bound = Bound::of_triangle(corners, front, strength);
            let power = PI * mean(emission) * triangle.area();
            self.add(Source::Triangle(triangle), Some(key), power, Some(bound));
        }
    }

    /// Adds a sky.
    pub(crate) fn add_sky(&mut self, table: SkyTable, strength: f32) {
        let power = PI * self.scene_area() * table.mean() * f64::from(strength);
        self.sky = Some((table, self.list.len() as u32));
        self.add(Source::Sky, None, power, None);
    }

    /// The table of the sources; `None` without any that has power.
    pub(crate) fn into_table(self) -> Option<LightTable> {
        let tree = self.tree();
        let in_tree = |index: usize| tree.is_some() && self.bounds[index].is_some();
        let of_all: Vec<f64> = self.powers.clone();
        let has_extent = |index: usize| !matches!(self.list[index].0, Source::Delta(_));
        let of_extended: Vec<f64> =
            of_all.iter().enumerate().map(|(i, &power)| if has_extent(i) { power } else { 0.0 }).collect();
        let outside = |powers: &[f64]| -> Vec<f64> {
            powers.iter().enumerate().map(|(i, &power)| if in_tree(i) { 0.0 } else { power }).collect()
        };
        let share = |powers: &[f64]| {
            let (total, outside) = (powers.iter().sum::<f64>(), outside(powers).iter().sum::<f64>());
            if total > 0.0 { (1.0 - outside / total) as f32 } else { 0.0 }
        };
        let shares = [share(&of_extended), share(&of_all)];
        let extended = Choice::by_power(&outside(&of_extended));
        let all = Choice::by_power(&outside(&of_all));
        let many = tree.map(|tree| Box::new(Many { tree, shares }));
        let Self { list, sky, .. } = self;
        let keyed = list.iter().zip(0..).filter_map(|((_, key), index)| Some(((*key)?, index)));
        let mut surfaces: Vec<(SurfaceKey, u32)> = keyed.collect();
        surfaces.sort_unstable_by_key(|(key, _)| *key);
        let sources = list.into_iter().map(|(source, _)| source).collect();
        let is_dark = all.is_empty() && many.is_none();
        (!is_dark).then_some(LightTable { sources, surfaces, sky, extended, all, many })
    }

    /// The tree of the sources that have a place and a power, if these are many.
    fn tree(&self) -> Option<LightTree> {
        let placed = self.bounds.iter().zip(&self.powers).zip(0..);
        let lights = placed.filter(|((_, power), _)| **power > 0.0);
        let lights: Vec<(u32, Bound)> =
            lights.filter_map(|((bound, _), index)| Some((index, (*bound)?))).collect();
        LightTree::new(&lights, self.list.len(), self.reach)
    }

    fn add(&mut self, source: Source, key: Option<SurfaceKey>, power: f64, bound: Option<Bound>) {
        self.list.push((source, key));
        self.powers.push(if power.is_finite() { power } else { 0.0 });
        self.bounds.push(bound);
    }

    /// Area of the disk that has the size of the scene.
    fn scene_area(&self) -> f64 {
        PI * self.reach * self.reach
    }
}

fn mean(color: Vec3) -> f64 {
    f64::from(color.x + color.y + color.z) / 3.0
}
