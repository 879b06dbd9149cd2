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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::cli::{Command, Invocation};

    fn passes(options: &str) -> PassesArgs {
        let line = format!("rayfarm-master render a.toml -o b.png {options}");
        match Invocation::parse(line.split_whitespace().map(Into::into)) {
            Ok(Invocation::Command(command, _)) => match *command {
                Command::Render(args) => args.passes,
                other => panic!("{options}: {other:?}"),
            },
            other => panic!("{options}: {other:?}"),
        }
    }

    #[test]
    fn a_picture_has_a_time_and_a_film() {
        assert_eq!(passes("").given(), None);
        let all = passes("--time 1.5 --checkpoint a.film --continue b.film");
        assert_eq!((all.time, all.given()), (Some(Duration::from_millis(1500)), Some("--time")));
        assert_eq!(all.checkpoint, Some(PathBuf::from("a.film")));
        assert_eq!(all.continued, Some(PathBuf::from("b.film")));
        assert_eq!(passes("--continue b.film").given(), Some("--continue"));
    }

    #[test]
    fn times_are_above_zero_and_finite() {
        for wrong in ["0", "-1", "nan", "inf", "1e10", "soon"] {
            let line = ["rayfarm-master", "render", "a.toml", "-o", "b.png", &format!("--time={wrong}")];
            let error = Invocation::parse(line.map(Into::into)).unwrap_err().to_string();
            assert!(error.contains("expected seconds above 0"), "{wrong}: {error}");
        }
    }
}
