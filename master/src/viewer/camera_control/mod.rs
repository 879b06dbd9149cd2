//! Control of the camera: movements to a camera, without a window.
//!
//! The camera is kept as a position, three angles, a distance to its look-at point and a magnification. A movement goes as far
//! as speed times time, so it is the same on a slow farm as on a fast one; speeds follow from the size of the scene.

mod lens;

use glam::DVec3;
use rayfarm_tracer::scene::{Camera, CameraKind};

use super::orbit::upright_axis;

/// Speed of movements, in scene sizes per second.
const MOVE_PER_SECOND: f64 = 0.3;
const LOOK_RADIANS_PER_SECOND: f64 = 1.0;
const ROLL_RADIANS_PER_SECOND: f64 = 1.0;
/// Factor of the picture's size per second.
const MAGNIFIED_PER_SECOND: f64 = 2.0;
/// A drag over the window's whole height turns by half a circle.
const DRAG_RADIANS: f64 = std::f64::consts::PI;
/// Factor of the distance to the look-at point per notch of the wheel.
const WHEEL_FACTOR: f64 = 0.88;
/// Longest time of one step: a pause (a suspended machine, a moved window) must not throw the camera across the scene.
const LONGEST_STEP_SECONDS: f64 = 0.1;
/// Steepest pitch, so that the camera cannot flip over the pole.
const STEEPEST: f64 = 89.0 * std::f64::consts::PI / 180.0;
/// Largest distance from the scene's camera, in scene sizes: beyond it nothing can be seen.
const LEASH: f64 = 1e4;
/// Range of distances to the look-at point, in scene sizes.
const DISTANCES: (f64, f64) = (1e-4, 1e3);

/// A camera under control of the displays.
#[derive(Clone, Debug)]
pub(crate) struct CameraControl {
    home: Camera,
    /// Camera of a scene that has replaced the first one.
    next_home: Option<Camera>,
    /// `None` until a movement, so that the untouched camera is the scene's own, bit for bit.
    pose: Option<Pose>,
    frame: Frame,
    scene_size: f64,
}

impl CameraControl {
    /// Control that starts at `home`. `bounds` are those of everything finite in the scene.
    pub(crate) fn new(home: Camera, bounds: Option<(DVec3, DVec3)>) -> Self {
        Self {
            home,
            next_home: None,
            pose: None,
            frame: Frame::of(&home),
            scene_size: scene_size(&home, bounds),
        }
    }

    /// The current camera.
    pub(crate) fn camera(&self) -> Camera {
        match &self.pose {
            None => self.home,
            Some(pose) => Camera {
                position: pose.position,
                look_at: pose.look_at(&self.frame),
                up: pose.up(&self.frame),
                ..lens::magnified(&self.home, pose.magnification)
            },
        }
    }

    /// Restores the scene's camera.
    pub(crate) fn reset(&mut self) {
        if let Some(home) = self.next_home.take() {
            (self.home, self.frame) = (home, Frame::of(&home));
        }
        self.pose = None;
    }

    /// Sets the camera that the next reset restores. The current camera remains.
    pub(crate) fn set_home(&mut self, home: Camera) {
        self.next_home = Some(home);
    }

    /// Moves camera and look-at point for `seconds`. `direction` is right, up and forward, each in -1..=1.
    pub(crate) fn fly(&mut self, direction: DVec3, seconds: f64) {
        let direction = DVec3::from_array(direction.to_array().map(finite));
        if direction != DVec3::ZERO {
            let distance = step_seconds(seconds) * MOVE_PER_SECOND * self.scene_size;
            self.change(|pose, frame, _| pose.fly(direction, frame, distance));
        }
    }

    /// Turns the camera in place for `seconds`. `right` and `up` are in -1..=1.
    pub(crate) fn look(&mut self, right: f64, up: f64, seconds: f64) {
        let (right, up) = (finite(right), finite(up));
        if (right, up) != (0.0, 0.0) {
            let radians = step_seconds(seconds) * LOOK_RADIANS_PER_SECOND;
            self.change(|pose, _, _| pose.turn(right * radians, up * radians));
        }
    }

