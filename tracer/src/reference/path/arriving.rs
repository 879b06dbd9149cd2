//! Light of lights that are aimed at.

use glam::DVec3;

use super::super::surface::SurfacePoint;
use super::PathOracle;
use super::aim::{Aim, Light};
use super::light_tree::Receiver;
use super::numbers::Numbers;
use super::parts::Parts;
use super::step::{Path, Sum, power_heuristic};
use crate::sampler::Vertex;

/// Upper end of rays to a light, as a fraction of the distance: what contains a light does not occlude it.
const BEFORE_LIGHT: f64 = 1.0 - 1e-9;

impl PathOracle<'_> {
    /// Adds the light that arrives at a vertex: at the first one that of all lights without extent, unless there are too many, and at
    /// each that of one selected light.
    pub(super) fn add_arriving(
        &self,
        bounce: u32,
        path: &Path,
        (surface, parts): (&SurfacePoint, &Parts),
        numbers: &Numbers,
        sum: &mut Sum,
    ) {
        let mut add = |aim: Option<Aim>, probability: f64| {
            if let Some(aim) = aim {
                let light = self.arriving(path, (surface, parts), &aim, probability);
                sum.add(bounce + 1, path.weight * light);
            }
        };
        if bounce == 0 && self.sources.all_at_first {
            for &index in &self.sources.lights {
                if !self.oracle.is_ball(&self.oracle.scene.lights[index]) {
                    add(self.aim_at_center(index, surface.position), 1.0);
                }
            }
        }
        let select = numbers.at_vertex(bounce, Vertex::Light).x;
        let to = Receiver { position: surface.position, normal: surface.ng };
        if let Some(selected) = self.sources.select(self.sources.among(bounce), &to, select) {
            let at = numbers.at_vertex(bounce, Vertex::LightPoint);
            add(self.aim(selected.kind, surface.position, at), selected.probability);
        }
    }

    /// The light of a direction that is reflected to the viewer: f cos L / p, with its weight.
    fn arriving(
        &self,
        path: &Path,
        (surface, parts): (&SurfacePoint, &Parts),
        aim: &Aim,
        probability: f64,
    ) -> DVec3 {
        let (value, other) = parts.eval(aim.direction);
        if !(surface.ng.dot(aim.direction) > 0.0) || value == DVec3::ZERO {
            return DVec3::ZERO;
        }
        let light = match aim.light {
            Light::Alone(irradiance) => irradiance / probability,
            Light::Found { radiance, density } => {
                let density = density * probability;
                radiance * (power_heuristic(density, other) / density)
            }
        };
        if aim.casts_shadows && self.is_occluded(surface, aim) {
            return DVec3::ZERO;
        }
        value * light * path.bodies.remaining_in_innermost(&self.oracle.scene.materials, aim.distance)
    }

    /// Whether any surface is before a light. Glass is, too: its light is found by being hit.
    fn is_occluded(&self, surface: &SurfacePoint, aim: &Aim) -> bool {
        let start = self.oracle.shadow_start(surface, aim.direction);
        let mut occluded = false;
        let (way, reach) = if aim.distance.is_finite() {
            let to_light = surface.position + aim.direction * aim.distance - start.position;
            (to_light, BEFORE_LIGHT)
        } else {
            (aim.direction, f64::INFINITY)
        };
        self.oracle.visit_between(&start, way, reach, |index, primitive| {
            let casts = self.oracle.scene.materials[primitive.material as usize].casts_shadow;
            occluded |= casts && Some(index) != aim.emitter;
            !occluded
        });
        occluded
    }
}
