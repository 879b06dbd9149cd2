//! Renders, compares and times settings in this process.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfarm_tracer::image::{self, FlipMap, PIXELS_PER_DEGREE, RgbImage};
use rayfarm_tracer::scene::{FrameView, MAX_SAMPLES};
use rayfarm_tracer::{CompiledScene, PreparedFrame};

use super::setting::Setting;
use super::table::Row;
use crate::error::CommandError;
use crate::in_process::trace;
use crate::quantile::{percentile, round_to_us};

/// Where pictures are taken: a scene, what is seen of it, and who renders.
pub(crate) struct Studio<'a> {
    /// The scene.
    pub(crate) scene: Arc<CompiledScene>,
    /// Camera and size of the finished pictures.
    pub(crate) view: FrameView,
    /// Render threads.
    pub(crate) threads: usize,
    /// Asked now and then: whether to stop.
    pub(crate) cancelled: &'a (dyn Fn() -> bool + Sync),
}

/// A setting's picture beside the reference.
pub(crate) struct Compared {
    /// What was rendered.
    pub(crate) picture: RgbImage,
    /// Where it differs from the reference to somebody's eye.
    pub(crate) errors: FlipMap,
    /// How much it differs, without times.
    pub(crate) row: Row,
}

impl Studio<'_> {
    /// What the reference is rendered as: full quality, with as many samples as there can be.
    pub(crate) fn reference_view(&self) -> FrameView {
        FrameView { samples: MAX_SAMPLES, ..Setting::plain().applied_to(&self.view).view }
    }

    /// The picture that all settings are held against. `done` is told how many rows are rendered.
    ///
    /// # Errors
    /// A stop.
    pub(crate) fn reference(&self, done: &(dyn Fn(u32) + Sync)) -> Result<RgbImage, CommandError> {
        self.render(&self.reference_view(), done)
    }

    /// Renders a setting's picture and compares it.
    ///
    /// # Errors
    /// A stop.
    pub(crate) fn compare(&self, setting: &Setting, reference: &RgbImage) -> Result<Compared, CommandError> {
        let picture = self.picture(setting)?;
        let difference = image::compare(reference, &picture).map_err(CommandError::failed)?;
        let errors = image::flip(reference, &picture, PIXELS_PER_DEGREE).map_err(CommandError::failed)?;
        let row = Row::new(setting.name(), &difference, errors.mean());
        Ok(Compared { picture, errors, row })
    }

    /// Renders every setting once, in turn, and adds to each its time: from the scene to the finished picture. Rounds that go forward and
    /// back by turns let no setting always have the same neighbour.
    ///
    /// # Errors
    /// A stop.
    pub(crate) fn time_round(
        &self,
        settings: &[Setting],
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
    fn picture(&self, setting: &Setting) -> Result<RgbImage, CommandError> {
        let wanted = setting.applied_to(&self.view);
        wanted.delivered(self.render(&wanted.rendered(), &|_| ())?).map_err(CommandError::failed)
    }

    fn render(&self, view: &FrameView, done: &(dyn Fn(u32) + Sync)) -> Result<RgbImage, CommandError> {
        let frame = PreparedFrame::new(Arc::clone(&self.scene), view).map_err(CommandError::failed)?;
        let mut picture = RgbImage::new(view.width, view.height);
        trace(&frame, &mut picture.pixels, self.threads, self.cancelled, done)
            .map_err(|_| CommandError::Interrupted("no table was written".to_owned()))?;
        Ok(picture)
    }
}

/// The median and the least time, in milliseconds.
pub(crate) fn summary(times: &[Duration]) -> (f64, f64) {
    let mut sorted = times.to_vec();
    sorted.sort_unstable();
    (round_to_us(percentile(&sorted, 0.5)), round_to_us(percentile(&sorted, 0.0)))
}
