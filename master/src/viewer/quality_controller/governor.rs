//! Which rung of the ladder a moving picture is rendered at. Pure: no clock, no picture; it is told what frames took.

use std::time::Duration;

use super::costs::Costs;

/// A rung is gone to when it is predicted to take at most this part of the time that a frame has, and left when it is
/// predicted to take more than that part: what lies between keeps a steady load from swinging to and fro.
const FRESH: Band = Band { enter: 0.87, leave: 1.0 };
/// The same once a rung has stood for [`SETTLE`] frames: what is predicted wavers a little for as long as it stands.
const SETTLED: Band = Band { enter: 0.83, leave: 1.03 };
const SETTLE: u32 = 60;
/// A better rung must be predicted to hold in so many frames in a row, and so many after the last change.
const PATIENCE: u32 = 3;
const DWELL: u32 = 8;
/// Where no rung holds, another is worth a change when it is quicker by this factor.
const NOTABLY: f64 = 0.95;
/// So many frames in a row in which no rung is predicted to hold: then that is told.
const BEATEN_FOR: u32 = 10;

/// The load has jumped up by this factor, and since then a rung that takes no more than this part of the time has stood for so
/// many frames: then the next better one is tried, whatever is predicted of it. What jumped may have been the cost of the rung
/// before alone, and nothing else would tell.
const JUMP: f64 = 1.2;
const ROOM: f64 = 0.6;
const TRY_AFTER: u32 = 40;
/// So many frames are given to it, the first of which are still those of the rung before.
const TRIAL: u32 = 8;

/// Parts of the time that a frame has.
#[derive(Clone, Copy, Debug)]
struct Band {
    enter: f64,
    leave: f64,
}

/// Picks the rung of least loss that is predicted to hold the target.
#[derive(Clone, Debug)]
pub(crate) struct Governor {
    costs: Costs,
    /// The time that a frame has, in seconds.
    budget: f64,
    rung: usize,
    /// Of the frame before.
    last_seen: usize,
    since_change: u32,
    better_for: u32,
    beaten_for: u32,
    /// Rungs that no frame has had since the load jumped.
    doubtful: Vec<bool>,
    /// The load before it did, in seconds of a full frame.
    calm: f64,
    /// Frames that a doubtful rung is still given.
    trial: u32,
}

impl Governor {
    /// For rungs in the order of their loss, the first being full quality. `ratios`: what a table says of their cost, as
    /// a part of the first one's. `budget`: the time that a frame has.
    pub(crate) fn new(ratios: impl IntoIterator<Item = f64>, budget: Duration) -> Self {
        let budget = budget.as_secs_f64();
        let costs = Costs::new(ratios);
        let doubtful = vec![false; costs.len()];
        Self {
            costs,
            budget,
            rung: 0,
            last_seen: 0,
            since_change: DWELL,
            better_for: 0,
            beaten_for: 0,
            doubtful,
            calm: f64::MAX,
            trial: 0,
        }
    }

    /// Likewise, where the full frame is known to take `full`.
    pub(crate) fn starting(ratios: impl IntoIterator<Item = f64>, budget: Duration, full: Duration) -> Self {
        let mut governor = Self::new(ratios, budget);
        governor.costs.expect(full);
        governor.descend((0..governor.costs.len()).find(|&rung| governor.fits(rung, FRESH.enter)));
        governor
    }

    /// The rung for the next frame.
    pub(crate) fn rung(&self) -> usize {
        self.rung
    }

    /// Whether even the cheapest rung does not hold the target.
    pub(crate) fn is_beaten(&self) -> bool {
        self.beaten_for >= BEATEN_FOR
    }

    /// What a frame at a rung is expected to take; `None` before the first frame.
    pub(crate) fn predicted(&self, rung: usize) -> Option<Duration> {
        Duration::try_from_secs_f64(self.costs.predicted(rung)?).ok()
    }

    /// A frame at a rung took so long. Frames need not have the rung that is wanted now: those in flight have an earlier
    /// one, and those of a picture at rest the first.
    pub(crate) fn observe(&mut self, rung: usize, took: Duration) {
        let is_first = self.costs.predicted(0).is_none();
        // Workers began it while they were busy with one of another rung: what it took says little of either.
        let is_mixed = std::mem::replace(&mut self.last_seen, rung) != rung && !is_first;
        let before = self.costs.predicted(0);
        if !is_mixed && self.costs.observe(rung, took) {
            self.doubtful.fill(true);
            self.calm = before.unwrap_or(f64::MAX);
        }
        if let Some(doubtful) = self.doubtful.get_mut(rung) {
            *doubtful &= is_mixed;
        }
        self.since_change = self.since_change.saturating_add(1);
        let band = if self.since_change >= SETTLE { SETTLED } else { FRESH };
        let best = (0..self.costs.len()).find(|&rung| self.fits(rung, band.enter));
        self.trial = self.trial.saturating_sub(1);
        match best {
            _ if self.trial > 0 => {}
            Some(best) if best < self.rung => self.climb(best),
            _ if is_first || !self.fits(self.rung, band.leave) => self.descend(best),
            _ => self.stay(),
        }
        let holds = (0..self.costs.len()).any(|rung| self.fits(rung, SETTLED.leave));
        self.beaten_for = if holds { 0 } else { self.beaten_for.saturating_add(1) };
    }

    /// A better rung holds, if it goes on like this.
    fn climb(&mut self, best: usize) {
        self.better_for += 1;
        if self.better_for >= PATIENCE && self.since_change >= DWELL {
            self.change(best);
        }
    }

    /// The rung holds, and is predicted to be the best that does. If that is doubtful, it is put to the test.
    fn stay(&mut self) {
        self.better_for = 0;
        let Some(better) = self.rung.checked_sub(1) else { return };
        let is_doubtful = self.doubtful.get(better).is_some_and(|doubtful| *doubtful);
        let has_jumped = self.costs.predicted(0).is_some_and(|load| load > JUMP * self.calm);
        let settled = self.since_change >= TRY_AFTER;
        if is_doubtful && has_jumped && settled && self.fits(self.rung, ROOM) {
            self.change(better);
            self.trial = TRIAL;
        }
    }

    /// The rung does not hold: on to the next one that does, or else to the one that is the quickest.
    fn descend(&mut self, best: Option<usize>) {
        self.better_for = 0;
        let quickest = || {
            let seconds = |rung: &usize| self.costs.predicted(*rung).unwrap_or(f64::MAX);
            let quickest = (0..self.costs.len()).min_by(|a, b| seconds(a).total_cmp(&seconds(b)))?;
            (seconds(&quickest) < NOTABLY * seconds(&self.rung)).then_some(quickest)
        };
        if let Some(rung) = best.or_else(quickest).filter(|&rung| rung != self.rung) {
            self.change(rung);
        }
    }

    fn change(&mut self, rung: usize) {
        self.rung = rung;
        (self.since_change, self.better_for) = (0, 0);
    }

    /// Whether a rung is predicted to take at most this part of the time that there is.
    fn fits(&self, rung: usize, part: f64) -> bool {
        self.costs.predicted(rung).is_none_or(|seconds| seconds <= self.budget * part)
    }
}
