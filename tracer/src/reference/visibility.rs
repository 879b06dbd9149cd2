//! Closest hits and occlusion of the oracle: every ray against every primitive.

use glam::DVec3;

use super::shape::{Crossing, Primitive, Shape};
use super::{F64_ERROR, Oracle};

/// Start of a shadow ray, relative to the scene's size: nothing nearer occludes a point.
const NEAR: f64 = 1e-11;

impl Oracle {
    /// The hit of a ray, with the index of its primitive: of all hits that coincide with the nearest one, one of an item before
    /// one of an infinite plane, then one of a front before one of a back, then the first. `origin` is relative to the camera;
    /// `starts_on` is the primitive that the ray starts on, of which only the far side of a sphere is hit.
    pub(super) fn closest(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_max: f64,
        starts_on: Option<usize>,
    ) -> Option<(usize, Crossing)> {
        let hits = self.primitives.iter().enumerate().filter_map(|(index, primitive)| {
            let own = starts_on == Some(index);
            if own && !matches!(primitive.shape, Shape::Sphere { .. }) {
                return None;
            }
            // The near root of the own sphere is zero but for rounding.
            let near = if own { NEAR * (self.size + origin.length()) / direction.length() } else { 0.0 };
            let hit = primitive.shape.hit(origin, direction, near).filter(|hit| hit.t < t_max)?;
            self.is_opaque(primitive, &hit).then_some((index, hit))
        });
        let mut hits: Vec<(usize, Crossing)> = hits.collect();
        let nearest = (0..hits.len()).min_by(|&a, &b| hits[a].1.t.total_cmp(&hits[b].1.t))?;
        let key = |(index, hit): &(usize, Crossing)| {
            let primitive = &self.primitives[*index];
            let behind = (hit.normal.dot(direction) < 0.0) == primitive.mirrored;
            (matches!(primitive.shape, Shape::Plane { .. }), behind, *index)
        };
        let seen = (0..hits.len())
            .filter(|&other| self.coincide(origin, direction, &hits[nearest], &hits[other]))
            .min_by_key(|&hit| key(&hits[hit]))
            .unwrap_or(nearest);
        Some(hits.swap_remove(seen))
    }

    /// Whether two hits are as near to each other, across the surface that the ray crosses faster, as rounding may move the
    /// surfaces.
    fn coincide(
        &self,
        origin: DVec3,
        direction: DVec3,
        (a, at_a): &(usize, Crossing),
        (b, at_b): &(usize, Crossing),
    ) -> bool {
        let speed = [at_a, at_b].map(|hit| hit.normal.dot(direction).abs());
        let point = origin.length() + at_a.t * direction.length();
        let error = self.primitives[*a].error + self.primitives[*b].error + 2.0 * F64_ERROR * point;
        (at_a.t - at_b.t).abs() * speed[0].max(speed[1]) <= error
    }

    /// Whether a point of the primitive `starts_on` is on another flat primitive, too, within rounding: it is not occluded by it.
    fn lies_on(&self, point: DVec3, primitive: &Primitive, starts_on: usize) -> bool {
        let (on, normal) = match primitive.shape {
            Shape::Triangle { corners: [a, b, c], .. } => (a, (b - a).cross(c - a).normalize_or_zero()),
            Shape::Plane { point, normal } => (point, normal),
            Shape::Disk { center, normal, .. } => (center, normal),
            Shape::Sphere { .. } => return false,
        };
        let error = primitive.error + self.primitives[starts_on].error + 2.0 * F64_ERROR * point.length();
        (point - on).dot(normal).abs() <= error
    }

    /// Whether anything is between a point and a light.
    pub(super) fn occluded(&self, point: DVec3, to_light: DVec3, reach: f64, starts_on: usize) -> bool {
        let near = NEAR * (self.size + point.length()) / to_light.length();
        self.primitives.iter().enumerate().any(|(index, primitive)| {
            let flat = !matches!(primitive.shape, Shape::Sphere { .. });
            if flat && (index == starts_on || self.lies_on(point, primitive, starts_on)) {
                return false;
            }
            let hit = primitive.shape.hit(point, to_light, near);
            hit.is_some_and(|hit| hit.t < reach && self.is_opaque(primitive, &hit))
        })
    }

    /// Whether a primitive is opaque at a hit: not cut out by alpha.
    fn is_opaque(&self, primitive: &Primitive, hit: &Crossing) -> bool {
        let cutout = self.scene.materials[primitive.material as usize].cutout;
        // Half of 255 is between two bytes.
        cutout.is_none_or(|index| self.texel(self.scene.textures[index as usize], hit.uv).w >= 0.5)
    }
}
