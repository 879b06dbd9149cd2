//! Arguments of a worker.

use std::path::PathBuf;

use clap::{ArgGroup, Args, ValueEnum};
use rayfarm_protocol::{address, limits};

use crate::app::memory::MemoryBudget;
use crate::app::options::{DiskCacheOptions, Share, WorkerOptions};
use crate::app::trust::{JOIN_VARIABLE, JoinInput};
use crate::scenes::user_cache_folder;

/// Environment variable with the name of a worker without `--name`. Unlike a command line, it is not readable for other
/// users of the machine.
pub const NAME_VARIABLE: &str = "RAYFARM_WORKER_NAME";

/// Default of `--asset-cache`, in MiB.
const ASSET_CACHE_MIB: u64 = 2048;

/// Selection of the master that a worker joins. Without any, the remembered masters are tried.
#[derive(Clone, Debug, Args)]
#[command(group = ArgGroup::new("farm").args(["master", "join", "discover"]))]
pub struct FarmArgs {
    /// Address of a master without encryption: one on this machine, or one with --insecure
    #[arg(long, value_name = "HOST:PORT", value_parser = host_and_port)]
    pub master: Option<String>,

    /// Join line that the master prints, or - to read it from standard input, so that it is in no list of processes
    #[arg(long, value_name = "LINE|-")]
    pub join: Option<JoinInput>,

    /// Search the local network for masters, and join the one that is found
    #[arg(long)]
    pub discover: bool,
}

/// Arguments of a worker. Another command line can flatten them.
#[derive(Clone, Debug, Args)]
pub struct WorkerArgs {
    /// Master to join [default: the environment's RAYFARM_JOIN, or the remembered masters]
    #[command(flatten)]
    pub farm: FarmArgs,

    /// Do not save the join line for later starts
    #[arg(long)]
    pub no_remember: bool,

    /// Number of render threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,

    /// Name of this worker in the master's displays [default: the environment's RAYFARM_WORKER_NAME, or the name of this
    /// machine]
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,

    /// Labels of this worker for the master, separated by commas
    #[arg(long, value_name = "TAG,...", value_delimiter = ',', value_parser = tag)]
    pub tags: Vec<String>,

    /// Run with a lower priority than other programs: a niceness from 1 to 19
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "10", value_parser = clap::value_parser!(u8).range(1..=19))]
    pub nice: Option<u8>,

    /// Bound of the memory for scenes, meshes, messages and pixels together [default: none, see --asset-cache]
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(256..=1 << 24))]
    pub memory: Option<u64>,

    /// Memory for scenes and meshes; the least recently used are dropped first [default: 2048, or a part of --memory]
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u64).range(1..=1 << 24))]
    pub asset_cache: Option<u64>,

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
    /// Options of the worker, without a master.
    pub(super) fn options(&self) -> WorkerOptions {
        let budget = self.memory.map(MemoryBudget::of_mib);
        let asset_cache = self.asset_cache.map(|mib| mib << 20);
        let asset_cache_bytes = match (asset_cache, &budget) {
            (Some(bytes), Some(budget)) => bytes.min(budget.asset_bytes),
            (Some(bytes), None) => bytes,
            (None, Some(budget)) => budget.asset_bytes,
            (None, None) => ASSET_CACHE_MIB << 20,
        };
        let default_share = match &budget {
            Some(budget) if !budget.allows_peers => Share::Off,
            _ => Share::Auto,
        };
        WorkerOptions {
            master: String::new(),
            threads: self.threads.map(usize::from),
            name: self.name(),
            tags: self.tags.clone(),
            reconnect: !self.no_reconnect,
            once: self.once,
            asset_cache_bytes,
            max_segment_bytes: budget.map(|budget| budget.segment_bytes),
            disk_cache: self.disk_cache(),
            share: self.share.unwrap_or(default_share),
            security: Default::default(),
            compress: match self.pixels {
                PixelEncoding::Auto => None,
                PixelEncoding::Raw => Some(false),
                PixelEncoding::Lz4 => Some(true),
            },
        }
    }

    fn name(&self) -> String {
        let of_environment = || std::env::var(NAME_VARIABLE).ok();
        self.name.clone().or_else(of_environment).unwrap_or_else(machine_name)
    }

    /// Options of the disk cache. A folder of the command line is used with every master.
    fn disk_cache(&self) -> Option<DiskCacheOptions> {
        let folder = self.cache.clone().or_else(user_cache_folder).filter(|_| !self.no_cache)?;
        let limit_bytes = self.cache_limit << 20;
        Some(DiskCacheOptions { folder, limit_bytes, within_machine: self.cache.is_some() })
    }
}

/// Validates the form of `HOST:PORT`. The host is resolved when the worker connects.
pub(super) fn host_and_port(text: &str) -> Result<String, String> {
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

/// Validates one label of `--tags`.
fn tag(text: &str) -> Result<String, String> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    if text.is_empty() || text.len() > limits::MAX_TAG_BYTES || !text.chars().all(is_plain) {
        let limit = limits::MAX_TAG_BYTES;
        return Err(format!("a tag has 1 to {limit} letters, digits, \"-\", \"_\" and \".\""));
    }
    Ok(text.to_owned())
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
        let output = std::process::Command::new("hostname").env_remove(JOIN_VARIABLE).output().ok()?;
        String::from_utf8(output.stdout).ok()
    };
    let name = file.or_else(command).unwrap_or_default();
    match name.trim() {
        "" => "unnamed".to_owned(),
        name => name.to_owned(),
    }
}
