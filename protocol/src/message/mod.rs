//! The messages of a session, and their conversion to and from envelopes.

mod body;
mod to_master;
mod to_worker;

use bytes::Bytes;
use serde::{Deserialize, Serialize};

use crate::envelope::{Envelope, Kind};
use crate::{AssetId, FrameId, PixelFormat, ProtocolError};

pub use to_master::ToMaster;
pub use to_worker::ToWorker;

#[cfg(feature = "transport")]
pub(crate) use body::{decode_control, decode_reason, encode_control, encode_reason};
#[cfg(feature = "transport")]
pub(crate) use to_worker::{decode_disconnect, encode_disconnect};

/// Introduction of a worker. Each text but the tags has at most [`crate::limits::MAX_NAME_BYTES`] bytes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// Name of the worker in logs and displays.
    pub name: String,
    /// Number of render threads, 1 to [`crate::limits::MAX_THREADS`].
    pub threads: u32,
    /// SIMD level selected at run time, for the log.
    pub simd: String,
    /// Version of the worker's software.
    pub software: String,
    /// Labels of the worker, at most [`crate::limits::MAX_TAGS`] of at most [`crate::limits::MAX_TAG_BYTES`] printable bytes.
    pub tags: Vec<String>,
}

/// Acceptance of a worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Welcome {
    /// Number of the worker within this run of the master.
    pub worker: u64,
}

/// Whether, and when, a worker may connect again after the end of its session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reconnect {
    /// Not to this master: the end was intended.
    Never,
    /// At once: the session failed, and the master continues.
    Now,
    /// To the next master that listens at the address: this one ends.
    NextMaster,
}

/// Announcement of a frame whose leases may follow. `view` is serialised once, and its bytes go to every worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameAnnounce {
    /// Frame that the message announces.
    pub frame: FrameId,
    /// The scene body that the frame shows.
    pub scene: AssetId,
    /// Number of pixels per row, 1 to [`crate::limits::MAX_FRAME_SIDE`].
    pub width: u32,
    /// Number of rows, 1 to [`crate::limits::MAX_FRAME_SIDE`].
    pub height: u32,
    /// Format of the pixels of its segments.
    pub format: PixelFormat,
    /// Everything that changes from frame to frame, opaque to the protocol; at most [`crate::limits::MAX_VIEW_BYTES`]
    /// bytes.
    pub view: Bytes,
}

/// Messages of one direction of a session: [`ToWorker`] or [`ToMaster`].
pub trait Message: Sized + Send + 'static {
    /// Description of the direction's messages, for errors.
    const EXPECTED: &'static str;

    /// Whether envelopes of this type belong to this direction.
    fn carries(kind: Kind) -> bool;

    /// Converts the message to an envelope. Bulk bytes are shared, not copied.
    ///
    /// # Errors
    /// A value out of the bounds of [`crate::limits`].
    fn to_envelope(&self) -> Result<Envelope, ProtocolError>;

    /// Converts the body of an envelope of type `kind` to a message. Bulk bytes are shared, not copied.
    ///
    /// # Errors
    /// A type of the other direction; a body that is no such message; a value out of bounds.
    fn from_body(kind: Kind, body: Bytes) -> Result<Self, ProtocolError>;
}
