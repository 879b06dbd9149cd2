//! The ladder: settings in the order of what they lose, each cheaper than all before it.

use std::fmt;

use super::setting::Setting;

/// A setting with what is known of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rung {
    /// What it does to a picture.
    pub(crate) setting: Setting,
    /// The time of a frame, as a part of the full one's.
    pub(crate) cost: f64,
    /// The mean FLIP error, 0..=1.
    pub(crate) loss: f64,
}

/// Rungs that are nearer to each other in cost than this factor are one: a step that changes the rate by less than its
/// noise is no use.
const LEAST_STEP: f64 = 0.93;
/// Rungs at most: so many steps go down to a ten-thousandth of the time.
const MAX_RUNGS: usize = 128;

/// The Pareto front of settings, the full one first.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Ladder(Vec<Rung>);

impl Ladder {
    /// The front of what is measured. What is not finite, or cheaper than nothing, was not measured.
    pub(crate) fn of(measured: impl IntoIterator<Item = Rung>) -> Self {
        let full = Rung { setting: Setting::FULL, cost: 1.0, loss: 0.0 };
        let is_sound = |rung: &Rung| rung.cost > 0.0 && rung.cost.is_finite() && rung.loss.is_finite();
        let mut rungs: Vec<Rung> = measured.into_iter().filter(is_sound).collect();
        rungs.sort_by(|a, b| a.loss.total_cmp(&b.loss).then(a.cost.total_cmp(&b.cost)));
        let mut front = vec![full];
        let mut cheapest = full.cost;
        for rung in rungs {
            if rung.cost <= cheapest * LEAST_STEP && front.len() < MAX_RUNGS {
                cheapest = rung.cost;
                front.push(rung);
            }
        }
        Self(front)
    }

    /// Without the rungs that lose more than `most`.
    #[must_use]
    pub(crate) fn up_to(mut self, most: f64) -> Self {
        self.0.retain(|rung| rung.loss <= most || rung.setting == Setting::FULL);
        self
    }

    /// All rungs; the first is the full one.
    pub(crate) fn rungs(&self) -> &[Rung] {
        &self.0
    }

    /// The fastest one.
    pub(crate) fn cheapest(&self) -> Setting {
        self.0.last().map_or(Setting::FULL, |rung| rung.setting)
    }
}

/// How a loss is told.
pub(crate) struct Loss(pub(crate) f64);

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "FLIP {:.3}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn rung(cost: f64, loss: f64) -> Rung {
        Rung { setting: Setting { samples: 1, ..Setting::FULL }, cost, loss }
    }

    fn figures(ladder: &Ladder) -> Vec<(f64, f64)> {
        ladder.rungs().iter().map(|rung| (rung.cost, rung.loss)).collect()
    }

    #[test]
    fn what_another_beats_in_both_is_left_out() {
        let ladder = Ladder::of([rung(0.3, 0.1), rung(0.5, 0.02), rung(0.6, 0.05), rung(0.2, 0.1)]);
        assert_eq!(figures(&ladder), [(1.0, 0.0), (0.5, 0.02), (0.2, 0.1)]);
        assert_eq!(figures(&ladder.clone().up_to(0.05)), [(1.0, 0.0), (0.5, 0.02)]);
        assert_eq!(figures(&ladder.up_to(0.0)), [(1.0, 0.0)]);
    }

    #[test]
    fn without_any_measurement_there_is_the_full_one() {
        let ladder =
            Ladder::of([rung(f64::NAN, 0.1), rung(0.5, f64::INFINITY), rung(0.0, 0.1), rung(-1.0, 0.1)]);
        assert_eq!(figures(&ladder), [(1.0, 0.0)]);
        assert_eq!(ladder.cheapest(), Setting::FULL);
    }

    proptest! {
        #[test]
        fn losses_rise_and_costs_fall(measured in prop::collection::vec((0.0..2.0_f64, 0.0..1.0_f64), 0..60)) {
            let ladder = Ladder::of(measured.into_iter().map(|(cost, loss)| rung(cost, loss)));
            for pair in ladder.rungs().windows(2) {
                prop_assert!(pair[0].cost > pair[1].cost && pair[0].loss <= pair[1].loss);
            }
        }
    }
}
