//! The command line: commands, options, and messages about wrong use.
//!
//! Parsing has no side effects. `view` is the default command, so `rayfarm-master SCENE` opens a window. The hidden command
//! `local-worker` turns the process into a worker of a master on this machine; all further words belong to the worker's
//! command line.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Args, CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};

use crate::app::control::Place;
use crate::viewer::VideoRate;
pub(crate) use values::Size;
use values::{frame_count, frame_index, ray_count, size, thread_count, worker_count};

mod aov;
mod display;
mod farm;
mod knobs;
mod light;
mod models;
mod passes;
mod picture;
mod plot;
mod quality_control;
mod shell;
mod simulate;
mod tradeoff;
mod trust;
mod values;

pub(crate) use aov::Aov;
#[cfg(feature = "terminal")]
pub(crate) use display::Cells;
pub(crate) use display::{DisplayArgs, DisplayKind};
pub(crate) use farm::FarmArgs;
pub(crate) use knobs::QualityArgs;
pub(crate) use light::LightArgs;
pub(crate) use models::ModelArgs;
pub(crate) use passes::PassesArgs;
pub(crate) use picture::PictureArgs;
pub(crate) use plot::PlotArgs;
pub(crate) use quality_control::{ErrorArgs, QualityControlArgs};
pub(crate) use shell::{CompletionsArgs, ManArgs, Program};
pub(crate) use simulate::{Profile, SimulateArgs};
pub(crate) use tradeoff::TradeoffArgs;
pub(crate) use trust::{MasterArgs, TrustAction, TrustArgs};

/// The command that turns the master into a worker.
pub(crate) const LOCAL_WORKER: &str = "local-worker";

/// Meaning of one command line.
#[derive(Debug)]
pub(crate) enum Invocation {
    /// A worker of a master on this machine, with the worker's arguments; the first one replaces the program name.
    LocalWorker(Vec<OsString>),
    /// A command of the master.
    Command(Box<Command>, LogArgs),
}

impl Invocation {
    /// Parses a whole command line, program name first.
    ///
    /// # Errors
    /// clap's error, which has the message and the exit status (2; 0 for `--help` and `--version`).
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

/// Refuses options before the name of a command. clap parses them as options of the default command, so that the named
/// command would silently ignore them.
fn refuse_options_before_the_command(matches: &ArgMatches) -> Result<(), clap::Error> {
    let Some(name) = matches.subcommand_name() else { return Ok(()) };
    let mut cli = Cli::command();
    cli.build(); // names arguments as its own messages do
    let given = |arg: &&Arg| {
        !arg.is_global_set() && matches.value_source(arg.get_id().as_str()) == Some(ValueSource::CommandLine)
    };
    let stray = cli.get_arguments().find(given).map(ToString::to_string);
    stray.map_or(Ok(()), |stray| {
        let message = format!("{stray} precedes {name}; options of {name} must follow it");
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

/// Commands of the master.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Show a scene in a window or another display; workers on this machine render it, and workers on other machines can connect.
    View(ViewArgs),
    /// Render frames to files; needs no display.
    Render(RenderArgs),
    /// Compile a model with its bounding volume hierarchy, so that it loads fast.
    Compile(CompileArgs),
    /// Measure the tracer alone, in one process, without the farm.
    Bench(BenchArgs),
    /// Run the scheduler with simulated workers, in virtual time: measure its efficiency, or test it with faults.
    Simulate(SimulateArgs),
    /// Plot CSV tables, as SVG or PNG.
    Plot(PlotArgs),
    /// Report the features that a scene uses and those that it does not, with their work, memory and bytes.
    Explain(ExplainArgs),
    /// Check the numerics of a scene: leaks, acne, scale, distance from the origin, levels of SIMD.
    CheckNumerics(CheckNumericsArgs),
    /// Measure the time and the error of each setting of the tracer; write a table, plots and pictures.
    Tradeoff(TradeoffArgs),
    /// Show or change the secret line with which workers on other machines join; list, refuse and admit workers.
    Trust(TrustArgs),
    /// Print a script that completes the options of a program in a shell.
    Completions(CompletionsArgs),
    /// Write manual pages of both programs.
    Man(ManArgs),
}

/// Options of `view`.
#[derive(Clone, Debug, Args)]
pub(crate) struct ViewArgs {
    /// A scene (.toml), or a model (.obj or compiled); without it, the room from rayfarm's models.
    pub(crate) scene: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) models: ModelArgs,
    #[command(flatten)]
    pub(crate) display: DisplayArgs,
    #[command(flatten)]
    pub(crate) farm: FarmArgs,
    #[command(flatten)]
    pub(crate) picture: PictureArgs,
    #[command(flatten)]
    pub(crate) quality_control: QualityControlArgs,
    /// Show pictures of paths at rest without most of their noise, guided by albedo, normals and depth: an estimate, which may blur
    /// what is weaker than the noise.
    #[arg(long)]
    pub(crate) denoise: bool,
    /// End after N frames, which are rendered although nothing changes; without it, the window stays open until Esc.
    #[arg(long, value_name = "N", value_parser = frame_count)]
    pub(crate) frames: Option<u32>,
    /// Render continuously although nothing changes or the window is hidden, to measure rates. Without it, a picture at rest
    /// is rendered once.
    #[arg(long)]
    pub(crate) continuous: bool,
    /// Write a CSV line per frame.
    #[arg(long, value_name = "FILE")]
    pub(crate) fps_log: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) observability: ObservabilityArgs,
}

/// Options of `render`.
#[derive(Clone, Debug, Args)]
pub(crate) struct RenderArgs {
    /// A scene (.toml), or a model (.obj or compiled).
    pub(crate) scene: PathBuf,
    /// Picture to write: .png or .ppm, or .exr or .hdr for linear light without exposure and tone curve; frame-%04d.png
    /// numbers a sequence from 0000; none writes no file. Or a video: .apng or .gif, and .mp4 or .webm through ffmpeg.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Auxiliary pictures of each frame, separated by commas, as layers of its .exr file.
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',')]
    pub(crate) aov: Vec<Aov>,
    /// Filter the noise of paths, guided by albedo, normals and depth: an estimate, which may blur what is weaker than the noise.
    #[arg(long)]
    pub(crate) denoise: bool,
    #[command(flatten)]
    pub(crate) models: ModelArgs,
    #[command(flatten)]
    pub(crate) farm: FarmArgs,
    #[command(flatten)]
    pub(crate) picture: PictureArgs,
    #[command(flatten)]
    pub(crate) error: ErrorArgs,
    #[command(flatten)]
    pub(crate) passes: PassesArgs,
    /// Number of frames of the whole camera path [default: up to the last key of the scene for sequences and videos, else 1].
    #[arg(long, value_name = "N", value_parser = frame_count)]
    pub(crate) frames: Option<u32>,
    /// Frames per second, of videos and of the keys of the scene: 25, 23.976 or 30000/1001 [default: 25].
    #[arg(long, value_name = "RATE", value_parser = VideoRate::parse)]
    pub(crate) fps: Option<VideoRate>,
    /// Begin at frame N, counted from 0; each frame is the same picture as in a run of all frames.
    #[arg(long, value_name = "N", default_value = "0", value_parser = frame_index)]
    pub(crate) first_frame: u32,
    /// Render the frames whose files are missing, damaged or truncated: continue an interrupted run.
    #[arg(long)]
    pub(crate) resume: bool,
    /// Render the frames whose files do not exist; existing files are not read.
    #[arg(long, conflicts_with = "resume")]
    pub(crate) skip_existing: bool,
    /// Begin when N workers are connected; without it, when the local ones are connected.
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

