//! Messages from a worker to its master.

use bytes::{Buf, Bytes};

use super::Message;
use super::body::{decode_control, decode_reason, encode_control, encode_reason, expect_empty, split_head};
use crate::envelope::{Envelope, Kind};
use crate::limits::MAX_ASSET_BYTES;
use crate::pixels::{PIXELS_HEAD_BYTES, PixelsHeader};
use crate::{AssetId, FrameId, ProtocolError};

/// Message from a worker to its master.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ToMaster {
    /// Requests an asset from the master, or the address of a worker that serves it.
    NeedAsset {
        /// The asset.
        id: AssetId,
        /// First byte that is requested.
        offset: u64,
        /// Whether a transfer from another worker has failed, so that the master must send the asset itself.
        again: bool,
    },
    /// Announces that the worker serves assets to other workers, at the address from which it is connected.
    Sharing {
        /// The port at which it listens for other workers.
        port: u16,
    },
    /// Reports that all of an asset has arrived and matches its hash.
    HaveAsset {
        /// The asset.
        id: AssetId,
    },
    /// Delivers the rows of a lease.
    Pixels {
        /// Lease, encoding and cost.
        header: PixelsHeader,
        /// The encoded pixels.
        bytes: Bytes,
    },
    /// Replies to a ping.
    Pong {
        /// Number of the ping.
        nonce: u64,
        /// Whether the worker's threads have finished a step of their work (a tile, a batch of rays, a part of the
        /// preparation of a scene) since the previous pong of the session.
        progressed: bool,
    },
    /// Reports that the worker renders none of a frame's leases.
    Failed {
        /// The frame.
        frame: FrameId,
        /// The reason, as text.
        reason: String,
    },
    /// Requests that the master sends no more leases. The worker finishes those that it has.
    Drain,
    /// Ends the session. No message follows.
    Disconnect {
        /// The reason, as text.
        reason: String,
    },
}

const FAILED_HEAD_BYTES: usize = 8;

impl Message for ToMaster {
    const EXPECTED: &'static str = "a message from a worker to its master";

    fn carries(kind: Kind) -> bool {
        match kind {
            Kind::NeedAsset | Kind::Pixels | Kind::Pong | Kind::Failed | Kind::Drain | Kind::Disconnect => {
                true
            }
            Kind::Sharing | Kind::HaveAsset => true,
            Kind::Hello | Kind::Welcome | Kind::Refused | Kind::Proof => false,
            Kind::Frame | Kind::Segment | Kind::Cancel | Kind::Ping => false,
            Kind::AssetBegin | Kind::AssetChunk | Kind::AssetUnknown => false,
            Kind::AssetFrom | Kind::ShareKey | Kind::PeerRequest => false,
        }
    }

    fn to_envelope(&self) -> Result<Envelope, ProtocolError> {
        match self {
            Self::NeedAsset { id, offset, again } => {
                encode_control(Kind::NeedAsset, &(id, checked_offset(*offset)?, again))
            }
            Self::Sharing { port } => encode_control(Kind::Sharing, &checked_port(*port)?),
            Self::HaveAsset { id } => encode_control(Kind::HaveAsset, id),
            Self::Pixels { header, bytes } => {
                check_rows(header)?;
                Envelope::new(Kind::Pixels, &header.to_bytes(), bytes.clone())
            }
            Self::Pong { nonce, progressed } => encode_control(Kind::Pong, &(nonce, progressed)),
            Self::Failed { frame, reason } => encode_reason(Kind::Failed, &frame.0.to_le_bytes(), reason),
            Self::Drain => Envelope::new(Kind::Drain, &[], Bytes::new()),
            Self::Disconnect { reason } => encode_reason(Kind::Disconnect, &[], reason),
        }
    }

    fn from_body(kind: Kind, body: Bytes) -> Result<Self, ProtocolError> {
        Ok(match kind {
            Kind::NeedAsset => {
                let (id, offset, again) = decode_control(kind, &body)?;
                Self::NeedAsset { id, offset: checked_offset(offset)?, again }
            }
            Kind::Sharing => Self::Sharing { port: checked_port(decode_control(kind, &body)?)? },
            Kind::HaveAsset => Self::HaveAsset { id: decode_control(kind, &body)? },
            Kind::Pixels => decode_pixels(body)?,
            Kind::Pong => {
                let (nonce, progressed) = decode_control(kind, &body)?;
                Self::Pong { nonce, progressed }
            }
            Kind::Failed => decode_failed(body)?,
            Kind::Drain => expect_empty(kind, &body).map(|()| Self::Drain)?,
            Kind::Disconnect => Self::Disconnect { reason: decode_reason(&body) },
            Kind::Hello | Kind::Welcome | Kind::Refused | Kind::Proof => return Err(unexpected(kind)),
            Kind::Frame | Kind::Segment | Kind::Cancel | Kind::Ping => return Err(unexpected(kind)),
            Kind::AssetBegin | Kind::AssetChunk | Kind::AssetUnknown => return Err(unexpected(kind)),
            Kind::AssetFrom | Kind::ShareKey | Kind::PeerRequest => return Err(unexpected(kind)),
        })
    }
}

fn unexpected(kind: Kind) -> ProtocolError {
    ProtocolError::Unexpected { kind, expected: ToMaster::EXPECTED }
}

fn checked_offset(offset: u64) -> Result<u64, ProtocolError> {
    if offset <= MAX_ASSET_BYTES {
        return Ok(offset);
    }
    Err(ProtocolError::malformed(Kind::NeedAsset, format!("byte {offset} is beyond the end of any asset")))
}

fn checked_port(port: u16) -> Result<u16, ProtocolError> {
    if port > 0 {
        Ok(port)
    } else {
        Err(ProtocolError::malformed(Kind::Sharing, "port 0 is no port to listen at"))
    }
}

fn decode_pixels(mut body: Bytes) -> Result<ToMaster, ProtocolError> {
    let header = PixelsHeader::from_bytes(split_head::<PIXELS_HEAD_BYTES>(Kind::Pixels, &mut body)?)?;
    check_rows(&header)?;
    Ok(ToMaster::Pixels { header, bytes: body })
}

/// Checks the rows only. The framebuffer checks the number of bytes, because only it has the width of the frame.
fn check_rows(header: &PixelsHeader) -> Result<(), ProtocolError> {
    match header.lease.rows() {
        Some(_) => Ok(()),
        None => Err(ProtocolError::malformed(
            Kind::Pixels,
            format!("{} has no valid range of rows", header.lease),
        )),
    }
}

fn decode_failed(mut body: Bytes) -> Result<ToMaster, ProtocolError> {
    let head = split_head::<FAILED_HEAD_BYTES>(Kind::Failed, &mut body)?;
    Ok(ToMaster::Failed { frame: FrameId(head.as_slice().get_u64_le()), reason: decode_reason(&body) })
}
