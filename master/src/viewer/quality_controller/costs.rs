//! What frames cost: the load as it is now, and how much cheaper each rung of the ladder really is.
//!
//! A frame at rung r takes `load * ratio(r)`, and noise. All three are kept as logarithms, so that factors are sums. What a
//! frame took beyond what was expected is put down to load and ratio in proportion to how uncertain each is: a Kalman
//! filter (1960) that neglects what the two have to do with each other. The load may jump: a cumulative sum of surprises
//! (Page, "Continuous Inspection Schemes", 1954) tells that within a few frames, and is not misled by single slow ones.

use std::time::Duration;

/// The variance of a ratio that only a table tells: a factor of 1.35 either way.
const UNTRIED: f64 = 0.3 * 0.3;
/// What coming back to a rung adds to it: the camera looks elsewhere since.
const REVISITED: f64 = 0.1 * 0.1;
/// The variance of the noise that is reckoned with at first, at least and at most.
const FIRST_NOISE: f64 = 0.1 * 0.1;
const LEAST_NOISE: f64 = 0.03 * 0.03;
const MOST_NOISE: f64 = 0.4 * 0.4;
/// How much of the noise's variance the newest frame decides.
const NOISE_GAIN: f64 = 1.0 / 64.0;
/// By how much of the noise's variance the load becomes uncertain from frame to frame: it follows the mean of about fifty.
const LOAD_DRIFT: f64 = 1.0 / 2500.0;
/// A surprise counts for so many standard deviations at most.
const CLIP: f64 = 3.0;
/// Of each surprise, what is no sign of a jump, and how much of the rest together is one: in standard deviations.
const SLACK: f64 = 0.75;
const ALARM: f64 = 5.0;
/// No frame takes less, in seconds: a clock may not have moved.
const SHORTEST: f64 = 1e-6;
/// No rung is taken to cost less or more than these parts of the full one.
const RATIOS: (f64, f64) = (1e-4, 1e2);

/// A value that is not known exactly.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    mean: f64,
    variance: f64,
}

impl Estimate {
    /// Takes its part of a surprise whose variance is `spread`.
    fn learn(&mut self, surprise: f64, spread: f64) {
        let gain = self.variance / spread;
        self.mean += gain * surprise;
        self.variance *= 1.0 - gain;
    }
}

/// What is known of the costs of frames.
#[derive(Clone, Debug)]
pub(super) struct Costs {
    /// Of the logarithm of the full frame's seconds; `None` before the first frame.
    load: Option<Estimate>,
    /// Of the logarithm of a rung's cost as a part of the full one's. The first rung is the full one.
    ratios: Vec<Estimate>,
    noise: f64,
    /// Surprises either way, added up, in standard deviations.
    slower: f64,
    quicker: f64,
    /// What the load would be by each of the last frames alone.
    last_loads: [f64; 3],
    last_rung: usize,
}

impl Costs {
    /// `ratios`: what a table says of each rung, the first being 1.
    pub(super) fn new(ratios: impl IntoIterator<Item = f64>) -> Self {
        let untried = |(rung, ratio): (usize, f64)| Estimate {
            mean: ratio.max(RATIOS.0).min(RATIOS.1).ln(),
            variance: if rung == 0 { 0.0 } else { UNTRIED },
        };
        Self {
            load: None,
            ratios: ratios.into_iter().enumerate().map(untried).collect(),
            noise: FIRST_NOISE,
            slower: 0.0,
            quicker: 0.0,
            last_loads: [0.0; 3],
            last_rung: 0,
        }
    }

    /// The full frame takes about so long, as frames of another ladder tell.
    pub(super) fn expect(&mut self, full: Duration) {
        let mean = full.as_secs_f64().max(SHORTEST).ln();
        self.load = Some(Estimate { mean, variance: self.noise + UNTRIED });
    }

    /// Rungs of the ladder.
    pub(super) fn len(&self) -> usize {
        self.ratios.len()
    }

    /// What a frame at a rung takes, in seconds; `None` before the first frame.
    pub(super) fn predicted(&self, rung: usize) -> Option<f64> {
        Some((self.load?.mean + self.ratios.get(rung)?.mean).exp())
    }

