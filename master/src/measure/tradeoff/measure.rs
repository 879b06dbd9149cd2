//! Renders, compares and times settings in this process.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfarm_tracer::CompiledScene;
use rayfarm_tracer::image::{self, FlipMap, PIXELS_PER_DEGREE, RgbImage};
use rayfarm_tracer::scene::{FrameView, Integrator, MAX_SAMPLES};

use super::rendering::passes_of;
use super::setting::MeasuredSetting;
use super::table::Row;
use crate::error::CommandError;
use crate::quantile::{percentile, round_to_us};

/// Paths per pixel of the reference: 32 times those of the best measured setting.
const REFERENCE_PATHS: u32 = 4096;

/// A scene with the view and the threads that it is measured with.
pub(crate) struct MeasureContext<'a> {
    /// Scene that is measured.
    pub(crate) scene: Arc<CompiledScene>,
    /// Camera and size of the finished pictures.
    pub(crate) view: FrameView,
    /// Render threads.
    pub(crate) threads: usize,
    /// Polled while rendering: whether to stop.
    pub(crate) cancelled: &'a (dyn Fn() -> bool + Sync),
}

/// A setting's picture compared with the reference.
pub(crate) struct Compared {
    /// Picture rendered at the setting.
    pub(crate) picture: RgbImage,
    /// FLIP error of each pixel against the reference.
    pub(crate) errors: FlipMap,
    /// Row of the table with the errors of the picture, without times.
    pub(crate) row: Row,
}

impl MeasureContext<'_> {
    /// View of the reference: full quality with the largest number of samples, or [`REFERENCE_PATHS`].
    pub(crate) fn reference_view(&self) -> FrameView {
        let samples = match self.view.integrator {
            Integrator::Direct => MAX_SAMPLES,
            Integrator::Path(_) => REFERENCE_PATHS,
        };
        FrameView { samples, ..MeasuredSetting::plain().applied_to(&self.view).view }
    }

    /// Rows of all passes of the reference.
    pub(crate) fn reference_rows(&self) -> u64 {
        let view = self.reference_view();
        u64::from(view.height) * passes_of(&view)
    }

    /// Renders the reference picture. `done` receives the number of rows that were rendered since the last call, of
    /// [`Self::reference_rows`].
    ///
    /// # Errors
    /// The measurement was cancelled.
    pub(crate) fn reference(&self, done: &(dyn Fn(u32) + Sync)) -> Result<RgbImage, CommandError> {
        self.in_passes(&self.reference_view(), done)
    }

    /// Renders a setting's picture and compares it with the reference.
    ///
    /// # Errors
    /// The measurement was cancelled.
    pub(crate) fn compare(
        &self,
        setting: &MeasuredSetting,
        reference: &RgbImage,
    ) -> Result<Compared, CommandError> {
        let picture = self.picture(setting)?;
        let difference = image::compare(reference, &picture).map_err(CommandError::failed)?;
        let errors = image::flip(reference, &picture, PIXELS_PER_DEGREE).map_err(CommandError::failed)?;
        let row = Row::new(setting.name.to_owned(), &difference, errors.mean());
        Ok(Compared { picture, errors, row })
    }

    /// Renders every setting once and appends each duration, from preparation to the resized picture, to `times`.
    /// Alternating forward and backward rounds vary the neighbours of a setting.
    ///
    /// # Errors
    /// A frame that cannot be prepared or resized; a cancelled measurement.
    pub(crate) fn time_round(
        &self,
        settings: &[MeasuredSetting],
        times: &mut [Vec<Duration>],
        backward: bool,
        done: &dyn Fn(),
    ) -> Result<(), CommandError> {
        for step in 0..settings.len() {
            let index = if backward { settings.len() - 1 - step } else { step };
            let started = Instant::now();
            self.picture(&settings[index])?;
            times[index].push(started.elapsed());
            done();
        }
        Ok(())
    }

    /// The picture under a setting, in its full size.
    fn picture(&self, setting: &MeasuredSetting) -> Result<RgbImage, CommandError> {
        let wanted = setting.applied_to(&self.view);
        let view = wanted.rendered();
        let rendered = if setting.is_denoised() { self.denoised(&view) } else { self.shown(&view, &|_| ()) };
        wanted.delivered(rendered?).map_err(CommandError::failed)
    }
}

/// The median and the least time, in milliseconds.
pub(crate) fn summary(times: &[Duration]) -> (f64, f64) {
    let mut sorted = times.to_vec();
    sorted.sort_unstable();
    (round_to_us(percentile(&sorted, 0.5)), round_to_us(percentile(&sorted, 0.0)))
}
