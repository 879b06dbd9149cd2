//! The application around viewer and farm: command line, commands, control of a run, files, reports and the log.

pub(crate) mod cli;
pub(crate) mod commands;
pub(crate) mod control;
mod eta;
pub(crate) mod frame_writer;
mod knob_values;
pub(crate) mod logging;
pub(crate) mod output;
pub(crate) mod picture;
mod plan;
pub(crate) mod progress;
pub(crate) mod reports;
pub(crate) mod trust;
pub(crate) mod video;
