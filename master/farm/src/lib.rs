//! The farm: frames are requested, workers render them, finished pictures come back.
//!
//! ```text
//! let mut farm = Farm::start(options, scene).await?;
//! farm.request(view);
//! let frame = farm.finished().await?;
//! farm.shut_down().await;
//! ```
//!
//! The crate has no command line and no display. [`rayfarm_scheduler`] decides which worker renders which rows; this
//! crate owns the sessions, the clock and the pixels.

pub mod accounting;
#[cfg(any(test, feature = "testing"))]
pub mod testing;

mod assets;
mod control;
mod driver;
mod error;
mod farm;
mod finished;
mod framebuffer;
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
pub use finished::{FinishedFrame, FrameCounts};
pub use framebuffer::FramePixels;
pub use options::{DEFAULT_PORT, FarmOptions, FarmScene};
pub use rayfarm_protocol::FrameId;
pub use rayfarm_scheduler::{SegmentPolicy, Verification, WorkerState};
pub use sessions::addresses::Reachable;
pub use sessions::lease_book::{LeaseBook, LeaseStatus};
pub use status::{BannedWorker, FarmStatus, RunTotals, WorkerStatus};
pub use supervisor::LocalWorkerCommand;
pub use verification::delivered::{FrameSet, as_text};
pub use view_request::ViewRequest;
