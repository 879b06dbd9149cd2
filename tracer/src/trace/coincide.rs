//! Surfaces in one place: which of them a ray sees.
//!
//! The two sides of a wall, a picture on it, a triangle on a plane: what is meant to be in one place is there but for rounding, and
//! which of them an exact test finds nearer changes from ray to ray. So a rule decides. The *nearest* hit of a ray is the one
//! with the lowest t, of equal ones that of the lowest rank. Of all hits that *coincide* with it the ray sees
//!
//! 1. one of an item before one of an infinite plane: what is laid on a plane is seen;
//! 2. one whose surface faces the ray before one seen from behind: the normal of a triangle's winding, of a plane or a sphere;
//! 3. the one of the lowest rank: item, then position in the source.
//!
//! Two hits coincide where each is as near to the plane of the other as rounding may have carried the two surfaces. Corners of a
//! mesh are rounded to `f32`, so each point of a triangle, a mean of its corners, is off by at most half a step of the
//! largest corner on each axis. What else places a surface is `f64`, and off by some steps of the numbers that went into it.
//!
//! The rule needs the nearest hit first. Searches note on their way whether two hits were so near that they may coincide; only
//! then the hits near the nearest one are looked at again, by [`PreparedFrame::preferred`].

use std::ops::ControlFlow::{self, Continue};

use glam::{DMat3, DVec3, Vec3};

use super::search::{Offer, Search};
use super::walk::with_stack;
use super::{Hit, PrimitiveId, Ray};
use crate::compile::Item;
use crate::frame::PreparedFrame;
use crate::simd::{dispatch, three};

/// Half a step of an `f32` in [1/2, 1): coordinates of a mesh lie within [-1, 1].
const STEP_OF_MESHES: f64 = 1.0 / (1 << 25) as f64;

/// Half a step of an `f32`, relative to the number, at most.
const RELATIVE_STEP: f64 = 1.0 / (1 << 24) as f64;

/// Relative error of a number that went through a handful of `f64` operations.
pub(crate) const FINE: f64 = 1.0 / (1_u64 << 50) as f64;

/// How a ray crosses a surface, in eye space.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    /// How fast the ray goes through the surface: distance across it per t.
    speed: f64,
    /// How far the surface may be off, across itself.
    off: f64,
    /// Whether it faces the ray.
    faces: bool,
}

