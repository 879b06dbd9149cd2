//! Keys and mouse to a camera: pure, so it can be tested without a window.
//!
//! The camera is kept as a place, two angles and a distance to the point it looks at. A held key moves it by speed
//! times elapsed time, so it goes as far on a slow farm as on a fast one; speeds follow from the scene's size.

use glam::DVec3;
use rayfarm_tracer::scene::Camera;

use crate::viewer::orbit::upright_axis;

/// Keys that move the camera while they are held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Held {
    /// W.
    pub(crate) forward: bool,
    /// S.
    pub(crate) back: bool,
    /// A.
    pub(crate) left: bool,
    /// D.
    pub(crate) right: bool,
    /// E.
    pub(crate) up: bool,
    /// Q.
    pub(crate) down: bool,
    /// Left arrow.
    pub(crate) look_left: bool,
    /// Right arrow.
    pub(crate) look_right: bool,
    /// Up arrow.
    pub(crate) look_up: bool,
    /// Down arrow.
    pub(crate) look_down: bool,
}

/// What the user did since the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Input {
    /// Keys held.
    pub(crate) held: Held,
    /// How far the mouse was dragged, as shares of the window's height: right and down are positive.
    pub(crate) drag: (f64, f64),
    /// Notches of the wheel; away from the user is positive and goes nearer.
    pub(crate) wheel: f64,
    /// R was pressed.
    pub(crate) reset: bool,
}

/// The share of the scene's size that a held key moves by in a second.
const MOVE_PER_SECOND: f64 = 0.3;
const LOOK_RADIANS_PER_SECOND: f64 = 1.0;
/// A drag over the window's whole height turns by half a circle.
const DRAG_RADIANS: f64 = std::f64::consts::PI;
/// What one notch of the wheel leaves of the distance.
const WHEEL_FACTOR: f64 = 0.88;
/// A pause (a suspended machine, a moved window) must not throw the camera across the scene.
const LONGEST_STEP_SECONDS: f64 = 0.1;
/// The camera never looks steeper than this, so that it cannot flip over the pole.
const STEEPEST: f64 = 89.0 * std::f64::consts::PI / 180.0;
/// How far from where it began the camera may go, in scene sizes: beyond it there is nothing to see.
const LEASH: f64 = 1e4;
/// The range of distances to the look-at point, in scene sizes.
const DISTANCES: (f64, f64) = (1e-4, 1e3);

/// A camera that listens to keys and mouse.
#[derive(Clone, Debug)]
pub(crate) struct CameraControl {
    home: Camera,
    /// `None` until something moves it, so that the untouched camera is the scene's own, bit for bit.
    pose: Option<Pose>,
    frame: Frame,
    scene_size: f64,
}

impl CameraControl {
    /// `bounds` are those of everything finite in the scene.
    pub(crate) fn new(home: Camera, bounds: Option<(DVec3, DVec3)>) -> Self {
        Self { home, pose: None, frame: Frame::of(&home), scene_size: scene_size(&home, bounds) }
    }

    /// The camera as it stands now.
    pub(crate) fn camera(&self) -> Camera {
        match &self.pose {
            None => self.home,
            Some(pose) => Camera {
                position: pose.position,
                look_at: pose.look_at(&self.frame),
                up: self.frame.up,
                ..self.home
            },
        }
    }

    /// Moves the camera by what happened within the last `seconds`.
    pub(crate) fn step(&mut self, input: &Input, seconds: f64) {
        if input.reset {
            self.pose = None;
        }
        let still = Input { reset: input.reset, ..Input::default() };
        if *input == still {
            return;
        }
        let seconds = if seconds.is_finite() { seconds.clamp(0.0, LONGEST_STEP_SECONDS) } else { 0.0 };
        let mut pose = self.pose.unwrap_or_else(|| Pose::of(&self.home, &self.frame));
        pose.fly(&input.held, &self.frame, seconds * MOVE_PER_SECOND * self.scene_size);
        pose.look(&input.held, seconds * LOOK_RADIANS_PER_SECOND);
        pose.orbit(finite(input.drag.0), finite(input.drag.1), &self.frame);
        pose.approach(finite(input.wheel), &self.frame, self.scene_size);
        pose.position = leashed(pose.position, self.home.position, LEASH * self.scene_size);
        self.pose = Some(pose);
    }
}

