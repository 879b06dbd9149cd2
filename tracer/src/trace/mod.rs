//! Rays against the whole scene: the scene's tree over its items, and for models a tree over their triangles.
//!
//! Rays live in `f64`. Trees and edges are `f32`, so before a ray enters one its origin is moved, exactly enough, to
//! where it meets the tree's bounds: the digits of an `f32` are then spent near the geometry, however far the ray
//! comes from.

#[cfg(test)]
mod tests;
mod walk;

use std::ops::ControlFlow::{self, Continue};

use glam::{DVec3, Vec3};

use crate::bvh::{RaySlabs, traverse};
use crate::compile::Item;
use crate::frame::{Instance, PreparedFrame};
use crate::simd::{Level, Simd, dispatch};
use crate::triangle::ShearedRay;
use walk::{FilterRay, walk};

/// o + t d in eye space; d need not be a unit vector.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub origin: DVec3,
    pub direction: DVec3,
}

/// One primitive of the scene: an item, and for models the triangle in its mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PrimitiveId {
    pub item: u32,
    pub triangle: u32,
}

/// Where a ray meets the scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    pub t: f64,
    pub primitive: PrimitiveId,
    /// Of two hits at the same distance the one with the lower rank is seen: item, then position in the source.
    rank: (u32, u32),
}

/// What a visitor of hits answers: go on up to this distance, or stop.
type Answer = ControlFlow<(), f64>;

/// Which ray is traced, and what it cannot hit.
#[derive(Clone, Copy)]
struct Query {
    ray: Ray,
    leaving: Option<PrimitiveId>,
}

impl Query {
    fn leaves(&self, primitive: PrimitiveId) -> bool {
        self.leaving == Some(primitive)
    }
}

impl PreparedFrame {
    /// The nearest hit with t > 0, for one ray: what tiles are held against.
    #[cfg(test)]
    pub(crate) fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut best = None;
        let mut limit = f64::INFINITY;
        let _ = self.each_hit(Query { ray: *ray, leaving: None }, limit, |hit| {
            if best.is_none_or(|best| hit.wins_over(&best)) {
                limit = hit.t;
                best = Some(hit);
            }
            Answer::Continue(limit)
        });
        best
    }

    /// Whether anything but the primitive that the ray leaves is hit within 0 < t < `t_max`.
    pub(crate) fn occluded(&self, ray: &Ray, t_max: f64, leaving: PrimitiveId) -> bool {
        let query = Query { ray: *ray, leaving: Some(leaving) };
        let visit = |hit: Hit| if hit.t < t_max { Answer::Break(()) } else { Answer::Continue(t_max) };
        self.each_hit(query, t_max, visit).is_break()
    }

    /// The hit of one primitive, to the last digit.
    pub(crate) fn hit_of(
        &self,
        ray: &Ray,
        primitive: PrimitiveId,
        leaving: Option<PrimitiveId>,
    ) -> Option<Hit> {
        let query = Query { ray: *ray, leaving };
        let PrimitiveId { item, triangle } = primitive;
        if item >= self.items.first_plane() {
            let plane = &self.planes[(item - self.items.first_plane()) as usize];
            let t = plane.intersect(ray.origin, ray.direction).filter(|_| !query.leaves(primitive))?;
            return Some(Hit::of_item(item, t));
        }
        let Item::Model(index) = self.items.get(item) else {
            return self.item_hit(item, query, &ShearedRay::new(ray.origin, ray.direction));
        };
        if query.leaves(primitive) {
            return None;
        }
        let instance = &self.instances[index];
        let local = instance.to_mesh(ray);
        let corners = instance.mesh.corners(triangle).map(Vec3::as_dvec3);
        let t = ShearedRay::new(local.origin, local.direction).intersect(&corners)?;
        let rank = (item, instance.mesh.source(triangle));
        Some(Hit { t, primitive, rank })
    }

    /// Offers every hit that may matter to `visit`, which answers with the farthest distance still of interest.
    #[inline(always)]
    fn each_hit(&self, query: Query, t_max: f64, mut visit: impl FnMut(Hit) -> Answer) -> ControlFlow<()> {
        let mut limit = t_max;
        for hit in self.plane_hits(query) {
            limit = visit(hit)?.min(limit);
        }
        let (lo, hi) = self.nodes[0].bounds();
        let Some(start) = approach(&query.ray, lo, hi) else { return Continue(()) };
        let local = query.ray.from(start);
        let triangle_ray = ShearedRay::new(query.ray.origin, query.ray.direction);
        traverse(&self.nodes, &local.slabs(), shifted(limit, start), |first, count| {
            for position in first..first + count {
                let item = self.item_at(position);
                if let Item::Model(index) = self.items.get(item) {
                    limit = self.instances[index].each_hit(self.level, item, query, limit, &mut visit)?;
                } else if let Some(hit) = self.item_hit(item, query, &triangle_ray) {
                    limit = visit(hit)?.min(limit);
                }
            }
            Continue(shifted(limit, start))
        })
    }

    fn plane_hits(&self, query: Query) -> impl Iterator<Item = Hit> {
        (self.items.first_plane()..).zip(&self.planes).filter_map(move |(item, plane)| {
            let t = plane.intersect(query.ray.origin, query.ray.direction)?;
            let hit = Hit::of_item(item, t);
            (!query.leaves(hit.primitive)).then_some(hit)
        })
    }

    /// The hit of a sphere or a triangle of the scene file.
    fn item_hit(&self, item: u32, query: Query, triangle_ray: &ShearedRay) -> Option<Hit> {
        let leaves = query.leaves(PrimitiveId { item, triangle: 0 });
        match self.items.get(item) {
            Item::Model(_) => None,
            Item::Sphere(index) => {
                let t = self.spheres[index].intersect(query.ray.origin, query.ray.direction, leaves)?;
                Some(Hit::of_item(item, t))
            }
            Item::Triangle(_) if leaves => None,
            Item::Triangle(index) => {
                let t = triangle_ray.intersect(&self.triangles[index].corners)?;
                Some(Hit::of_item(item, t))
            }
        }
    }
}

