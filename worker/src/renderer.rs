//! The interface between a worker and a ray tracer. Tests and simulations implement it as well.

use std::ops::Range;
use std::sync::Arc;

use rayfarm_protocol::{AssetId, FrameAnnounce};

/// Numbers of rays traced for some rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Rays from the camera.
    pub primary: u64,
    /// Rays to lights.
    pub shadow: u64,
    /// Reflected and transmitted rays.
    pub secondary: u64,
}

/// Rendering ended early because it was cancelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cancelled;

/// Decoder of scenes and renderer of rows. Errors are texts, which the master receives as the reason of a failed frame.
///
/// All methods but [`render`](Self::render) run on blocking threads, never on a thread that serves the network. A panic
/// in any method is caught and becomes such a text. Long work polls `cancelled` between steps.
pub trait Renderer: Send + Sync + 'static {
    /// Decoded scene body without its parts.
    type Draft: Send + 'static;
    /// Decoded asset that a scene body names by hash: a mesh or a texture.
    type Part: Send + Sync + 'static;
    /// Compiled scene: a body with all its parts.
    type Scene: Send + Sync + 'static;
    /// Prepared frame of a scene, shared by the render threads.
    type Frame: Send + Sync + 'static;

    /// Name of the SIMD level, for the master's log.
    fn simd(&self) -> String;

    /// Number of rows in a band: bands begin at its multiples, and one thread renders a band.
    fn band_rows(&self, frame: &Self::Frame) -> u32;

    /// Decodes a scene body and lists the parts that it names.
    ///
    /// # Errors
    /// Bytes that are no scene; an invalid scene.
    fn decode_scene(&self, body: &[u8]) -> Result<(Self::Draft, Vec<AssetId>), String>;

    /// Decodes a part. Its bytes are freed afterwards.
    ///
    /// # Errors
    /// Bytes that are no part.
    fn decode_part(&self, bytes: &[u8]) -> Result<Self::Part, String>;

    /// Compiles a scene from its body and all its parts.
    ///
    /// # Errors
    /// Parts that do not match the body; a cancellation, whose text is discarded.
    fn compile(
        &self,
        draft: Self::Draft,
        parts: Vec<Arc<Self::Part>>,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self::Scene, String>;

    /// Prepares a frame of a scene. The view must match the announced size and the announced format.
    ///
    /// # Errors
    /// A view that cannot be rendered; a cancellation, whose text is discarded.
    fn prepare(
        &self,
        scene: Arc<Self::Scene>,
        announce: &FrameAnnounce,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<Self::Frame, String>;

    /// Whether every pixel of the frame has a colour of RGB 5-6-5, so that it takes two bytes on the wire. Only called for
    /// frames in [`PixelFormat::Rgb8`](rayfarm_protocol::PixelFormat::Rgb8).
    fn is_rgb565(&self, frame: &Self::Frame) -> bool;

    /// Renders rows into `out`, from top to bottom without gaps, in the announced
    /// [`PixelFormat`](rayfarm_protocol::PixelFormat).
    ///
    /// # Errors
    /// A cancellation. The content of `out` is unspecified then.
    fn render(
        &self,
        frame: &Self::Frame,
        rows: Range<u32>,
        out: &mut [u8],
        cancelled: &dyn Fn() -> bool,
    ) -> Result<RayCounts, Cancelled>;
}