/// The fixed directions that the angles are measured from: orthonormal.
#[derive(Clone, Copy, Debug)]
struct Frame {
    up: DVec3,
    /// Where a camera with yaw 0 and pitch 0 looks.
    ahead: DVec3,
    /// What is then to its right.
    right: DVec3,
}

impl Frame {
    fn of(camera: &Camera) -> Self {
        let up = upright_axis(camera);
        let forward = camera.look_at - camera.position;
        let ahead = forward.reject_from_normalized(up).try_normalize().unwrap_or(up.any_orthonormal_vector());
        Self { up, ahead, right: ahead.cross(up) }
    }

    /// The unit direction of two angles.
    fn direction(&self, yaw: f64, pitch: f64) -> DVec3 {
        let ((sin_yaw, cos_yaw), (sin_pitch, cos_pitch)) = (libm::sincos(yaw), libm::sincos(pitch));
        (self.ahead * cos_yaw + self.right * sin_yaw) * cos_pitch + self.up * sin_pitch
    }

    /// What is to the right of a camera with this yaw.
    fn rightwards(&self, yaw: f64) -> DVec3 {
        let (sin, cos) = libm::sincos(yaw);
        self.right * cos - self.ahead * sin
    }
}

/// Where the camera is and looks.
#[derive(Clone, Copy, Debug)]
struct Pose {
    position: DVec3,
    /// Radians to the right of the frame's `ahead`.
    yaw: f64,
    /// Radians above the horizon.
    pitch: f64,
    /// To the look-at point.
    distance: f64,
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
        }
    }

    fn direction(&self, frame: &Frame) -> DVec3 {
        frame.direction(self.yaw, self.pitch)
    }

    fn look_at(&self, frame: &Frame) -> DVec3 {
        self.position + self.direction(frame) * self.distance
    }

    fn fly(&mut self, held: &Held, frame: &Frame, by: f64) {
        let wish = self.direction(frame) * axis(held.forward, held.back)
            + frame.rightwards(self.yaw) * axis(held.right, held.left)
            + frame.up * axis(held.up, held.down);
        self.position += wish.clamp_length_max(1.0) * by;
    }

    fn look(&mut self, held: &Held, radians: f64) {
        self.turn(
            axis(held.look_right, held.look_left) * radians,
            axis(held.look_up, held.look_down) * radians,
        );
    }

    /// Round the look-at point, which stays where it is: what is dragged follows the mouse.
    fn orbit(&mut self, right: f64, down: f64, frame: &Frame) {
        if right == 0.0 && down == 0.0 {
            return;
        }
        let centre = self.look_at(frame);
        self.turn(right * DRAG_RADIANS, -down * DRAG_RADIANS);
        self.position = centre - self.direction(frame) * self.distance;
    }

    /// Towards the look-at point, which stays where it is.
    fn approach(&mut self, notches: f64, frame: &Frame, scene_size: f64) {
        if notches == 0.0 {
            return;
        }
        let centre = self.look_at(frame);
        let (nearest, farthest) = (DISTANCES.0 * scene_size, DISTANCES.1 * scene_size);
        let wanted = self.distance * libm::pow(WHEEL_FACTOR, notches.clamp(-100.0, 100.0));
        self.distance = wanted.clamp(nearest.min(self.distance), farthest.max(self.distance));
        self.position = centre - self.direction(frame) * self.distance;
    }

    fn turn(&mut self, yaw: f64, pitch: f64) {
        self.yaw = (self.yaw + yaw).rem_euclid(std::f64::consts::TAU);
        self.pitch = (self.pitch + pitch).clamp(-STEEPEST, STEEPEST);
    }
}

/// What one "scene" of movement is: the size of everything finite, held near what the camera shows, so that a close-up
/// in a large scene and a scene that stands on a huge floor can both be steered.
fn scene_size(home: &Camera, bounds: Option<(DVec3, DVec3)>) -> f64 {
    let in_view = 2.0 * home.position.distance(home.look_at);
    let size = bounds.map_or(in_view, |(low, high)| (high - low).length());
    if size.is_finite() && size > 0.0 { in_view.clamp(size / 20.0, size) } else { in_view }
}

fn leashed(position: DVec3, home: DVec3, leash: f64) -> DVec3 {
    home + (position - home).clamp_length_max(leash)
}

fn axis(forth: bool, back: bool) -> f64 {
    f64::from(i8::from(forth) - i8::from(back))
}

fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}

#[cfg(test)]
mod tests;
