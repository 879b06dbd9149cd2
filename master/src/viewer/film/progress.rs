//! Progress of a film: samples, error, and the time to the target.

use std::collections::VecDeque;
use std::time::Duration;

use rayfarm_tracer::scene::FrameView;
use serde::Serialize;

use super::passes;

/// Passes in the estimate of the time of a sample.
const PASSES: usize = 4;

/// The end of a film: a number of samples, or an error that is reached sooner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FilmTarget {
    /// Samples of each pixel.
    pub(crate) samples: u32,
    /// Largest relative error; `None` where only the samples count.
    pub(crate) error: Option<f64>,
}

impl FilmTarget {
    /// The target of a view.
    pub(crate) fn of(view: &FrameView) -> Self {
        Self { samples: view.samples, error: passes::error_target(view) }
    }

    /// Whether a film of a number of samples with an estimated error has reached the target.
    pub(crate) fn is_reached(&self, samples: u32, error: Option<f64>) -> bool {
        samples >= self.samples || self.error.zip(error).is_some_and(|(target, error)| error <= target)
    }

    /// Samples that the target needs, from those so far and their estimated error, which falls with the square root of the samples.
    fn needed(&self, samples: u32, error: Option<f64>) -> u32 {
        let by_error =
            self.error.zip(error).map(|(target, error)| f64::from(samples) * (error / target).powi(2));
        // Conversion saturates.
        by_error
            .map_or(self.samples, |needed| (needed.ceil() as u32).clamp(samples, self.samples.max(samples)))
    }
}

/// Progress of a film.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct FilmProgress {
    /// Samples of each pixel so far.
    pub(crate) samples: u32,
    /// Samples of each pixel at the end.
    pub(crate) of: u32,
    /// Estimated relative error: the standard deviation of a pixel in parts of the picture's mean brightness. `None` before the second
    /// sample.
    pub(crate) error: Option<f64>,
    /// Error at which the film ends before all of its samples.
    pub(crate) target_error: Option<f64>,
    /// Estimated time to the end; `None` before the second pass.
    pub(crate) left: Option<Duration>,
    /// Whether the picture is shown without most of its noise. The film and its error are those of the noisy one.
    pub(crate) is_denoised: bool,
}

impl FilmProgress {
    /// Whether the film is complete.
    pub(crate) fn is_complete(&self) -> bool {
        FilmTarget { samples: self.of, error: self.target_error }.is_reached(self.samples, self.error)
    }

    /// Samples, error and filter as text: `12 of 64 samples, error 3.1 %, denoised`.
    pub(crate) fn text(&self) -> String {
        let Self { samples, of, target_error, .. } = self;
        let error = self.error.map_or(String::new(), |error| format!(", error {}", percent(error)));
        let target = target_error.map_or(String::new(), |error| format!(" (to {})", percent(error)));
        let denoised = if self.is_denoised { ", denoised" } else { "" };
        format!("{samples} of {of} samples{error}{target}{denoised}")
    }
}

/// A share as text with two significant digits.
fn percent(share: f64) -> String {
    match share * 100.0 {
        percent if percent >= 10.0 => format!("{percent:.0} %"),
        percent if percent >= 1.0 => format!("{percent:.1} %"),
        percent => format!("{percent:.2} %"),
    }
}

/// Pace of a film: the time of the last passes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pace {
    /// Times at which passes were complete, since any moment, with the samples then.
    last: VecDeque<(Duration, u32)>,
}

impl Pace {
    /// Records a pass that was complete at a time, with the samples of the film. Samples before the first call took no time of this run.
    pub(crate) fn record(&mut self, at: Duration, samples: u32) {
        self.last.push_back((at, samples));
        if self.last.len() > PASSES {
            self.last.pop_front();
        }
    }

    /// Progress towards a target with an estimated error.
    pub(crate) fn progress(&self, target: &FilmTarget, error: Option<f64>) -> FilmProgress {
        let samples = self.last.back().map_or(0, |(_, samples)| *samples);
        let more = match target.is_reached(samples, error) {
            true => 0,
            false => target.needed(samples, error).saturating_sub(samples).max(1),
        };
        let left = self.per_sample().map(|time| time.saturating_mul(more));
        let (of, target_error) = (target.samples, target.error);
        FilmProgress { samples, of, error, target_error, left, is_denoised: false }
    }

    /// Time of a sample of all pixels.
    fn per_sample(&self) -> Option<Duration> {
        let ((first_at, first), (last_at, last)) = self.last.front().zip(self.last.back())?;
        let samples = last.checked_sub(*first).filter(|samples| *samples > 0)?;
        Some(last_at.saturating_sub(*first_at) / samples)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn the_time_to_a_number_of_samples_is_that_of_the_last_passes() {
        let mut pace = Pace::default();
        let target = FilmTarget { samples: 64, error: None };
        assert_eq!(pace.progress(&target, None).left, None);
        // The first pass waited for workers; later ones take half a second a sample.
        for (at, samples) in [(60, 1), (90, 2), (91, 4), (93, 8), (97, 16), (105, 32)] {
            pace.record(SECOND * at, samples);
        }
        let progress = pace.progress(&target, Some(0.1));
        assert_eq!((progress.samples, progress.of, progress.left), (32, 64, Some(SECOND * 16)));
        assert!(!progress.is_complete());
        pace.record(SECOND * 113, 64);
        let progress = pace.progress(&target, Some(0.07));
        assert!(progress.is_complete() && progress.left == Some(Duration::ZERO));
    }

    #[test]
    fn the_error_falls_with_the_square_root_of_the_samples() {
        let target = FilmTarget { samples: 1000, error: Some(0.05) };
        assert_eq!(target.needed(16, Some(0.1)), 64);
        assert_eq!(target.needed(16, Some(0.051)), 17);
        assert_eq!(target.needed(16, Some(1e9)), 1000, "all samples");
        assert_eq!(target.needed(1, None), 1000);
        assert!(target.is_reached(16, Some(0.05)) && !target.is_reached(16, Some(0.051)));
        assert!(!target.is_reached(1, None) && target.is_reached(1000, Some(0.3)));
    }

    #[test]
    fn progress_is_one_line() {
        let error = Some(0.0312);
        let progress =
            FilmProgress { samples: 12, of: 64, error, target_error: None, left: None, is_denoised: false };
        assert_eq!(progress.text(), "12 of 64 samples, error 3.1 %");
        let targeted = FilmProgress { target_error: Some(0.005), error: Some(0.31), ..progress };
        assert_eq!(targeted.text(), "12 of 64 samples, error 31 % (to 0.50 %)");
        assert_eq!(FilmProgress { error: None, ..progress }.text(), "12 of 64 samples");
        let denoised = FilmProgress { is_denoised: true, ..progress };
        assert_eq!(denoised.text(), "12 of 64 samples, error 3.1 %, denoised");
    }
}
