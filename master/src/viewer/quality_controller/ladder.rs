//! The ladder: settings in the order of their loss, each cheaper than all earlier ones.

use std::fmt;

use rayfarm_tracer::scene::Setting;

/// A setting with its cost and its loss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rung {
    /// Upper limits of the request's knobs.
    pub(crate) setting: Setting,
    /// Work of a frame, as a part of the full one's.
    pub(crate) cost: f64,
    /// Bytes of its pixels, as a part of the full one's.
    pub(crate) wire: f64,
    /// Mean FLIP error, 0..=1.
    pub(crate) loss: f64,
}

impl Rung {
    const FULL: Self = Self { setting: Setting::FULL, cost: 1.0, wire: 1.0, loss: 0.0 };

    /// Time of a frame as a part of the full one's: the longer of threads and wire, where the wire takes `balance` times the
    /// time of the threads for the full frame.
    pub(crate) fn time(&self, balance: f64) -> f64 {
        self.cost.max(balance * self.wire) / balance.max(1.0)
    }
}

/// Source of costs and losses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Origin {
    /// A table measured on the scene.
    Measured,
    /// Medians over other scenes.
    General,
}

/// Largest factor of time between neighbouring rungs: a step that changes the rate by less than its noise is useless.
const LEAST_STEP: f64 = 0.93;
/// Largest number of rungs: as many steps lead to a ten-thousandth of the time.
const MAX_RUNGS: usize = 128;

/// Pareto front of settings, the full one first.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Ladder {
    /// All known rungs, in the order of their losses.
    known: Vec<Rung>,
    rungs: Vec<Rung>,
    origin: Origin,
}

impl Ladder {
    /// Front of measured rungs, where threads are the limit. Rungs with figures that are not finite, or not positive costs, are
    /// left out.
    pub(crate) fn of(measured: impl IntoIterator<Item = Rung>, origin: Origin) -> Self {
        let is_positive = |value: f64| value > 0.0 && value.is_finite();
        let is_sound =
            |rung: &Rung| is_positive(rung.cost) && is_positive(rung.wire) && rung.loss.is_finite();
        let mut known: Vec<Rung> = measured.into_iter().filter(is_sound).collect();
        known.sort_by(|a, b| a.loss.total_cmp(&b.loss).then(a.cost.total_cmp(&b.cost)));
        let rungs = front(&known, 0.0);
        Self { known, rungs, origin }
    }

    /// Front where the wire takes `balance` times the time of the threads for the full picture. Knobs that do not relieve the
    /// bottleneck are not on it.
    pub(crate) fn balanced(&self, balance: f64) -> Self {
        Self { rungs: front(&self.known, balance), ..self.clone() }
    }

    /// The ladder without the rungs that lose more than `most`.
    #[must_use]
    pub(crate) fn up_to(mut self, most: f64) -> Self {
        for rungs in [&mut self.known, &mut self.rungs] {
            rungs.retain(|rung| rung.loss <= most || rung.setting == Setting::FULL);
        }
        self
    }

    /// All rungs; the first one has full quality.
    pub(crate) fn rungs(&self) -> &[Rung] {
        &self.rungs
    }

    /// Source of the figures.
    pub(crate) fn origin(&self) -> Origin {
        self.origin
    }

    /// The fastest setting.
    pub(crate) fn cheapest(&self) -> Setting {
        self.rungs.last().map_or(Setting::FULL, |rung| rung.setting)
    }
}

/// The full rung, and those rungs, in the order of their losses, that are notably faster than all earlier ones.
fn front(known: &[Rung], balance: f64) -> Vec<Rung> {
    let mut front = vec![Rung::FULL];
    let mut fastest = 1.0;
    for rung in known {
        let time = rung.time(balance);
        if time <= fastest * LEAST_STEP && front.len() < MAX_RUNGS {
            fastest = time;
            front.push(*rung);
        }
    }
    front
}

/// Text of a loss, which is an estimate.
pub(crate) struct Loss(pub(crate) f64);

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "about FLIP {:.3}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn rung(cost: f64, loss: f64) -> Rung {
        Rung { setting: Setting { samples: 1, ..Setting::FULL }, cost, wire: 1.0, loss }
    }

    fn of(rungs: impl IntoIterator<Item = Rung>) -> Ladder {
        Ladder::of(rungs, Origin::General)
    }

    fn figures(ladder: &Ladder) -> Vec<(f64, f64)> {
        ladder.rungs().iter().map(|rung| (rung.cost, rung.loss)).collect()
    }

    #[test]
    fn dominated_rungs_are_left_out() {
        let ladder = of([rung(0.3, 0.1), rung(0.5, 0.02), rung(0.6, 0.05), rung(0.2, 0.1)]);
        assert_eq!(figures(&ladder), [(1.0, 0.0), (0.5, 0.02), (0.2, 0.1)]);
        assert_eq!(figures(&ladder.clone().up_to(0.05)), [(1.0, 0.0), (0.5, 0.02)]);
        assert_eq!(figures(&ladder.up_to(0.0)), [(1.0, 0.0)]);
    }

    #[test]
    fn without_any_measurement_the_ladder_has_the_full_rung() {
        let ladder = of([rung(f64::NAN, 0.1), rung(0.5, f64::INFINITY), rung(0.0, 0.1), rung(-1.0, 0.1)]);
        assert_eq!(figures(&ladder), [(1.0, 0.0)]);
        assert_eq!(ladder.cheapest(), Setting::FULL);
    }

    #[test]
    fn where_the_wire_is_the_limit_only_settings_with_fewer_bytes_are_rungs() {
        let dark = Rung { wire: 1.0, ..rung(0.5, 0.01) };
        let coarse = Rung { wire: 0.25, ..rung(0.4, 0.02) };
        let pale = Rung { wire: 0.6, ..rung(1.0, 0.015) };
        let ladder = of([dark, coarse, pale]);
        assert_eq!(figures(&ladder), [(1.0, 0.0), (0.5, 0.01), (0.4, 0.02)]);
        assert_eq!(figures(&ladder.balanced(4.0)), [(1.0, 0.0), (1.0, 0.015), (0.4, 0.02)]);
        assert_eq!(ladder.balanced(4.0).balanced(0.0), ladder);
        // At twice the time of the threads, fewer bytes help until the threads are the limit.
        assert!((pale.time(2.0) - 0.6).abs() < 1e-12 && (coarse.time(1.25) - 0.32).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn losses_rise_and_costs_fall(measured in prop::collection::vec((0.0..2.0_f64, 0.0..1.0_f64), 0..60)) {
            let ladder = of(measured.into_iter().map(|(cost, loss)| rung(cost, loss)));
            for pair in ladder.rungs().windows(2) {
                prop_assert!(pair[0].cost > pair[1].cost && pair[0].loss <= pair[1].loss);
            }
        }
    }
}
