//! A list of sources with their power.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use super::ball::Ball;
use super::select::Choice;
use super::triangle::Triangle;
use super::{LightTable, SkyTable, Source};

/// A primitive: the index of its item, and of the triangle in a mesh.
pub(crate) type SurfaceKey = (u32, u32);

/// Sources with their power: the light that they would send to the scene, red, green and blue averaged, in square eye units.
pub(crate) struct Sources {
    list: Vec<(Source, Option<SurfaceKey>)>,
    powers: Vec<f64>,
    sky: Option<(SkyTable, u32)>,
    /// Half of the diagonal of the scene, in eye units.
    reach: f64,
}

impl Sources {
    /// No sources yet; `reach` is half of the diagonal of the scene, in eye units.
    pub(crate) fn new(reach: f64) -> Self {
        Self { list: Vec::new(), powers: Vec::new(), sky: None, reach }
    }

    /// Adds light number `index` of the scene, whose I_j A_j is `strength` at the far end of the scene. With a ball, in eye units, it is
    /// one with a radius.
    pub(crate) fn add_light(&mut self, index: u32, ball: Option<(DVec3, f64)>, strength: Vec3) {
        let power = PI * self.scene_area() * mean(strength);
        let source = match ball {
            Some((center, radius)) => Source::Lamp(Ball::new(center, radius), index),
            None => Source::Delta(index),
        };
        self.add(source, None, power);
    }

    /// Adds a sphere that emits outwards.
    pub(crate) fn add_sphere(&mut self, key: SurfaceKey, center: DVec3, radius: f64, emission: Vec3) {
        let ball = Ball::new(center, radius);
        self.add(Source::Sphere(ball, emission), Some(key), PI * mean(emission) * ball.area());
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
            self.add(Source::Triangle(triangle), Some(key), PI * mean(emission) * triangle.area());
        }
    }

    /// Adds a sky.
    pub(crate) fn add_sky(&mut self, table: SkyTable, strength: f32) {
        let power = PI * self.scene_area() * table.mean() * f64::from(strength);
        self.sky = Some((table, self.list.len() as u32));
        self.add(Source::Sky, None, power);
    }

    /// The table of the sources; `None` without any that has power.
    pub(crate) fn into_table(self) -> Option<LightTable> {
        let Self { list, powers, sky, .. } = self;
        let has_extent = |source: &Source| !matches!(source, Source::Delta(_));
        let extended =
            list.iter().zip(&powers).map(|((s, _), &power)| if has_extent(s) { power } else { 0.0 });
        let extended = Choice::by_power(&extended.collect::<Vec<f64>>());
        let all = Choice::by_power(&powers);
        let keyed = list.iter().zip(0..).filter_map(|((_, key), index)| Some(((*key)?, index)));
        let mut surfaces: Vec<(SurfaceKey, u32)> = keyed.collect();
        surfaces.sort_unstable_by_key(|(key, _)| *key);
        let sources = list.into_iter().map(|(source, _)| source).collect();
        (!all.is_empty()).then_some(LightTable { sources, surfaces, sky, extended, all })
    }

    fn add(&mut self, source: Source, key: Option<SurfaceKey>, power: f64) {
        self.list.push((source, key));
        self.powers.push(if power.is_finite() { power } else { 0.0 });
    }

    /// Area of the disk that has the size of the scene.
    fn scene_area(&self) -> f64 {
        PI * self.reach * self.reach
    }
}

fn mean(color: Vec3) -> f64 {
    f64::from(color.x + color.y + color.z) / 3.0
}
