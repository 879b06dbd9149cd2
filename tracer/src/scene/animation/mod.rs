//! Animation over frames: smooth curves through keys, and the path of a camera.
//!
//! ```text
//! curve    values at times, and the curve through them
//! camera   the camera at a time
//! ```
//!
//! Objects that have keys are placed where the scene file is read: see [`SceneAnimation`](crate::scene::SceneAnimation).

mod camera;
mod curve;

pub use camera::CameraPath;
pub(super) use curve::{Curve, Shape};
