//! Coincident surfaces: which of them a ray hits.
//!
//! The two sides of a wall, a picture on it, a triangle on a plane: such surfaces are in one place except for rounding, and
//! which of them an exact test finds nearer changes from ray to ray. So a rule decides. The *nearest* hit of a ray is the one
//! with the lowest t, of equal ones that of the lowest rank. Of all hits that *coincide* with it the ray hits
//!
//! 1. one of an item before one of an infinite plane: a decal on a plane is visible;
//! 2. one whose surface faces the ray before one seen from behind: by the normal of a triangle's winding, of a plane or of a
//!    sphere;
//! 3. the one of the lowest rank: item, then position in the source.
//!
//! Two hits coincide if each is as near to the plane of the other as rounding may move the two surfaces: see
//! `frame::rounding`.
//!
//! The rule needs the nearest hit first. Searches detect on the way whether two hits are near enough to coincide; only then
//! the hits near the nearest one are searched again, by [`PreparedFrame::preferred`].

use std::ops::ControlFlow::{self, Continue};

use glam::{DVec3, Vec3};

use super::Hit;
use super::single::{Candidate, RayQuery};
use crate::compile::Item;
use crate::frame::{F64_ERROR, PreparedFrame, corner_rounding};
use crate::rays::{PrimitiveId, Ray};

/// How a ray crosses a surface, in eye space.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    /// Distance across the surface per t.
    speed: f64,
    /// Error bound of the surface's position, across itself.
    error: f64,
    /// Whether the surface faces the ray.
    faces: bool,
}

impl PreparedFrame {
    /// Largest difference in t between a hit at `t` and one that coincides with it.
    pub(crate) fn slack(&self, ray: &Ray, primitive: PrimitiveId, t: f64) -> f64 {
        self.slack_of(ray, &self.crossing(ray, primitive, t), t)
    }

    /// Whether a ray hits the front of a primitive at `t`, and [`PreparedFrame::slack`].
    pub(super) fn side_and_slack(&self, ray: &Ray, primitive: PrimitiveId, t: f64) -> (bool, f64) {
        let crossing = self.crossing(ray, primitive, t);
        (crossing.faces, self.slack_of(ray, &crossing, t))
    }

    fn slack_of(&self, ray: &Ray, crossing: &Crossing, t: f64) -> f64 {
        let error = crossing.error + self.coarsest + point_error(ray, t);
        if crossing.speed > 0.0 { error / crossing.speed } else { f64::INFINITY }
    }

    /// The primitive that a ray hits, of all hits before `t_max` that coincide with the nearest one, and whether there are
    /// others than the nearest.
    #[cold]
    #[inline(never)]
    pub(super) fn preferred(
        &self,
        ray: &Ray,
        nearest: PrimitiveId,
        t_max: f64,
        starts_on: Option<PrimitiveId>,
    ) -> (PrimitiveId, bool) {
        self.preferred_by(ray, nearest, t_max, starts_on, |query| self.search_all(ray, query))
    }

    /// [`PreparedFrame::preferred`] of the hits of the nearest hit's item.
    #[cold]
    #[inline(never)]
    pub(super) fn preferred_of_item(
        &self,
        ray: &Ray,
        nearest: PrimitiveId,
        t_max: f64,
        starts_on: Option<PrimitiveId>,
    ) -> (PrimitiveId, bool) {
        let item = nearest.item;
        self.preferred_by(ray, nearest, t_max, starts_on, |query| self.search_all_of(item, ray, query))
    }

