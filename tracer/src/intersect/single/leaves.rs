//! The leaves of the scene's tree and of a mesh's tree.

use std::hint::black_box;
use std::ops::ControlFlow::{self, Continue};

use glam::Vec3;

use super::filter::FilterRay;
use super::near_ray::NearRay;
use super::query::{Candidate, RayQuery};
use super::traversal::{LeafVisitor, Stack, traverse};
use crate::bvh::WIDTH;
use crate::compile::Item;
use crate::frame::{Instance, PreparedFrame};
use crate::intersect::cutout;
use crate::mesh::TriangleBlock;
use crate::rays::{PrimitiveId, Ray};
use crate::simd::{Simd, each_bit, prefetch};

impl PreparedFrame {
    /// Passes every primitive that the ray may hit to a query, those in nearer boxes first.
    #[inline(always)]
    pub(super) fn search<S: Simd>(
        &self,
        simd: S,
        ray: &Ray,
        stack: Stack,
        query: &mut impl RayQuery,
    ) -> ControlFlow<()> {
        for plane in 0..self.planes.len() as u32 {
            let plane = self.items.first_plane() + plane;
            if !query.skips(plane) {
                self.visit_item(ray, plane, query)?;
            }
        }
        // A single model: its own tree is all there is to walk.
        if let ([instance], true) = (&self.instances[..], self.is_single_model) {
            return if query.skips(0) { Continue(()) } else { instance.search(simd, ray, 0, stack, query) };
        }
        let bounds = || self.nodes[0].bounds();
        let Some(near) = NearRay::new(*ray, 0.0, bounds) else { return Continue(()) };
        traverse(simd, &self.nodes, &near, stack, &mut ItemLeaves { frame: self, ray, query })
    }

    /// Passes every primitive of an item that the ray may hit to a query.
    #[inline(always)]
    pub(super) fn search_item<S: Simd>(
        &self,
        simd: S,
        ray: &Ray,
        item: u32,
        stack: Stack,
        query: &mut impl RayQuery,
    ) -> ControlFlow<()> {
        if let Item::Model(index) = self.items.get(item) {
            self.instances[index].search(simd, ray, item, stack, query)
        } else {
            self.visit_item(ray, item, query)
        }
    }

    /// Passes a sphere, a plane or a triangle of the scene file to a query.
    #[inline(never)]
    fn visit_item(&self, ray: &Ray, item: u32, query: &mut impl RayQuery) -> ControlFlow<()> {
        let primitive = PrimitiveId { item, triangle: 0 };
        let starts_on = query.starts_on(primitive).then_some(primitive);
        let Some(t) = self.t_of(ray, primitive, starts_on) else { return Continue(()) };
        let slack = self.slack(ray, primitive, t);
        query.consider(Candidate { primitive, certain: true, low: t - slack, high: t + slack })
    }
}

/// Leaves of the scene's tree: items.
struct ItemLeaves<'a, T> {
    frame: &'a PreparedFrame,
    ray: &'a Ray,
    query: &'a mut T,
}

impl<S: Simd, T: RayQuery> LeafVisitor<S> for ItemLeaves<'_, T> {
    #[inline(always)]
    fn limit(&self) -> f64 {
        self.query.limit()
    }

    #[inline(always)]
    fn visit(&mut self, simd: S, leaf: u32, _: f32, mut stack: Stack) -> ControlFlow<(), bool> {
        for &item in self.frame.items_of(leaf) {
            if self.query.skips(item) {
                continue;
            }
            self.frame.search_item(simd, self.ray, item, stack.above(), self.query)?;
        }
        Continue(true)
    }

    #[inline(always)]
    fn prefetch(&self, _: u32) {}
}

/// Leaves of a mesh's tree: blocks of triangles.
struct TriangleLeaves<'a, T> {
    item: u32,
    blocks: &'a [TriangleBlock],
    /// Bits of those that alpha cuts out: see [`PreparedFrame::cutouts_of`].
    cutouts: &'a [u16],
    near: &'a NearRay,
    query: &'a mut T,
}

impl<S: Simd, T: RayQuery> LeafVisitor<S> for TriangleLeaves<'_, T> {
    #[inline(always)]
    fn limit(&self) -> f64 {
        self.query.limit()
    }

    #[inline(always)]
    fn visit(&mut self, simd: S, leaf: u32, reach: f32, _: Stack) -> ControlFlow<(), bool> {
        // Made for each block: many rays reach none, few reach many. Not before the traversal: see `traverse`.
        let filter = FilterRay::new(black_box(self.near));
        let hits = filter.hits(simd, &self.blocks[leaf as usize], reach);
        let certain = hits.certain & !cutout::bits_at(self.cutouts, leaf * WIDTH as u32);
        for lane in each_bit(hits.maybe) {
            let triangle = leaf * WIDTH as u32 + lane as u32;
            let primitive = PrimitiveId { item: self.item, triangle };
            if !self.query.starts_on(primitive) {
                let certain = certain >> lane & 1 == 1;
                let (low, high) = (self.near.t(hits.low[lane]), self.near.t(hits.high[lane]));
                self.query.consider(Candidate { primitive, certain, low, high })?;
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
    /// Passes every triangle of this model that the ray may hit to a query.
    #[inline(always)]
    pub(super) fn search<S: Simd>(
        &self,
        simd: S,
        ray: &Ray,
        item: u32,
        stack: Stack,
        query: &mut impl RayQuery,
    ) -> ControlFlow<()> {
        let whole_mesh = || (Vec3::NEG_ONE, Vec3::ONE);
        let Some(near) = NearRay::new(self.to_mesh(ray), self.drift, whole_mesh) else { return Continue(()) };
        let blocks = self.mesh.blocks();
        let cutouts = &self.cutouts;
        let mut triangles = TriangleLeaves { item, blocks, cutouts, near: &near, query };
        traverse(simd, self.mesh.nodes(), &near, stack, &mut triangles)
    }
}
