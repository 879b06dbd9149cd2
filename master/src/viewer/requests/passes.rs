//! Passes of a view at rest, one after the other.

use rayfarm_farm::ViewRequest;
use rayfarm_tracer::GUIDES;

use crate::viewer::film::pass::{Part, Pass};
use crate::viewer::film::passes;

/// Passes of a view at rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passes {
    /// The request for the whole picture.
    pub(super) whole: ViewRequest,
    /// Number of their film.
    pub(super) film: u64,
    /// First sample of the next pass.
    next: u32,
    /// Number of guides of the denoiser that have been requested.
    guides: usize,
    /// Whether the picture needs no more passes, although it could have some.
    is_complete: bool,
}

impl Passes {
    /// Passes from the first sample on, of a film with a number.
    pub(super) fn new(whole: &ViewRequest, film: u64) -> Self {
        Self { whole: *whole, film, next: 0, guides: 0, is_complete: false }
    }

    /// The next pass, if there is one. A picture that is denoised needs its guides from its second sample on, so they follow the first
    /// pass, which is shown sooner without them.
    pub(super) fn pass(&self, denoised: bool) -> Option<Pass> {
        let Self { whole, film, next, guides, is_complete } = *self;
        let needs_guides = denoised && next > 0 && whole.view.samples > 1;
        if let Some(shading) = GUIDES.get(guides).filter(|_| needs_guides) {
            return Some(Pass { film, whole, part: Part::Guide(*shading) });
        }
        let range = passes::next(next, whole.view.samples).filter(|_| !is_complete)?;
        let part = Part::Samples { first: range.start, samples: range.end - range.start };
        Some(Pass { film, whole, part })
    }

    /// The passes after one of them.
    #[must_use]
    pub(super) fn after(self, pass: &Pass) -> Self {
        match pass.part {
            Part::Samples { first, samples } => Self { next: first.saturating_add(samples), ..self },
            Part::Guide(_) => Self { guides: self.guides + 1, ..self },
        }
    }

    /// Ends the picture before all of its samples. `open_guides` are the guides in flight, which are dropped, and requested again if the
    /// picture is denoised.
    pub(super) fn complete(&mut self, open_guides: usize) {
        self.is_complete = true;
        self.guides = self.guides.saturating_sub(open_guides);
    }
}
