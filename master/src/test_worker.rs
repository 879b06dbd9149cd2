//! A worker in the process of a test.

use std::net::SocketAddr;

use rayfarm_worker::{Share, ShutdownHandle, WorkerOptions};
use tokio::task::JoinHandle;

/// Starts a worker of one thread, named `correct`, that joins a master once.
pub(crate) fn start(master: SocketAddr) -> JoinHandle<()> {
    let options = WorkerOptions {
        master: master.to_string(),
        threads: Some(1),
        name: "correct".to_owned(),
        tags: Vec::new(),
        max_segment_bytes: None,
        reconnect: false,
        once: true,
        asset_cache_bytes: 1 << 20,
        disk_cache: None,
        compress: None,
        share: Share::Off,
        security: Default::default(),
    };
    tokio::spawn(async { drop(rayfarm_worker::run(options, ShutdownHandle::new()).await) })
}
