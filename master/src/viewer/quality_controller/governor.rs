//! Choice of the rung at which a moving picture is rendered. Pure: no clock, no picture; its input is the time of frames.

use std::time::Duration;

use super::costs::Costs;

/// Hysteresis: a rung is entered when its predicted time is at most one part of a frame's budget, and left when it is more
/// than another part, so that a steady load does not oscillate.
const FRESH: Band = Band { enter: 0.87, leave: 1.0 };
/// Hysteresis after [`SETTLE`] frames at a rung: predictions vary a little from frame to frame.
const SETTLED: Band = Band { enter: 0.83, leave: 1.03 };
const SETTLE: u32 = 60;
/// Consecutive frames in which a better rung must be predicted to hold, and frames since the last change, before a climb.
const PATIENCE: u32 = 3;
const DWELL: u32 = 8;
/// Factor of time below which another rung is worth a change, where no rung holds.
const NOTABLY: f64 = 0.95;
/// Consecutive frames in which no rung is predicted to hold before that is reported.
const BEATEN_FOR: u32 = 10;

/// Trial of a better rung whatever its prediction, after the load has jumped up by the factor `JUMP` and a rung that takes at
/// most `ROOM` of the budget has been in use for `TRY_AFTER` frames. The jump may have been of the former rung's cost alone,
/// which only a trial can show.
const JUMP: f64 = 1.2;
const ROOM: f64 = 0.6;
const TRY_AFTER: u32 = 40;
/// Frames of a trial, the first of which are still of the previous rung.
const TRIAL: u32 = 8;

/// Parts of a frame's budget.
#[derive(Clone, Copy, Debug)]
struct Band {
    enter: f64,
    leave: f64,
}

/// Governor: picks the rung of least loss that is predicted to hold the target rate.
#[derive(Clone, Debug)]
pub(crate) struct Governor {
    costs: Costs,
    /// Time budget of a frame, in seconds.
    budget: f64,
    rung: usize,
    /// Rung of the previous frame.
    last_seen: usize,
    since_change: u32,
    better_for: u32,
    beaten_for: u32,
    /// Rungs without a frame since the load jumped.
    doubtful: Vec<bool>,
    /// Load before it jumped, in seconds of a full frame.
    calm: f64,
    /// Remaining frames of the trial of a doubtful rung.
    trial: u32,
}

impl Governor {
    /// A governor of rungs in the order of their loss, the first being full quality. `ratios`: their costs by a table, as parts
    /// of the first one's. `budget`: time of a frame at the target rate.
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

    /// As [`Governor::new`], with the time of the full frame known to be `full`.
    pub(crate) fn starting(ratios: impl IntoIterator<Item = f64>, budget: Duration, full: Duration) -> Self {
        let mut governor = Self::new(ratios, budget);
        governor.costs.expect(full);
        governor.descend((0..governor.costs.len()).find(|&rung| governor.fits(rung, FRESH.enter)));
        governor
    }

    /// Rung of the next frame.
    pub(crate) fn rung(&self) -> usize {
        self.rung
    }

    /// Whether even the cheapest rung does not hold the target.
    pub(crate) fn is_beaten(&self) -> bool {
        self.beaten_for >= BEATEN_FOR
    }

    /// Predicted time of a frame at a rung; `None` before the first frame.
    pub(crate) fn predicted(&self, rung: usize) -> Option<Duration> {
        Duration::try_from_secs_f64(self.costs.predicted(rung)?).ok()
    }

    /// Adds the time of a frame at a rung. It need not be the current rung: frames in flight have an earlier one, and those of a
    /// picture at rest the first.
    pub(crate) fn observe(&mut self, rung: usize, took: Duration) {
        let is_first = self.costs.predicted(0).is_none();
        // Workers began it while they were busy with a frame of another rung: its time measures neither.
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

    /// Climbs to a better rung if it has been predicted to hold for long enough.
    fn climb(&mut self, best: usize) {
        self.better_for += 1;
        if self.better_for >= PATIENCE && self.since_change >= DWELL {
            self.change(best);
        }
    }

    /// Keeps the rung, which is predicted to be the best that holds, or starts a trial of a doubtful better one.
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

    /// Leaves a rung that does not hold for the best one that does, or else for the fastest.
    fn descend(&mut self, best: Option<usize>) {
        self.better_for = 0;
        let fastest = || {
            let seconds = |rung: &usize| self.costs.predicted(*rung).unwrap_or(f64::MAX);
            let fastest = (0..self.costs.len()).min_by(|a, b| seconds(a).total_cmp(&seconds(b)))?;
            (seconds(&fastest) < NOTABLY * seconds(&self.rung)).then_some(fastest)
        };
        if let Some(rung) = best.or_else(fastest).filter(|&rung| rung != self.rung) {
            self.change(rung);
        }
    }

    fn change(&mut self, rung: usize) {
        self.rung = rung;
        (self.since_change, self.better_for) = (0, 0);
    }

    /// Whether a rung is predicted to take at most this part of the budget.
    fn fits(&self, rung: usize, part: f64) -> bool {
        self.costs.predicted(rung).is_none_or(|seconds| seconds <= self.budget * part)
    }
}
