//! The recent frame rate of a run, and the predicted time of the rest.

use std::collections::VecDeque;
use std::time::Duration;

/// Time over which the rate is averaged.
const WINDOW: Duration = Duration::from_secs(20);
/// Samples that are closer together are merged.
const STEP: Duration = Duration::from_millis(100);
/// Shortest time after which a rate is known.
const MIN_TIME: Duration = Duration::from_millis(500);

/// Finished frames over time. Times are durations since a fixed moment and never decrease; frames may be fractions.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pace {
    /// Times with the frames finished by then. The first is the newest sample from before the window.
    samples: VecDeque<(Duration, f64)>,
}

impl Pace {
    /// Notes that `done` frames are finished at `at`. The first call marks the start.
    pub(crate) fn note(&mut self, at: Duration, done: f64) {
        let recent = self.samples.len() > 1
            && self.samples.back().is_some_and(|(then, _)| at.saturating_sub(*then) < STEP);
        if recent {
            self.samples.pop_back();
        }
        self.samples.push_back((at, done));
        while self.samples.get(1).is_some_and(|(then, _)| *then + WINDOW < at) {
            self.samples.pop_front();
        }
    }

    /// Frames per second up to now, with `done` frames finished; 0 while unknown.
    pub(crate) fn per_second(&self, now: Duration, done: f64) -> f64 {
        let Some((then, done_then)) = self.samples.front() else { return 0.0 };
        let passed = now.saturating_sub(*then);
        if passed < MIN_TIME { 0.0 } else { ((done - done_then) / passed.as_secs_f64()).max(0.0) }
    }

    /// Predicted time for the rest of `total` frames; `None` while unknown.
    pub(crate) fn left(&self, now: Duration, done: f64, total: f64) -> Option<Duration> {
        let seconds = (total - done).max(0.0) / self.per_second(now, done);
        Duration::try_from_secs_f64(seconds).ok()
    }
}

/// A duration as text: `45 s`, `12 min 30 s`, `3 h 5 min`, `2 d 4 h`.
pub fn duration_text(time: Duration) -> String {
    let seconds = time.as_secs_f64().round() as u64;
    let (minutes, hours) = (seconds / 60, seconds / 3600);
    match () {
        () if seconds < 60 => format!("{seconds} s"),
        () if hours == 0 => format!("{minutes} min {} s", seconds % 60),
        () if hours < 48 => format!("{hours} h {} min", minutes % 60),
        () => format!("{} d {} h", hours / 24, hours % 24),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn the_end_of_a_steady_run_is_predicted() {
        let mut pace = Pace::default();
        for second in 0..=30u32 {
            pace.note(SECOND * second, f64::from(second) * 2.0);
        }
        assert!((pace.per_second(SECOND * 30, 60.0) - 2.0).abs() < 1e-9);
        assert_eq!(pace.left(SECOND * 30, 60.0, 100.0), Some(SECOND * 20));
    }

    #[test]
    fn a_part_of_a_frame_is_enough_for_a_prediction() {
        let mut pace = Pace::default();
        pace.note(SECOND * 5, 0.0);
        assert_eq!(pace.left(SECOND * 15, 0.25, 1.0), Some(SECOND * 30));
        assert_eq!(pace.left(SECOND * 15, 0.0, 1.0), None);
        assert_eq!(Pace::default().left(SECOND, 0.5, 1.0), None);
    }

    #[test]
    fn the_rate_follows_changes_and_drops_when_the_run_stops() {
        let mut pace = Pace::default();
        for tenth in 0..1000u32 {
            pace.note(SECOND * tenth / 10, f64::from(tenth));
        }
        for second in 0..60u32 {
            pace.note(SECOND * (100 + second), f64::from(1000 + second));
        }
        let now = SECOND * 159;
        assert!((pace.per_second(now, 1059.0) - 1.0).abs() < 0.1, "{}", pace.per_second(now, 1059.0));
        assert!(pace.per_second(now * 100, 1059.0) < 0.01);
    }

    #[test]
    fn memory_is_bounded() {
        let mut pace = Pace::default();
        for ms in 0..200_000u32 {
            pace.note(Duration::from_millis(ms.into()), f64::from(ms));
        }
        assert!(pace.samples.len() < 300);
    }

    #[test]
    fn durations_have_two_units_at_most() {
        let texts =
            [0, 45, 60, 750, 11_100, 187_200].map(|seconds| duration_text(Duration::from_secs(seconds)));
        assert_eq!(texts, ["0 s", "45 s", "1 min 0 s", "12 min 30 s", "3 h 5 min", "2 d 4 h"]);
    }
}