    #[inline(always)]
    fn preferred_by(
        &self,
        ray: &Ray,
        nearest: PrimitiveId,
        t_max: f64,
        starts_on: Option<PrimitiveId>,
        search: impl FnOnce(&mut Coincident<'_>),
    ) -> (PrimitiveId, bool) {
        let Some(hit) = self.hit_of(ray, nearest, starts_on) else { return (nearest, false) };
        let crossing = self.crossing(ray, nearest, hit.t);
        let limit = hit.t + self.slack_of(ray, &crossing, hit.t);
        let nearest = CrossedHit { hit, crossing };
        let mut query =
            Coincident { frame: self, ray, t_max, starts_on, limit, nearest, best: nearest, others: false };
        search(&mut query);
        (query.best.hit.primitive, query.others)
    }

    /// The primitive that a ray hits, of a list of primitives, and its t.
    #[cfg(test)]
    pub(crate) fn preferred_of(
        &self,
        ray: &Ray,
        primitives: impl Iterator<Item = PrimitiveId>,
        t_max: f64,
        starts_on: Option<PrimitiveId>,
    ) -> Option<(f64, PrimitiveId)> {
        let hits = primitives.filter_map(|primitive| self.hit_of(ray, primitive, starts_on));
        let crossed = |hit: Hit| CrossedHit { hit, crossing: self.crossing(ray, hit.primitive, hit.t) };
        let all: Vec<CrossedHit> = hits.filter(|hit| hit.t < t_max).map(crossed).collect();
        let nearest = all.iter().copied().reduce(|a, b| if b.hit.wins_over(&a.hit, self) { b } else { a })?;
        let coincident = all.iter().filter(|hit| hit.coincides_with(&nearest));
        let preferred = coincident.min_by_key(|hit| hit.key(self))?;
        Some((preferred.hit.t, preferred.hit.primitive))
    }

    /// How a ray crosses a primitive that it hits at `t`.
    fn crossing(&self, ray: &Ray, primitive: PrimitiveId, t: f64) -> Crossing {
        let of = |normal: DVec3, error: f64| {
            let along = normal.dot(ray.direction);
            Crossing { speed: along.abs(), error: error + point_error(ray, t), faces: along < 0.0 }
        };
        let PrimitiveId { item, triangle } = primitive;
        if item >= self.items.first_plane() {
            let plane = &self.planes[(item - self.items.first_plane()) as usize];
            return of(plane.normal, plane.error);
        }
        match self.items.get(item) {
            Item::Sphere(index) => of(self.spheres[index].normal(ray.origin + ray.direction * t), 0.0),
            Item::Triangle(index) => of(self.triangles[index].normal, self.triangles[index].error),
            Item::Disk(index) => of(self.disks[index].plane.normal, self.disks[index].plane.error),
            Item::Model(index) => {
                let instance = &self.instances[index];
                let corners = instance.mesh.corners(triangle);
                let [a, b, c] = corners.map(Vec3::as_dvec3);
                let normal = (b - a).cross(c - a);
                let [x, y, z] = normal.abs().to_array();
                let across = (x + y + z) * corner_rounding(&corners);
                // Relative to the length of the normal, which stays precise even where it is tiny.
                let per_length = 1.0 / (instance.normals * normal).length();
                let along = normal.dot(instance.inverse * ray.direction);
                Crossing {
                    speed: along.abs() * per_length,
                    error: across * per_length + instance.error + point_error(ray, t),
                    faces: along < 0.0,
                }
            }
        }
    }
}

/// Rounding error of the point at `t`.
fn point_error(ray: &Ray, t: f64) -> f64 {
    F64_ERROR * (ray.origin.abs().max_element() + t * ray.direction.abs().max_element())
}

/// A hit, with the way that its ray crosses the surface.
#[derive(Clone, Copy)]
struct CrossedHit {
    hit: Hit,
    crossing: Crossing,
}

impl CrossedHit {
    fn coincides_with(&self, other: &CrossedHit) -> bool {
        let (own, others) = (&self.crossing, &other.crossing);
        let apart = (self.hit.t - other.hit.t).abs() * own.speed.max(others.speed);
        apart <= own.error + others.error
    }

    /// Sort key: of coincident hits the lowest is preferred.
    fn key(&self, frame: &PreparedFrame) -> (bool, bool, (u32, u32)) {
        let primitive = self.hit.primitive;
        (primitive.item >= frame.items.first_plane(), !self.crossing.faces, frame.rank(primitive))
    }
}

/// Query for all hits that coincide with the nearest one. Keeps the preferred hit.
struct Coincident<'a> {
    frame: &'a PreparedFrame,
    ray: &'a Ray,
    t_max: f64,
    starts_on: Option<PrimitiveId>,
    limit: f64,
    nearest: CrossedHit,
    best: CrossedHit,
    others: bool,
}

impl RayQuery for Coincident<'_> {
    fn limit(&self) -> f64 {
        self.limit
    }

    fn starts_on(&self, primitive: PrimitiveId) -> bool {
        self.starts_on == Some(primitive)
    }

    fn consider(&mut self, candidate: Candidate) -> ControlFlow<()> {
        if candidate.low <= self.limit
            && let Some(hit) = self.frame.hit_of(self.ray, candidate.primitive, self.starts_on)
            && hit.t < self.t_max
        {
            let crossed = CrossedHit { hit, crossing: self.frame.crossing(self.ray, hit.primitive, hit.t) };
            if hit.primitive != self.nearest.hit.primitive && crossed.coincides_with(&self.nearest) {
                self.others = true;
                if crossed.key(self.frame) < self.best.key(self.frame) {
                    self.best = crossed;
                }
            }
        }
        Continue(())
    }
}
