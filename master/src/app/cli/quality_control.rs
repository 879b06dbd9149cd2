//! Options that trade accuracy for speed by measured costs.

use std::path::PathBuf;

use clap::Args;

use super::values::{error_limit, frame_rate};

/// Frame rate to hold, and the loss allowed for it.
#[derive(Clone, Debug, Args)]
pub(crate) struct QualityControlArgs {
    /// Hold N frames per second while the picture moves, with the least loss of quality; a picture at rest has full quality.
    #[arg(long, value_name = "N", value_parser = frame_rate)]
    pub(crate) target_fps: Option<f64>,
    #[command(flatten)]
    pub(crate) error: ErrorArgs,
}

/// Largest loss of quality.
#[derive(Clone, Debug, Args)]
pub(crate) struct ErrorArgs {
    /// Use the fastest setting with a mean FLIP error of at most E against the requested picture: 0 is no error, 1 is white
    /// for black. With --target-fps, the largest error of a moving picture.
    #[arg(long, value_name = "E", value_parser = error_limit)]
    pub(crate) max_error: Option<f64>,
    /// Table of the costs and errors of settings on this scene: the tradeoff.csv that tradeoff writes. Without it, the table
    /// in the scene's folder (SCENE.tradeoff.csv, or tradeoff/SCENE.csv), or else medians over other scenes.
    #[arg(long, value_name = "CSV")]
    pub(crate) front: Option<PathBuf>,
}