/// How far rounding to `f32` may carry a point of a triangle whose corners are at most this large, on each axis of the mesh.
fn step_of(corners: &[Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(Vec3::abs);
    let largest = a.max(b).max(c).max_element();
    (f64::from(largest) * RELATIVE_STEP).min(STEP_OF_MESHES)
}

/// How far rounding to `f32` may carry any point of a mesh in eye space. `linear` places the mesh, with columns that are
/// perpendicular to each other.
pub(crate) fn mesh_rounding(linear: &DMat3) -> f64 {
    let squares = three!(axis => linear.col(axis).length_squared());
    STEP_OF_MESHES * (squares[0] + squares[1] + squares[2]).sqrt()
}

impl PreparedFrame {
    /// How far from a hit at `t`, in t, another one may be that coincides with it.
    pub(crate) fn slack(&self, ray: &Ray, primitive: PrimitiveId, t: f64) -> f64 {
        self.slack_of(ray, &self.crossing(ray, primitive, t), t)
    }

    fn slack_of(&self, ray: &Ray, crossing: &Crossing, t: f64) -> f64 {
        let off = crossing.off + self.coarsest + digits_at(ray, t);
        if crossing.speed > 0.0 { off / crossing.speed } else { f64::INFINITY }
    }

    /// What the ray sees, of all hits before `t_max` that coincide with the nearest one, and whether there are others than it.
    #[cold]
    #[inline(never)]
    pub(crate) fn preferred(&self, ray: &Ray, nearest: PrimitiveId, t_max: f64) -> (PrimitiveId, bool) {
        let Some(hit) = self.hit_of(ray, nearest, None) else { return (nearest, false) };
        let crossing = self.crossing(ray, nearest, hit.t);
        let limit = hit.t + self.slack_of(ray, &crossing, hit.t);
        let nearest = Candidate { hit, crossing };
        let mut search = Coincident { frame: self, ray, t_max, limit, nearest, best: nearest, others: false };
        let _ = with_stack(|stack| dispatch!(self.level, simd => self.search(simd, ray, stack, &mut search)));
        (search.best.hit.primitive, search.others)
    }

    /// What the ray sees of these primitives, one by one.
    #[cfg(test)]
    pub(crate) fn seen_of(
        &self,
        ray: &Ray,
        primitives: impl Iterator<Item = PrimitiveId>,
        t_max: f64,
    ) -> Option<(f64, PrimitiveId)> {
        let hits = primitives.filter_map(|primitive| self.hit_of(ray, primitive, None));
        let candidate = |hit: Hit| Candidate { hit, crossing: self.crossing(ray, hit.primitive, hit.t) };
        let all: Vec<Candidate> = hits.filter(|hit| hit.t < t_max).map(candidate).collect();
        let nearest = all.iter().copied().reduce(|a, b| if b.hit.wins_over(&a.hit) { b } else { a })?;
        let coincident = all.iter().filter(|candidate| candidate.coincides_with(&nearest));
        let seen = coincident.min_by_key(|candidate| candidate.key(self.items.first_plane()))?;
        Some((seen.hit.t, seen.hit.primitive))
    }

    /// How a ray crosses a primitive that it hits at `t`.
    fn crossing(&self, ray: &Ray, primitive: PrimitiveId, t: f64) -> Crossing {
        let of = |normal: DVec3, off: f64| {
            let along = normal.dot(ray.direction);
            Crossing { speed: along.abs(), off: off + digits_at(ray, t), faces: along < 0.0 }
        };
        let PrimitiveId { item, triangle } = primitive;
        if item >= self.items.first_plane() {
            let plane = &self.planes[(item - self.items.first_plane()) as usize];
            return of(plane.normal, plane.off);
        }
        match self.items.get(item) {
            Item::Sphere(index) => of(self.spheres[index].normal(ray.origin + ray.direction * t), 0.0),
            Item::Triangle(index) => of(self.triangles[index].normal, self.triangles[index].off),
            Item::Model(index) => {
                let instance = &self.instances[index];
                let corners = instance.mesh.corners(triangle);
                let [a, b, c] = corners.map(Vec3::as_dvec3);
                let normal = (b - a).cross(c - a);
                let [x, y, z] = normal.abs().to_array();
                let across = (x + y + z) * step_of(&corners);
                // Per length of the normal, which is not lost even where it is tiny.
                let per_length = 1.0 / (instance.normals * normal).length();
                let along = normal.dot(instance.inverse * ray.direction);
                Crossing {
                    speed: along.abs() * per_length,
                    off: across * per_length + instance.off + digits_at(ray, t),
                    faces: along < 0.0,
                }
            }
        }
    }
}

/// What the digits of a point at `t` are good for.
fn digits_at(ray: &Ray, t: f64) -> f64 {
    FINE * (ray.origin.abs().max_element() + t * ray.direction.abs().max_element())
}

/// A hit that the rule looks at.
#[derive(Clone, Copy)]
struct Candidate {
    hit: Hit,
    crossing: Crossing,
}

impl Candidate {
    fn coincides_with(&self, other: &Candidate) -> bool {
        let (own, others) = (&self.crossing, &other.crossing);
        let apart = (self.hit.t - other.hit.t).abs() * own.speed.max(others.speed);
        apart <= own.off + others.off
    }

    /// Lower is seen.
    fn key(&self, first_plane: u32) -> (bool, bool, (u32, u32)) {
        (self.hit.primitive.item >= first_plane, !self.crossing.faces, self.hit.rank)
    }
}

/// Takes all hits that coincide with the nearest one, and keeps the one that is seen.
struct Coincident<'a> {
    frame: &'a PreparedFrame,
    ray: &'a Ray,
    t_max: f64,
    limit: f64,
    nearest: Candidate,
    best: Candidate,
    others: bool,
}

impl Search for Coincident<'_> {
    fn limit(&self) -> f64 {
        self.limit
    }

    fn leaves(&self, _: PrimitiveId) -> bool {
        false
    }

    fn offer(&mut self, offer: Offer) -> ControlFlow<()> {
        if offer.low <= self.limit
            && let Some(hit) = self.frame.hit_of(self.ray, offer.primitive, None)
            && hit.t < self.t_max
        {
            let crossing = self.frame.crossing(self.ray, offer.primitive, hit.t);
            let candidate = Candidate { hit, crossing };
            let first_plane = self.frame.items.first_plane();
            if offer.primitive != self.nearest.hit.primitive && candidate.coincides_with(&self.nearest) {
                self.others = true;
                if candidate.key(first_plane) < self.best.key(first_plane) {
                    self.best = candidate;
                }
            }
        }
        Continue(())
    }
}
