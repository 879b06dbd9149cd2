//! Directions from a point to a light, and their densities over solid angle.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::super::shading::{attenuation, beam};
use super::super::shape::Shape;
use super::PathOracle;
use super::hemisphere::in_cone;
use super::light_tree::Receiver;
use super::sources::{Among, Kind};
use crate::scene::{Background, LightKind};

/// A direction to a light.
pub(super) struct Aim {
    /// Unit length.
    pub direction: DVec3,
    /// Distance of the light; infinite for the sky and directional lights.
    pub distance: f64,
    pub light: Light,
    /// Whether surfaces occlude the light.
    pub casts_shadows: bool,
    /// The primitive that emits the light, if it is one.
    pub emitter: Option<usize>,
}

/// What a light sends along a direction.
pub(super) enum Light {
    /// Radiance, which paths find as well, and the density of the direction over solid angle.
    Found { radiance: DVec3, density: f64 },
    /// Irradiance of a surface across the direction; paths hit nothing there.
    Alone(DVec3),
}

impl PathOracle<'_> {
    /// A random direction from a point to a light, by a point of the unit square; `None` where the light does not reach the point.
    pub(super) fn aim(&self, kind: &Kind, point: DVec3, at: DVec2) -> Option<Aim> {
        match kind {
            Kind::Surface(index) => self.aim_at_surface(*index, point, at),
            Kind::Point(index) => self.aim_at_center(*index, point),
            Kind::Ball(index) => {
                let center = self.aim_at_center(*index, point)?;
                let radius = self.oracle.scene.lights[*index].radius;
                let way = center.direction * center.distance;
                let direction = into_ball(way, radius, at)?;
                Some(Aim { direction, distance: to_ball(way, radius, direction), ..center })
            }
            Kind::Sky(_) => self.aim_at_sky(at),
        }
    }

    /// The direction to the centre of a light of the scene. Its irradiance is pi I A B, so that a white diffuse surface shows I A B cos as
    /// with direct light.
    pub(super) fn aim_at_center(&self, index: usize, point: DVec3) -> Option<Aim> {
        let light = &self.oracle.scene.lights[index];
        let way = match light.kind {
            LightKind::Point { position } | LightKind::Spot { position, .. } => {
                position - self.oracle.view.camera.position - point
            }
            LightKind::Directional { direction } => -direction,
        };
        let distance = way.length();
        let direction = way / distance;
        let strength = attenuation(light, distance) * beam(&light.kind, direction);
        let placed = !matches!(light.kind, LightKind::Directional { .. });
        (distance > 0.0 && strength > 0.0 && strength.is_finite()).then(|| Aim {
            direction,
            distance: if placed { distance } else { f64::INFINITY },
            light: Light::Alone(light.color.as_dvec3() * strength * PI),
            casts_shadows: light.shadows && self.oracle.view.quality.shadows,
            emitter: None,
        })
    }

    fn aim_at_surface(&self, index: usize, point: DVec3, at: DVec2) -> Option<Aim> {
        let primitive = &self.oracle.primitives[index];
        let (direction, distance) = match &primitive.shape {
            Shape::Triangle { corners: [a, b, c], .. } => {
                // Barycentric coordinates of even density (Turk, "Generating random points in triangles", 1990).
                let root = at.x.sqrt();
                let way = *a + (b - a) * (root * (1.0 - at.y)) + (c - a) * (root * at.y) - point;
                (way.normalize_or_zero(), way.length())
            }
            Shape::Sphere { center, radius, .. } => {
                let direction = into_ball(center - point, *radius, at)?;
                (direction, to_ball(center - point, *radius, direction))
            }
            Shape::Disk { .. } | Shape::Plane { .. } => return None,
        };
        let density = self.density_on(index, point, direction, distance);
        let emission = self.oracle.scene.materials[primitive.material as usize].emission;
        (density > 0.0).then(|| Aim {
            direction,
            distance,
            light: Light::Found { radiance: emission.as_dvec3(), density },
            casts_shadows: true,
            emitter: Some(index),
        })
    }

    fn aim_at_sky(&self, at: DVec2) -> Option<Aim> {
        let (in_picture, density) = self.sources.sky()?.sample(at)?;
        let direction = turned(in_picture, -self.sky_turn());
        let radiance = self.oracle.background(direction);
        Some(Aim {
            direction,
            distance: f64::INFINITY,
            light: Light::Found { radiance, density },
            casts_shadows: true,
            emitter: None,
        })
    }

    /// Density over solid angle of the directions of [`PathOracle::aim`] to a point of an emitting surface, without the probability of
    /// the surface.
    pub(super) fn density_on(&self, index: usize, from: DVec3, direction: DVec3, distance: f64) -> f64 {
        match &self.oracle.primitives[index].shape {
            Shape::Triangle { corners: [a, b, c], skin, .. } => {
                let doubled = (b - a).cross(c - a);
                let front = if skin.mirrored { -doubled } else { doubled };
                // r^2 / (A cos)
                let seen = -front.dot(direction) / 2.0;
                if seen > 0.0 { distance * distance / seen } else { 0.0 }
            }
            Shape::Sphere { center, radius, .. } => {
                cone_of(center - from, *radius).map_or(0.0, |cosine| 1.0 / (2.0 * PI * (1.0 - cosine)))
            }
            Shape::Disk { .. } | Shape::Plane { .. } => 0.0,
        }
    }

    /// The density of hits of a primitive, with its probability.
    pub(super) fn density_of_hit(
        &self,
        (among, to): (Among, &Receiver),
        primitive: usize,
        (from, direction, distance): (DVec3, DVec3, f64),
    ) -> f64 {
        let is_hit = |kind: &Kind| matches!(kind, Kind::Surface(index) if *index == primitive);
        let probability = self.sources.probability(among, to, is_hit);
        if probability > 0.0 {
            probability * self.density_on(primitive, from, direction, distance)
        } else {
            0.0
        }
    }

    /// The density of a direction to the sky, with the probability of the sky.
    pub(super) fn density_of_sky(&self, (among, to): (Among, &Receiver), direction: DVec3) -> f64 {
        let Some(sky) = self.sources.sky() else { return 0.0 };
        let probability = self.sources.probability(among, to, |kind| matches!(kind, Kind::Sky(_)));
        probability * sky.density(turned(direction, self.sky_turn()))
    }

    /// Angle from the direction to the place in the picture, around +Y.
    fn sky_turn(&self) -> f64 {
        match &self.oracle.scene.background {
            Background::Sky(sky) => sky.rotate.to_radians(),
            Background::Color(_) | Background::Gradient { .. } => 0.0,
        }
    }
}

/// A direction turned around +Y: -Z turns towards +X.
fn turned(direction: DVec3, angle: f64) -> DVec3 {
    let (s, c) = libm::sincos(angle);
    let DVec3 { x, y, z } = direction;
    DVec3::new(c * x - s * z, y, c * z + s * x)
}

/// Cosine of half of the angle in which a ball is seen; `None` from inside.
fn cone_of(way: DVec3, radius: f64) -> Option<f64> {
    let sine = radius / way.length();
    (sine < 1.0).then(|| (1.0 - sine * sine).sqrt())
}

/// A direction to a ball, uniform over the solid angle in which it is seen; `None` from inside.
fn into_ball(way: DVec3, radius: f64, at: DVec2) -> Option<DVec3> {
    Some(in_cone(way.normalize(), cone_of(way, radius)?, at))
}

/// Distance of a ball along a unit direction.
fn to_ball(way: DVec3, radius: f64, direction: DVec3) -> f64 {
    let middle = way.dot(direction);
    let apart = (way - direction * middle).length_squared();
    middle - (radius * radius - apart).max(0.0).sqrt()
}
