//! The lens of a pinhole camera.

use serde::{Deserialize, Serialize};

/// A thin lens. Only the path integrator and pinhole cameras have one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lens {
    /// Radius in world units; 0 is a pinhole.
    pub aperture: f64,
    /// Distance of the sharp plane along the camera's axis, in world units; `None` is the distance of the point that the camera looks
    /// at.
    pub focus_distance: Option<f64>,
}
