//! The dial: quality for speed while the picture moves, and full quality when it rests.
//!
//! The [`governor`] decides on numbers only: it is told what frames took, and answers with a rung of the [`ladder`] of
//! settings. [`stillness`] tells whether the picture moves. None of them knows a clock or a picture; times are since any
//! fixed moment, and grow.
//!
//! A picture at rest is asked for exactly as it would be without a dial, so it is the same, bit for bit.

mod costs;
mod governor;
mod ladder;
mod measured;
mod prior;
mod setting;
mod stillness;

#[cfg(test)]
mod simulation;
#[cfg(test)]
mod tests;

use std::time::Duration;

use governor::Governor;
pub(crate) use ladder::Ladder;
use ladder::Loss;
pub(crate) use measured::ladder as measured_ladder;
pub(crate) use prior::ladder as prior_ladder;
use stillness::{Motion, Stillness};

use crate::wanted::WantedPicture;

/// How a frame was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shown {
    /// At full quality: nothing moves.
    Resting,
    /// At a rung of the ladder.
    Moving(usize),
}

impl Shown {
    /// Whether such a frame, when it is on the way, is given up for one like `next`: it is the full picture of a camera that
    /// has moved on, and the other one is sooner there.
    pub(crate) fn gives_way_to(self, next: Self) -> bool {
        self == Self::Resting && next.rung() > 0
    }

    fn rung(self) -> usize {
        match self {
            Self::Resting => 0,
            Self::Moving(rung) => rung,
        }
    }
}

/// Turns the knobs for one window.
#[derive(Clone, Debug)]
pub(crate) struct Dial {
    ladder: Ladder,
    governor: Governor,
    stillness: Stillness,
    target_fps: f64,
    last_finished: Duration,
    has_told: bool,
}

impl Dial {
    /// Holds a rate as well as the ladder allows. `animated`: something moves without anybody's doing.
    pub(crate) fn new(ladder: Ladder, target_fps: f64, animated: bool) -> Self {
        let budget = Duration::try_from_secs_f64(1.0 / target_fps).unwrap_or(Duration::MAX);
        let governor = Governor::new(ladder.rungs().iter().map(|rung| rung.cost), budget);
        let stillness = Stillness::new(animated);
        Self { ladder, governor, stillness, target_fps, last_finished: Duration::ZERO, has_told: false }
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
    pub(crate) fn next(&mut self, now: Duration) -> Shown {
        match self.stillness.motion(now) {
            Motion::Resting => Shown::Resting,
            Motion::Moving => Shown::Moving(self.governor.rung()),
        }
    }

    /// The picture for a frame that is asked for like this.
    pub(crate) fn picture(&self, wanted: &WantedPicture, shown: Shown) -> WantedPicture {
        match shown {
            Shown::Resting => *wanted,
            Shown::Moving(rung) => {
                self.ladder.rungs().get(rung).map_or(*wanted, |rung| rung.setting.applied(wanted))
            }
        }
    }

    /// A frame has come that was asked for like this, `asked_at`, and took `elapsed` from its beginning. Frames overlap: what
    /// counts is the time since the one before.
    pub(crate) fn finished(&mut self, now: Duration, elapsed: Duration, shown: Shown, asked_at: Duration) {
        let took = elapsed.min(now.saturating_sub(self.last_finished));
        self.last_finished = now;
        let before = self.governor.rung();
        self.governor.observe(shown.rung(), took);
        self.stillness.shown(asked_at);
        self.log(before, shown);
    }

    fn log(&mut self, before: usize, shown: Shown) {
        let rung = self.governor.rung();
        if rung != before {
            let (setting, cost) = (self.ladder.rungs().get(rung), self.governor.predicted(rung));
            tracing::debug!("the dial goes from rung {before} to {rung}, {cost:.1?} a frame: {setting:?}");
        }
        if self.governor.is_beaten() && shown == Shown::Moving(rung) && !self.has_told {
            self.has_told = true;
            let cost = self.governor.predicted(rung).unwrap_or_default();
            tracing::warn!(
                "{} frames a second are out of reach while the picture moves: even the cheapest setting takes {:.1} ms; \
                 more workers or a smaller window would help",
                self.target_fps,
                cost.as_secs_f64() * 1e3,
            );
        }
    }

    /// What the overlay says of a frame.
    pub(crate) fn told(&self, shown: Shown) -> Vec<String> {
        let first = match shown {
            Shown::Resting => "at rest: all that was asked for".to_owned(),
            Shown::Moving(0) => "moving: all that was asked for".to_owned(),
            Shown::Moving(rung) => {
                let loss = self.ladder.rungs().get(rung).map_or(0.0, |rung| rung.loss);
                format!("moving: loses {}", Loss(loss))
            }
        };
        let beaten = self.governor.is_beaten() && shown != Shown::Resting;
        let beaten = beaten.then(|| format!("{} FPS: out of reach", self.target_fps));
        std::iter::once(first).chain(beaten).collect()
    }
}
