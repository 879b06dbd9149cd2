//! The options that trade accuracy for speed by what it costs.

use std::path::PathBuf;

use clap::Args;

use super::values::{error_limit, frame_rate};

/// How fast a window shall be.
#[derive(Clone, Debug, Args)]
pub(crate) struct QualityControlArgs {
    /// Hold N frames a second while the picture moves, at the least loss of quality that this takes; a picture at rest is
    /// the full one.
    #[arg(long, value_name = "N", value_parser = frame_rate)]
    pub(crate) target_fps: Option<f64>,
    #[command(flatten)]
    pub(crate) error: ErrorArgs,
}

/// How much may be lost.
#[derive(Clone, Debug, Args)]
pub(crate) struct ErrorArgs {
    /// The fastest setting that loses at most E of mean FLIP error beside the picture that is asked for: 0 is nothing, 1 white
    /// for black. With --target-fps, the most
    /// that a moving picture may lose.
    #[arg(long, value_name = "E", value_parser = error_limit)]
    pub(crate) max_error: Option<f64>,
    /// What settings cost and lose, as tradeoff has measured it on this scene: its tradeoff.csv. Without it, the table that
    /// lies with the scene (SCENE.tradeoff.csv beside it, or SCENE.csv in a folder tradeoff), or else as on other scenes.
    #[arg(long, value_name = "CSV")]
    pub(crate) front: Option<PathBuf>,
}
