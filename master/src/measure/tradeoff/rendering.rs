//! Pictures of a measurement, rendered in this process.

use std::sync::Arc;

use rayfarm_farm::ViewRequest;
use rayfarm_tracer::image::{LinearImage, RgbImage};
use rayfarm_tracer::scene::{FrameView, Integrator};
use rayfarm_tracer::{GUIDES, Guides, PixelFormat, PixelSums, PreparedFrame, develop, develop_denoised};

use super::measure::MeasureContext;
use crate::error::CommandError;
use crate::in_process::trace;

/// Samples of a pass: progress is reported for each band of each pass.
const SAMPLES_OF_PASS: u32 = 64;

/// Passes in which [`MeasureContext::in_passes`] renders a view.
pub(super) fn passes_of(view: &FrameView) -> u64 {
    match view.integrator {
        Integrator::Direct => 1,
        Integrator::Path(_) => u64::from(view.samples.div_ceil(SAMPLES_OF_PASS)),
    }
}

impl MeasureContext<'_> {
    /// The picture of a view in RGB8. `done` receives the number of rows that were rendered since the last call.
    ///
    /// # Errors
    /// The measurement was cancelled; a view that cannot be rendered.
    pub(super) fn shown(
        &self,
        view: &FrameView,
        done: &(dyn Fn(u32) + Sync),
    ) -> Result<RgbImage, CommandError> {
        let FrameView { width, height, .. } = *view;
        let view = FrameView { format: PixelFormat::Rgb8, ..*view };
        Ok(RgbImage { width, height, pixels: self.bytes(&view, done)? })
    }

    /// The same picture, of paths in several passes that add up to the same bytes.
    ///
    /// # Errors
    /// As [`Self::shown`].
    pub(super) fn in_passes(
        &self,
        view: &FrameView,
        done: &(dyn Fn(u32) + Sync),
    ) -> Result<RgbImage, CommandError> {
        if view.integrator == Integrator::Direct {
            return self.shown(view, done);
        }
        let mut picture = RgbImage::new(view.width, view.height);
        let mut sums = vec![PixelSums::default(); view.width as usize * view.height as usize];
        for first_sample in (0..view.samples).step_by(SAMPLES_OF_PASS as usize) {
            let samples = SAMPLES_OF_PASS.min(view.samples - first_sample);
            let pass = self.sums(&FrameView { first_sample, samples, ..*view }, done)?;
            sums.iter_mut().zip(&pass).for_each(|(sums, pass)| sums.add(pass));
        }
        let shown = FrameView { format: PixelFormat::Rgb8, ..*view };
        develop(&shown, 0, view.samples, &sums, &mut picture.pixels);
        Ok(picture)
    }

    /// The picture of paths of a view without most of its noise.
    ///
    /// # Errors
    /// As [`Self::shown`].
    pub(super) fn denoised(&self, view: &FrameView) -> Result<RgbImage, CommandError> {
        let sums = self.sums(view, &|_| ())?;
        let [albedo, normals, depth] =
            GUIDES.map(|guide| self.linear(&ViewRequest::from(*view).auxiliary(guide).view));
        let guides = Guides::new(&albedo?, &normals?, &depth?).map_err(CommandError::failed)?;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads).build();
        let view = FrameView { format: PixelFormat::Rgb8, ..*view };
        let develop = || develop_denoised(&view, view.samples, &sums, &guides);
        let pixels = pool.map_err(CommandError::failed)?.install(develop).map_err(CommandError::failed)?;
        Ok(RgbImage { width: view.width, height: view.height, pixels })
    }

    /// Sums of the samples of a view of paths.
    fn sums(&self, view: &FrameView, done: &(dyn Fn(u32) + Sync)) -> Result<Vec<PixelSums>, CommandError> {
        let bytes = self.bytes(&FrameView { format: PixelFormat::Sums, ..*view }, done)?;
        Ok(bytes.as_chunks().0.iter().map(PixelSums::from_bytes).collect())
    }

    /// The numbers of a view in linear light.
    fn linear(&self, view: &FrameView) -> Result<LinearImage, CommandError> {
        let FrameView { width, height, .. } = *view;
        let bytes = self.bytes(&FrameView { format: PixelFormat::Linear, ..*view }, &|_| ())?;
        let pixels = bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        Ok(LinearImage { width, height, pixels })
    }

    /// The pixels of a view in its format.
    fn bytes(&self, view: &FrameView, done: &(dyn Fn(u32) + Sync)) -> Result<Vec<u8>, CommandError> {
        let frame = PreparedFrame::new(Arc::clone(&self.scene), view).map_err(CommandError::failed)?;
        let mut pixels = vec![0; view.format.bytes_of(view.width, view.height)];
        trace(&frame, &mut pixels, self.threads, self.cancelled, done)
            .map_err(|_| CommandError::Interrupted("no table was written".to_owned()))?;
        Ok(pixels)
    }
}

#[cfg(test)]
mod tests {
    use rayfarm_farm::testing::test_scene;
    use rayfarm_tracer::CompiledScene;
    use rayfarm_tracer::image;
    use rayfarm_tracer::scene::{PathSettings, Quality};

    use super::*;

    #[test]
    fn passes_add_up_to_the_picture_and_report_all_their_rows() {
        let scene = Arc::new(CompiledScene::new(test_scene::scene(), [], []).unwrap());
        let integrator = Integrator::Path(PathSettings::DEFAULT);
        let quality = Quality { max_depth: 2, ..Quality::default() };
        let view =
            FrameView { width: 16, height: 20, samples: 130, integrator, quality, ..test_scene::view() };
        let context = MeasureContext { scene, view, threads: 2, cancelled: &|| false };
        let rows = std::sync::atomic::AtomicU64::new(0);
        let done = |count| {
            rows.fetch_add(u64::from(count), std::sync::atomic::Ordering::Relaxed);
        };
        let in_passes = context.in_passes(&view, &done).unwrap();
        assert!(in_passes == context.shown(&view, &|_| ()).unwrap());
        assert_eq!((passes_of(&view), rows.into_inner()), (3, 3 * 20));
        let denoised = context.denoised(&view).unwrap();
        assert!(image::compare(&in_passes, &denoised).unwrap().rmse < 8.0);
    }
}
