//! Types of messages: their numbers on the wire and their bounds.

use std::fmt;

use crate::limits::{MAX_CHUNK_BYTES, MAX_CONTROL_BYTES, MAX_PIXELS_BYTES, MAX_VIEW_BYTES, PROOF_BYTES};

/// Number of bytes of the longest fixed-layout head between a header and the bulk bytes of a message.
pub(crate) const MAX_HEAD_BYTES: usize = 88;

/// Type of an envelope. The numbers are those of the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Kind {
    /// A worker introduces itself.
    Hello = 0x01,
    /// A master accepts a worker.
    Welcome = 0x02,
    /// A handshake is refused. The body is the reason as plain UTF-8, in every version.
    Refused = 0x03,
    /// A worker proves the token of the farm, before its hello and with TLS only.
    Proof = 0x04,
    /// Announcement of a frame whose leases may follow.
    Frame = 0x10,
    /// A lease.
    Segment = 0x11,
    /// Cancellation of all frames before a given one.
    Cancel = 0x12,
    /// Announcement of an asset that follows in chunks.
    AssetBegin = 0x13,
    /// A part of an asset.
    AssetChunk = 0x14,
    /// The sender does not have a requested asset.
    AssetUnknown = 0x15,
    /// Address of a worker that serves a requested asset.
    AssetFrom = 0x16,
    /// The key of the tokens that open assets at this worker.
    ShareKey = 0x17,
    /// Request for an asset.
    NeedAsset = 0x20,
    /// The rows of a lease.
    Pixels = 0x21,
    /// A worker cannot render a frame.
    Failed = 0x22,
    /// A worker serves assets to other workers.
    Sharing = 0x23,
    /// A worker has received all of an asset.
    HaveAsset = 0x24,
    /// Request for a pong; between workers a keepalive.
    Ping = 0x30,
    /// Reply to a ping.
    Pong = 0x31,
    /// Announcement that no more leases follow, or a request for none.
    Drain = 0x32,
    /// The last message of a session.
    Disconnect = 0x33,
    /// Request of a worker for an asset of another worker.
    PeerRequest = 0x40,
}

impl Kind {
    /// All types.
    pub const ALL: [Kind; 22] = [
        Self::Hello,
        Self::Welcome,
        Self::Refused,
        Self::Proof,
        Self::Frame,
        Self::Segment,
        Self::Cancel,
        Self::AssetBegin,
        Self::AssetChunk,
        Self::AssetUnknown,
        Self::AssetFrom,
        Self::ShareKey,
        Self::NeedAsset,
        Self::Pixels,
        Self::Failed,
        Self::Sharing,
        Self::HaveAsset,
        Self::Ping,
        Self::Pong,
        Self::Drain,
        Self::Disconnect,
        Self::PeerRequest,
    ];

    /// Largest body of this type, in bytes.
    pub fn limit_bytes(self) -> usize {
        match self {
            Self::Frame => MAX_HEAD_BYTES + MAX_VIEW_BYTES,
            Self::AssetChunk => MAX_HEAD_BYTES + MAX_CHUNK_BYTES,
            Self::Pixels => MAX_HEAD_BYTES + MAX_PIXELS_BYTES,
            Self::Proof => PROOF_BYTES,
            Self::Hello | Self::Welcome | Self::Refused => MAX_CONTROL_BYTES,
            Self::Segment | Self::Cancel | Self::AssetBegin | Self::AssetUnknown => MAX_CONTROL_BYTES,
            Self::AssetFrom | Self::ShareKey | Self::Sharing | Self::HaveAsset => MAX_CONTROL_BYTES,
            Self::NeedAsset | Self::Failed | Self::Ping | Self::Pong => MAX_CONTROL_BYTES,
            Self::Drain | Self::Disconnect | Self::PeerRequest => MAX_CONTROL_BYTES,
        }
    }

    pub(crate) fn from_byte(byte: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| *kind as u8 == byte)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a {self:?} message")
    }
}
