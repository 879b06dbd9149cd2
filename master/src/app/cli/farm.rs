//! Options of the farm: workers, and how frames are divided among them.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Args;
use rayfarm_farm::{FarmOptions, LocalWorkerCommand, SegmentPolicy};

use rayfarm_protocol::transport::MasterSecurity;

use super::LOCAL_WORKER;
use super::values::{listen_address, thread_count, worker_count};

/// Workers, and how frames are divided among them.
#[derive(Clone, Debug, Args)]
pub(crate) struct FarmArgs {
    /// Address at which workers connect, for workers on other machines [default: 127.0.0.1:7117].
    #[arg(long, value_name = "ADDR:PORT", value_parser = listen_address)]
    pub(super) listen: Option<SocketAddr>,
    /// Secure the connections of workers on this machine too: TLS, and only with the join line. Where other machines can connect, that
    /// is the default.
    #[arg(long, conflicts_with = "insecure")]
    pub(crate) secure: bool,
    /// Connections without TLS: every machine that reaches the port can join, see the scene and alter pictures.
    #[arg(long)]
    pub(crate) insecure: bool,
    /// Folder with the key and the token of this master; without it, in the user's state folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) state: Option<PathBuf>,
    /// Do not announce this master in the local network, where `rayfarm-worker --discover` finds it.
    #[cfg(feature = "discovery")]
    #[arg(long)]
    pub(crate) no_announce: bool,
    /// Number of worker processes that the master starts on this machine.
    #[arg(long, value_name = "N", default_value = "1", value_parser = worker_count)]
    pub(super) local_workers: u32,
    /// Start no worker: wait for workers to connect.
    #[arg(long, conflicts_with = "local_workers")]
    pub(super) no_local_workers: bool,
    /// Render threads of each local worker; without it, the workers share all cores.
    #[arg(long, value_name = "N", value_parser = thread_count)]
    pub(crate) threads: Option<usize>,
    /// Policy for the size of segments: static:ROWS, smart:ROWS or adaptive.
    #[arg(long, value_name = "POLICY", default_value = "adaptive")]
    pub(super) segment: SegmentPolicy,
    /// Frames that workers may begin before the current one is complete: 1, or 0 for the newest camera.
    #[arg(long, value_name = "0|1", default_value = "1", value_parser = clap::value_parser!(u8).range(0..=1))]
    pub(super) pipeline: u8,
    /// Render this share of the segments on a second worker too, and ban workers that send wrong pixels.
    #[arg(long, value_name = "PERCENT", default_value = "0", value_parser = clap::value_parser!(u8).range(0..=100))]
    pub(super) verify: u8,
}

impl FarmArgs {
    /// Whether segments are verified, and frames may be rendered again.
    pub(crate) fn verifies(&self) -> bool {
        self.verify > 0
    }

    /// Local workers to start.
    pub(crate) fn local_workers(&self) -> u32 {
        if self.no_local_workers { 0 } else { self.local_workers }
    }

    /// Whether other machines can connect.
    pub(crate) fn listens_beyond_this_machine(&self) -> bool {
        self.listen.is_some_and(|address| !address.ip().to_canonical().is_loopback())
    }

    /// Options of the farm.
    pub(crate) fn options(&self, security: MasterSecurity) -> FarmOptions {
        FarmOptions {
            listen: self.listen,
            local_workers: self.local_workers(),
            local_worker: local_worker(),
            threads: self.threads,
            policy: self.segment,
            sequential: self.pipeline == 0,
            verify_percent: self.verify,
            security,
        }
    }
}

/// This program, run again as a worker.
fn local_worker() -> LocalWorkerCommand {
    LocalWorkerCommand {
        // Without a known path, the search path may have the program, and a failure to start it is reported.
        program: std::env::current_exe().unwrap_or_else(|_| "rayfarm-master".into()),
        args: vec![LOCAL_WORKER.into()],
        name_variable: rayfarm_worker::cli::NAME_VARIABLE.to_owned(),
    }
}
