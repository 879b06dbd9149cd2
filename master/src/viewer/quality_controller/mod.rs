//! The quality controller: quality for speed while the picture moves, and full quality when it rests.
//!
//! The [`governor`] decides on numbers only: it is told what frames took, and answers with a rung of the [`ladder`] of
//! settings. Which settings are on the ladder depends on what frames wait for, threads or wire: [`balance`] estimates it
//! from their accounts. [`stillness`] tells whether the picture moves. None of them knows a clock or a picture; times are since any
//! fixed moment, and grow.
//!
//! A picture at rest is asked for exactly as it would be without a quality controller, so it is the same, bit for bit.

mod balance;
mod costs;
mod governor;
mod ladder;
mod measured;
mod prior;
mod setting;
mod small_scales;
mod stillness;

#[cfg(test)]
mod farm_simulation;
#[cfg(test)]
mod simulation;
#[cfg(test)]
mod tests;

use std::time::Duration;

use balance::Balance;
use governor::Governor;
pub(crate) use ladder::{Ladder, Origin};
use ladder::{Loss, Rung};
pub(crate) use measured::ladder as measured_ladder;
pub(crate) use prior::ladder as prior_ladder;
use stillness::{Motion, Stillness};

use crate::accounting::FrameAccount;
use crate::viewer::view_request::ViewRequest;

/// How a frame was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum QualityMode {
    /// At full quality: nothing moves.
    Resting,
    /// At a rung of the ladder.
    Moving(Step),
}

/// A rung of one of the ladders that a quality controller has had.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Step {
    rung: usize,
    /// How many ladders there were before.
    ladder: u32,
}

impl QualityMode {
    /// Whether such a frame, when it is on the way, is given up for one like `next`: it is the full picture of a camera that
    /// has moved on, and the other one is sooner there.
    pub(crate) fn gives_way_to(self, next: Self) -> bool {
        self == Self::Resting && next.rung() > 0
    }

    fn rung(self) -> usize {
        match self {
            Self::Resting => 0,
            Self::Moving(step) => step.rung,
        }
    }
}

/// Turns the knobs for one window.
#[derive(Clone, Debug)]
pub(crate) struct QualityController {
    ladder: Ladder,
    governor: Governor,
    balance: Balance,
    /// How many ladders there were before this one.
    ladders: u32,
    stillness: Stillness,
    target_fps: f64,
    last_finished: Duration,
    /// How the frame before was asked for.
    last_shown: Option<QualityMode>,
    has_told: bool,
}

impl QualityController {
    /// Holds a rate as well as the ladder allows. `animated`: something moves without anybody's doing.
    pub(crate) fn new(ladder: Ladder, target_fps: f64, animated: bool) -> Self {
        let governor = Governor::new(ladder.rungs().iter().map(|rung| rung.cost), budget(target_fps));
        Self {
            ladder,
            governor,
            balance: Balance::new(),
            ladders: 0,
            stillness: Stillness::new(animated),
            target_fps,
            last_finished: Duration::ZERO,
            last_shown: None,
            has_told: false,
        }
    }

    /// What is wanted has changed.
    pub(crate) fn changed(&mut self, now: Duration) {
        self.stillness.changed(now);
    }

    /// When the picture comes to rest, if nothing changes any more.
    pub(crate) fn rests_at(&self) -> Option<Duration> {
        self.stillness.rests_at()
    }

    /// How to ask for the next frame.
    pub(crate) fn next(&mut self, now: Duration) -> QualityMode {
        match self.stillness.motion(now) {
            Motion::Resting => QualityMode::Resting,
            Motion::Moving => QualityMode::Moving(Step { rung: self.governor.rung(), ladder: self.ladders }),
        }
    }

    /// The picture for a frame that is asked for like this.
    pub(crate) fn apply(&self, wanted: &ViewRequest, mode: QualityMode) -> ViewRequest {
        self.rung(mode).map_or(*wanted, |rung| rung.setting.applied(wanted))
    }

    /// What is known of a frame that was asked for like this; `None` where the ladder has been another one since then.
    fn rung(&self, mode: QualityMode) -> Option<&Rung> {
        let is_of_this = |mode| match mode {
            QualityMode::Resting => true,
            QualityMode::Moving(step) => step.rung == 0 || step.ladder == self.ladders,
        };
        self.ladder.rungs().get(mode.rung()).filter(|_| is_of_this(mode))
    }

