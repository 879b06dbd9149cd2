//! Frames per second, smoothed over about a second.

use std::collections::VecDeque;
use std::time::Duration;

/// Time over which the rate is the mean.
const WINDOW: Duration = Duration::from_secs(1);
/// Frames remembered at most; at such rates half a second is smooth enough.
const MAX_FRAMES: usize = 512;

/// Rate of completed frames. Times are since any fixed moment, and grow.
#[derive(Clone, Debug, Default)]
pub(crate) struct FrameRate {
    /// Time of completion and duration of each frame; the first one is the last before the window.
    frames: VecDeque<(Duration, Duration)>,
    /// Whether nothing has been requested since the last frame.
    rested: bool,
}

impl FrameRate {
    /// Adds a frame that took `elapsed` and was completed `at`.
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

    /// Starts the rate anew with the next frame, because nothing was requested since the last one.
    pub(crate) fn rested(&mut self) {
        self.rested = true;
    }

    /// Frames per second at the time `now`; zero before the second frame. Falls when no frame is completed any more.
    pub(crate) fn fps(&self, now: Duration) -> f64 {
        let (Some((first, _)), Some((last, _))) = (self.frames.front(), self.frames.back()) else {
            return 0.0;
        };
        let intervals = self.frames.len() - 1;
        let until = if now.saturating_sub(*last) > WINDOW { now } else { *last };
        let seconds = until.saturating_sub(*first).as_secs_f64();
        if seconds > 0.0 { intervals as f64 / seconds } else { 0.0 }
    }

    /// Lowest and highest rate by the times between two frames within the window; `None` before the third frame, and when no
    /// frame is completed any more.
    pub(crate) fn range(&self, now: Duration) -> Option<(f64, f64)> {
        let (last, _) = self.frames.back()?;
        if self.frames.len() < 3 || now.saturating_sub(*last) > WINDOW {
            return None;
        }
        let times = self.frames.iter().zip(self.frames.iter().skip(1));
        let seconds = times.map(|((from, _), (to, _))| to.saturating_sub(*from).as_secs_f64());
        let (shortest, longest) = seconds
            .fold((f64::INFINITY, 0.0_f64), |(least, most), seconds| (least.min(seconds), most.max(seconds)));
        (shortest > 0.0).then(|| (1.0 / longest, 1.0 / shortest))
    }

    /// Mean duration of a frame.
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
    fn a_steady_rate_is_exact() {
        let mut rate = FrameRate::default();
        for frame in 0..200 {
            rate.completed(MS * 20 * frame, MS * 15);
        }
        assert!((rate.fps(MS * 20 * 199) - 50.0).abs() < 1e-9);
        assert_eq!(rate.frame_time(), MS * 15);
    }

    #[test]
    fn the_range_is_that_of_the_last_second() {
        let mut rate = FrameRate::default();
        rate.completed(MS, MS);
        rate.completed(MS * 900, MS);
        assert_eq!(rate.range(MS * 900), None, "two frames have one rate");
        [1000, 1010, 1210].iter().for_each(|at| rate.completed(MS * *at, MS));
        let (lowest, highest) = rate.range(MS * 1210).unwrap();
        assert!((highest - 100.0).abs() < 1e-9 && (lowest - 1000.0 / 899.0).abs() < 1e-9);
        rate.completed(MS * 1990, MS);
        let (lowest, _) = rate.range(MS * 1990).unwrap();
        assert!((lowest - 1000.0 / 780.0).abs() < 1e-9, "{lowest}");
        assert_eq!(rate.range(MS * 3000), None);
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
    fn frames_longer_than_the_window_have_a_rate() {
        let mut rate = FrameRate::default();
        for frame in 0..5 {
            rate.completed(MS * 4000 * frame, MS * 4000);
        }
        assert!((rate.fps(MS * 16_000) - 0.25).abs() < 1e-9);
    }

    #[test]
    fn a_rest_does_not_count_as_a_slow_frame() {
        let mut rate = FrameRate::default();
        (0..50).for_each(|frame| rate.completed(MS * 20 * frame, MS * 15));
        rate.rested();
        assert_eq!(rate.frame_time(), MS * 15, "the frame time before the rest is still known");
        rate.completed(MS * 60_000, MS * 25);
        assert!((rate.fps(MS * 60_000) - 40.0).abs() < 1e-9, "{}", rate.fps(MS * 60_000));
        assert_eq!(rate.frame_time(), MS * 25);
    }

    #[test]
    fn the_rate_is_zero_before_the_second_frame() {
        let mut rate = FrameRate::default();
        assert_eq!((rate.fps(MS), rate.frame_time()), (0.0, Duration::ZERO));
        rate.completed(MS, MS);
        assert_eq!(rate.fps(MS), 0.0);
    }

    #[test]
    fn the_rate_falls_when_no_frame_is_completed() {
        let mut rate = FrameRate::default();
        for frame in 0..50 {
            rate.completed(MS * 20 * frame, MS * 20);
        }
        assert!(rate.fps(MS * 60_000) < 1.0);
    }
}
