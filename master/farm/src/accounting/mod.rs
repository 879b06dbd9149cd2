//! Where did my frames per second go? What every render thread of every worker did with its time.
//!
//! Pure: what happened comes in with its time, accounts come out. No clock, no socket.
//!
//! The whole is *thread time*: a worker with four render threads that is connected for a second has four seconds to
//! spend. Each nanosecond of it is put down to one part, so the parts of a worker sum to 100 % by construction:
//!
//! | part | the worker's threads ... |
//! | --- | --- |
//! | trace | rendered rows that came into a picture, or that verified others, as the worker measures it |
//! | encode | made these rows small for the wire, as the worker measures it |
//! | decode | had nothing to do while the master took their pixels in |
//! | send | had nothing to do while leases or pixels were on the wire |
//! | wait | had nothing to do though the worker held leases (they waited for the frame to be prepared, or threads ran out of rows before others did), or because no frame was asked for |
//! | idle tail | had no rows while a frame was finished by others, or rendered rows in vain: others were faster, or nobody wanted them any more |
//! | scene | waited for the scene: from the worker's request for an asset until it answers a lease, less what it traced |
//!
//! What is hidden costs nothing: a thread that traces while pixels of its worker are on the wire traces. So `send`
//! and `decode` are what a better link and a faster master could win at most.
//!
//! A frame's account covers the time from the frame before it to the moment it is done. Time under a lease is put
//! down when the lease is answered, for only then it is known what became of it: it counts for the frame that is done next.

mod accounts;
mod fading;
mod ledger;
pub(crate) mod pace;
mod parts;
mod run;
mod span;
mod timeline_file;

#[cfg(test)]
mod tests;

pub(crate) use accounts::Accounts;
pub use accounts::{FrameAccount, SegmentNote, WorkerAccount};
pub use fading::{Fading, Smoothed};
pub use pace::spoken;
pub use parts::{PART_COUNT, PART_NAMES, Parts};
pub use run::{AccountReport, Percent, RunAccount, WorkerReport};
pub use timeline_file::{TimelineError, TraceFile, TraceSink};
