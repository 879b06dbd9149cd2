//! One ray against the whole scene: the scene's tree over its items, and for models the tree over their triangles.
//!
//! Rays are `f64`; trees and edge functions are `f32`. A filter tests sixteen boxes or triangles at once and finds which hits
//! are certain (`traversal`, `filter`); the exact test decides all others, and computes the distance of the result.
//!
//! ```text
//!   near_ray        a ray in f32, with error bounds
//!   traversal       one ray down a tree
//!   filter          one ray against sixteen triangles
//!   query           closest hit, any hit
//!   transmittance   share of light that passes all surfaces
//!   moving          items that move while the shutter is open
//!   solid           where a ray crosses the surface of a closed mesh
//!   leaves          the leaves of the scene's tree and of a mesh's tree
//! ```

mod filter;
mod leaves;
mod moving;
mod near_ray;
mod query;
mod solid;
#[cfg(test)]
mod tests;
mod transmittance;
mod traversal;

pub(crate) use moving::TimedRay;
use query::Closest;
pub(super) use query::{Any, Candidate, RayQuery};
pub(super) use solid::SolidCrossing;
pub(crate) use transmittance::Crossings;
pub(super) use traversal::{Stack, with_stack};

use super::Hit;
use crate::frame::PreparedFrame;
use crate::rays::{PrimitiveId, Ray};
use crate::simd::{Simd, dispatch};

impl PreparedFrame {
    /// The closest hit with 0 < t < `t_max` of a ray that may start on a primitive.
    pub(crate) fn closest(&self, ray: &Ray, t_max: f64, starts_on: Option<PrimitiveId>) -> Option<Hit> {
        let nearest = with_stack(
            |stack| dispatch!(self.level, simd => self.nearest(simd, stack, ray, t_max, starts_on)),
        );
        let (mut primitive, tied) = nearest?;
        if tied {
            (primitive, _) = self.preferred(ray, primitive, t_max, starts_on);
        }
        self.hit_of(ray, primitive, starts_on)
    }

    /// Whether anything is hit within 0 < t < `t_max` by a ray that may start on a primitive.
    pub(crate) fn hits_anything(&self, ray: &Ray, t_max: f64, starts_on: Option<PrimitiveId>) -> bool {
        self.any_of(&Any { of_light: false, frame: self, ray, t_max, starts_on })
    }

    /// Whether anything that does not let all light pass is hit within 0 < t < `t_max` by a ray that may start on a primitive.
    pub(crate) fn occluded(&self, ray: &Ray, t_max: f64, starts_on: Option<PrimitiveId>) -> bool {
        self.any_of(&Any { of_light: true, frame: self, ray, t_max, starts_on })
    }

    fn any_of(&self, any: &Any<'_>) -> bool {
        with_stack(|stack| dispatch!(self.level, simd => self.hits_any(simd, stack, any)))
    }

    /// The primitive of the nearest hit, and whether others may coincide with it: then [`PreparedFrame::preferred`] decides,
    /// after the thread's stack is free again.
    #[inline(always)]
    pub(super) fn nearest<S: Simd>(
        &self,
        simd: S,
        stack: Stack,
        ray: &Ray,
        t_max: f64,
        starts_on: Option<PrimitiveId>,
    ) -> Option<(PrimitiveId, bool)> {
        let mut closest = Closest::new(self, ray, t_max, starts_on);
        let _ = self.search(simd, ray, stack, &mut closest);
        closest.found()
    }

    /// Whether anything is hit.
    #[inline(always)]
    pub(super) fn hits_any<S: Simd>(&self, simd: S, stack: Stack, any: &Any<'_>) -> bool {
        let mut any = *any;
        self.search(simd, any.ray, stack, &mut any).is_break()
    }

    /// Passes every primitive that the ray may hit to a query, those in nearer boxes first.
    pub(super) fn search_all(&self, ray: &Ray, query: &mut impl RayQuery) {
        let _ = with_stack(|stack| dispatch!(self.level, simd => self.search(simd, ray, stack, query)));
    }

    /// Passes every primitive of an item that the ray may hit to a query.
    pub(super) fn search_all_of(&self, item: u32, ray: &Ray, query: &mut impl RayQuery) {
        let _ = with_stack(
            |stack| dispatch!(self.level, simd => self.search_item(simd, ray, item, stack, query)),
        );
    }
}
