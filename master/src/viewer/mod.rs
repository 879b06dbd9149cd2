//! The viewer: camera, view requests, quality controller and statistics, the same for every display.

pub(crate) mod camera_control;
pub(crate) mod frame_loop;
pub(crate) mod frame_rate;
mod latency;
pub(crate) mod orbit;
pub(crate) mod quality_controller;
pub(crate) mod requests;
pub(crate) mod view_request;
