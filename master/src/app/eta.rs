//! The predicted end of a run, as it is shown: without jumps.

use std::time::Duration;

/// Time in which a shown end moves most of the way to a new prediction.
const SETTLING: f64 = 8.0;
/// Share of the remaining time that counts as settling time, where that is longer.
const SETTLING_SHARE: f64 = 0.1;

/// The shown end of a run.
///
/// Predictions are of the last seconds, and vary from one to the next: by a worker that joins, a slow frame, a rounded count. The
/// shown end follows them by an exponential filter, so that the remaining time counts down with the clock while the predictions agree.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Eta {
    /// Time of the last prediction and the shown end, in seconds since a fixed moment.
    shown: Option<(f64, f64)>,
}

impl Eta {
    /// The remaining time to show at `now`, a duration since a fixed moment, where `left` is predicted. `None` while nothing is
    /// predicted: the next prediction is then shown as it is.
    pub(crate) fn left(&mut self, now: Duration, left: Option<Duration>) -> Option<Duration> {
        let Some(left) = left else {
            self.shown = None;
            return None;
        };
        let (now, left) = (now.as_secs_f64(), left.as_secs_f64());
        let predicted = now + left;
        let end = match self.shown {
            None => predicted,
            Some((before, end)) => {
                let settling = SETTLING.max(SETTLING_SHARE * (end - now));
                // The nearer the end, the less there is to filter: it must not be shown after it has come.
                let share = 1.0 - (-(now - before).max(0.0) / settling.min(left.max(0.1))).exp();
                end + (predicted - end) * share
            }
        };
        self.shown = Some((now, end));
        Duration::try_from_secs_f64((end - now).max(0.0)).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: f64 = 0.2;

    /// The shown seconds of predictions, one for each tick.
    fn shown(predictions: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut eta = Eta::default();
        let show = |(tick, left): (usize, f64)| {
            let now = Duration::from_secs_f64(tick as f64 * TICK);
            eta.left(now, Some(Duration::from_secs_f64(left))).unwrap().as_secs_f64()
        };
        predictions.enumerate().map(show).collect()
    }

    #[test]
    fn a_steady_run_counts_down_with_the_clock() {
        let left = |tick: usize| 100.0 - tick as f64 * TICK;
        for (tick, shown) in shown((0..500).map(left)).into_iter().enumerate() {
            assert!((shown - left(tick)).abs() < 1e-3, "{shown} at {tick}");
        }
    }

    #[test]
    fn varying_predictions_never_jump() {
        // Each prediction is wrong by up to a third.
        let left = |tick: usize| (300.0 - tick as f64 * TICK) * (1.0 + 0.33 * ((tick * 7919) as f64).sin());
        let shown = shown((0..1000).map(left));
        for pair in shown.windows(2) {
            assert!((pair[1] - pair[0]).abs() < 5.0, "{pair:?}");
        }
        let late = &shown[200..800];
        let worst = late.iter().enumerate().map(|(at, shown)| (shown - (260.0 - at as f64 * TICK)).abs());
        assert!(worst.fold(0.0, f64::max) < 30.0);
    }

    #[test]
    fn another_pace_is_shown_within_half_a_minute() {
        let left = |tick: usize| if tick < 50 { 100.0 } else { 50.0 - (tick - 50) as f64 * TICK };
        let shown = shown((0..250).map(left));
        let tick = 50 + 150;
        assert!((shown[tick] - left(tick)).abs() < 3.0, "{}", shown[tick]);
        assert!(shown[51] > 90.0, "not at once: {}", shown[51]);
    }

    #[test]
    fn nothing_is_shown_without_a_prediction() {
        let mut eta = Eta::default();
        let second = Duration::from_secs(1);
        assert_eq!(eta.left(second, None), None);
        assert_eq!(eta.left(second * 2, Some(second * 9)), Some(second * 9));
        assert_eq!(eta.left(second * 3, None), None);
        assert_eq!(eta.left(second * 4, Some(second * 90)), Some(second * 90));
    }
}