    /// A frame has come that was asked for like this, `asked_at`, and took `elapsed` from its beginning. Frames overlap: what
    /// counts is the time since the one before.
    pub(crate) fn finished(
        &mut self,
        now: Duration,
        elapsed: Duration,
        mode: QualityMode,
        asked_at: Duration,
        account: &FrameAccount,
    ) {
        let took = elapsed.min(now.saturating_sub(self.last_finished));
        self.last_finished = now;
        let is_mixed = self.last_shown.replace(mode).is_some_and(|before| before != mode);
        if let Some(rung) = self.rung(mode).copied() {
            let before = self.governor.rung();
            self.governor.observe(mode.rung(), took);
            if !is_mixed {
                self.balance.observe(rung.cost, rung.wire, account);
            }
            match self.balance.news() {
                Some(ratio) => self.change_ladder(ratio, &rung, took),
                None => self.log(before, mode),
            }
        }
        self.stillness.shown(asked_at);
    }

    /// Frames wait for something else, or for longer: other knobs help. The last frame, at `rung`, took so long.
    fn change_ladder(&mut self, ratio: f64, rung: &Rung, took: Duration) {
        self.ladder = self.ladder.balanced(ratio);
        self.ladders = self.ladders.wrapping_add(1);
        let full = took.as_secs_f64() / rung.time(ratio);
        let full = Duration::try_from_secs_f64(full).unwrap_or(Duration::MAX);
        let times: Vec<f64> = self.ladder.rungs().iter().map(|rung| rung.time(ratio)).collect();
        self.governor = Governor::starting(times, budget(self.target_fps), full);
        let rungs = self.ladder.rungs().len();
        tracing::debug!(
            "the wire takes {ratio:.2} times as long as the threads for full pictures: the quality controller has {rungs} rungs now"
        );
    }

    fn log(&mut self, before: usize, mode: QualityMode) {
        let rung = self.governor.rung();
        if rung != before {
            let (setting, cost) = (self.ladder.rungs().get(rung), self.governor.predicted(rung));
            tracing::debug!(
                "the quality controller goes from rung {before} to {rung}, {cost:.1?} a frame: {setting:?}"
            );
        }
        let is_there = matches!(mode, QualityMode::Moving(_)) && mode.rung() == rung;
        if self.governor.is_beaten() && is_there && !self.has_told {
            self.has_told = true;
            let cost = self.governor.predicted(rung).unwrap_or_default();
            let limit = self.balance.limit();
            tracing::warn!(
                "{} frames a second are out of reach while the picture moves: even the cheapest setting takes {:.1} ms, \
                 and waits for {}; {}",
                self.target_fps,
                cost.as_secs_f64() * 1e3,
                limit.words(),
                limit.remedy(),
            );
        }
    }

    /// What the overlay says of a frame.
    pub(crate) fn lines(&self, mode: QualityMode) -> Vec<String> {
        let mut lines = match (mode, self.rung(mode)) {
            (QualityMode::Resting, _) => return vec!["at rest: all that was asked for".to_owned()],
            (QualityMode::Moving(Step { rung: 0, .. }), _) => {
                vec!["moving: all that was asked for".to_owned()]
            }
            (QualityMode::Moving(_), None) => vec!["moving: turns other knobs".to_owned()],
            (QualityMode::Moving(_), Some(rung)) => {
                let origin = match self.ladder.origin() {
                    Origin::Measured => "by the scene's table",
                    Origin::General => "by the general table",
                };
                vec![format!("moving: loses {}", Loss(rung.loss)), origin.to_owned()]
            }
        };
        if self.governor.is_beaten() {
            lines.push(format!("{} FPS: out of reach", self.target_fps));
        }
        if lines.len() > 1 {
            lines.push(format!("waits for {}", self.balance.limit().words()));
        }
        lines
    }
}

/// The time that a frame has at a rate.
fn budget(target_fps: f64) -> Duration {
    Duration::try_from_secs_f64(1.0 / target_fps).unwrap_or(Duration::MAX)
}