    /// Turns the camera about its look-at point by a drag, in heights of the display.
    pub(crate) fn orbit(&mut self, right: f64, down: f64) {
        let (right, down) = (finite(right), finite(down));
        if (right, down) != (0.0, 0.0) {
            self.change(|pose, frame, _| pose.orbit(right, down, frame));
        }
    }

    /// Rolls the camera about its view direction for `seconds`. `right` is in -1..=1; rolled to the right, the picture turns to
    /// the left.
    pub(crate) fn roll(&mut self, right: f64, seconds: f64) {
        let right = finite(right);
        if right != 0.0 {
            let radians = step_seconds(seconds) * ROLL_RADIANS_PER_SECOND;
            self.change(|pose, _, _| {
                pose.roll = (pose.roll + right * radians).rem_euclid(std::f64::consts::TAU);
            });
        }
    }

    /// Magnifies the picture for `seconds`. `inwards` is in -1..=1.
    pub(crate) fn magnify(&mut self, inwards: f64, seconds: f64) {
        let inwards = finite(inwards).clamp(-1.0, 1.0);
        if inwards != 0.0 {
            self.magnify_by(libm::pow(MAGNIFIED_PER_SECOND, inwards * step_seconds(seconds)));
        }
    }

    /// Moves the camera towards its look-at point by notches of a wheel; negative ones move it away. The picture of an
    /// orthographic camera does not change with its distance, and is magnified instead.
    pub(crate) fn zoom(&mut self, notches: f64) {
        let notches = finite(notches).clamp(-100.0, 100.0);
        if notches == 0.0 {
            return;
        }
        match self.home.kind {
            CameraKind::Orthographic { .. } => self.magnify_by(libm::pow(WHEEL_FACTOR, -notches)),
            CameraKind::Pinhole { .. } | CameraKind::Fisheye => {
                self.change(|pose, frame, scene_size| pose.approach(notches, frame, scene_size));
            }
        }
    }

    fn magnify_by(&mut self, factor: f64) {
        let home = self.home;
        self.change(|pose, _, _| pose.magnification = lens::limited(&home, pose.magnification * factor));
    }

    fn change(&mut self, change: impl FnOnce(&mut Pose, &Frame, f64)) {
        let mut pose = self.pose.unwrap_or_else(|| Pose::of(&self.home, &self.frame));
        change(&mut pose, &self.frame, self.scene_size);
        pose.position = leashed(pose.position, self.home.position, LEASH * self.scene_size);
        self.pose = Some(pose);
    }
}

/// Orthonormal directions from which the angles are measured.
#[derive(Clone, Copy, Debug)]
struct Frame {
    up: DVec3,
    /// Viewing direction at yaw 0 and pitch 0.
    ahead: DVec3,
    /// Direction to the right of `ahead`.
    right: DVec3,
}

impl Frame {
    fn of(camera: &Camera) -> Self {
        let up = upright_axis(camera);
        let forward = camera.look_at - camera.position;
        let ahead = forward.reject_from_normalized(up).try_normalize().unwrap_or(up.any_orthonormal_vector());
        Self { up, ahead, right: ahead.cross(up) }
    }

    /// Unit direction of two angles in radians.
    fn direction(&self, yaw: f64, pitch: f64) -> DVec3 {
        let ((sin_yaw, cos_yaw), (sin_pitch, cos_pitch)) = (libm::sincos(yaw), libm::sincos(pitch));
        (self.ahead * cos_yaw + self.right * sin_yaw) * cos_pitch + self.up * sin_pitch
    }

    /// Unit direction to the right of a camera with this yaw.
    fn rightwards(&self, yaw: f64) -> DVec3 {
        let (sin, cos) = libm::sincos(yaw);
        self.right * cos - self.ahead * sin
    }
}

/// Position and direction of the camera, and the magnification of its picture.
#[derive(Clone, Copy, Debug)]
struct Pose {
    position: DVec3,
    /// Radians to the right of the frame's `ahead`.
    yaw: f64,
    /// Radians above the horizon.
    pitch: f64,
    /// Distance to the look-at point.
    distance: f64,
    /// Radians about the view direction, to the right.
    roll: f64,
    /// Relative to the scene's camera.
    magnification: f64,
}

