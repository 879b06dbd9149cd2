//! What is requested, by which rules, and of whom.

use std::sync::Arc;

use rayfarm_farm::{Assets, Farm, FrameId, ViewRequest};

use crate::viewer::orbit::Animation;

/// Accepts requests for frames.
pub(in crate::viewer) trait Renderer {
    /// Requests the next frame.
    fn request(&self, request: ViewRequest) -> FrameId;
    /// Drops all requested frames.
    fn drop_requests(&self);
    /// Replaces the scene for all frames that are requested from now on.
    fn replace_scene(&self, scene: Arc<Assets>);
}

impl Renderer for Farm {
    fn request(&self, request: ViewRequest) -> FrameId {
        Self::request(self, request)
    }

    fn drop_requests(&self) {
        self.drop_requests();
    }

    fn replace_scene(&self, scene: Arc<Assets>) {
        self.replace_scene(scene);
    }
}

/// The view of the display.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ViewState {
    /// Picture in the size of the display.
    pub(crate) request: ViewRequest,
    /// Number of times that the scene was replaced.
    pub(crate) scene: u64,
    /// Whether the display is minimised, unmapped or covered.
    pub(crate) hidden: bool,
    /// Whether the picture at rest is shown without most of its noise, if it is rendered in passes.
    pub(crate) denoised: bool,
}

/// Rules by which frames are requested.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RequestPolicy {
    /// Movement without input.
    pub(crate) animation: Animation,
    /// Number of frames after which the run ends.
    pub(crate) limit: Option<u64>,
    /// Whether frames are requested even if nothing has changed and the display is hidden, for measurements.
    pub(crate) continuous: bool,
}
