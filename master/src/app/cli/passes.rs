//! Options of pictures that are rendered in passes.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::values::seconds;

/// End of a picture of the path integrator, and its film: the sums of its samples.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct PassesArgs {
    /// End after this time with the samples so far, at least one; for the path integrator.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub(crate) time: Option<Duration>,
    /// Save the samples to this film each minute, at the end and on Ctrl-C; for one picture of the path integrator.
    #[arg(long, value_name = "FILE")]
    pub(crate) checkpoint: Option<PathBuf>,
    /// Go on from this film of the same picture, and save it as with --checkpoint, to the same file unless that option names another one.
    #[arg(long = "continue", value_name = "FILE")]
    pub(crate) continued: Option<PathBuf>,
}

impl PassesArgs {
    /// The first of these options that is given.
    pub(crate) fn given(&self) -> Option<&'static str> {
        [
            (self.time.is_some(), "--time"),
            (self.checkpoint.is_some(), "--checkpoint"),
            (self.continued.is_some(), "--continue"),
        ]
        .into_iter()
        .find_map(|(is_given, option)| is_given.then_some(option))
    }
}