impl Instance {
    /// Offers the hits of this model to `visit`. Continues with the farthest distance still of interest.
    fn each_hit(
        &self,
        level: Level,
        item: u32,
        query: Query,
        limit: f64,
        visit: &mut impl FnMut(Hit) -> Answer,
    ) -> Answer {
        let ray = self.to_mesh(&query.ray);
        let (lo, hi) = self.mesh.root_bounds();
        let Some(start) = approach(&ray, lo, hi).filter(|&start| start <= limit) else {
            return Continue(limit);
        };
        let near = ray.from(start);
        let filter = FilterRay::new(near.origin, near.direction);
        let exact = ShearedRay::new(ray.origin, ray.direction);
        dispatch!(level, simd => self.walk(simd, &filter, &exact, (item, start), query, limit, visit))
    }

    #[inline(always)]
    #[expect(
        clippy::too_many_arguments,
        reason = "one call, split off so that it is compiled for each level"
    )]
    fn walk<S: Simd>(
        &self,
        simd: S,
        filter: &FilterRay,
        exact: &ShearedRay,
        (item, start): (u32, f64),
        query: Query,
        mut limit: f64,
        visit: &mut impl FnMut(Hit) -> Answer,
    ) -> Answer {
        walk(simd, &self.mesh, filter, shifted(limit, start), |triangle| {
            let primitive = PrimitiveId { item, triangle };
            if !query.leaves(primitive)
                && let Some(t) = exact.intersect(&self.mesh.corners(triangle).map(Vec3::as_dvec3))
            {
                let rank = (item, self.mesh.source(triangle));
                limit = visit(Hit { t, primitive, rank })?.min(limit);
            }
            Continue(shifted(limit, start))
        })?;
        Continue(limit)
    }

    fn to_mesh(&self, ray: &Ray) -> Ray {
        Ray {
            origin: self.inverse * (ray.origin - self.translation),
            direction: self.inverse * ray.direction,
        }
    }
}

impl Hit {
    fn of_item(item: u32, t: f64) -> Self {
        Self { t, primitive: PrimitiveId { item, triangle: 0 }, rank: (item, 0) }
    }

    pub(crate) fn wins_over(&self, other: &Hit) -> bool {
        self.t < other.t || (self.t == other.t && self.rank < other.rank)
    }
}

impl Ray {
    /// The same line, starting at distance `start`: t there is t here minus `start`.
    fn from(&self, start: f64) -> Ray {
        Ray { origin: self.origin + self.direction * start, direction: self.direction }
    }

    fn slabs(&self) -> RaySlabs {
        RaySlabs::new(self.origin.as_vec3(), self.direction.as_vec3())
    }
}

/// A limit along the ray, seen from `start` on.
fn shifted(limit: f64, start: f64) -> f32 {
    ((limit - start).max(0.0)) as f32
}

/// How far before a box a ray is started, in units of its space (boxes lie within [-1, 1] or so): far more than the
/// rounding of its origin to `f32` may carry it past a flat box, and far less than would cost digits.
const RUN_UP: f64 = 1.0 / (1 << 18) as f64;

/// Where to start a ray so that it enters a box soon, 0 if it starts inside or close by; `None` if it misses the box.
#[inline(always)]
fn approach(ray: &Ray, lo: Vec3, hi: Vec3) -> Option<f64> {
    let (mut near, mut far) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let inverse = 1.0 / ray.direction[axis];
        let (entry, exit) = if inverse.is_sign_negative() { (hi, lo) } else { (lo, hi) };
        // Written so that a NaN (a ray inside the plane of a side) changes nothing.
        let t_entry = (f64::from(entry[axis]) - ray.origin[axis]) * inverse;
        let t_exit = (f64::from(exit[axis]) - ray.origin[axis]) * inverse;
        near = if t_entry > near { t_entry } else { near };
        far = if t_exit < far { t_exit } else { far };
    }
    let run_up = RUN_UP / ray.direction.abs().max_element();
    (near <= far * (1.0 + 1e-12)).then_some((near - run_up).max(0.0))
}
