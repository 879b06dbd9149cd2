//! Options of `tradeoff`.

use std::path::PathBuf;

use clap::Args;
use rayfarm_tracer::scene::Integrator;

use super::ModelArgs;
use super::values::{Size, one_of, repeat_count, size, thread_count};

/// Options of `tradeoff`.
#[derive(Clone, Debug, Args)]
pub(crate) struct TradeoffArgs {
    /// A scene (.toml), or a model (.obj or compiled).
    #[arg(required_unless_present = "saved")]
    pub(crate) scene: Option<PathBuf>,
    /// Measure nothing: print the Pareto front of an existing tradeoff.csv.
    #[arg(long, value_name = "CSV", conflicts_with_all = ["scene", "output", "integrator", "size", "repeats", "threads", "up", "crease_angle"])]
    pub(crate) saved: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) models: ModelArgs,
    /// Folder to write to; created if it does not exist.
    #[arg(short, long, value_name = "FOLDER", default_value = "tradeoff")]
    pub(crate) output: PathBuf,
    /// How light is computed: direct, without noise; or path, with all that bounces. Overrides the scene file.
    #[arg(long, value_name = "direct|path", value_parser = one_of(&Integrator::WORDS))]
    pub(crate) integrator: Option<Integrator>,
    /// Picture size in pixels.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<Size>,
    /// Number of times that each setting is timed, in turns.
    #[arg(long, value_name = "N", default_value = "7", value_parser = repeat_count)]
    pub(crate) repeats: u32,
    /// Render threads; without it, all cores.
    #[arg(long, value_name = "N", value_parser = thread_count)]
    pub(crate) threads: Option<usize>,
    /// Print one line of JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}
