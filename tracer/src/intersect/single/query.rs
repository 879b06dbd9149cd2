//! Queries of one ray: the closest hit, or any hit.
//!
//! Filters find candidates: primitives with intervals of distances that are as wide as coincident hits may be apart (see
//! `coincide`). A certain candidate whose interval is before all others needs no exact test; where intervals overlap, or where
//! a hit is not certain, the exact test decides. So the result is that of the exact test of all primitives.

use std::ops::ControlFlow::{self, Break, Continue};

use crate::frame::PreparedFrame;
use crate::rays::{PrimitiveId, Ray};

/// A primitive that a ray may hit, at a t between `low` and `high` if it does.
#[derive(Clone, Copy)]
pub(in crate::intersect) struct Candidate {
    pub primitive: PrimitiveId,
    /// Whether the ray hits it for certain.
    pub certain: bool,
    pub low: f64,
    pub high: f64,
}

/// A query that considers candidates until its result is known.
pub(in crate::intersect) trait RayQuery {
    /// Upper end of the distances that matter.
    fn limit(&self) -> f64;

    /// Whether the ray starts on this primitive.
    fn starts_on(&self, primitive: PrimitiveId) -> bool;

    /// Whether no primitive of an item or plane matters.
    #[inline(always)]
    fn skips(&self, _item: u32) -> bool {
        false
    }

    /// Considers a candidate. Breaks when no further candidate matters.
    fn consider(&mut self, candidate: Candidate) -> ControlFlow<()>;
}

/// Query for the nearest hit in (0, `t_max`): the one with the lowest t, of equal ones that of the lowest rank. It notes whether
/// others may coincide with it.
pub(super) struct Closest<'a> {
    frame: &'a PreparedFrame,
    ray: &'a Ray,
    t_max: f64,
    starts_on: Option<PrimitiveId>,
    best: Option<PrimitiveId>,
    /// Whether two hits were so near to each other that they may coincide.
    tied: bool,
    /// Bounds of the t of the best hit; `t_max` before the first.
    low: f64,
    high: f64,
}

impl<'a> Closest<'a> {
    pub(super) fn new(
        frame: &'a PreparedFrame,
        ray: &'a Ray,
        t_max: f64,
        starts_on: Option<PrimitiveId>,
    ) -> Self {
        Self { frame, ray, t_max, starts_on, best: None, tied: false, low: t_max, high: t_max }
    }

    /// The primitive of the nearest hit, and whether hits of others may coincide with it.
    pub(super) fn found(&self) -> Option<(PrimitiveId, bool)> {
        Some((self.best?, self.tied))
    }

    #[cold]
    #[inline(never)]
    fn test_exactly(&mut self, primitive: PrimitiveId) {
        let Some(hit) = self.frame.hit_of(self.ray, primitive, self.starts_on) else { return };
        let slack = self.frame.slack(self.ray, primitive, hit.t);
        let best = self.best.and_then(|best| self.frame.hit_of(self.ray, best, self.starts_on));
        let wins = match best {
            Some(best) => {
                self.tied |= (hit.t - best.t).abs() <= slack;
                hit.wins_over(&best, self.frame)
            }
            None => hit.t < self.t_max,
        };
        if wins {
            self.take(primitive, hit.t, hit.t + slack);
        }
    }

    #[inline(always)]
    fn take(&mut self, primitive: PrimitiveId, low: f64, high: f64) {
        (self.best, self.low, self.high) = (Some(primitive), low, high);
    }
}

impl RayQuery for Closest<'_> {
    #[inline(always)]
    fn limit(&self) -> f64 {
        self.high
    }

    #[inline(always)]
    fn starts_on(&self, primitive: PrimitiveId) -> bool {
        self.starts_on == Some(primitive)
    }

    #[inline(always)]
    fn consider(&mut self, candidate: Candidate) -> ControlFlow<()> {
        if candidate.certain && candidate.high < self.low {
            self.take(candidate.primitive, candidate.low, candidate.high);
        } else if candidate.low <= self.high {
            self.test_exactly(candidate.primitive);
        }
        Continue(())
    }
}

/// Query for any hit with t in (0, `t_max`).
#[derive(Clone, Copy)]
pub(in crate::intersect) struct Any<'a> {
    /// Whether items do not count that let all light pass.
    pub of_light: bool,
    pub frame: &'a PreparedFrame,
    pub ray: &'a Ray,
    pub t_max: f64,
    pub starts_on: Option<PrimitiveId>,
}

impl Any<'_> {
    #[cold]
    #[inline(never)]
    fn test_exactly(&self, primitive: PrimitiveId) -> bool {
        self.frame.t_of(self.ray, primitive, self.starts_on).is_some_and(|t| t < self.t_max)
    }
}

impl RayQuery for Any<'_> {
    #[inline(always)]
    fn limit(&self) -> f64 {
        self.t_max
    }

    #[inline(always)]
    fn starts_on(&self, primitive: PrimitiveId) -> bool {
        self.starts_on == Some(primitive)
    }

    #[inline(always)]
    fn skips(&self, item: u32) -> bool {
        self.of_light && self.frame.is_clear(item)
    }

    #[inline(always)]
    fn consider(&mut self, candidate: Candidate) -> ControlFlow<()> {
        // A ray may hit the sphere that it starts on: candidates of spheres are exact.
        let certain = candidate.certain && candidate.high < self.t_max;
        if certain || self.test_exactly(candidate.primitive) { Break(()) } else { Continue(()) }
    }
}
