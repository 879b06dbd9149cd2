//! Rays of the camera.

use std::f64::consts::PI;

use glam::DVec3;

use super::Oracle;
use crate::scene::{CameraKind, FovAxis};

/// A ray in world space relative to the camera's position.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub origin: DVec3,
    /// Unit length.
    pub direction: DVec3,
    /// Place of its sample in a pattern of 2 x 2 samples of the picture: 0 and 1 in even rows, 2 and 3 in odd ones.
    pub place: usize,
    /// Length of the way from the camera to the origin, over all bounces.
    pub before: f64,
}

/// A ray of the camera.
pub(super) struct CameraRay {
    pub ray: Ray,
    /// Whether it is in the picture: outside of the circle of a fisheye camera is only the background, by the same formula with
    /// angles limited to half a turn.
    pub in_picture: bool,
}

impl Oracle {
    /// The ray through a point of the picture, in pixels from its top left corner.
    pub(super) fn camera_ray(&self, sx: f64, sy: f64) -> CameraRay {
        let camera = &self.view.camera;
        let (width, height) = (f64::from(self.view.width), f64::from(self.view.height));
        let forward = (camera.look_at - camera.position).normalize();
        let right = forward.cross(camera.up).normalize();
        let up = right.cross(forward);
        // Both from -1 to 1, to the right and upwards.
        let (x, y) = (2.0 * sx / width - 1.0, 1.0 - 2.0 * sy / height);
        let grid = f64::from(self.view.samples.isqrt());
        let [column, row] = [sx, sy].map(|along| (along * grid).floor().rem_euclid(2.0) as usize);
        let seen = |origin: DVec3, direction: DVec3| CameraRay {
            ray: Ray { origin, direction: direction.normalize(), place: column + 2 * row, before: 0.0 },
            in_picture: true,
        };
        match camera.kind {
            CameraKind::Pinhole { fov_axis } => {
                let half = libm::tan(camera.fov.to_radians() / 2.0) / camera.zoom;
                let (half_width, half_height) = match fov_axis {
                    FovAxis::Vertical => (half * width / height, half),
                    FovAxis::Horizontal => (half, half * height / width),
                };
                seen(DVec3::ZERO, forward + right * (x * half_width) + up * (y * half_height))
            }
            CameraKind::Orthographic { view_height } => {
                let half_height = view_height / camera.zoom / 2.0;
                let half_width = half_height * width / height;
                seen(right * (x * half_width) + up * (y * half_height), forward)
            }
            CameraKind::Fisheye => {
                let smaller = width.min(height);
                let across = right * (x * width / smaller) + up * (y * height / smaller);
                let r = across.length();
                let theta = (r * camera.fov.to_radians() / 2.0).min(PI);
                let direction = forward * libm::cos(theta) + across.normalize_or_zero() * libm::sin(theta);
                CameraRay { in_picture: r <= 1.0, ..seen(DVec3::ZERO, direction) }
            }
        }
    }
}
