//! Frames per second as people want to read them: smoothed over about a second, never stale.

use std::collections::VecDeque;
use std::time::Duration;

/// What is looked back upon.
const WINDOW: Duration = Duration::from_secs(1);
/// Frames remembered at most; at such rates half a second is smooth enough.
const MAX_FRAMES: usize = 512;

/// Counts completed frames. Times are since any fixed moment, and grow.
#[derive(Clone, Debug, Default)]
pub(crate) struct FrameRate {
    /// When each frame completed and what it took; the first is the one before the window.
    frames: VecDeque<(Duration, Duration)>,
    /// Whether nothing has been requested since the last frame.
    rested: bool,
}

impl FrameRate {
    /// A frame that took `elapsed` was completed `at`.
    pub(crate) fn completed(&mut self, at: Duration, elapsed: Duration) {
        if std::mem::take(&mut self.rested) {
            self.frames.clear();
            self.frames.push_back((at.saturating_sub(elapsed), elapsed));
        }
        self.frames.push_back((at, elapsed));
        let old = |frame: Option<&(Duration, Duration)>| frame.is_some_and(|(then, _)| *then + WINDOW < at);
        while self.frames.len() > MAX_FRAMES || old(self.frames.get(1)) {
            self.frames.pop_front();
        }
    }

    /// Nothing was requested for a while: the rate counts anew from the beginning of the next frame.
    pub(crate) fn rested(&mut self) {
        self.rested = true;
    }

    /// Frames per second at the moment `now`; zero before the second frame. Falls when frames stop coming.
    pub(crate) fn fps(&self, now: Duration) -> f64 {
        let (Some((first, _)), Some((last, _))) = (self.frames.front(), self.frames.back()) else {
            return 0.0;
        };
        let intervals = self.frames.len() - 1;
        let until = if now.saturating_sub(*last) > WINDOW { now } else { *last };
        let seconds = until.saturating_sub(*first).as_secs_f64();
        if seconds > 0.0 { intervals as f64 / seconds } else { 0.0 }
    }

    /// What a frame took, in the mean.
    pub(crate) fn frame_time(&self) -> Duration {
        let count = u32::try_from(self.frames.len()).unwrap_or(u32::MAX).max(1);
        self.frames.iter().map(|(_, elapsed)| *elapsed).sum::<Duration>() / count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_steady_rate_is_told_as_it_is() {
        let mut rate = FrameRate::default();
        for frame in 0..200 {
            rate.completed(MS * 20 * frame, MS * 15);
        }
        assert!((rate.fps(MS * 20 * 199) - 50.0).abs() < 1e-9);
        assert_eq!(rate.frame_time(), MS * 15);
    }

    #[test]
    fn a_change_shows_within_about_a_second() {
        let mut rate = FrameRate::default();
        for frame in 0..100 {
            rate.completed(MS * 10 * frame, MS * 10);
        }
        for frame in 1..=15 {
            rate.completed(MS * (990 + 100 * frame), MS * 100);
        }
        assert!((rate.fps(MS * 2490) - 10.0).abs() < 1.0, "{}", rate.fps(MS * 2490));
    }

    #[test]
    fn slow_frames_are_counted_too() {
        let mut rate = FrameRate::default();
        for frame in 0..5 {
            rate.completed(MS * 4000 * frame, MS * 4000);
        }
        assert!((rate.fps(MS * 16_000) - 0.25).abs() < 1e-9);
    }

    #[test]
    fn a_rest_is_no_slow_frame() {
        let mut rate = FrameRate::default();
        (0..50).for_each(|frame| rate.completed(MS * 20 * frame, MS * 15));
        rate.rested();
        assert_eq!(rate.frame_time(), MS * 15, "what the last frames took is still known");
        rate.completed(MS * 60_000, MS * 25);
        assert!((rate.fps(MS * 60_000) - 40.0).abs() < 1e-9, "{}", rate.fps(MS * 60_000));
        assert_eq!(rate.frame_time(), MS * 25);
    }

    #[test]
    fn nothing_is_told_of_nothing() {
        let mut rate = FrameRate::default();
        assert_eq!((rate.fps(MS), rate.frame_time()), (0.0, Duration::ZERO));
        rate.completed(MS, MS);
        assert_eq!(rate.fps(MS), 0.0);
    }

    #[test]
    fn a_farm_that_stops_does_not_look_alive() {
        let mut rate = FrameRate::default();
        for frame in 0..50 {
            rate.completed(MS * 20 * frame, MS * 20);
        }
        assert!(rate.fps(MS * 60_000) < 1.0);
    }
}
