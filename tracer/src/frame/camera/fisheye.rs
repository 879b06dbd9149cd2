//! The equidistant fisheye camera.
//!
//! A place at the distance r from the picture's centre, in units of half the smaller side, shows the direction at the angle
//! theta = r fov / 2 from the view axis, towards the place: the places of equal angles are circles with equal steps of r (Kannala
//! and Brandt, "A Generic Camera Model and Calibration Method for Conventional, Wide-Angle, and Fish-Eye Lenses", 2006, table 1).

use glam::DVec3;

use super::Basis;
use crate::scene::FrameView;

/// Directions of the rays of a fisheye camera. All rays start at the origin of eye space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FisheyeRays {
    basis: Basis,
    /// The picture's centre, in pixels.
    center: [f64; 2],
    /// Radius of the circle, in pixels.
    radius: f64,
    /// Angle at the rim of the circle, in radians.
    half_angle: f64,
    /// Samples along a side of a pixel.
    grid: u32,
}

/// A ray of a fisheye camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FisheyeRay {
    /// Unit direction. Outside of the circle that of the same formula, with theta limited to half a turn.
    pub direction: DVec3,
    /// Whether the place is in the circle. Rays outside of it hit nothing.
    pub in_circle: bool,
}

impl FisheyeRays {
    /// The rays of a view.
    pub(super) fn new(view: &FrameView) -> Self {
        Self {
            basis: Basis::of(&view.camera),
            center: [view.width, view.height].map(|side| f64::from(side) / 2.0),
            radius: f64::from(view.width.min(view.height)) / 2.0,
            half_angle: view.camera.fov.to_radians() / 2.0,
            grid: view.grid(),
        }
    }

    /// Samples along a side of a pixel.
    pub(crate) fn grid(&self) -> u32 {
        self.grid
    }

    /// The ray through a place of the picture, in pixels from its top left corner.
    pub(crate) fn through(&self, across: f64, along: f64) -> FisheyeRay {
        let Basis { forward, right, up } = self.basis;
        let (x, y) = (across - self.center[0], self.center[1] - along);
        let distance = (x * x + y * y).sqrt();
        if distance == 0.0 {
            return FisheyeRay { direction: forward, in_circle: true };
        }
        let theta = (distance / self.radius * self.half_angle).min(std::f64::consts::PI);
        let (sin, cos) = libm::sincos(theta);
        let outwards = (right * x + up * y) / distance;
        FisheyeRay { direction: forward * cos + outwards * sin, in_circle: distance <= self.radius }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, CameraKind, Quality};

    fn rays(width: u32, height: u32, fov: f64) -> FisheyeRays {
        let camera = Camera {
            position: DVec3::new(1.0, 2.0, 3.0),
            look_at: DVec3::new(1.0, 2.0, -5.0),
            up: DVec3::Y,
            fov,
            zoom: 1.0,
            kind: CameraKind::Fisheye,
        };
        let quality = Quality::default();
        FisheyeRays::new(&FrameView {
            camera,
            width,
            height,
            samples: 1,
            spin: 0.0,
            quality,
            ..FrameView::default()
        })
    }

    fn close(ray: FisheyeRay, direction: DVec3) -> bool {
        ray.direction.distance(direction) < 1e-12
    }

    #[test]
    fn half_a_turn_shows_what_is_at_right_angles_on_the_rim() {
        let rays = rays(6, 4, 180.0);
        let places = [(3.0, 0.0), (3.0, 4.0), (1.0, 2.0), (5.0, 2.0)];
        for ((x, y), direction) in places.into_iter().zip([DVec3::Y, DVec3::NEG_Y, DVec3::NEG_X, DVec3::X]) {
            let ray = rays.through(x, y);
            assert!(close(ray, direction) && ray.in_circle, "({x}, {y}): {ray:?}");
        }
        assert!(close(rays.through(3.0, 2.0), DVec3::NEG_Z));
    }

    #[test]
    fn angles_grow_in_proportion_to_the_distance() {
        let rays = rays(4, 8, 120.0);
        // Half of the way to the rim: 30 degrees.
        let (sin, cos) = (0.5, libm::sqrt(0.75));
        assert!(close(rays.through(2.0, 3.0), DVec3::new(0.0, sin, -cos)));
        let slanted = rays.through(2.0 + libm::sqrt(0.5), 4.0 + libm::sqrt(0.5));
        let side = sin * libm::sqrt(0.5);
        assert!(close(slanted, DVec3::new(side, -side, -cos)), "{slanted:?}");
    }

    #[test]
    fn corners_are_outside_of_the_circle_and_never_beyond_half_a_turn() {
        for fov in [10.0, 180.0, 360.0] {
            let corner = rays(4, 4, fov).through(0.0, 0.0);
            assert!(!corner.in_circle && corner.direction.is_normalized());
            let theta = (fov.to_radians() / 2.0 * libm::sqrt(2.0)).min(std::f64::consts::PI);
            assert!((corner.direction.dot(DVec3::NEG_Z) - libm::cos(theta)).abs() < 1e-12, "{fov}");
        }
        // The whole rim of a full turn is the direction backwards.
        assert!(close(rays(4, 4, 360.0).through(0.0, 2.0), DVec3::Z));
    }
}
