//! The film of a still view: exact sums of the passes of a picture, added one after the other.
//!
//! A picture of the path integrator is rendered in passes of sample ranges 0..1, 1..2, 2..4, 4..8, 8..16, 16..32, 32..48 and so on
//! ([`passes`]). Each pass is an ordinary frame of [`PixelFormat::Sums`]. Sums are whole numbers, so the film after n samples is the same
//! by any passes, and what it shows ([`Film::develop`]) is the picture that workers write when they render all n samples at once.
//!
//! ```text
//!   passes     ranges of samples, and the views that are rendered for them
//!   error      estimate of the error from the sums of even and odd samples
//!   progress   samples, error, and the time to the target
//!   pass       frames of which a picture at rest consists
//!   guides     auxiliary pictures that guide the denoiser
//!   still      the film of an interactive view, and the frames that it shows
//! ```

mod error;
mod guides;
pub(super) mod pass;
pub(crate) mod passes;
mod progress;
pub(super) mod still;

use rayfarm_farm::{FinishedFrame, FrameId};
use rayfarm_tracer::scene::FrameView;
use rayfarm_tracer::{PixelFormat, PixelSums, develop};

pub(crate) use progress::{FilmProgress, FilmTarget, Pace};

/// Sums of the first samples of all pixels of a view.
#[derive(Clone, Debug)]
pub(crate) struct Film {
    /// The view, with any number of samples, in any format.
    view: FrameView,
    sums: Vec<PixelSums>,
    samples: u32,
    /// Frames whose pixels are in the sums.
    frames: Vec<FrameId>,
}

/// Reason for which the pixels of a frame are not added to a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum PassError {
    /// The frame is of another view, or has other numbers than sums.
    #[error("the frame is no pass of this picture")]
    OtherView,
    /// The samples are not those that follow.
    #[error("the pass begins at sample {first}, and the film has {samples} samples")]
    OtherSamples {
        /// First sample of the pass.
        first: u32,
        /// Samples of the film.
        samples: u32,
    },
}

impl Film {
    /// An empty film of a view.
    pub(crate) fn new(view: &FrameView) -> Self {
        Self::of_sums(view, vec![PixelSums::default(); pixel_count(view)], 0)
    }

    /// A film that has the sums of a number of samples. The sums are one for each pixel, rows from top to bottom.
    pub(crate) fn of_sums(view: &FrameView, sums: Vec<PixelSums>, samples: u32) -> Self {
        Self { view: *view, sums, samples, frames: Vec::new() }
    }

    /// Samples of each pixel.
    pub(crate) fn samples(&self) -> u32 {
        self.samples
    }

    /// Sums of the pixels, rows from top to bottom.
    pub(crate) fn sums(&self) -> &[PixelSums] {
        &self.sums
    }

    /// Frames whose pixels are in the sums.
    pub(crate) fn frames(&self) -> &[FrameId] {
        &self.frames
    }

    /// Adds the pass that follows.
    ///
    /// # Errors
    /// A frame of another view or other samples; nothing is added.
    pub(crate) fn add(&mut self, frame: &FinishedFrame) -> Result<(), PassError> {
        let FrameView { first_sample: first, samples, .. } = frame.view;
        if frame.view != passes::pass(&self.view, first..first.saturating_add(samples)) {
            return Err(PassError::OtherView);
        }
        if first != self.samples {
            return Err(PassError::OtherSamples { first, samples: self.samples });
        }
        if !frame.add_sums_to(&mut self.sums) {
            return Err(PassError::OtherView);
        }
        self.samples = self.samples.saturating_add(samples);
        self.frames.push(frame.frame);
        Ok(())
    }

    /// The view of the picture that the film shows: with its samples so far, in a format.
    pub(crate) fn shown(&self, format: PixelFormat) -> FrameView {
        FrameView { samples: self.samples.max(1), first_sample: 0, format, ..self.view }
    }

    /// Pixels of the picture that the film shows, rows from top to bottom in a format.
    pub(crate) fn develop(&self, format: PixelFormat) -> Vec<u8> {
        let view = self.shown(format);
        let mut pixels = vec![0; format.bytes_of(view.width, view.height)];
        develop(&view, 0, view.samples, &self.sums, &mut pixels);
        pixels
    }

    /// Estimate of the relative error of the picture; `None` with fewer than two samples. See [`error::relative_error`].
    pub(crate) fn error(&self) -> Option<f64> {
        error::relative_error(&self.sums, self.samples)
    }
}

/// Pixels of a view.
pub(crate) fn pixel_count(view: &FrameView) -> usize {
    view.width as usize * view.height as usize
}

#[cfg(test)]
mod still_tests;
#[cfg(test)]
pub(in crate::viewer) mod tests;
