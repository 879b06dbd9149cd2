//! What a worker needs of a ray tracer, and nothing more: tests and simulations put in their own.

use std::ops::Range;
use std::sync::Arc;

use rayfarm_protocol::{AssetId, FrameAnnounce};

/// Rays traced for some rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// From the camera.
    pub primary: u64,
    /// Towards lights.
    pub shadow: u64,
    /// Reflected and transmitted.
    pub secondary: u64,
}

/// Rendering was told to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cancelled;

/// Bytes in, pixels out. Errors are texts for people: they travel to the master as the reason of a failure.
///
/// Everything but [`render`](Self::render) runs on a blocking thread, never on one that serves the network. A panic
/// anywhere is caught, and becomes such a reason. What takes its time asks `cancelled` now and then.
pub trait Renderer: Send + Sync + 'static {
    /// A scene body, decoded, before its parts are there.
    type Draft: Send + 'static;
    /// What a scene names by hash: a mesh, a texture.
    type Part: Send + Sync + 'static;
    /// A scene with its parts.
    type Scene: Send + Sync + 'static;
    /// One frame of it, shared by the render threads.
    type Frame: Send + Sync + 'static;

    /// The SIMD level, for the master's log.
    fn simd(&self) -> String;

    /// Most rows of a frame that should be rendered in one go; bands begin on multiples of it.
    fn band_rows(&self, frame: &Self::Frame) -> u32;

    /// Decodes a scene body, and names the parts it needs.
    ///
    /// # Errors
    /// Bytes that are no scene, or one that breaks a rule.
    fn decode_scene(&self, body: &[u8]) -> Result<(Self::Draft, Vec<AssetId>), String>;

    /// Takes a part in. The bytes are freed afterwards.
    ///
    /// # Errors
    /// Bytes that are no part of any kind.
    fn decode_part(&self, bytes: &[u8]) -> Result<Self::Part, String>;

    /// Puts a scene and all its parts together.
    ///
    /// # Errors
    /// When they do not fit; or when `cancelled` says so, then the text is of no use.
    fn compile(
        &self,
        draft: Self::Draft,
        parts: Vec<Arc<Self::Part>>,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self::Scene, String>;

    /// Prepares a frame: its view is decoded, and must agree with the announced size.
    ///
    /// # Errors
    /// A view that cannot be rendered; or when `cancelled` says so, then the text is of no use.
    fn prepare(
        &self,
        scene: Arc<Self::Scene>,
        announce: &FrameAnnounce,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self::Frame, String>;

    /// Whether every pixel of this frame has one of the colours that take two bytes on the wire.
    fn is_narrow(&self, frame: &Self::Frame) -> bool;

    /// Renders rows into `out`: `rows.len() * width * 3` bytes, RGB8, sRGB.
    ///
    /// # Errors
    /// When `cancelled` said so; what `out` holds then is worth nothing.
    fn render(
        &self,
        frame: &Self::Frame,
        rows: Range<u32>,
        out: &mut [u8],
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Counts, Cancelled>;
}
