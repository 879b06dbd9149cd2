//! What the two sides say. Every message knows its envelope, and the other way round.

mod body;
mod to_master;
mod to_worker;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::envelope::{Envelope, Kind};
use crate::{AssetId, FrameId, ProtocolError};

pub use to_master::ToMaster;
pub use to_worker::ToWorker;

#[cfg(feature = "transport")]
pub(crate) use body::{decode_control, decode_reason, encode_control, encode_reason};
#[cfg(feature = "transport")]
pub(crate) use to_worker::{decode_goodbye, encode_goodbye};

/// A worker says who it is. Texts are at most [`crate::limits::MAX_NAME_BYTES`] each.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// What people call the machine.
    pub name: String,
    /// Render threads, at least 1.
    pub threads: u32,
    /// The SIMD level chosen at run time, for the log.
    pub simd: String,
    /// The release of the software.
    pub software: String,
}

/// A master takes a worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Welcome {
    /// The worker's number in this run of the master.
    pub worker: u64,
}

/// When a worker whose session has ended may connect again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reconnect {
    /// Not to this master: the worker was meant to leave.
    Never,
    /// Now: this session has failed, and the master goes on.
    Now,
    /// When another master listens there: this one ends.
    NextMaster,
}

/// A frame that leases may follow for. The same bytes go to every worker: `view` is serialised once and shared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameAnnounce {
    /// The frame.
    pub frame: FrameId,
    /// The scene body it shows.
    pub scene: AssetId,
    /// Pixels per row, 1 to [`crate::limits::MAX_FRAME_SIDE`].
    pub width: u32,
    /// Rows, likewise.
    pub height: u32,
    /// What changes from frame to frame, opaque here; at most [`crate::limits::MAX_VIEW_BYTES`].
    pub view: Bytes,
}

/// One direction of a session: [`ToWorker`] or [`ToMaster`].
pub trait Message: Sized + Send + 'static {
    /// What this direction may carry, for error messages.
    const EXPECTED: &'static str;

    /// Whether envelopes of this type belong to this direction.
    fn carries(kind: Kind) -> bool;

    /// The message as an envelope; bulk bytes are shared, not copied.
    ///
    /// # Errors
    /// What breaks a bound of [`crate::limits`].
    fn to_envelope(&self) -> Result<Envelope, ProtocolError>;

    /// The message in the body of an envelope of type `kind`; bulk bytes stay where they are.
    ///
    /// # Errors
    /// A body that is no such message, or breaks a bound.
    fn from_body(kind: Kind, body: Bytes) -> Result<Self, ProtocolError>;
}
