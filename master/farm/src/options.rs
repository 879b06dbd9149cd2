//! The setup of a farm.

use std::net::SocketAddr;

use rayfarm_protocol::transport::MasterSecurity;
use rayfarm_scheduler::SegmentPolicy;

use crate::supervisor::LocalWorkerCommand;

/// The default port for workers.
pub const DEFAULT_PORT: u16 = 7117;

/// The setup of a farm.
#[derive(Clone, Debug, Default)]
pub struct FarmOptions {
    /// The address to listen at for workers. `None`: 127.0.0.1 at [`DEFAULT_PORT`], or at a free port when that one is
    /// taken. An explicit address that is taken is an error.
    pub listen: Option<SocketAddr>,
    /// Worker processes to start on this machine. They end with the farm.
    pub local_workers: u32,
    /// The command line of a local worker.
    pub local_worker: LocalWorkerCommand,
    /// Render threads of each local worker; `None` divides the cores among them, at least one each.
    pub threads: Option<usize>,
    /// Policy by which frames are cut into segments.
    pub policy: SegmentPolicy,
    /// Whether each frame starts only when its predecessor is complete. Otherwise workers without work in one frame start
    /// the next: more frames per second, each with an older camera.
    pub sequential: bool,
    /// The share of the segments, in percent (0 to 100), that are rendered a second time, by another worker or the master,
    /// to find workers that send wrong pixels. They are drawn at random after their pixels have arrived.
    pub verify_percent: u8,
    /// Whether workers connect through TLS and must prove a token.
    pub security: MasterSecurity,
}
