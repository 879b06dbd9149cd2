//! The worker's command line, for its own binary and for the master, which starts itself as a local worker.

use std::ffi::OsString;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, ValueEnum};
use rayfarm_protocol::address;
use tracing_subscriber::EnvFilter;

use super::client::run;
use super::options::{DiskCacheOptions, Share, WorkerOptions};
use super::signals::{shut_down_on_signals, stop_at_end_of_stdin};
use crate::scenes::user_cache_folder;
use crate::shutdown::ShutdownHandle;

/// Environment variable with the name of a worker without `--name`. Unlike a command line, it is not readable for other
/// users of the machine.
pub const NAME_VARIABLE: &str = "RAYFARM_WORKER_NAME";

/// A render node of rayfarm: traces segments for a master with all cores.
#[derive(Debug, Parser)]
#[command(name = "rayfarm-worker", version)]
struct Cli {
    #[command(flatten)]
    worker: WorkerArgs,
}

/// Arguments of a worker. Another command line can flatten them.
#[derive(Clone, Debug, Args)]
pub struct WorkerArgs {
    /// Address of the master
    #[arg(long, value_name = "HOST:PORT", value_parser = host_and_port)]
    pub master: String,

    /// Number of render threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,

    /// Name of this worker in the master's displays [default: the environment's RAYFARM_WORKER_NAME, or the name of this
    /// machine]
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,

    /// Memory for scenes and meshes; the least recently used are dropped first
    #[arg(long, value_name = "MIB", default_value_t = 2048, value_parser = clap::value_parser!(u64).range(1..=1 << 24))]
    pub asset_cache: u64,

    /// Folder that keeps scenes and meshes for later runs [default: in the user's cache folder, for masters on other
    /// machines]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,

    /// Keep no scenes and meshes on the disk
    #[arg(long, conflicts_with_all = ["cache", "cache_limit"])]
    pub no_cache: bool,

    /// Disk space for scenes and meshes; the least recently used are removed first
    #[arg(long, value_name = "MIB", default_value_t = 4096, value_parser = clap::value_parser!(u64).range(1..=1 << 24))]
    pub cache_limit: u64,

    /// Encoding of the pixels that are sent
    #[arg(long, value_name = "HOW", value_enum, default_value_t = PixelEncoding::Auto)]
    pub pixels: PixelEncoding,

    /// Address and port to serve scenes and meshes to other workers, so that the master sends them once; or off [default:
    /// a free port, for masters on other machines]
    #[arg(long, value_name = "off|ADDR:PORT", value_parser = share)]
    pub share: Option<Share>,

    /// End at the end of standard input, and so with the process that started this worker
    #[arg(long)]
    pub exit_with_stdin: bool,

    /// End with the master, instead of waiting for the next master at its address
    #[arg(long)]
    pub once: bool,

    /// End with an error when the connection fails, instead of connecting again; and end with the master
    #[arg(long)]
    pub no_reconnect: bool,

    /// Log more
    #[arg(long, short, conflicts_with = "quiet")]
    pub verbose: bool,

    /// Log errors only
    #[arg(long, short)]
    pub quiet: bool,
}

/// Values of `--pixels`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PixelEncoding {
    /// Compressed to another machine, raw within this one
    Auto,
    /// Not compressed
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
            security: Default::default(),
            compress: match self.pixels {
                PixelEncoding::Auto => None,
                PixelEncoding::Raw => Some(false),
                PixelEncoding::Lz4 => Some(true),
            },
        }
    }

    /// Options of the disk cache. A folder of the command line is used with every master.
    fn disk_cache(&self) -> Option<DiskCacheOptions> {
        let folder = self.cache.clone().or_else(user_cache_folder).filter(|_| !self.no_cache)?;
        let limit_bytes = self.cache_limit << 20;
        Some(DiskCacheOptions { folder, limit_bytes, within_machine: self.cache.is_some() })
    }
}

/// Definition of the worker's command line, for completions and manual pages.
pub fn command_line() -> clap::Command {
    Cli::command()
}

/// Runs the program: parses `args` (the first is the program's name), logs to standard error, and renders. The exit code
/// is 0 after a disconnect or a signal, 1 after an error, 2 for a wrong command line.
pub fn main_from<I>(args: I) -> ExitCode
where
    I: IntoIterator,
    I::Item: Into<OsString> + Clone,
{
    match Cli::try_parse_from(args) {
        Ok(cli) => main_with(&cli.worker),
        Err(error) => {
            // A failure to print has no other output to report it.
            let _ = error.print();
            u8::try_from(error.exit_code()).map_or(ExitCode::FAILURE, ExitCode::from)
        }
    }
}

/// Runs the program with parsed arguments: see [`main_from`]. Installs its own logging where none is installed.
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
    let shutdown = ShutdownHandle::new();
    if args.exit_with_stdin {
        stop_at_end_of_stdin(shutdown.clone());
    }
    let result = runtime.block_on(async {
        tokio::spawn(shut_down_on_signals(shutdown.clone()));
        run(args.options(), shutdown).await
    });
    // Does not wait for a mesh that is being decoded.
    runtime.shutdown_background();
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            tracing::error!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// Installs a log to standard error. `RUST_LOG` takes precedence over the flags.
fn log_to_stderr(args: &WorkerArgs) {
    let level = match (args.verbose, args.quiet) {
        (true, _) => "debug",
        (_, true) => "error",
        _ => "info",
    };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level));
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    let log = log.with_target(false).with_ansi(std::io::stderr().is_terminal());
    // Fails where the program has installed its own log.
    let _ = log.try_init();
}

/// Validates the form of `HOST:PORT`. The host is resolved when the worker connects.
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

/// Parses the value of `--share`.
fn share(text: &str) -> Result<Share, String> {
    if text == "off" {
        return Ok(Share::Off);
    }
    match address::parse(text)? {
        Some(address) => Ok(Share::At(address)),
        None => Err("expected off, or ADDR:PORT as in 192.168.1.20:7200 or [fe80::1%eth0]:7200".to_owned()),
    }
}

/// Name of this machine, or `unnamed`.
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