    /// A frame at a rung took so long. Returns whether the load has jumped.
    pub(super) fn observe(&mut self, rung: usize, took: Duration) -> bool {
        let Some(ratio) = self.ratios.get_mut(rung) else { return false };
        let seen = took.as_secs_f64().max(SHORTEST).ln();
        if std::mem::replace(&mut self.last_rung, rung) != rung && rung > 0 {
            ratio.variance = (ratio.variance + REVISITED).min(UNTRIED);
        }
        let Some(load) = &mut self.load else {
            self.load = Some(Estimate { mean: seen - ratio.mean, variance: self.noise + ratio.variance });
            return false;
        };
        load.variance += self.noise * LOAD_DRIFT;
        let known = load.variance + ratio.variance;
        let spread = known + self.noise;
        let deviation = spread.sqrt();
        let surprise = (seen - load.mean - ratio.mean).clamp(-CLIP * deviation, CLIP * deviation);
        self.last_loads = [self.last_loads[1], self.last_loads[2], seen - ratio.mean];
        self.slower = (self.slower + surprise / deviation - SLACK).max(0.0);
        self.quicker = (self.quicker - surprise / deviation - SLACK).max(0.0);
        if self.slower > ALARM || self.quicker > ALARM {
            (self.slower, self.quicker) = (0.0, 0.0);
            // Two of three frames at least are of the new load.
            *load = Estimate { mean: median(self.last_loads), variance: self.noise };
            return true;
        }
        load.learn(surprise, spread);
        ratio.learn(surprise, spread);
        let noise = self.noise + NOISE_GAIN * (surprise * surprise - known - self.noise);
        self.noise = noise.clamp(LEAST_NOISE, MOST_NOISE);
        false
    }
}

fn median([a, b, c]: [f64; 3]) -> f64 {
    a.max(b).min(a.min(b).max(c))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(costs: &Costs, rung: usize) -> f64 {
        costs.predicted(rung).unwrap()
    }

    fn see(costs: &mut Costs, rung: usize, seconds: f64, frames: usize) {
        for _ in 0..frames {
            costs.observe(rung, Duration::from_secs_f64(seconds));
        }
    }

    #[test]
    fn one_frame_tells_what_all_rungs_take() {
        let mut costs = Costs::new([1.0, 0.5, 0.25]);
        assert_eq!(costs.predicted(0), None);
        see(&mut costs, 1, 0.1, 1);
        assert!((seconds(&costs, 0) - 0.2).abs() < 1e-9 && (seconds(&costs, 2) - 0.05).abs() < 1e-9);
        assert_eq!(costs.predicted(3), None);
    }

    #[test]
    fn a_single_slow_frame_changes_little() {
        let mut costs = Costs::new([1.0, 0.5]);
        see(&mut costs, 0, 0.1, 50);
        see(&mut costs, 0, 5.0, 1);
        assert!((seconds(&costs, 0) / 0.1).ln().abs() < 0.05, "{}", seconds(&costs, 0));
    }

    #[test]
    fn a_jump_of_the_load_is_known_after_three_frames() {
        for factor in [5.0, 2.0, 0.5, 0.2] {
            let mut costs = Costs::new([1.0, 0.5]);
            see(&mut costs, 0, 0.1, 50);
            see(&mut costs, 0, 0.1 * factor, 3);
            assert!((seconds(&costs, 0) / (0.1 * factor)).ln().abs() < 0.02, "{factor}");
        }
    }

    #[test]
    fn what_a_new_rung_takes_is_put_down_to_the_rung() {
        let mut costs = Costs::new([1.0, 0.5, 0.25]);
        see(&mut costs, 0, 0.1, 50);
        see(&mut costs, 1, 0.09, 10);
        assert!((seconds(&costs, 1) - 0.09).abs() < 0.003);
        assert!((seconds(&costs, 0) - 0.1).abs() < 0.005 && (seconds(&costs, 2) - 0.025).abs() < 0.002);
    }

    #[test]
    fn what_becomes_of_the_load_is_not_put_down_to_a_rung_that_is_known() {
        let mut costs = Costs::new([1.0, 0.5, 0.25]);
        see(&mut costs, 0, 0.1, 50);
        see(&mut costs, 1, 0.05, 50);
        see(&mut costs, 1, 0.15, 20);
        assert!((seconds(&costs, 0) - 0.3).abs() < 0.02 && (seconds(&costs, 2) - 0.075).abs() < 0.005);
    }
}
