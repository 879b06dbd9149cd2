//! Reflection and transmission: c_r I(R) + c_t I(T) a^d of the model of light. All rays of a sample after one bounce are followed
//! before those after two.

use glam::DVec3;

use super::Oracle;
use super::bodies::Bodies;
use super::camera::{CameraRay, Ray};
use super::optics;
use super::surface::SurfacePoint;

/// Most reflected and transmitted rays of a sample.
const MOST_RAYS: usize = 1024;

/// A ray with its weight, and the bodies around its origin.
struct TracedRay {
    ray: Ray,
    /// The primitive that it starts on.
    starts_on: Option<usize>,
    /// Factor of what it sees.
    weight: DVec3,
    bodies: Bodies,
}

impl Oracle {
    /// Linear RGB of a ray from the camera.
    pub(super) fn radiance(&self, camera_ray: &CameraRay) -> DVec3 {
        let ray = camera_ray.ray;
        if !camera_ray.in_picture {
            return self.background_of_camera(ray.direction);
        }
        let max_depth = self.view.quality.max_depth;
        let (mut sum, mut count) = (DVec3::ZERO, 0);
        let mut generation =
            vec![TracedRay { ray, starts_on: None, weight: DVec3::ONE, bodies: Bodies::default() }];
        for depth in 0..=max_depth {
            let (mut reflected, mut transmitted) = (Vec::new(), Vec::new());
            for mut traced in generation {
                let Some(surface) = self.surface(traced.ray, traced.starts_on) else {
                    sum += self.seen_without_hit(&traced, depth > 0);
                    continue;
                };
                traced.weight *= self.remaining(&traced, &surface);
                sum += traced.weight * self.local_light(&surface);
                if depth == max_depth {
                    continue;
                }
                let [first, second] = self.leaving(&traced, &surface);
                for (leaving, list) in [(first, &mut reflected), (second, &mut transmitted)] {
                    if let Some(leaving) = leaving.filter(|_| count < MOST_RAYS) {
                        count += 1;
                        list.push(leaving);
                    }
                }
            }
            reflected.append(&mut transmitted);
            generation = reflected;
        }
        sum
    }

    /// Radiance of the background along a ray that hits nothing.
    fn seen_without_hit(&self, traced: &TracedRay, bounced: bool) -> DVec3 {
        let direction = traced.ray.direction;
        let seen = if bounced { self.background(direction) } else { self.background_of_camera(direction) };
        traced.weight * traced.bodies.remaining_at_infinity(&self.scene.materials) * seen
    }

    /// Share of light that the body around a ray leaves on the way to a surface.
    fn remaining(&self, traced: &TracedRay, surface: &SurfacePoint) -> DVec3 {
        let ends_at = (surface.material_index, surface.front);
        traced.bodies.remaining(&self.scene.materials, ends_at, surface.way)
    }

    /// The reflected and the transmitted ray that leave a surface, as far as they contribute.
    fn leaving(&self, traced: &TracedRay, surface: &SurfacePoint) -> [Option<TracedRay>; 2] {
        let material = &self.scene.materials[surface.material_index as usize];
        let (direction, ns) = (surface.direction, surface.ns);
        let (mut reflect, mut transmit) = (material.reflect.as_dvec3(), material.transmit.as_dvec3());
        let sides = traced.bodies.sides(&self.scene.materials, surface.material_index, surface.front);
        let (indices, beyond) =
            if material.thin { ([1.0, 1.0], traced.bodies.clone()) } else { (sides.indices, sides.beyond) };
        let bent = optics::bent(direction, ns, indices);
        if material.fresnel {
            let share = if material.thin {
                // Light between the two surfaces of a sheet: a geometric series.
                let one = optics::reflected_share(direction, ns, [1.0, f64::from(material.ior)]);
                2.0 * one / (1.0 + one)
            } else {
                optics::reflected_share(direction, ns, indices)
            };
            reflect *= share;
            transmit *= 1.0 - share;
        } else if bent.is_none() {
            reflect += transmit;
        }
        let least = f64::from(self.view.quality.min_contribution);
        let leave = |direction: DVec3, share: DVec3, bodies: Bodies| {
            let weight = traced.weight * share;
            let origin = surface.clear_origin();
            let before = surface.before + surface.way;
            let ray = Ray { origin, direction: direction.normalize(), place: surface.place, before };
            let contributes = weight.max_element() >= least && weight.max_element() > 0.0;
            contributes.then_some(TracedRay { ray, starts_on: Some(surface.primitive), weight, bodies })
        };
        let mirrored = optics::leaving(optics::mirrored(direction, ns), surface.ng);
        let through = bent.map(|direction| optics::leaving(direction, -surface.ng));
        [
            leave(mirrored, reflect, traced.bodies.clone()),
            through.and_then(|direction| leave(direction, transmit, beyond)),
        ]
    }
}
