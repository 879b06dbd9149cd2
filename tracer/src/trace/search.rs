//! What a ray is asked for: the closest hit, or any.
//!
//! Filters offer intervals of distances, as wide as hits that coincide may be apart (`coincide.rs`). What they decide is decided; only where intervals overlap, or where a hit is not
//! certain, the exact test is asked. So the answer is the one of the exact test over all primitives.

use std::ops::ControlFlow::{self, Break, Continue};

use super::{PrimitiveId, Ray};
use crate::frame::PreparedFrame;

/// A primitive that the ray may hit, at a t between `low` and `high` if it does.
#[derive(Clone, Copy)]
pub(super) struct Offer {
    pub primitive: PrimitiveId,
    pub certain: bool,
    pub low: f64,
    pub high: f64,
}

/// Takes offers until it has its answer.
pub(super) trait Search {
    /// Hits at a larger t are of no interest.
    fn limit(&self) -> f64;

    /// Whether the ray starts on this primitive.
    fn leaves(&self, primitive: PrimitiveId) -> bool;

    /// Breaks when nothing more is to be found out.
    fn offer(&mut self, offer: Offer) -> ControlFlow<()>;
}

/// The hit that a ray sees in (0, `t_max`): the one with the lowest t, of equal ones that of the lowest rank, or one that
/// coincides with it.
pub(super) struct Closest<'a> {
    frame: &'a PreparedFrame,
    ray: &'a Ray,
    t_max: f64,
    best: Option<PrimitiveId>,
    /// Whether hits were so near to each other that they may coincide.
    tied: bool,
    /// The t of the best hit lies between these; `t_max` as long as there is none.
    low: f64,
    high: f64,
}

impl<'a> Closest<'a> {
    pub(super) fn new(frame: &'a PreparedFrame, ray: &'a Ray, t_max: f64) -> Self {
        Self { frame, ray, t_max, best: None, tied: false, low: t_max, high: t_max }
    }

    /// What was found, and its t to the last digit.
    pub(super) fn found(&self) -> Option<(f64, PrimitiveId)> {
        let mut best = self.best?;
        if self.tied {
            (best, _) = self.frame.preferred(self.ray, best, self.t_max);
        }
        Some((self.frame.t_of(self.ray, best, None)?, best))
    }

    #[cold]
    #[inline(never)]
    fn ask(&mut self, primitive: PrimitiveId) {
        let Some(hit) = self.frame.hit_of(self.ray, primitive, None) else { return };
        let slack = self.frame.slack(self.ray, primitive, hit.t);
        let best = self.best.and_then(|best| self.frame.hit_of(self.ray, best, None));
        let wins = match best {
            Some(best) => {
                self.tied |= (hit.t - best.t).abs() <= slack;
                hit.wins_over(&best)
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

impl Search for Closest<'_> {
    #[inline(always)]
    fn limit(&self) -> f64 {
        self.high
    }

    #[inline(always)]
    fn leaves(&self, _: PrimitiveId) -> bool {
        false
    }

    #[inline(always)]
    fn offer(&mut self, offer: Offer) -> ControlFlow<()> {
        if offer.certain && offer.high < self.low {
            self.take(offer.primitive, offer.low, offer.high);
        } else if offer.low <= self.high {
            self.ask(offer.primitive);
        }
        Continue(())
    }
}

/// Whether anything but the primitive that the ray leaves is hit with t in (0, `t_max`).
pub(super) struct Any<'a> {
    pub frame: &'a PreparedFrame,
    pub ray: &'a Ray,
    pub t_max: f64,
    pub leaving: Option<PrimitiveId>,
}

impl Any<'_> {
    #[cold]
    #[inline(never)]
    fn ask(&self, primitive: PrimitiveId) -> bool {
        self.frame.t_of(self.ray, primitive, self.leaving).is_some_and(|t| t < self.t_max)
    }
}

impl Search for Any<'_> {
    #[inline(always)]
    fn limit(&self) -> f64 {
        self.t_max
    }

    #[inline(always)]
    fn leaves(&self, primitive: PrimitiveId) -> bool {
        self.leaving == Some(primitive)
    }

    #[inline(always)]
    fn offer(&mut self, offer: Offer) -> ControlFlow<()> {
        // A sphere may be hit by a ray that leaves it: what is offered of it is exact.
        let certain = offer.certain && offer.high < self.t_max;
        if certain || self.ask(offer.primitive) { Break(()) } else { Continue(()) }
    }
}
