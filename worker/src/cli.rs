//! The worker's command line, shared by its own binary and by the master, which runs itself again as a local worker.

use std::ffi::OsString;
use std::io::{IsTerminal, Read};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, ValueEnum};
use rayfarm_protocol::address;
use tracing_subscriber::EnvFilter;

use crate::client::{DiskCacheOptions, Share, WorkerOptions, run};
use crate::disk_cache::user_folder;
use crate::ending::Ending;

/// Names a worker whose command line does not: unlike a command line, other users of the machine cannot read it.
pub const NAME_VARIABLE: &str = "RAYFARM_WORKER_NAME";

/// A render node of rayfarm: traces segments for a master, with all its cores.
#[derive(Debug, Parser)]
#[command(name = "rayfarm-worker", version)]
struct Cli {
    #[command(flatten)]
    worker: WorkerArgs,
}

/// What a worker can be told. Flatten it into another command line to offer a worker there.
#[derive(Clone, Debug, Args)]
pub struct WorkerArgs {
    /// Where the master listens
    #[arg(long, value_name = "HOST:PORT", value_parser = host_and_port)]
    pub master: String,

    /// Render threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,

    /// What the master calls this worker [default: RAYFARM_WORKER_NAME of the environment, or the name of this machine]
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,

    /// Memory for scenes and meshes; what was not used for longest is dropped first
    #[arg(long, value_name = "MIB", default_value_t = 2048, value_parser = clap::value_parser!(u64).range(1..=1 << 24))]
    pub asset_cache: u64,

    /// Folder for scenes and meshes that are to be here after a restart [default: in the user's cache folder, for
    /// masters on other machines]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,

    /// Keep nothing on the disk
    #[arg(long, conflicts_with_all = ["cache", "cache_limit"])]
    pub no_cache: bool,

    /// Disk space for them; what was not used for longest goes first
    #[arg(long, value_name = "MIB", default_value_t = 4096, value_parser = clap::value_parser!(u64).range(1..=1 << 24))]
    pub cache_limit: u64,

    /// How pixels are sent
    #[arg(long, value_name = "HOW", value_enum, default_value_t = PixelEncoding::Auto)]
    pub pixels: PixelEncoding,

    /// Where scenes and meshes are passed on to other workers, so that the master need not send them to each: off, or an
    /// address and port [default: any free port, for masters on other machines]
    #[arg(long, value_name = "off|ADDR:PORT", value_parser = share)]
    pub share: Option<Share>,

    /// End when standard input ends: with whoever started this worker
    #[arg(long)]
    pub exit_with_stdin: bool,

    /// End with the master, instead of waiting for the next one that listens at its address
    #[arg(long)]
    pub once: bool,

    /// End with an error when the connection fails, instead of trying again; and with the master
    #[arg(long)]
    pub no_reconnect: bool,

    /// Say more
    #[arg(long, short, conflicts_with = "quiet")]
    pub verbose: bool,

    /// Say only what is wrong
    #[arg(long, short)]
    pub quiet: bool,
}

/// What `--pixels` takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PixelEncoding {
    /// Compressed to another machine, raw within this one
    Auto,
    /// As they are
    Raw,
    /// Compressed where that makes them fewer bytes
    Lz4,
}

impl WorkerArgs {
    fn options(&self) -> WorkerOptions {
        WorkerOptions {
            master: self.master.clone(),
            threads: self.threads.map(usize::from),
            name: self
                .name
                .clone()
                .or_else(|| std::env::var(NAME_VARIABLE).ok())
                .unwrap_or_else(machine_name),
            reconnect: !self.no_reconnect,
            once: self.once,
            asset_cache_bytes: self.asset_cache << 20,
            disk_cache: self.disk_cache(),
            share: self.share.unwrap_or_default(),
            compress: match self.pixels {
                PixelEncoding::Auto => None,
                PixelEncoding::Raw => Some(false),
                PixelEncoding::Lz4 => Some(true),
            },
        }
    }

    /// A folder that was asked for serves every master.
    fn disk_cache(&self) -> Option<DiskCacheOptions> {
        let folder = self.cache.clone().or_else(user_folder).filter(|_| !self.no_cache)?;
        let limit_bytes = self.cache_limit << 20;
        Some(DiskCacheOptions { folder, limit_bytes, within_machine: self.cache.is_some() })
    }
}

/// The definition of the worker's command line, for completions and manual pages.
pub fn command_line() -> clap::Command {
    Cli::command()
}

