//! One ray at a time against the items that move while the shutter is open.
//!
//! A tree over the boxes of all poses of the items leads to those that the ray may hit. Each is searched at rest, by the ray that the
//! inverse of its pose maps there: t is the same. The exact test decides between items, so the order of the search does not matter.

use std::ops::ControlFlow::{self, Continue};

use super::near_ray::NearRay;
use super::query::{Any, Closest};
use super::traversal::{LeafVisitor, Stack, traverse, with_stack};
use crate::frame::{Motions, MovingItem, PreparedFrame};
use crate::intersect::Hit;
use crate::rays::{PrimitiveId, Ray};
use crate::simd::{Simd, dispatch};

/// A ray at a time from 0, when the shutter opens, to 1, when it closes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TimedRay {
    pub ray: Ray,
    /// Hits within 0 < t < `t_max` count.
    pub t_max: f64,
    /// The primitive that the ray starts on.
    pub starts_on: Option<PrimitiveId>,
    pub time: f64,
}

/// A hit of an item that moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MovingHit {
    pub hit: Hit,
    /// The ray as the item at rest meets it.
    pub at_rest: Ray,
    /// Whether hits of other primitives of the item coincide with it.
    pub coincident: bool,
}

impl PreparedFrame {
    /// The closest hit of items that move, if it is before that of `still` items, which is computed if the ray comes near any.
    #[inline(never)]
    pub(crate) fn closest_moving(
        &self,
        timed: &TimedRay,
        still: impl FnOnce() -> Option<Hit>,
    ) -> Option<MovingHit> {
        let motions = self.motions.as_deref()?;
        let near = near_ray(motions, &timed.ray)?;
        let mut nearest =
            Nearest { frame: self, motions, timed, still: Some(still), best: None, found: None };
        let _ = with_stack(
            |stack| dispatch!(self.level, simd => traverse(simd, &motions.nodes, &near, stack, &mut nearest)),
        );
        nearest.found.map(|found| self.settled(found, timed))
    }

    /// Whether a ray hits an item that moves. With `of_light`, those do not count that let all light pass.
    #[inline(never)]
    pub(crate) fn hits_moving(&self, timed: &TimedRay, of_light: bool) -> bool {
        let Some(motions) = self.motions.as_deref() else { return false };
        let Some(near) = near_ray(motions, &timed.ray) else { return false };
        let mut any = AnyMoving { frame: self, motions, timed, of_light };
        let found = with_stack(
            |stack| dispatch!(self.level, simd => traverse(simd, &motions.nodes, &near, stack, &mut any)),
        );
        found.is_break()
    }

    /// The hit that coincident ones of the same item leave.
    fn settled(&self, found: MovingHit, timed: &TimedRay) -> MovingHit {
        if !found.coincident {
            return found;
        }
        let MovingHit { hit, at_rest, .. } = found;
        let (preferred, coincident) =
            self.preferred_of_item(&at_rest, hit.primitive, timed.t_max, timed.starts_on);
        let hit = self.hit_of(&at_rest, preferred, timed.starts_on).unwrap_or(hit);
        MovingHit { hit, at_rest, coincident }
    }
}

fn near_ray(motions: &Motions, ray: &Ray) -> Option<NearRay> {
    NearRay::new(*ray, 0.0, || motions.nodes[0].bounds())
}

/// The items in a leaf of the tree over the items that move.
fn items_of(motions: &Motions, leaf: u32) -> impl Iterator<Item = &MovingItem> {
    motions.blocks[leaf as usize].iter().map(|&index| &motions.items[index as usize])
}

/// Visitor for the closest hit.
struct Nearest<'a, F> {
    frame: &'a PreparedFrame,
    motions: &'a Motions,
    timed: &'a TimedRay,
    /// The hit of still items, until it is computed.
    still: Option<F>,
    /// The closest hit so far, of any item.
    best: Option<Hit>,
    /// The closest one of items that move, if it is the closest. Its coincident hits are still to be settled.
    found: Option<MovingHit>,
}

impl<S: Simd, F: FnOnce() -> Option<Hit>> LeafVisitor<S> for Nearest<'_, F> {
    #[inline(always)]
    fn limit(&self) -> f64 {
        self.best.as_ref().map_or(self.timed.t_max, |hit| hit.t)
    }

    #[inline(always)]
    fn visit(&mut self, simd: S, leaf: u32, _: f32, mut stack: Stack) -> ControlFlow<(), bool> {
        let Self { frame, motions, timed, .. } = *self;
        if let Some(still) = self.still.take() {
            self.best = still();
        }
        let starts_on = timed.starts_on;
        for moving in items_of(motions, leaf) {
            let at_rest = moving.pose(timed.time).to_rest(&timed.ray);
            // A hit at the same t may be of a lower rank.
            let end = self.best.as_ref().map_or(timed.t_max, |hit| hit.t.next_up());
            let mut closest = Closest::new(frame, &at_rest, end, starts_on);
            let _ = frame.search_item(simd, &at_rest, moving.item, stack.above(), &mut closest);
            let Some((primitive, coincident)) = closest.found() else { continue };
            let Some(hit) = frame.hit_of(&at_rest, primitive, starts_on) else { continue };
            if self.best.as_ref().is_none_or(|best| hit.wins_over(best, frame)) {
                self.best = Some(hit);
                self.found = Some(MovingHit { hit, at_rest, coincident });
            }
        }
        Continue(true)
    }

    #[inline(always)]
    fn prefetch(&self, _: u32) {}
}

/// Visitor for any hit.
struct AnyMoving<'a> {
    frame: &'a PreparedFrame,
    motions: &'a Motions,
    timed: &'a TimedRay,
    of_light: bool,
}

impl<S: Simd> LeafVisitor<S> for AnyMoving<'_> {
    #[inline(always)]
    fn limit(&self) -> f64 {
        self.timed.t_max
    }

    #[inline(always)]
    fn visit(&mut self, simd: S, leaf: u32, _: f32, mut stack: Stack) -> ControlFlow<(), bool> {
        let Self { frame, motions, timed, of_light } = *self;
        for moving in items_of(motions, leaf) {
            if of_light && frame.is_clear(moving.item) {
                continue;
            }
            let ray = moving.pose(timed.time).to_rest(&timed.ray);
            let (t_max, starts_on) = (timed.t_max, timed.starts_on);
            let mut any = Any { of_light, frame, ray: &ray, t_max, starts_on };
            frame.search_item(simd, &ray, moving.item, stack.above(), &mut any)?;
        }
        Continue(false)
    }

    #[inline(always)]
    fn prefetch(&self, _: u32) {}
}
