//! Requests in flight, and what is known about their frames.

use std::time::Instant;

use rayfarm_farm::{FrameId, ViewRequest};

use crate::viewer::film::pass::{Part, Pass};
use crate::viewer::quality_controller::QualityMode;
use crate::viewer::sequence::Slot;

/// The last request.
pub(super) struct Requested {
    pub(super) request: ViewRequest,
    /// Request before the quality controller.
    pub(super) wanted: ViewRequest,
    pub(super) mode: Option<QualityMode>,
}

/// A request in flight.
pub(super) struct Open {
    pub(super) frame: FrameId,
    pub(super) answered: Answered,
    pub(super) requested_at: Instant,
    /// `None` without a quality controller.
    pub(super) mode: Option<QualityMode>,
}

impl Open {
    /// Whether the request is dropped for one of another mode.
    pub(super) fn gives_way_to(&self, next: QualityMode) -> bool {
        self.mode.is_some_and(|mode| mode.gives_way_to(next))
    }

    /// Whether a display shows the frame after a change of the view: not a later pass, nor a guide of the denoiser.
    pub(super) fn is_shown_alone(&self) -> bool {
        self.answered.pass.is_none_or(|pass| pass.is_first())
    }

    /// Whether the frame is a guide of the denoiser.
    pub(super) fn is_guide(&self) -> bool {
        self.answered.pass.is_some_and(|pass| matches!(pass.part, Part::Guide(_)))
    }
}

/// Properties of a request that the farm does not know.
#[derive(Debug)]
pub(in crate::viewer) struct Answered {
    /// Time of the input that the frame answers.
    pub(in crate::viewer) input_at: Instant,
    /// Number of the frame in the animation.
    pub(in crate::viewer) number: u64,
    /// Place in the sequence, for a frame of one.
    pub(in crate::viewer) slot: Option<Slot>,
    /// Lines of the quality controller about the frame; empty without a controller.
    pub(in crate::viewer) quality: Vec<String>,
    /// The pass that the frame is, if it is one.
    pub(in crate::viewer) pass: Option<Pass>,
}
