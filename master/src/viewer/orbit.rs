//! Animations: orbits of the camera about its look-at point, and rotation of the models.
//!
//! Sines and cosines are the tracer's own, so the same command line gives the same pictures on every platform.

use glam::DVec3;
use rayfarm_farm::ViewRequest;
use rayfarm_tracer::scene::rotation::sin_cos_degrees;
use rayfarm_tracer::scene::{Camera, FrameView};

/// Movements without input, as the command line offers them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Animation {
    /// Degrees by which the camera turns about its look-at point over all frames.
    pub(crate) orbit: f64,
    /// Degrees by which the models turn about y from each frame to the next.
    pub(crate) spin: f64,
    /// Number of frames of the orbit; at least 1.
    pub(crate) frames: u32,
}

impl Animation {
    /// Whether frames differ without input.
    pub(crate) fn is_moving(&self) -> bool {
        self.orbit != 0.0 || self.spin != 0.0
    }

    /// Request of frame `index` (from 0): `base` with the view of that frame.
    pub(crate) fn request(&self, base: &ViewRequest, index: u64) -> ViewRequest {
        ViewRequest { view: self.view(&base.view, index), ..*base }
    }

    /// View of frame `index` (from 0). Frame 0 is `base` itself, bit for bit.
    pub(crate) fn view(&self, base: &FrameView, index: u64) -> FrameView {
        let frames = f64::from(self.frames.max(1));
        let angle = self.orbit * index as f64 / frames;
        FrameView {
            camera: orbited(&base.camera, angle),
            spin: base.spin + self.spin * index as f64,
            ..*base
        }
    }
}

/// The camera after a turn about its look-at point by `degrees`, anticlockwise seen from above.
pub(crate) fn orbited(camera: &Camera, degrees: f64) -> Camera {
    if degrees == 0.0 {
        return *camera;
    }
    let axis = upright_axis(camera);
    let offset = rotated(camera.position - camera.look_at, axis, degrees);
    Camera { position: camera.look_at + offset, up: rotated(camera.up, axis, degrees), ..*camera }
}

/// Unit axis of orbits: +Y for a level camera, its own `up` for a rolled one.
///
/// A camera given by `rotation` has an `up` that tilts with its pitch. An orbit about that axis would tilt the horizon,
/// although both axes give the same picture at rest.
pub(crate) fn upright_axis(camera: &Camera) -> DVec3 {
    let forward = (camera.look_at - camera.position).normalize_or_zero();
    let upwards = |v: DVec3| v.reject_from_normalized(forward).try_normalize();
    let up = camera.up.normalize_or(DVec3::Y);
    match (upwards(DVec3::Y), upwards(up)) {
        (Some(level), Some(own)) if level.distance(own) < LEVEL_TOLERANCE => DVec3::Y,
        _ => up,
    }
}

/// Largest deviation of a level camera, in radians: far below a pixel, far above the rounding of a rotation's sines.
const LEVEL_TOLERANCE: f64 = 1e-6;

/// `v` rotated about the unit `axis` (Rodrigues' formula).
fn rotated(v: DVec3, axis: DVec3, degrees: f64) -> DVec3 {
    let (sin, cos) = sin_cos_degrees(degrees);
    v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rayfarm_tracer::scene::Quality;

    use rayfarm_tracer::scene::CameraKind;

    use super::*;

    fn camera(position: DVec3, look_at: DVec3, up: DVec3) -> Camera {
        Camera { position, look_at, up, fov: 40.0, zoom: 1.0, kind: CameraKind::PINHOLE }
    }

    fn base() -> FrameView {
        let camera = camera(DVec3::new(0.0, 1.0, 4.0), DVec3::new(0.0, 1.0, 0.0), DVec3::Y);
        FrameView {
            camera,
            width: 64,
            height: 48,
            samples: 1,
            spin: 0.0,
            quality: Quality::default(),
            ..FrameView::default()
        }
    }

    #[test]
    fn a_quarter_of_an_orbit_is_to_the_side_of_the_look_at_point() {
        let animation = Animation { orbit: 360.0, spin: 0.0, frames: 4 };
        let quarter = animation.view(&base(), 1).camera;
        assert!(quarter.position.distance(DVec3::new(4.0, 1.0, 0.0)) < 1e-12, "{}", quarter.position);
        assert_eq!(quarter.look_at, base().camera.look_at);
    }

    #[test]
    fn the_first_frame_is_the_scenes_view_and_spin_accumulates() {
        let animation = Animation { orbit: 90.0, spin: 2.5, frames: 10 };
        assert_eq!(animation.view(&base(), 0), base());
        assert_eq!(animation.view(&base(), 7).spin, 17.5);
    }

    #[test]
    fn a_pitched_camera_orbits_the_vertical() {
        let pitched = camera(DVec3::new(0.0, 3.0, 3.0), DVec3::ZERO, DVec3::new(0.0, 1.0, -1.0));
        assert_eq!(upright_axis(&pitched), DVec3::Y);
        assert!((orbited(&pitched, 77.0).position.y - 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_rolled_camera_orbits_its_own_up() {
        let rolled = camera(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, DVec3::X);
        assert_eq!(upright_axis(&rolled), DVec3::X);
    }

    #[test]
    fn a_camera_that_looks_straight_down_orbits_its_own_up() {
        let plan = camera(DVec3::new(0.0, 9.0, 0.0), DVec3::ZERO, DVec3::NEG_Z);
        assert_eq!(upright_axis(&plan), DVec3::NEG_Z);
        assert!(orbited(&plan, 45.0).position.is_finite());
    }

    proptest! {
        #[test]
        fn orbits_keep_the_distance(degrees in -1e6..1e6f64, x in -9.0..9.0f64, y in -9.0..9.0f64) {
            let before = camera(DVec3::new(x, y, 5.0), DVec3::ZERO, DVec3::Y);
            let after = orbited(&before, degrees);
            let error = after.position.distance(after.look_at) / before.position.distance(before.look_at) - 1.0;
            prop_assert!(error.abs() < 1e-12);
        }
    }
}
