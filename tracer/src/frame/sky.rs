//! What rays that hit nothing see.

use glam::Vec3;

use crate::rotation::sin_cos_degrees;
use crate::scene::{Background, Scene};

/// The background as rays of the camera see it.
pub(super) fn seen_background(scene: &Scene) -> Background {
    if scene.background_visible { scene.background } else { Background::Color(Vec3::ZERO) }
}

/// Sine and cosine of the rotation of a sky.
pub(super) fn sky_rotation(scene: &Scene) -> [f32; 2] {
    let Background::Sky(sky) = scene.background else { return [0.0, 1.0] };
    let (sin, cos) = sin_cos_degrees(sky.rotate);
    [sin as f32, cos as f32]
}
