//! Accounting: how each render thread of each worker spends its time.
//!
//! Pure: events come in with their time, accounts come out. No clock, no socket.
//!
//! The whole is *thread time*: a worker with four render threads that is connected for one second has four seconds of it.
//! Each nanosecond is attributed to one part, so the parts of a worker sum to 100 % by construction:
//!
//! | part | the worker's threads ... |
//! | --- | --- |
//! | trace | rendered rows for a picture or for a verification, as measured by the worker |
//! | encode | encoded these rows, as measured by the worker |
//! | decode | were idle while the master decoded their pixels |
//! | send | were idle while leases or pixels were on the wire |
//! | wait | were idle although the worker held leases (its frame was being prepared, or some threads ran out of rows earlier than others), or because no frame was requested |
//! | idle tail | had no rows while other workers finished a frame, or rendered rows that are in no picture: another worker was faster, or the frame was dropped |
//! | scene | waited for the scene: from the worker's request for an asset until it replies to a lease, minus what it traced |
//!
//! Overlapped time costs nothing: a thread that traces while pixels of its worker are on the wire counts as tracing. So
//! `send` and `decode` are upper bounds of what a faster link and a faster master can gain.
//!
//! The account of a frame covers the time from the end of the previous frame to its own. Time under a lease is attributed
//! when the lease is answered, because its use is unknown before: it counts for the frame that is finished next.

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
pub use pace::duration_text;
pub use parts::{PART_COUNT, PART_NAMES, Parts};
pub use run::{AccountReport, Percent, RunAccount, WorkerReport};
pub use timeline_file::{TimelineError, TimelineFile, TimelineSink};
