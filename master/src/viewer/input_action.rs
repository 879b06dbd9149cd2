//! Actions that displays send to the viewer.

use std::time::Duration;

use glam::DVec3;

use super::knob_change::KnobChange;
use super::scene_update::SceneUpdate;
use super::worker_command::WorkerCommand;

/// One input of a display. The display decides which key or gesture means which action; the viewer decides its effect.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum InputAction {
    /// Moves the camera and its look-at point.
    Move {
        /// Right, up and forward, each in -1..=1.
        direction: DVec3,
        /// Time for which the movement was held, in seconds.
        seconds: f64,
    },
    /// Turns the camera in place.
    Look {
        /// To the right, in -1..=1.
        right: f64,
        /// Upwards, in -1..=1.
        up: f64,
        /// Time for which the turn was held, in seconds.
        seconds: f64,
    },
    /// Turns the camera about its look-at point.
    Orbit {
        /// Drag to the right, in heights of the display.
        right: f64,
        /// Drag downwards, in heights of the display.
        down: f64,
    },
    /// Rolls the camera about its view direction.
    Roll {
        /// To the right, in -1..=1.
        right: f64,
        /// Time for which the roll was held, in seconds.
        seconds: f64,
    },
    /// Magnifies the picture: the zoom of a camera, or the angle of a fisheye camera.
    Magnify {
        /// Inwards, in -1..=1.
        inwards: f64,
        /// Time for which the magnification was held, in seconds.
        seconds: f64,
    },
    /// Moves the camera towards its look-at point; magnifies the picture of an orthographic camera.
    Zoom {
        /// Notches of a wheel; positive values move nearer.
        notches: f64,
    },
    /// Restores the camera of the scene.
    ResetCamera,
    /// Changes the size of the picture.
    Resize {
        /// Pixels per row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Reports whether any part of the display can be seen. No frame is requested for a hidden display.
    SetVisible(bool),
    /// Reports that a frame is on the screen.
    Presented {
        /// Time from the input that the frame answers to its presentation.
        latency: Duration,
    },
    /// Gives a knob of the view another value.
    Set(KnobChange),
    /// Shows pictures of paths at rest with or without most of their noise.
    Denoise(bool),
    /// Shows another scene with the same camera.
    ShowScene(Box<SceneUpdate>),
    /// Reports a fault in the files of the scene, which is shown as it was.
    SceneFault(String),
    /// Commands workers.
    Worker(WorkerCommand),
    /// Ends the viewer.
    Quit,
}
