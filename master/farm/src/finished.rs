//! A finished frame.

use std::time::Duration;

use rayfarm_protocol::FrameId;
use rayfarm_tracer::scene::FrameView;

use crate::accounting::FrameAccount;
use crate::framebuffer::FramePixels;

pub use rayfarm_protocol::Cost as FrameCounts;

/// A completed picture and what it took.
#[derive(Debug)]
pub struct FinishedFrame {
    /// Which request this is.
    pub frame: FrameId,
    /// What was asked for.
    pub view: FrameView,
    /// RGB8 sRGB rows, top to bottom: `view.width * view.height * 3` bytes.
    pub pixels: FramePixels,
    /// What the segments of the picture took, summed: nanoseconds of tracing over all threads, and rays by kind.
    /// Each row counts once, however many workers rendered it.
    pub counts: FrameCounts,
    /// From the moment the frame began to its last row.
    pub elapsed: Duration,
    /// From the request to the last row: how old the camera is that the picture shows.
    pub latency: Duration,
    /// Workers connected when it completed.
    pub workers: u32,
    /// Render threads of these workers together.
    pub threads: u32,
    /// Bytes sent to all workers since the frame before.
    pub sent_bytes: u64,
    /// Bytes received from all workers since the frame before.
    pub received_bytes: u64,
    /// The part of `sent_bytes` that describes what to draw: frame announcements and assets.
    pub scene_bytes: u64,
    /// What the workers did with their time since the frame before, and who rendered what.
    pub account: FrameAccount,
}
