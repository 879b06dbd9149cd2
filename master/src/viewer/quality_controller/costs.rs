//! Costs of frames: the current load, and the measured cost of each rung of the ladder.
//!
//! A frame at rung r takes `load * ratio(r)`, times noise. All three are kept as logarithms, so that factors are sums. The
//! difference between measured and predicted time, the innovation, is attributed to load and ratio in proportion to their
//! variances: a Kalman filter (1960) that neglects their covariance. The load may jump: a cumulative sum of innovations
//! (Page, "Continuous Inspection Schemes", 1954) detects that within a few frames, and ignores single slow ones.

use std::time::Duration;

/// Variance of a ratio from a table: a factor of 1.35 either way.
const UNTRIED: f64 = 0.3 * 0.3;
/// Variance added on return to a rung: the view has changed since.
const REVISITED: f64 = 0.1 * 0.1;
/// Variance of the noise: initial, smallest and largest.
const FIRST_NOISE: f64 = 0.1 * 0.1;
const LEAST_NOISE: f64 = 0.03 * 0.03;
const MOST_NOISE: f64 = 0.4 * 0.4;
/// Weight of the newest frame in the variance of the noise.
const NOISE_GAIN: f64 = 1.0 / 64.0;
/// Variance that the load gains per frame, as a part of the noise's: the load follows the mean of about fifty frames.
const LOAD_DRIFT: f64 = 1.0 / 2500.0;
/// Largest innovation, in standard deviations.
const CLIP: f64 = 3.0;
/// Slack of the cumulative sum per frame, and its threshold for a jump, in standard deviations.
const SLACK: f64 = 0.75;
const ALARM: f64 = 5.0;
/// Shortest frame, in seconds: a clock may not have moved.
const SHORTEST: f64 = 1e-6;
/// Smallest and largest cost of a rung, as parts of the full one's.
const RATIOS: (f64, f64) = (1e-4, 1e2);

/// A normally distributed value.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    mean: f64,
    variance: f64,
}

impl Estimate {
    /// Takes its part of an innovation whose variance is `spread`.
    fn update(&mut self, innovation: f64, spread: f64) {
        let gain = self.variance / spread;
        self.mean += gain * innovation;
        self.variance *= 1.0 - gain;
    }
}

/// Estimates of the costs of frames.
#[derive(Clone, Debug)]
pub(super) struct Costs {
    /// Logarithm of the full frame's seconds; `None` before the first frame.
    load: Option<Estimate>,
    /// Logarithm of each rung's cost as a part of the full one's. The first rung is the full one.
    ratios: Vec<Estimate>,
    noise: f64,
    /// Cumulative sums of innovations in either direction, in standard deviations.
    slower: f64,
    faster: f64,
    /// Load according to each of the last frames alone.
    last_loads: [f64; 3],
    last_rung: usize,
}

impl Costs {
    /// Costs before the first frame. `ratios`: costs of the rungs by a table, the first being 1.
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
            faster: 0.0,
            last_loads: [0.0; 3],
            last_rung: 0,
        }
    }

    /// Sets the expected time of the full frame, known from frames of another ladder.
    pub(super) fn expect(&mut self, full: Duration) {
        let mean = full.as_secs_f64().max(SHORTEST).ln();
        self.load = Some(Estimate { mean, variance: self.noise + UNTRIED });
    }

    /// Number of rungs.
    pub(super) fn len(&self) -> usize {
        self.ratios.len()
    }

    /// Predicted time of a frame at a rung, in seconds; `None` before the first frame.
    pub(super) fn predicted(&self, rung: usize) -> Option<f64> {
        Some((self.load?.mean + self.ratios.get(rung)?.mean).exp())
    }

    /// Adds the time of a frame at a rung. Returns whether the load has jumped.
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
        let innovation = (seen - load.mean - ratio.mean).clamp(-CLIP * deviation, CLIP * deviation);
        self.last_loads = [self.last_loads[1], self.last_loads[2], seen - ratio.mean];
        self.slower = (self.slower + innovation / deviation - SLACK).max(0.0);
        self.faster = (self.faster - innovation / deviation - SLACK).max(0.0);
        if self.slower > ALARM || self.faster > ALARM {
            (self.slower, self.faster) = (0.0, 0.0);
            // At least two of the three frames are of the new load.
            *load = Estimate { mean: median(self.last_loads), variance: self.noise };
            return true;
        }
        load.update(innovation, spread);
        ratio.update(innovation, spread);
        let noise = self.noise + NOISE_GAIN * (innovation * innovation - known - self.noise);
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
    fn one_frame_predicts_all_rungs() {
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
    fn a_new_rung_changes_the_estimate_of_that_rung() {
        let mut costs = Costs::new([1.0, 0.5, 0.25]);
        see(&mut costs, 0, 0.1, 50);
        see(&mut costs, 1, 0.09, 10);
        assert!((seconds(&costs, 1) - 0.09).abs() < 0.003);
        assert!((seconds(&costs, 0) - 0.1).abs() < 0.005 && (seconds(&costs, 2) - 0.025).abs() < 0.002);
    }

    #[test]
    fn a_change_of_the_load_does_not_change_a_known_rung() {
        let mut costs = Costs::new([1.0, 0.5, 0.25]);
        see(&mut costs, 0, 0.1, 50);
        see(&mut costs, 1, 0.05, 50);
        see(&mut costs, 1, 0.15, 20);
        assert!((seconds(&costs, 0) - 0.3).abs() < 0.02 && (seconds(&costs, 2) - 0.075).abs() < 0.005);
    }
}
