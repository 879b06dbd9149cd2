//! Rays against the whole scene: the scene's tree over its items, and for models a tree over their triangles.
//!
//! Rays live in `f64`. Trees and edges are `f32`: a filter looks at sixteen boxes or triangles at once and tells what is
//! certain (`walk.rs`, `filter.rs`); the exact test of `triangle.rs` decides the rest, and computes the distance that is
//! answered. Every level of SIMD, and every tree, therefore gives the same hit, to the bit.

pub(crate) mod coincide;
mod filter;
mod near_ray;
mod search;
#[cfg(test)]
mod tests;
mod walk;

use std::hint::black_box;
use std::ops::ControlFlow::{self, Continue};

use glam::{DVec3, Vec3};

use crate::bvh::WIDTH;
use crate::compile::Item;
use crate::cutout;
use crate::frame::{EyeTriangle, Instance, PreparedFrame};
use crate::mesh::TriangleBlock;
use crate::simd::{Simd, dispatch, each_bit, prefetch, three};
use crate::triangle::ShearedRay;
use filter::FilterRay;
use near_ray::NearRay;
use search::{Any, Closest, Offer, Search};
use walk::{Leaves, Stack, walk, with_stack};

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

/// Where a ray meets one primitive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    pub t: f64,
    pub primitive: PrimitiveId,
    /// Of two hits at the same distance the one with the lower rank is seen: item, then position in the source.
    rank: (u32, u32),
}

/// Where a ray meets the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// The point is origin + `t` * direction.
    pub t: f64,
    /// What is there.
    pub primitive: Primitive,
}

/// A part of a scene that a ray can hit, by its place in [`crate::scene::Scene`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Primitive {
    /// A triangle of a model's mesh.
    Model {
        /// Index of the model in the scene.
        model: usize,
        /// Index of the triangle in the model's [`crate::mesh::CompiledMesh`].
        triangle: u32,
    },
    /// Index of a sphere.
    Sphere(usize),
    /// Index of a triangle of the scene file.
    Triangle(usize),
    /// Index of a plane.
    Plane(usize),
}

impl PreparedFrame {
    /// The closest hit with 0 < t < `t_max` of the ray origin + t * direction, in world space, from either side of a
    /// surface.
    ///
    /// `direction` need not be a unit vector; t is in its lengths. The hit is the one that an exact test (in `f64`) of all
    /// primitives in turn would find, to the bit and on every machine. No ray slips between two triangles that share an
    /// edge (Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2013). Where alpha cuts a triangle out, the
    /// ray goes on. Where surfaces coincide but for the
    /// rounding of their corners, the hit is one of the same surface all over: of an item before that of an infinite plane, then
    /// of a surface that faces the ray before one seen from behind, then of the first in the scene: models before
    /// spheres before triangles before planes, and in a mesh the triangle that comes first in its file.
    ///
    /// `None` also for what is no ray: an origin or a direction that is not finite, or a direction whose largest
    /// component is not within 1e-100 to 1e100.
    pub fn closest_hit(&self, origin: DVec3, direction: DVec3, t_max: f64) -> Option<RayHit> {
        let ray = self.to_eye(origin, direction)?;
        let (t, primitive) = self.closest(&ray, t_max)?;
        Some(RayHit { t, primitive: self.named(primitive) })
    }

    /// Whether there is a hit with 0 < t < `t_max`: as [`PreparedFrame::closest_hit`], in less time.
    pub fn any_hit(&self, origin: DVec3, direction: DVec3, t_max: f64) -> bool {
        self.to_eye(origin, direction).is_some_and(|ray| self.is_occluded(&ray, t_max, None))
    }

    /// The closest hit with 0 < t < `t_max`: its t, and what is there.
    pub(crate) fn closest(&self, ray: &Ray, t_max: f64) -> Option<(f64, PrimitiveId)> {
        let mut closest = Closest::new(self, ray, t_max);
        let _ =
            with_stack(|stack| dispatch!(self.level, simd => self.search(simd, ray, stack, &mut closest)));
        closest.found()
    }

    /// Whether anything but the primitive that the ray leaves is hit within 0 < t < `t_max`.
    pub(crate) fn occluded(&self, ray: &Ray, t_max: f64, leaving: PrimitiveId) -> bool {
        self.is_occluded(ray, t_max, Some(leaving))
    }