impl Pose {
    fn of(camera: &Camera, frame: &Frame) -> Self {
        let forward = camera.look_at - camera.position;
        let distance = forward.length();
        let pitch = libm::asin((forward.dot(frame.up) / distance).clamp(-1.0, 1.0));
        Self {
            position: camera.position,
            yaw: 0.0,
            pitch: finite(pitch).clamp(-STEEPEST, STEEPEST),
            distance,
            roll: 0.0,
            magnification: 1.0,
        }
    }

    /// The up direction of the camera.
    fn up(&self, frame: &Frame) -> DVec3 {
        let (sin, cos) = libm::sincos(self.roll);
        let forward = self.direction(frame);
        let along = forward * forward.dot(frame.up);
        along + (frame.up - along) * cos + forward.cross(frame.up) * sin
    }

    /// A movement to the right and upwards in the picture, as it is for the camera without its roll.
    fn without_roll(&self, right: f64, up: f64) -> (f64, f64) {
        let (sin, cos) = libm::sincos(self.roll);
        (right * cos + up * sin, up * cos - right * sin)
    }

    fn direction(&self, frame: &Frame) -> DVec3 {
        frame.direction(self.yaw, self.pitch)
    }

    fn look_at(&self, frame: &Frame) -> DVec3 {
        self.position + self.direction(frame) * self.distance
    }

    fn fly(&mut self, direction: DVec3, frame: &Frame, distance: f64) {
        let (right, up) = self.without_roll(direction.x, direction.y);
        let movement =
            self.direction(frame) * direction.z + frame.rightwards(self.yaw) * right + frame.up * up;
        self.position += movement.clamp_length_max(1.0) * distance;
    }

    /// Turns about the look-at point, which keeps its position: the scene follows the mouse.
    fn orbit(&mut self, right: f64, down: f64, frame: &Frame) {
        let centre = self.look_at(frame);
        self.turn(right * DRAG_RADIANS, -down * DRAG_RADIANS);
        self.position = centre - self.direction(frame) * self.distance;
    }

    /// Moves towards the look-at point, which keeps its position.
    fn approach(&mut self, notches: f64, frame: &Frame, scene_size: f64) {
        let centre = self.look_at(frame);
        let (nearest, farthest) = (DISTANCES.0 * scene_size, DISTANCES.1 * scene_size);
        let wanted = self.distance * libm::pow(WHEEL_FACTOR, notches);
        self.distance = wanted.clamp(nearest.min(self.distance), farthest.max(self.distance));
        self.position = centre - self.direction(frame) * self.distance;
    }

    /// Turns to the right and upwards in the picture, by radians.
    fn turn(&mut self, right: f64, up: f64) {
        let (yaw, pitch) = self.without_roll(right, up);
        self.yaw = (self.yaw + yaw).rem_euclid(std::f64::consts::TAU);
        self.pitch = (self.pitch + pitch).clamp(-STEEPEST, STEEPEST);
    }
}

/// Unit of movements: the size of everything finite, held near what the camera shows, so that a close-up in a large scene
/// and a scene on a huge floor can both be controlled.
fn scene_size(home: &Camera, bounds: Option<(DVec3, DVec3)>) -> f64 {
    let in_view = match home.kind {
        CameraKind::Orthographic { view_height } => view_height / home.zoom,
        CameraKind::Pinhole { .. } | CameraKind::Fisheye => 2.0 * home.position.distance(home.look_at),
    };
    let size = bounds.map_or(in_view, |(low, high)| (high - low).length());
    if size.is_finite() && size > 0.0 { in_view.clamp(size / 20.0, size) } else { in_view }
}

fn leashed(position: DVec3, home: DVec3, leash: f64) -> DVec3 {
    home + (position - home).clamp_length_max(leash)
}

/// Time that a step counts for.
fn step_seconds(seconds: f64) -> f64 {
    finite(seconds).clamp(0.0, LONGEST_STEP_SECONDS)
}

fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}

#[cfg(test)]
mod tests;
