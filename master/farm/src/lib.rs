//! The farm: frames are requested, workers render them, finished pictures come back.
//!
//! # Example
//!
//! A small frame; `examples/embed.rs` is the same as a program.
//!
//! ```
//! use rayfarm_farm::{Farm, FarmOptions, FarmScene};
//! use rayfarm_tracer::scene::{self, FrameView};
//! # use rayfarm_worker::{Share, ShutdownHandle, WorkerOptions};
//!
//! # #[tokio::main]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let loaded = scene::load("../../models/lights.toml".as_ref())?;
//! let view = FrameView { width: 64, height: 48, ..FrameView::of(&loaded.scene) };
//! let scene = FarmScene { scene: loaded.scene, meshes: loaded.meshes, textures: loaded.textures };
//! let listen = Some(([127, 0, 0, 1], 0).into());
//! let options = FarmOptions { listen, ..FarmOptions::default() };
//! let mut farm = Farm::start(options, scene).await?;
//! # let worker = WorkerOptions {
//! #     master: farm.address().to_string(), threads: Some(1), name: "embedded".to_owned(), reconnect: false, once: true,
//! #     asset_cache_bytes: 1 << 20, disk_cache: None, compress: None, share: Share::Off,
//! #     security: Default::default(), tags: Vec::new(), max_segment_bytes: None,
//! # };
//! # tokio::spawn(rayfarm_worker::run(worker, ShutdownHandle::new()));
//!
//! farm.request(view); // workers connect to `farm.address()`
//! let frame = farm.finished().await?;
//! assert_eq!(frame.pixels.len(), 64 * 48 * 3);
//! farm.shut_down().await;
//! # Ok(())
//! # }
//! ```
//!
//! The crate has no command line and no display. [`rayfarm_scheduler`] decides which worker renders which rows; this
//! crate owns the sessions, the clock and the pixels.

pub mod accounting;
#[cfg(any(test, feature = "testing"))]
pub mod testing;

mod admission;
mod assets;
mod bucket;
mod control;
mod descriptors;
mod driver;
mod error;
mod farm;
mod farm_scene;
mod finished;
mod format;
mod framebuffer;
mod host_table;
mod line_budget;
mod options;
mod server;
mod sessions;
mod status;
mod supervisor;
mod verification;
mod view_request;

#[cfg(test)]
mod tests;

pub use accounting::{FrameAccount, Parts, SegmentNote, WorkerAccount};
pub use assets::routing::{AssetRouting, AssetSource};
pub use assets::{AssetError, Assets, TransferStatus};
pub use control::FarmControl;
pub use error::{FarmError, UnknownWorker};
pub use farm::Farm;
pub use farm_scene::FarmScene;
pub use finished::{FinishedFrame, FrameCounts};
pub use format::wire_format;
pub use framebuffer::FramePixels;
pub use options::{DEFAULT_PORT, FarmOptions};
pub use rayfarm_protocol::FrameId;
pub use rayfarm_scheduler::{SegmentPolicy, Verification, WorkerState};
pub use sessions::addresses::{Entrance, Reachable};
pub use sessions::lease_book::{LeaseBook, LeaseStatus};
pub use status::{BannedWorker, FarmStatus, RunTotals, WorkerStatus};
pub use supervisor::LocalWorkerCommand;
pub use verification::delivered::{FrameSet, as_text};
pub use view_request::ViewRequest;
