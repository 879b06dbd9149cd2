//! Options of a worker.

use std::net::SocketAddr;
use std::path::PathBuf;

use rayfarm_protocol::transport::WorkerSecurity;

/// Options of a worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkerOptions {
    /// Address of the master as HOST:PORT.
    pub master: String,
    /// Number of render threads; `None` for one per core.
    pub threads: Option<usize>,
    /// Name of the worker in the master's logs and displays.
    pub name: String,
    /// Labels of the worker, which the master can select workers by.
    pub tags: Vec<String>,
    /// Whether to connect again, with exponential backoff, after a failed connection.
    pub reconnect: bool,
    /// Whether to end with the first master that ends in order, instead of waiting for the next one.
    pub once: bool,
    /// Largest size of the scenes and meshes that are kept in memory, in bytes.
    pub asset_cache_bytes: u64,
    /// Largest pixels of a segment that are rendered, in bytes; `None` for the bound of the protocol.
    pub max_segment_bytes: Option<usize>,
    /// Cache of assets on the disk, if any.
    pub disk_cache: Option<DiskCacheOptions>,
    /// Whether pixels are compressed; `None` for compression on connections to another machine only.
    pub compress: Option<bool>,
    /// Whether, and where, the worker serves assets to other workers.
    pub share: Share,
    /// Whether the worker connects through TLS, with which keys and token.
    pub security: WorkerSecurity,
}

/// Whether, and where, a worker serves assets to other workers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Share {
    /// At a free port, where the master runs on another machine; nowhere otherwise.
    #[default]
    Auto,
    /// At this address.
    At(SocketAddr),
    /// Nowhere.
    Off,
}

/// Options of the cache of assets on the disk, which later runs and other workers of the machine share.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DiskCacheOptions {
    /// Folder of the cache.
    pub folder: PathBuf,
    /// Largest total size of its files, in bytes.
    pub limit_bytes: u64,
    /// Whether it is used with a master on this machine, whose assets are on this disk already.
    pub within_machine: bool,
}