/// The whole program: parses `args` (the first is the program's name), logs to standard error, works. The exit code is
/// 0 after a goodbye or a signal, 1 when the worker gave up, 2 on wrong use.
pub fn main_from<I>(args: I) -> ExitCode
where
    I: IntoIterator,
    I::Item: Into<OsString> + Clone,
{
    match Cli::try_parse_from(args) {
        Ok(cli) => main_with(&cli.worker),
        Err(error) => {
            // Nowhere to complain to if this fails.
            let _ = error.print();
            u8::try_from(error.exit_code()).map_or(ExitCode::FAILURE, ExitCode::from)
        }
    }
}

/// As [`main_from`], with arguments that are parsed already. Installs its own logging unless there is one.
pub fn main_with(args: &WorkerArgs) -> ExitCode {
    log_to_stderr(args);
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
    let runtime = match runtime {
        Ok(runtime) => runtime,
        Err(error) => {
            tracing::error!("cannot start: {error}");
            return ExitCode::FAILURE;
        }
    };
    let ending = Ending::new();
    if args.exit_with_stdin {
        stop_with_stdin(ending.clone());
    }
    let result = runtime.block_on(async {
        tokio::spawn(end_on_signals(ending.clone()));
        run(args.options(), ending).await
    });
    // A mesh that is still being decoded is not waited for.
    runtime.shutdown_background();
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            tracing::error!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// `RUST_LOG` wins over the flags.
fn log_to_stderr(args: &WorkerArgs) {
    let level = match (args.verbose, args.quiet) {
        (true, _) => "debug",
        (_, true) => "error",
        _ => "info",
    };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level));
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    let log = log.with_target(false).with_ansi(std::io::stderr().is_terminal());
    // It fails when the program that this is part of has set up its own.
    let _ = log.try_init();
}

/// The first signal lets the worker finish what it holds, the second does not.
async fn end_on_signals(ending: Ending) {
    if let Err(error) = wait_for_signals(&ending).await {
        tracing::warn!("cannot listen for signals: {error}; end this worker through its master");
    }
}

fn drain(ending: &Ending, signal: &str) {
    tracing::info!(
        "{signal}: leaving when the segments that this worker holds are done; again to leave at once"
    );
    ending.drain();
}

#[cfg(unix)]
async fn wait_for_signals(ending: &Ending) -> std::io::Result<()> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    tokio::select! {
        _ = terminate.recv() => drain(ending, "terminated"),
        _ = interrupt.recv() => drain(ending, "interrupted"),
    }
    tokio::select! {
        _ = terminate.recv() => ending.stop(),
        _ = interrupt.recv() => ending.stop(),
    }
    Ok(())
}

#[cfg(not(unix))]
async fn wait_for_signals(ending: &Ending) -> std::io::Result<()> {
    tokio::signal::ctrl_c().await?;
    drain(ending, "interrupted");
    tokio::signal::ctrl_c().await?;
    ending.stop();
    Ok(())
}

/// Whoever started us holds the other end, and need not do anything for us to end with it: not even live.
fn stop_with_stdin(ending: Ending) {
    let wait = move || {
        let mut stdin = std::io::stdin().lock();
        let mut sink = [0; 256];
        while matches!(stdin.read(&mut sink), Ok(more) if more > 0) {}
        tracing::debug!("standard input has ended: leaving");
        ending.stop();
    };
    if let Err(error) = std::thread::Builder::new().name("stdin".to_owned()).spawn(wait) {
        tracing::warn!("cannot watch standard input: {error}");
    }
}

/// Checks the form; whether the host is known shows when connecting.
fn host_and_port(text: &str) -> Result<String, String> {
    let form = "expected HOST:PORT, as in farm.local:7117, [::1]:7117 or [fe80::1%eth0]:7117";
    let (host, port) = text.rsplit_once(':').ok_or(form)?;
    let bare_v6 = host.contains(':') && !(host.starts_with('[') && host.ends_with(']'));
    if host.is_empty() || bare_v6 {
        return Err(form.to_owned());
    }
    match port.parse::<u16>() {
        Ok(1..) => Ok(text.to_owned()),
        _ => Err(format!("{port:?} is no port from 1 to 65535; {form}")),
    }
}

fn share(text: &str) -> Result<Share, String> {
    if text == "off" {
        return Ok(Share::Off);
    }
    match address::parse(text)? {
        Some(address) => Ok(Share::At(address)),
        None => Err("expected off, or ADDR:PORT as in 192.168.1.20:7200 or [fe80::1%eth0]:7200".to_owned()),
    }
}

fn machine_name() -> String {
    let file = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let command = || {
        let output = std::process::Command::new("hostname").output().ok()?;
        String::from_utf8(output.stdout).ok()
    };
    let name = file.or_else(command).unwrap_or_default();
    match name.trim() {
        "" => "unnamed".to_owned(),
        name => name.to_owned(),
    }
}
