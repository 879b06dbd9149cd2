//! The axes of a camera.

use glam::DVec3;

use crate::scene::Camera;

/// The axes of a camera in world space, right-handed: right x up = -forward.
#[derive(Clone, Copy, Debug)]
pub struct Basis {
    /// Unit vector into the picture.
    pub forward: DVec3,
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector to the top of the picture.
    pub up: DVec3,
}

impl Basis {
    /// The axes of a camera. Its `up` need not be perpendicular to its view direction.
    pub fn of(camera: &Camera) -> Self {
        let forward = (camera.look_at - camera.position).normalize_or(DVec3::NEG_Z);
        let sideways = forward.cross(camera.up.normalize_or(DVec3::Y));
        let right = sideways.try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        Self { forward, right, up: right.cross(forward) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::CameraKind;

    #[test]
    fn up_along_the_view_still_gives_axes() {
        let camera = Camera {
            position: DVec3::new(1.0, 2.0, 3.0),
            look_at: DVec3::new(1.0, 2.0, -5.0),
            up: DVec3::NEG_Z,
            fov: 90.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        };
        let Basis { forward, right, up } = Basis::of(&camera);
        assert!(forward.dot(right).abs() < 1e-12 && up.dot(right).abs() < 1e-12 && right.is_normalized());
    }
}
