//! The command line: what may be asked for, and how wrong use is refused.
//!
//! Parsing touches nothing outside the arguments. `view` is the default command, so `rayfarm-master SCENE` opens a
//! window. The hidden `local-worker` is how the master starts itself again as its own render node; everything after
//! that word belongs to the worker's own command line.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};

use crate::app::control::Place;
pub(crate) use values::Size;
use values::{frame_count, frame_index, ray_count, sample_count, size, thread_count, worker_count};

mod farm;
mod models;
mod picture;
mod plot;
mod quality_control;
mod simulate;
mod tradeoff;
mod values;

pub(crate) use farm::FarmArgs;
pub(crate) use models::ModelArgs;
pub(crate) use picture::{PictureArgs, QualityArgs};
pub(crate) use plot::PlotArgs;
pub(crate) use quality_control::{ErrorArgs, QualityControlArgs};
pub(crate) use simulate::{Profile, SimulateArgs};
pub(crate) use tradeoff::TradeoffArgs;

/// The word that turns the master into a worker.
pub(crate) const LOCAL_WORKER: &str = "local-worker";

/// What one command line asks for.
#[derive(Debug)]
pub(crate) enum Invocation {
    /// Be a render node of a master on this machine; the arguments are the worker's, the first in place of its name.
    LocalWorker(Vec<OsString>),
    /// Do one of the commands.
    Command(Box<Command>, LogArgs),
}

impl Invocation {
    /// Reads a whole command line, program name first.
    ///
    /// # Errors
    /// clap's error, which carries the message and the exit status (2; 0 for `--help` and `--version`).
    pub(crate) fn parse(args: impl IntoIterator<Item = OsString>) -> Result<Self, clap::Error> {
        let args: Vec<OsString> = args.into_iter().collect();
        if args.get(1).is_some_and(|word| word == LOCAL_WORKER) {
            return Ok(Self::LocalWorker(args.into_iter().skip(1).collect()));
        }
        let matches = Cli::command().try_get_matches_from(args)?;
        refuse_options_before_the_command(&matches)?;
        let cli = Cli::from_arg_matches(&matches)?;
        Ok(Self::Command(Box::new(cli.command.unwrap_or(Command::View(cli.view))), cli.log))
    }
}

/// The options of the default command are known before a command's name too, but mean nothing to that command:
/// ignoring them in silence would render something else than was asked for.
fn refuse_options_before_the_command(matches: &ArgMatches) -> Result<(), clap::Error> {
    let Some(name) = matches.subcommand_name() else { return Ok(()) };
    let mut cli = Cli::command();
    cli.build(); // names arguments as its own messages do
    let given = |arg: &&Arg| {
        !arg.is_global_set() && matches.value_source(arg.get_id().as_str()) == Some(ValueSource::CommandLine)
    };
    let stray = cli.get_arguments().find(given).map(ToString::to_string);
    stray.map_or(Ok(()), |stray| {
        let message = format!("{stray} stands before {name}; what belongs to {name} follows it");
        Err(cli.error(ErrorKind::ArgumentConflict, message))
    })
}

/// An interactive ray tracer that renders with all the machines of a room.
///
/// Without a command it opens a window: rayfarm-master [SCENE] is rayfarm-master view [SCENE].
#[derive(Debug, Parser)]
#[command(name = "rayfarm-master", version, args_override_self = true, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    view: ViewArgs,
    #[command(flatten)]
    log: LogArgs,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Show a scene in a window; workers on this machine render it, and others may join.
    View(ViewArgs),
    /// Render frames to files; needs no display.
    Render(RenderArgs),
    /// Write a model with its bounding volume hierarchy, ready to load.
    Compile(CompileArgs),
    /// Measure the tracer alone, in this one process, without the farm.
    Bench(BenchArgs),
    /// Run the scheduler with simulated workers, in virtual time: how well it uses them, or what it survives.
    Simulate(SimulateArgs),
    /// Draw CSV tables as a plot, as SVG or PNG.
    Plot(PlotArgs),
    /// Tell what a scene asks for, what it does without, and what that means in work, memory and bytes.
    Explain(ExplainArgs),
    /// Check a scene's numbers: leaks, acne, scale, distance from the origin, levels of SIMD.
    CheckNumerics(CheckNumericsArgs),
    /// Measure what each setting of the tracer costs and how far its picture is from the best one; write table, plot and pictures.
    Tradeoff(TradeoffArgs),
}

/// `view`.
#[derive(Clone, Debug, Args)]
pub(crate) struct ViewArgs {
    /// A scene (.toml), or a model (.obj or compiled); without it, the room that comes with rayfarm.
    pub(crate) scene: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) models: ModelArgs,
    #[command(flatten)]
    pub(crate) farm: FarmArgs,
    #[command(flatten)]
    pub(crate) picture: PictureArgs,
    #[command(flatten)]
    pub(crate) quality_control: QualityControlArgs,
    /// End after N frames; without it, the window stays until Esc. Frames are rendered although nothing changes.
    #[arg(long, value_name = "N", value_parser = frame_count)]
    pub(crate) frames: Option<u32>,
    /// Render frame after frame although nothing changes or the window is hidden, to measure rates. Without it, a picture
    /// at rest is rendered once.
    #[arg(long)]
    pub(crate) continuous: bool,
    /// Write a CSV line per frame.
    #[arg(long, value_name = "FILE")]
    pub(crate) fps_log: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) observability: ObservabilityArgs,
}

