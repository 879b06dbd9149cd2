//! Frames of which a picture at rest consists.

use rayfarm_farm::ViewRequest;
use rayfarm_tracer::scene::Shading;

use super::passes;

/// A frame of the picture at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::viewer) struct Pass {
    /// Number of its film: each start of a picture has a film of its own.
    pub(in crate::viewer) film: u64,
    /// The request for the whole picture.
    pub(in crate::viewer) whole: ViewRequest,
    /// The part of the picture.
    pub(in crate::viewer) part: Part,
}

/// The part of a picture that a frame has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::viewer) enum Part {
    /// Sums of some samples of all pixels.
    Samples {
        /// The first sample.
        first: u32,
        /// The number of samples.
        samples: u32,
    },
    /// An auxiliary picture that guides the denoiser.
    Guide(Shading),
}

impl Pass {
    /// The request for the frame.
    pub(in crate::viewer) fn request(&self) -> ViewRequest {
        match self.part {
            Part::Samples { first, samples } => {
                let view = passes::pass(&self.whole.view, first..first.saturating_add(samples));
                ViewRequest { view, ..self.whole }
            }
            Part::Guide(shading) => self.whole.auxiliary(shading),
        }
    }

    /// Whether the frame has the first sample of the picture.
    pub(in crate::viewer) fn is_first(&self) -> bool {
        matches!(self.part, Part::Samples { first: 0, .. })
    }
}