    fn is_occluded(&self, ray: &Ray, t_max: f64, leaving: Option<PrimitiveId>) -> bool {
        let mut any = Any { frame: self, ray, t_max, leaving };
        with_stack(|stack| dispatch!(self.level, simd => self.search(simd, ray, stack, &mut any))).is_break()
    }

    /// The hit of one primitive, to the last digit.
    pub(crate) fn hit_of(
        &self,
        ray: &Ray,
        primitive: PrimitiveId,
        leaving: Option<PrimitiveId>,
    ) -> Option<Hit> {
        let t = self.t_of(ray, primitive, leaving)?;
        let PrimitiveId { item, triangle } = primitive;
        // Planes and other items have one triangle, so to say.
        let position = match self.items.get(item) {
            Item::Model(index) => self.instances[index].mesh.source(triangle),
            Item::Sphere(_) | Item::Triangle(_) => 0,
        };
        Some(Hit { t, primitive, rank: (item, position) })
    }

    /// Where the ray hits one primitive, to the last digit. Of one that it leaves only the far side is hit, if it has one.
    pub(crate) fn t_of(
        &self,
        ray: &Ray,
        primitive: PrimitiveId,
        leaving: Option<PrimitiveId>,
    ) -> Option<f64> {
        let PrimitiveId { item, triangle } = primitive;
        let leaves = leaving == Some(primitive);
        if item >= self.items.first_plane() {
            let plane = &self.planes[(item - self.items.first_plane()) as usize];
            return plane.intersect(ray.origin, ray.direction).filter(|_| !leaves);
        }
        match self.items.get(item) {
            Item::Sphere(index) => self.spheres[index].intersect(ray.origin, ray.direction, leaves),
            Item::Model(_) | Item::Triangle(_) if leaves => None,
            Item::Triangle(index) => {
                let EyeTriangle { corners, cut, .. } = &self.triangles[index];
                let t = ShearedRay::new(ray.origin, ray.direction).intersect(corners)?;
                (!cut || self.is_there(primitive, ray, corners, t)).then_some(t)
            }
            Item::Model(index) => {
                let instance = &self.instances[index];
                let local = instance.to_mesh(ray);
                let corners = instance.mesh.corners(triangle);
                let corners = three!(k => corners[k].as_dvec3());
                let t = ShearedRay::new(local.origin, local.direction).intersect(&corners)?;
                let solid = instance.cutouts.is_empty() || self.is_there(primitive, &local, &corners, t);
                solid.then_some(t)
            }
        }
    }

    /// Offers every primitive to `search` that the ray may hit, those in nearer boxes earlier.
    #[inline(always)]
    fn search<S: Simd>(&self, simd: S, ray: &Ray, stack: Stack, search: &mut impl Search) -> ControlFlow<()> {
        for plane in 0..self.planes.len() as u32 {
            self.offer_item(ray, self.items.first_plane() + plane, search)?;
        }
        // A model alone: the scene's tree has nothing to add to its own.
        if let ([instance], 1) = (&self.instances[..], self.items.first_plane()) {
            return instance.search(simd, ray, 0, stack, search);
        }
        let bounds = || self.nodes[0].bounds();
        let Some(near) = NearRay::new(*ray, 0.0, bounds) else { return Continue(()) };
        walk(simd, &self.nodes, &near, stack, &mut ItemLeaves { frame: self, ray, search })
    }

    /// A sphere, a plane or a triangle of the scene file.
    #[inline(never)]
    fn offer_item(&self, ray: &Ray, item: u32, search: &mut impl Search) -> ControlFlow<()> {
        let primitive = PrimitiveId { item, triangle: 0 };
        let leaving = search.leaves(primitive).then_some(primitive);
        let Some(t) = self.t_of(ray, primitive, leaving) else { return Continue(()) };
        let slack = self.slack(ray, primitive, t);
        search.offer(Offer { primitive, certain: true, low: t - slack, high: t + slack })
    }

    /// `None` for what is no ray.
    #[inline(always)]
    pub(crate) fn to_eye(&self, origin: DVec3, direction: DVec3) -> Option<Ray> {
        let reach = direction.abs().max_element();
        let usable = origin.is_finite() && direction.is_finite() && (1e-100..=1e100).contains(&reach);
        // Units are powers of two: t stays what it is, to the bit.
        usable.then(|| Ray {
            origin: (origin - self.view().camera.position) * self.per_unit,
            direction: direction * self.per_unit,
        })
    }

