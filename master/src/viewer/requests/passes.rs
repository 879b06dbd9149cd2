//! Passes of a view at rest, one after the other.

use rayfarm_farm::ViewRequest;

use crate::viewer::film::passes;
use crate::viewer::film::still::Pass;

/// Passes of a view at rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passes {
    /// The request for the whole picture.
    pub(super) whole: ViewRequest,
    /// Number of their film.
    pub(super) film: u64,
    /// First sample of the next pass.
    next: u32,
    /// Whether the picture needs no more passes, although it could have some.
    is_complete: bool,
}

impl Passes {
    /// Passes from the first sample on, of a film with a number.
    pub(super) fn new(whole: &ViewRequest, film: u64) -> Self {
        Self { whole: *whole, film, next: 0, is_complete: false }
    }

    /// The next pass, if there is one.
    pub(super) fn pass(&self) -> Option<Pass> {
        let Self { whole, film, next, is_complete } = *self;
        let range = passes::next(next, whole.view.samples).filter(|_| !is_complete)?;
        Some(Pass { film, whole, first: range.start, samples: range.end - range.start })
    }

    /// The passes after one of them.
    #[must_use]
    pub(super) fn after(self, pass: &Pass) -> Self {
        Self { next: pass.first.saturating_add(pass.samples), ..self }
    }

    /// Ends the picture before all of its samples.
    pub(super) fn complete(&mut self) {
        self.is_complete = true;
    }
}