/// Options of `compile`.
#[derive(Clone, Debug, Args)]
pub(crate) struct CompileArgs {
    /// Model to compile (.obj).
    pub(crate) model: PathBuf,
    /// Compiled model to write.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// Quality of the hierarchy: higher quality takes more time to build. Pictures do not depend on it.
    #[arg(long, value_enum, value_name = "QUALITY", default_value_t)]
    pub(crate) quality: Quality,
    #[command(flatten)]
    pub(crate) models: ModelArgs,
}

/// Quality of a hierarchy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Quality {
    /// Shortest build.
    Fast,
    /// Best quality before longer builds gain little.
    #[default]
    Default,
    /// Best quality, for models that are compiled once and rendered often.
    High,
}

/// Options of `bench`.
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
    /// Number of frames to measure, after one for warming up.
    #[arg(long, value_name = "N", default_value = "20", value_parser = frame_count)]
    pub(crate) frames: u32,
    /// Print one line of JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Options of `explain`.
#[derive(Clone, Debug, Args)]
pub(crate) struct ExplainArgs {
    /// A scene (.toml), or a model (.obj or compiled).
    pub(crate) scene: PathBuf,
    #[command(flatten)]
    pub(crate) models: ModelArgs,
    /// Picture size in pixels.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<Size>,
    #[command(flatten)]
    pub(crate) light: LightArgs,
    #[command(flatten)]
    pub(crate) quality: QualityArgs,
    /// Print one line of JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Options of `check-numerics`.
#[derive(Clone, Debug, Args)]
pub(crate) struct CheckNumericsArgs {
    /// A scene (.toml), or a model (.obj or compiled); without it, built-in scenes of a plane, spheres and tori.
    pub(crate) scene: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) models: ModelArgs,
    /// Number of rays aimed at edges and vertices of the models [default: 200000].
    #[arg(long, value_name = "N", value_parser = ray_count)]
    pub(crate) rays: Option<u64>,
    /// Trace only this ray of the check for leaks, by the number that a failure names, and report everything about it. The
    /// number does not depend on --rays.
    #[arg(long, value_name = "N", conflicts_with = "json")]
    pub(crate) ray: Option<u64>,
    /// Pixels of each picture to compare with the reference tracer in double precision: 27648 are all pixels at an aspect of 4
    /// to 3 [default: as many as take some seconds].
    #[arg(long, value_name = "N", value_parser = frame_count)]
    pub(crate) pixels: Option<u32>,
    /// Print a line of JSON for each scene on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Options for watching and controlling a run.
#[derive(Clone, Debug, Args)]
pub(crate) struct ObservabilityArgs {
    /// Write a timeline of what every worker did, for ui.perfetto.dev or chrome://tracing.
    #[arg(long, alias = "trace", value_name = "FILE")]
    pub(crate) timeline: Option<PathBuf>,
    /// Largest size of the files of --timeline and --fps-log, each, in MiB; later events are left out, and the file says so.
    #[arg(long, value_name = "MIB", default_value = "1024", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) record_limit: u32,
    /// Accept commands, one per line: on standard input (-), at a port of this machine (127.0.0.1:PORT; the log names the
    /// token) or at a Unix socket (a path with a slash in it). The command help lists them.
    #[arg(long, value_name = "PLACE", value_parser = Place::parse, allow_hyphen_values = true)]
    pub(crate) control: Option<Place>,
}

impl ObservabilityArgs {
    /// Largest size of a timeline and of a frame log, in bytes.
    pub(crate) fn record_bytes(&self) -> u64 {
        u64::from(self.record_limit) << 20
    }
}

/// Verbosity of the log on standard error. RUST_LOG has priority.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct LogArgs {
    /// Log more on standard error.
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    pub(crate) verbose: bool,
    /// Log only errors on standard error.
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
}

#[cfg(test)]
mod tests;