    fn named(&self, PrimitiveId { item, triangle }: PrimitiveId) -> Primitive {
        if item >= self.items.first_plane() {
            return Primitive::Plane((item - self.items.first_plane()) as usize);
        }
        match self.items.get(item) {
            Item::Model(model) => Primitive::Model { model, triangle },
            Item::Sphere(index) => Primitive::Sphere(index),
            Item::Triangle(index) => Primitive::Triangle(index),
        }
    }
}

/// Leaves of the scene's tree.
struct ItemLeaves<'a, T> {
    frame: &'a PreparedFrame,
    ray: &'a Ray,
    search: &'a mut T,
}

impl<S: Simd, T: Search> Leaves<S> for ItemLeaves<'_, T> {
    #[inline(always)]
    fn limit(&self) -> f64 {
        self.search.limit()
    }

    #[inline(always)]
    fn visit(&mut self, simd: S, leaf: u32, _: f32, mut stack: Stack) -> ControlFlow<(), bool> {
        for &item in self.frame.items_of(leaf) {
            if let Item::Model(index) = self.frame.items.get(item) {
                let instance = &self.frame.instances[index];
                instance.search(simd, self.ray, item, stack.above(), self.search)?;
            } else {
                self.frame.offer_item(self.ray, item, self.search)?;
            }
        }
        Continue(true)
    }

    #[inline(always)]
    fn prefetch(&self, _: u32) {}
}

/// Blocks of triangles of a mesh.
struct TriangleLeaves<'a, T> {
    item: u32,
    blocks: &'a [TriangleBlock],
    /// Which of them can be cut out: see [`PreparedFrame::cutouts_of`].
    cutouts: &'a [u16],
    near: &'a NearRay,
    search: &'a mut T,
}

impl<S: Simd, T: Search> Leaves<S> for TriangleLeaves<'_, T> {
    #[inline(always)]
    fn limit(&self) -> f64 {
        self.search.limit()
    }

    #[inline(always)]
    fn visit(&mut self, simd: S, leaf: u32, reach: f32, _: Stack) -> ControlFlow<(), bool> {
        // Made for each block: many rays see none, few see many. Not before the walk either: see `walk`.
        let filter = FilterRay::new(black_box(self.near));
        let hits = filter.hits(simd, &self.blocks[leaf as usize], reach);
        let certain = hits.certain & !cutout::bits_at(self.cutouts, leaf * WIDTH as u32);
        for lane in each_bit(hits.maybe) {
            let triangle = leaf * WIDTH as u32 + lane as u32;
            let primitive = PrimitiveId { item: self.item, triangle };
            if !self.search.leaves(primitive) {
                let certain = certain >> lane & 1 == 1;
                let (low, high) = (self.near.t(hits.low[lane]), self.near.t(hits.high[lane]));
                self.search.offer(Offer { primitive, certain, low, high })?;
            }
        }
        Continue(hits.maybe != 0)
    }

    #[inline(always)]
    fn prefetch(&self, leaf: u32) {
        if let Some(block) = self.blocks.get(leaf as usize) {
            prefetch(block);
        }
    }
}

impl Instance {
    /// Offers every triangle of this model to `search` that the ray may hit.
    #[inline(always)]
    fn search<S: Simd>(
        &self,
        simd: S,
        ray: &Ray,
        item: u32,
        stack: Stack,
        search: &mut impl Search,
    ) -> ControlFlow<()> {
        let whole_mesh = || (Vec3::NEG_ONE, Vec3::ONE);
        let Some(near) = NearRay::new(self.to_mesh(ray), self.drift, whole_mesh) else { return Continue(()) };
        let blocks = self.mesh.blocks();
        let cutouts = &self.cutouts;
        let mut triangles = TriangleLeaves { item, blocks, cutouts, near: &near, search };
        walk(simd, self.mesh.nodes(), &near, stack, &mut triangles)
    }

    #[inline(always)]
    pub(crate) fn to_mesh(&self, ray: &Ray) -> Ray {
        Ray {
            origin: self.inverse * (ray.origin - self.translation),
            direction: self.inverse * ray.direction,
        }
    }
}

impl Hit {
    pub(crate) fn wins_over(&self, other: &Hit) -> bool {
        self.t < other.t || (self.t == other.t && self.rank < other.rank)
    }
}
