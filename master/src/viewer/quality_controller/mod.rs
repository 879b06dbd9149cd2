//! The quality controller: trades quality for speed while the picture moves, and restores full quality at rest.
//!
//! The [`governor`] decides on numbers only: it receives the times of frames and chooses a rung of the [`ladder`] of
//! settings. The ladder depends on the bottleneck of frames, threads or wire, which [`balance`] estimates from their
//! accounts. [`stillness`] detects whether the picture moves. None of them knows a clock or a picture; times are since any
//! fixed moment, and grow.
//!
//! The request for a picture at rest is the same as without a quality controller, so its pixels are the same, bit for bit.

mod balance;
mod costs;
mod governor;
mod ladder;
mod prior;
mod small_scales;
mod stillness;
mod wire;

#[cfg(test)]
mod farm_simulation;
#[cfg(test)]
mod simulation;
#[cfg(test)]
mod tests;

use std::time::Duration;

use balance::Balance;
use governor::Governor;
use ladder::Loss;
pub(crate) use ladder::{Ladder, Origin, Rung};
pub(crate) use prior::ladder as prior_ladder;
use rayfarm_farm::ViewRequest;
use rayfarm_farm::accounting::FrameAccount;
pub(crate) use small_scales::continued;
pub(crate) use stillness::{Motion, Stillness};
pub(crate) use wire::bytes;

/// Quality at which a frame is requested.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum QualityMode {
    /// Full quality: nothing moves.
    Resting,
    /// A rung of the ladder.
    Moving(Step),
}

/// A rung of one of the ladders of a quality controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Step {
    rung: usize,
    /// Number of the ladder, from 0.
    ladder: u32,
}

impl QualityMode {
    /// Whether such a frame in flight is dropped for one of `next`: it is the full picture of a camera that has moved on, and
    /// the other one is complete sooner.
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

/// Controller of the knobs of one view.
#[derive(Clone, Debug)]
pub(crate) struct QualityController {
    ladder: Ladder,
    governor: Governor,
    balance: Balance,
    /// Number of the current ladder, from 0.
    ladders: u32,
    stillness: Stillness,
    target_fps: f64,
    last_finished: Duration,
    /// Mode of the previous frame.
    last_mode: Option<QualityMode>,
    /// Whether the log has the warning that the rate is out of reach.
    has_warned: bool,
}

impl QualityController {
    /// A controller that holds a rate as well as the ladder allows. `animated`: something moves without input.
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
            last_mode: None,
            has_warned: false,
        }
    }

    /// Records a change of the view.
    pub(crate) fn changed(&mut self, now: Duration) {
        self.stillness.changed(now);
    }

    /// Time at which the picture comes to rest, if nothing changes any more.
    pub(crate) fn rests_at(&self) -> Option<Duration> {
        self.stillness.rests_at()
    }

    /// Mode of the next frame.
    pub(crate) fn next(&mut self, now: Duration) -> QualityMode {
        match self.stillness.motion(now) {
            Motion::Resting => QualityMode::Resting,
            Motion::Moving => QualityMode::Moving(Step { rung: self.governor.rung(), ladder: self.ladders }),
        }
    }

    /// Request for a frame of this mode.
    pub(crate) fn apply(&self, wanted: &ViewRequest, mode: QualityMode) -> ViewRequest {
        self.rung(mode).map_or(*wanted, |rung| wanted.at_most(&rung.setting))
    }

    /// Rung of a frame of this mode; `None` if the ladder has changed since the request.
    fn rung(&self, mode: QualityMode) -> Option<&Rung> {
        let is_of_this = |mode| match mode {
            QualityMode::Resting => true,
            QualityMode::Moving(step) => step.rung == 0 || step.ladder == self.ladders,
        };
        self.ladder.rungs().get(mode.rung()).filter(|_| is_of_this(mode))
    }

    /// Records a finished frame, requested at `requested_at`, that took `elapsed` from its beginning. Frames overlap, so at most
    /// the time since the previous frame counts.
    pub(crate) fn finished(
        &mut self,
        now: Duration,
        elapsed: Duration,
        mode: QualityMode,
        requested_at: Duration,
        account: &FrameAccount,
    ) {
        let took = elapsed.min(now.saturating_sub(self.last_finished));
        self.last_finished = now;
        let is_mixed = self.last_mode.replace(mode).is_some_and(|before| before != mode);
        if let Some(rung) = self.rung(mode).copied() {
            let before = self.governor.rung();
            self.governor.observe(mode.rung(), took);
            if !is_mixed {
                self.balance.observe(rung.cost, rung.wire, account);
            }
            match self.balance.take_change() {
                Some(ratio) => self.change_ladder(ratio, &rung, took),
                None => self.log(before, mode),
            }
        }
        self.stillness.shown(requested_at);
    }

    /// Records a finished pass of a picture at rest, requested at `requested_at`, that took `per_sample` for each of its samples: about the
    /// time of a moving picture of full quality, which has one sample. Its pixels are sums, whose bytes say nothing about those of moving
    /// pictures.
    pub(crate) fn finished_pass(&mut self, now: Duration, per_sample: Duration, requested_at: Duration) {
        self.governor.observe(0, per_sample.min(now.saturating_sub(self.last_finished)));
        self.last_finished = now;
        self.last_mode = Some(QualityMode::Resting);
        self.stillness.shown(requested_at);
    }

    /// Replaces the ladder after a change of the bottleneck, because other knobs help now. `took` is the time of the last
    /// frame, at `rung`.
    fn change_ladder(&mut self, ratio: f64, rung: &Rung, took: Duration) {
        self.ladder = self.ladder.balanced(ratio);
        self.ladders = self.ladders.wrapping_add(1);
        let full = took.as_secs_f64() / rung.time(ratio);
        let full = Duration::try_from_secs_f64(full).unwrap_or(Duration::MAX);
        let times: Vec<f64> = self.ladder.rungs().iter().map(|rung| rung.time(ratio)).collect();
        self.governor = Governor::starting(times, budget(self.target_fps), full);
        let rungs = self.ladder.rungs().len();
        tracing::debug!(
            "the wire takes {ratio:.2} times as long as the threads for full pictures: the ladder has {rungs} rungs now"
        );
    }

    fn log(&mut self, before: usize, mode: QualityMode) {
        let rung = self.governor.rung();
        if rung != before {
            let (setting, cost) = (self.ladder.rungs().get(rung), self.governor.predicted(rung));
            tracing::debug!("quality: from rung {before} to {rung}, {cost:.1?} a frame: {setting:?}");
        }
        let is_reached = matches!(mode, QualityMode::Moving(_)) && mode.rung() == rung;
        if self.governor.is_beaten() && is_reached && !self.has_warned {
            self.has_warned = true;
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

    /// Lines of the overlay about a frame.
    pub(crate) fn lines(&self, mode: QualityMode) -> Vec<String> {
        let mut lines = match (mode, self.rung(mode)) {
            (QualityMode::Resting, _) => return vec!["at rest: full quality".to_owned()],
            (QualityMode::Moving(Step { rung: 0, .. }), _) => {
                vec!["moving: full quality".to_owned()]
            }
            (QualityMode::Moving(_), None) => vec!["moving: other knobs now".to_owned()],
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

/// Time budget of a frame at a rate.
fn budget(target_fps: f64) -> Duration {
    Duration::try_from_secs_f64(1.0 / target_fps).unwrap_or(Duration::MAX)
}
