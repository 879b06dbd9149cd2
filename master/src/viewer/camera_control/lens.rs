//! Magnification of a camera's picture, for every kind of camera.

use rayfarm_tracer::scene::{Camera, CameraKind};

/// Range of the magnification relative to the scene's camera.
const MAGNIFICATIONS: (f64, f64) = (1.0 / 64.0, 4096.0);
/// Range of the zoom that a scene may have.
const ZOOMS: (f64, f64) = (f64::MIN_POSITIVE, 1e30);
/// Range of the angles of a fisheye camera, in degrees.
const FISHEYE_ANGLES: (f64, f64) = (1.0, 360.0);

/// The magnification nearest to `wanted` that a camera supports, relative to the camera itself.
pub(super) fn limited(home: &Camera, wanted: f64) -> f64 {
    let (least, most) = match home.kind {
        CameraKind::Pinhole { .. } | CameraKind::Orthographic { .. } => {
            let (least, most) = (ZOOMS.0 / home.zoom, ZOOMS.1 / home.zoom);
            (MAGNIFICATIONS.0.max(least), MAGNIFICATIONS.1.min(most))
        }
        CameraKind::Fisheye => (home.fov / FISHEYE_ANGLES.1, home.fov / FISHEYE_ANGLES.0),
    };
    wanted.clamp(least.min(1.0), most.max(1.0))
}

/// The camera with a magnified picture: `zoom` is multiplied, and the angle of a fisheye camera, which has no zoom, divided.
pub(super) fn magnified(home: &Camera, by: f64) -> Camera {
    match home.kind {
        CameraKind::Pinhole { .. } | CameraKind::Orthographic { .. } => {
            Camera { zoom: home.zoom * by, ..*home }
        }
        CameraKind::Fisheye => Camera { fov: (home.fov / by).min(FISHEYE_ANGLES.1), ..*home },
    }
}
