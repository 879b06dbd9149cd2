//! Closest hits and shadow rays of the oracle: the textbook formulas over all primitives that a ray may hit.

use glam::DVec3;

use super::shape::{Crossing, Primitive, Shape};
use super::terminator::ShadowStart;
use super::{F64_ERROR, Oracle};

/// Start of a shadow ray, relative to the scene's size: nothing nearer occludes a point.
const NEAR: f64 = 1e-11;

/// The hit of a ray.
pub(super) struct Found {
    /// Index of the primitive.
    pub primitive: usize,
    pub crossing: Crossing,
    /// Bound of the distance to the surfaces that coincide with the primitive at the hit; 0 if there are none.
    pub coincidence: f64,
}

impl Oracle {
    /// The hit of a ray: of all hits that coincide with the nearest one, one of an item before one of an infinite plane, then one
    /// of a front before one of a back, then the first. `origin` is relative to the camera; `starts_on` is the primitive that the
    /// ray starts on, of which only the far side of a sphere is hit.
    pub(super) fn closest(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_max: f64,
        starts_on: Option<usize>,
    ) -> Option<Found> {
        let candidates = self.boxes.candidates(origin, direction);
        let hits = candidates.into_iter().filter_map(|index| {
            let primitive = &self.primitives[index];
            let hit = if starts_on == Some(index) {
                primitive.shape.hit_again(origin, direction)
            } else {
                primitive.shape.hit(origin, direction, 0.0)
            };
            let hit = hit.filter(|hit| hit.t < t_max)?;
            self.is_present(primitive, &hit).then_some((index, hit))
        });
        let hits: Vec<(usize, Crossing)> = hits.collect();
        let nearest = hits.iter().min_by(|(_, a), (_, b)| a.t.total_cmp(&b.t))?;
        let key = |(index, hit): &(usize, Crossing)| {
            let primitive = &self.primitives[*index];
            let behind = (hit.normal.dot(direction) < 0.0) == primitive.mirrored;
            (matches!(primitive.shape, Shape::Plane { .. }), behind, *index)
        };
        let (mut seen, mut coincidence) = (nearest, 0.0_f64);
        for other in hits.iter().filter(|other| other.0 != nearest.0) {
            let error = self.error_of(origin, direction, [nearest, other]);
            let speed = [nearest, other].map(|(_, hit)| hit.normal.dot(direction).abs());
            // Apart by at most what rounding may move them, across the surface that the ray crosses faster.
            if (nearest.1.t - other.1.t).abs() * speed[0].max(speed[1]) <= error {
                coincidence = coincidence.max(error);
                seen = if key(other) < key(seen) { other } else { seen };
            }
        }
        let primitive = seen.0;
        let crossing = hits.into_iter().find(|(index, _)| *index == primitive)?.1;
        Some(Found { primitive, crossing, coincidence })
    }

    /// Distance by which rounding may move two surfaces apart where a ray hits them.
    fn error_of(&self, origin: DVec3, direction: DVec3, hits: [&(usize, Crossing); 2]) -> f64 {
        let point = origin.length() + hits[0].1.t * direction.length();
        hits.iter().map(|(index, _)| self.primitives[*index].error).sum::<f64>() + 2.0 * F64_ERROR * point
    }

    /// Whether a point of the primitive `starts_on` is on another flat primitive, too, within rounding: it is not occluded by it.
    fn is_on(&self, point: DVec3, primitive: &Primitive, starts_on: usize) -> bool {
        let (on, normal) = match primitive.shape {
            Shape::Triangle { corners: [a, b, c], .. } => (a, (b - a).cross(c - a).normalize_or_zero()),
            Shape::Plane { point, normal, .. } => (point, normal),
            Shape::Disk { center, normal, .. } => (center, normal),
            Shape::Sphere { .. } => return false,
        };
        let error = primitive.error + self.primitives[starts_on].error + 2.0 * F64_ERROR * point.length();
        (point - on).dot(normal).abs() <= error
    }

    /// Share of light per channel that passes all surfaces between a point and a light: the product of their transmitted shares.
    pub(super) fn unoccluded(&self, start: &ShadowStart, to_light: DVec3, reach: f64) -> DVec3 {
        let mut share = DVec3::ONE;
        self.visit_between(start, to_light, reach, |_, primitive| {
            share *= self.passing_share(primitive);
            share != DVec3::ZERO
        });
        share
    }

    /// Calls a function with the primitives between a point and a light, in no order, once for each crossing, as long as it returns `true`.
    pub(super) fn visit_between(
        &self,
        start: &ShadowStart,
        to_light: DVec3,
        reach: f64,
        mut visit: impl FnMut(usize, &Primitive) -> bool,
    ) {
        let point = start.position;
        let near = NEAR * (self.size + point.length()) / to_light.length();
        for index in self.boxes.candidates(point, to_light) {
            let primitive = &self.primitives[index];
            let flat = !matches!(primitive.shape, Shape::Sphere { .. });
            if flat && (index == start.on || self.is_on(point, primitive, start.on)) {
                continue;
            }
            let mut from = near;
            while let Some(hit) = primitive.shape.hit(point, to_light, from).filter(|hit| hit.t < reach) {
                if self.is_present(primitive, &hit) && !visit(index, primitive) {
                    return;
                }
                // The second side of a sphere.
                from = hit.t * (1.0 + F64_ERROR);
            }
        }
    }

    /// Share of light that shadow rays keep at a surface.
    fn passing_share(&self, primitive: &Primitive) -> DVec3 {
        let material = &self.scene.materials[primitive.material as usize];
        if material.casts_shadow { material.transmit.as_dvec3() } else { DVec3::ONE }
    }

    /// Whether a primitive is present at a hit: not cut out by alpha.
    fn is_present(&self, primitive: &Primitive, hit: &Crossing) -> bool {
        if !matches!(primitive.shape, Shape::Triangle { .. }) {
            return true;
        }
        let cutout = self.scene.materials[primitive.material as usize].cutout;
        // Half of 255 is between two bytes.
        cutout.is_none_or(|index| self.texel(self.scene.textures[index as usize], hit.uv).w >= 0.5)
    }
}
