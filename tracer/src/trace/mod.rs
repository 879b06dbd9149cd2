//! Rays against the whole scene: the scene's tree over its items, and for models a tree over their triangles.
//!
//! Rays live in `f64`. Trees and edges are `f32`, so before a ray enters one its origin is moved, exactly enough, to
//! where it meets the tree's bounds: the digits of an `f32` are then spent near the geometry, however far the ray
//! comes from.

mod surface;

use glam::{DVec3, Vec3};

use crate::bvh::{RaySlabs, Walk, traverse};
use crate::compile::Item;
use crate::frame::{Instance, PreparedFrame};
use crate::triangle::TriangleRay;
pub(crate) use surface::Surface;

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
    /// Barycentric weights of the second and third corner, for triangles.
    pub uv: (f64, f64),
    /// Of two hits at the same distance the one with the lower rank is seen: item, then position in the source.
    rank: (u32, u32),
}

impl PreparedFrame {
    /// The nearest hit with t > 0.
    pub(crate) fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut best = Best { hit: None, t_max: f64::INFINITY };
        self.each_hit(ray, f64::INFINITY, None, |hit| {
            best.offer(hit);
            Walk::Continue(best.t_max as f32)
        });
        best.hit
    }

    /// Whether anything but the primitive that the ray leaves is hit within 0 < t < `t_max`.
    pub(crate) fn occluded(&self, ray: &Ray, t_max: f64, leaving: PrimitiveId) -> bool {
        let mut blocked = false;
        self.each_hit(ray, t_max, Some(leaving), |hit| {
            blocked = blocked || hit.t < t_max;
            if blocked { Walk::Break(()) } else { Walk::Continue(t_max as f32) }
        });
        blocked
    }

    /// Offers every hit that may matter to `visit`, which answers with the farthest distance still of interest.
    #[inline(always)]
    fn each_hit(
        &self,
        ray: &Ray,
        t_max: f64,
        leaving: Option<PrimitiveId>,
        mut visit: impl FnMut(Hit) -> Walk,
    ) {
        let mut limit = t_max;
        for (index, plane) in (self.items.first_plane()..).zip(&self.planes) {
            let primitive = PrimitiveId { item: index, triangle: 0 };
            if leaving == Some(primitive) {
                continue;
            }
            if let Some(t) = plane.intersect(ray.origin, ray.direction) {
                match visit(Hit { t, primitive, uv: (0.0, 0.0), rank: (index, 0) }) {
                    Walk::Continue(farthest) => limit = limit.min(f64::from(farthest)),
                    Walk::Break(()) => return,
                }
            }
        }
        let (lo, hi) = self.nodes[0].bounds();
        let Some(start) = approach(ray, lo, hi) else { return };
        let origin = ray.origin + ray.direction * start;
        let slabs = RaySlabs::new(origin.as_vec3(), ray.direction.as_vec3());
        let scene_triangle = TriangleRay::new(origin, ray.direction);
        traverse(&self.nodes, &slabs, shifted(limit, start), |first, count| {
            let mut farthest = shifted(limit, start);
            for position in first..first + count {
                let item = self.item_at(position);
                let answer = match self.items.get(item) {
                    Item::Model(i) => {
                        self.model_hits(item, &self.instances[i], ray, limit, leaving, &mut visit)
                    }
                    Item::Sphere(i) => {
                        let primitive = PrimitiveId { item, triangle: 0 };
                        let t =
                            self.spheres[i].intersect(ray.origin, ray.direction, leaving == Some(primitive));
                        t.map(|t| visit(Hit { t, primitive, uv: (0.0, 0.0), rank: (item, 0) }))
                    }
                    Item::Triangle(i) => {
                        let primitive = PrimitiveId { item, triangle: 0 };
                        let triangle = &self.triangles[i];
                        let hit = if leaving == Some(primitive) {
                            None
                        } else {
                            scene_triangle.intersect_exact(&triangle.rounded, &triangle.corners)
                        };
                        hit.map(|hit| {
                            visit(Hit { t: hit.t + start, primitive, uv: (hit.u, hit.v), rank: (item, 0) })
                        })
                    }
                };
                match answer {
                    None => {}
                    Some(Walk::Continue(nearer)) => {
                        limit = limit.min(f64::from(nearer));
                        farthest = shifted(limit, start);
                    }
                    Some(Walk::Break(())) => return Walk::Break(()),
                }
            }
            Walk::Continue(farthest)
        });
    }

    /// The hits of one model. `None` where it has none.
    #[inline(always)]
    fn model_hits(
        &self,
        item: u32,
        instance: &Instance,
        ray: &Ray,
        mut limit: f64,
        leaving: Option<PrimitiveId>,
        visit: &mut impl FnMut(Hit) -> Walk,
    ) -> Option<Walk> {
        let mesh = &*instance.mesh;
        let local = Ray {
            origin: instance.inverse * (ray.origin - instance.translation),
            direction: instance.inverse * ray.direction,
        };
        let (lo, hi) = mesh.root_bounds();
        let start = approach(&local, lo, hi)?;
        if start > limit {
            return None;
        }
        let origin = local.origin + local.direction * start;
        let slabs = RaySlabs::new(origin.as_vec3(), local.direction.as_vec3());
        let triangle_ray = TriangleRay::new(origin, local.direction);
        let excluded = leaving.filter(|left| left.item == item).map(|left| left.triangle);
        let corners = mesh.all_corners();
        let mut answer = None;
        traverse(mesh.nodes(), &slabs, shifted(limit, start), |first, count| {
            for triangle in first..first + count {
                let Some(hit) = triangle_ray.intersect(&corners[triangle as usize]) else { continue };
                if excluded == Some(triangle) {
                    continue;
                }
                let said = visit(Hit {
                    t: hit.t + start,
                    primitive: PrimitiveId { item, triangle },
                    uv: (hit.u, hit.v),
                    rank: (item, mesh.source(triangle)),
                });
                answer = Some(said);
                match said {
                    Walk::Continue(nearer) => limit = limit.min(f64::from(nearer)),
                    Walk::Break(()) => return said,
                }
            }
            Walk::Continue(shifted(limit, start))
        });
        answer
    }
}

/// The nearest hit so far; ties go to the lower rank.
struct Best {
    hit: Option<Hit>,
    t_max: f64,
}

impl Best {
    fn offer(&mut self, hit: Hit) {
        let wins = self.hit.is_none_or(|best| hit.t < best.t || (hit.t == best.t && hit.rank < best.rank));
        if wins {
            self.t_max = hit.t;
            self.hit = Some(hit);
        }
    }
}

/// A limit along the ray, seen from `start` on.
fn shifted(limit: f64, start: f64) -> f32 {
    ((limit - start).max(0.0)) as f32
}

/// Where the ray enters a box, or 0 if it starts inside; `None` if it misses it. A margin covers rounding.
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
    (near <= far * (1.0 + 1e-12)).then_some(near)
}
