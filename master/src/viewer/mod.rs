//! The viewer: camera, view requests, quality controller and statistics, the same for every display.
//!
//! [`frame_loop`] runs over the farm. Displays hold a [`ViewerHandle`]: they read snapshots and send [`InputAction`]s.
//! Nothing in here knows a window, a terminal or a command line.

mod camera_control;
mod displays;
pub(crate) mod edits;
mod error;
pub(crate) mod film;
pub(crate) mod frame_counts;
mod frame_log;
mod frame_loop;
mod frame_rate;
mod handle;
mod input_action;
mod keyed_scene;
mod knob_change;
mod latency;
mod open_requests;
pub(crate) mod orbit;
pub(crate) mod quality_controller;
mod requests;
mod scene_update;
mod sequence;
mod statistics;
mod video_rate;
mod worker_command;
mod worker_facts;

pub(crate) use camera_control::CameraControl;
pub(crate) use error::ViewerError;
pub(crate) use frame_log::{FrameLine, FrameLogError, FrameLogFile};
pub(crate) use frame_loop::{Viewer, ViewerConfig};
pub(crate) use frame_rate::FrameRate;
pub(crate) use handle::{KnobSender, PresentedFrame, ViewerHandle};
pub(crate) use input_action::InputAction;
pub(crate) use keyed_scene::KeyedScene;
pub(crate) use knob_change::KnobChange;
pub(crate) use open_requests::OPEN_REQUESTS;
pub(crate) use requests::RequestPolicy;
pub(crate) use sequence::{FrameSequence, SequenceFrame, Slot};
pub(crate) use statistics::Statistics;
pub(crate) use video_rate::VideoRate;
pub(crate) use worker_command::KICK_REASON;
#[cfg(any(feature = "terminal", feature = "window"))]
pub(crate) use worker_command::WorkerCommand;
pub(crate) use worker_facts::{banned_facts, worker_facts};
