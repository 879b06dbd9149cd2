//! A finished frame.

use std::time::Duration;

use rayfarm_protocol::FrameId;
use rayfarm_tracer::scene::FrameView;

use crate::accounting::FrameAccount;
use crate::framebuffer::FramePixels;
use crate::view_request::ViewRequest;

pub use rayfarm_protocol::Cost as FrameCounts;

/// A completed picture with its costs.
#[derive(Debug)]
pub struct FinishedFrame {
    /// Number of the request that it answers.
    pub frame: FrameId,
    /// The request that it answers.
    pub request: ViewRequest,
    /// The rendered view: the requested one at its scale.
    pub view: FrameView,
    /// RGB8 sRGB rows, top to bottom: `view.width * view.height * 3` bytes.
    pub pixels: FramePixels,
    /// The costs of the picture's segments, summed: nanoseconds over all threads, and rays by kind. Each row counts once,
    /// even if several workers rendered it.
    pub counts: FrameCounts,
    /// Time from the start of the frame to its last row.
    pub elapsed: Duration,
    /// Time from the request to the last row: the age of the camera in the picture.
    pub latency: Duration,
    /// Workers that were connected when the frame completed.
    pub workers: u32,
    /// Render threads of these workers together.
    pub threads: u32,
    /// Bytes sent to all workers since the previous frame completed.
    pub sent_bytes: u64,
    /// Bytes received from all workers since the previous frame completed.
    pub received_bytes: u64,
    /// The part of `sent_bytes` that describes what to draw: frame announcements and assets.
    pub scene_bytes: u64,
    /// Thread time of the workers since the previous frame, by use, and the worker of each row.
    pub account: FrameAccount,
}