/// `render`.
#[derive(Clone, Debug, Args)]
pub(crate) struct RenderArgs {
    /// A scene (.toml), or a model (.obj or compiled).
    pub(crate) scene: PathBuf,
    /// The picture to write: .png or .ppm; frame-%04d.png numbers a sequence from 0000; none writes nothing.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) models: ModelArgs,
    #[command(flatten)]
    pub(crate) farm: FarmArgs,
    #[command(flatten)]
    pub(crate) picture: PictureArgs,
    #[command(flatten)]
    pub(crate) error: ErrorArgs,
    /// Frames of the whole camera path.
    #[arg(long, value_name = "N", default_value = "1", value_parser = frame_count)]
    pub(crate) frames: u32,
    /// Begin at frame N of them, counted from 0; each frame is the same picture as in a run of all.
    #[arg(long, value_name = "N", default_value = "0", value_parser = frame_index)]
    pub(crate) first_frame: u32,
    /// Render the frames whose files are missing, damaged or cut short: go on with a run that was interrupted.
    #[arg(long)]
    pub(crate) resume: bool,
    /// Render the frames whose files do not exist; look into none of those that do.
    #[arg(long, conflicts_with = "resume")]
    pub(crate) skip_existing: bool,
    /// Begin when N workers are connected, and not before; without it, when the local ones are.
    #[arg(long, value_name = "N", value_parser = worker_count)]
    pub(crate) wait_for_workers: Option<u32>,
    /// Write a CSV line per frame.
    #[arg(long, value_name = "FILE")]
    pub(crate) fps_log: Option<PathBuf>,
    /// Print one line of JSON about the run on standard output.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) observability: ObservabilityArgs,
}

/// `compile`.
#[derive(Clone, Debug, Args)]
pub(crate) struct CompileArgs {
    /// The model (.obj).
    pub(crate) model: PathBuf,
    /// The compiled model to write.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// How much time the hierarchy may take. The picture does not depend on it.
    #[arg(long, value_enum, value_name = "QUALITY", default_value_t)]
    pub(crate) quality: Quality,
    #[command(flatten)]
    pub(crate) models: ModelArgs,
}

/// How well a hierarchy is built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Quality {
    /// As soon as possible.
    Fast,
    /// Where more time would gain little.
    #[default]
    Default,
    /// For models that are compiled once and rendered often.
    High,
}

/// `bench`.
#[derive(Clone, Debug, Args)]
pub(crate) struct BenchArgs {
    /// A scene (.toml), or a model (.obj or compiled).
    pub(crate) scene: PathBuf,
    #[command(flatten)]
    pub(crate) models: ModelArgs,
    /// Render threads; without it, all cores.
    #[arg(long, value_name = "N", value_parser = thread_count)]
    pub(crate) threads: Option<usize>,
    #[command(flatten)]
    pub(crate) picture: PictureArgs,
    /// Frames to measure, after one that is not counted.
    #[arg(long, value_name = "N", default_value = "20", value_parser = frame_count)]
    pub(crate) frames: u32,
    /// Print one line of JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `explain`.
#[derive(Clone, Debug, Args)]
pub(crate) struct ExplainArgs {
    /// A scene (.toml), or a model (.obj or compiled).
    pub(crate) scene: PathBuf,
    #[command(flatten)]
    pub(crate) models: ModelArgs,
    /// Picture size in pixels.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<Size>,
    /// Rays per pixel: a square number, 1, 4, 9, 16, ...
    #[arg(long, value_name = "N", value_parser = sample_count)]
    pub(crate) samples: Option<u32>,
    #[command(flatten)]
    pub(crate) quality: QualityArgs,
    /// Print one line of JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `check-numerics`.
#[derive(Clone, Debug, Args)]
pub(crate) struct CheckNumericsArgs {
    /// A scene (.toml), or a model (.obj or compiled); without it, built-in scenes of a plane, spheres and tori.
    pub(crate) scene: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) models: ModelArgs,
    /// Rays to aim at edges and vertices of the models [default: 200000].
    #[arg(long, value_name = "N", value_parser = ray_count)]
    pub(crate) rays: Option<u64>,
    /// Shoot only this ray of the check for leaks, and tell all that is known of it: the number that a failure names. It is the same
    /// ray whatever --rays says.
    #[arg(long, value_name = "N", conflicts_with = "json")]
    pub(crate) ray: Option<u64>,
    /// Pixels of each picture that the slow tracer in double precision is asked for: 27648 are all of a picture of 4 to 3
    /// [default: as many as some seconds allow].
    #[arg(long, value_name = "N", value_parser = frame_count)]
    pub(crate) pixels: Option<u32>,
    /// Print a line of JSON for each scene on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

/// What watches and steers a run.
#[derive(Clone, Debug, Args)]
pub(crate) struct ObservabilityArgs {
    /// Write a timeline of what every worker did, for ui.perfetto.dev or chrome://tracing.
    #[arg(long, alias = "trace", value_name = "FILE")]
    pub(crate) timeline: Option<PathBuf>,
    /// Take commands, one a line: from standard input (-), a port of this machine (127.0.0.1:PORT; its log names the
    /// token) or a Unix socket (a path with a slash in it). The command help lists them.
    #[arg(long, value_name = "PLACE", value_parser = Place::parse, allow_hyphen_values = true)]
    pub(crate) control: Option<Place>,
}

/// How much is told on standard error; RUST_LOG wins over both.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct LogArgs {
    /// Tell more on standard error.
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    pub(crate) verbose: bool,
    /// Tell only of errors on standard error.
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
}

#[cfg(test)]
mod tests;
