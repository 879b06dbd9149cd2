//! The path of a camera.

use glam::DVec3;

use super::Curve;
use crate::rotation::sin_cos_degrees;
use crate::scene::data::Camera;

/// The path of a camera over time. What it does not describe is that of the scene's camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraPath {
    /// World position.
    pub(in crate::scene) position: Option<Curve>,
    /// The point at the centre of the picture.
    pub(in crate::scene) look_at: Option<Curve>,
    /// Field of view in degrees, as x.
    pub(in crate::scene) fov: Option<Curve>,
    /// Zoom, as x.
    pub(in crate::scene) zoom: Option<Curve>,
    /// Degrees by which the camera rolls about its axis, anticlockwise seen from behind, as x.
    pub(in crate::scene) roll: Option<Curve>,
    /// Whether the camera keeps its direction where only its position has keys; otherwise it keeps looking at its point.
    pub(in crate::scene) keeps_direction: bool,
}

impl CameraPath {
    /// Whether the camera is the same at all times.
    pub fn is_empty(&self) -> bool {
        let Self { position, look_at, fov, zoom, roll, .. } = self;
        [position, look_at, fov, zoom, roll].into_iter().all(Option::is_none)
    }

    /// The camera at a time, in seconds. `base` is the scene's camera.
    pub fn camera(&self, base: &Camera, time: f64) -> Camera {
        let at = |curve: &Option<Curve>| curve.as_ref().map(|curve| curve.at(time));
        let position = at(&self.position).unwrap_or(base.position);
        let kept = match self.keeps_direction {
            true => base.look_at + (position - base.position),
            false => base.look_at,
        };
        let camera = Camera {
            position,
            look_at: at(&self.look_at).unwrap_or(kept),
            fov: at(&self.fov).map_or(base.fov, |fov| fov.x),
            zoom: at(&self.zoom).map_or(base.zoom, |zoom| zoom.x),
            ..*base
        };
        match at(&self.roll) {
            Some(roll) if roll.x != 0.0 => Camera { up: rolled(&camera, roll.x), ..camera },
            _ => camera,
        }
    }
}

/// The up direction after a roll about the axis from the point that the camera looks at towards the camera.
fn rolled(camera: &Camera, degrees: f64) -> DVec3 {
    let backward = (camera.position - camera.look_at).normalize_or_zero();
    let (sin, cos) = sin_cos_degrees(degrees);
    let up = camera.up;
    // Rodrigues' formula.
    up * cos + backward.cross(up) * sin + backward * (backward.dot(up) * (1.0 - cos))
}

#[cfg(test)]
mod tests {
    use super::super::Shape;
    use super::*;
    use crate::rotation;

    fn curve(values: &[(f64, DVec3)]) -> Option<Curve> {
        Curve::new(Shape::Round, values)
    }

    const BASE: Camera = Camera {
        position: DVec3::new(0.0, 0.0, 5.0),
        look_at: DVec3::ZERO,
        up: DVec3::Y,
        fov: 40.0,
        zoom: 1.0,
        kind: crate::scene::CameraKind::PINHOLE,
    };

    #[test]
    fn an_empty_path_is_the_scenes_camera() {
        let path = CameraPath::default();
        assert!(path.is_empty());
        assert_eq!(path.camera(&BASE, 3.0), BASE);
    }

    #[test]
    fn a_position_alone_keeps_the_point_or_the_direction() {
        let position = curve(&[(0.0, BASE.position), (2.0, DVec3::new(4.0, 0.0, 5.0))]);
        let path = CameraPath { position, ..CameraPath::default() };
        let half = path.camera(&BASE, 1.0);
        assert_eq!((half.position, half.look_at), (DVec3::new(2.0, 0.0, 5.0), DVec3::ZERO));
        let path = CameraPath { keeps_direction: true, ..path };
        assert_eq!(path.camera(&BASE, 1.0).look_at, DVec3::X * 2.0);
    }

    #[test]
    fn a_roll_is_that_of_a_camera_given_by_its_rotation() {
        for degrees in [90.0, 30.0, -77.0] {
            let roll = curve(&[(0.0, DVec3::X * degrees), (1.0, DVec3::X * degrees)]);
            let path = CameraPath { roll, ..CameraPath::default() };
            let expected = rotation::of_camera(0.0, 0.0, degrees) * DVec3::Y;
            assert!(path.camera(&BASE, 0.5).up.distance(expected) < 1e-12);
        }
    }
}
