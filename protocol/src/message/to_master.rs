//! What a worker says.

use bytes::{Buf, Bytes};

use super::Message;
use super::body::{decode_control, decode_reason, encode_control, encode_reason, nothing, split_head};
use crate::envelope::{Envelope, Kind};
use crate::limits::MAX_ASSET_BYTES;
use crate::pixels::{PIXELS_HEAD_BYTES, PixelsHeader};
use crate::{AssetId, FrameId, ProtocolError};

/// What a worker says to its master.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ToMaster {
    /// Send me this asset, or tell me who passes it on.
    NeedAsset {
        /// Its name.
        id: AssetId,
        /// From which byte on.
        offset: u64,
        /// Whether another worker was to pass it on and did not: the master is to send it itself.
        again: bool,
    },
    /// I pass assets on, at the address from which I am connected.
    Sharing {
        /// The port where I listen for other workers.
        port: u16,
    },
    /// All of this asset is here, and bears its name.
    HaveAsset {
        /// Its name.
        id: AssetId,
    },
    /// The rows of a lease.
    Pixels {
        /// Which rows, how they are written, and what they cost.
        header: PixelsHeader,
        /// The pixels.
        bytes: Bytes,
    },
    /// Answers a ping.
    Pong {
        /// The ping's number.
        nonce: u64,
    },
    /// None of this frame's leases will be rendered here.
    Failed {
        /// The frame.
        frame: FrameId,
        /// Why, for people.
        reason: String,
    },
    /// Give me no more leases; I finish those I hold.
    Drain,
    /// The last message.
    Goodbye {
        /// Why.
        reason: String,
    },
}

const FAILED_HEAD_BYTES: usize = 8;

impl Message for ToMaster {
    const EXPECTED: &'static str = "a message from a worker to its master";

    fn carries(kind: Kind) -> bool {
        match kind {
            Kind::NeedAsset | Kind::Pixels | Kind::Pong | Kind::Failed | Kind::Drain | Kind::Goodbye => true,
            Kind::Sharing | Kind::HaveAsset => true,
            Kind::Hello | Kind::Welcome | Kind::Refused => false,
            Kind::Frame | Kind::Segment | Kind::Cancel | Kind::Ping => false,
            Kind::AssetBegin | Kind::AssetChunk | Kind::AssetUnknown => false,
            Kind::AssetFrom | Kind::ShareKey | Kind::Fetch => false,
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
            Self::Pong { nonce } => encode_control(Kind::Pong, nonce),
            Self::Failed { frame, reason } => encode_reason(Kind::Failed, &frame.0.to_le_bytes(), reason),
            Self::Drain => Envelope::new(Kind::Drain, &[], Bytes::new()),
            Self::Goodbye { reason } => encode_reason(Kind::Goodbye, &[], reason),
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
            Kind::Pong => Self::Pong { nonce: decode_control(kind, &body)? },
            Kind::Failed => decode_failed(body)?,
            Kind::Drain => nothing(kind, &body).map(|()| Self::Drain)?,
            Kind::Goodbye => Self::Goodbye { reason: decode_reason(&body) },
            Kind::Hello | Kind::Welcome | Kind::Refused => return Err(unexpected(kind)),
            Kind::Frame | Kind::Segment | Kind::Cancel | Kind::Ping => return Err(unexpected(kind)),
            Kind::AssetBegin | Kind::AssetChunk | Kind::AssetUnknown => return Err(unexpected(kind)),
            Kind::AssetFrom | Kind::ShareKey | Kind::Fetch => return Err(unexpected(kind)),
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
    Err(ProtocolError::malformed(Kind::NeedAsset, format!("byte {offset} lies beyond the end of any asset")))
}

fn checked_port(port: u16) -> Result<u16, ProtocolError> {
    if port > 0 { Ok(port) } else { Err(ProtocolError::malformed(Kind::Sharing, "nobody listens at port 0")) }
}

fn decode_pixels(mut body: Bytes) -> Result<ToMaster, ProtocolError> {
    let header = PixelsHeader::from_bytes(split_head::<PIXELS_HEAD_BYTES>(Kind::Pixels, &mut body)?)?;
    check_rows(&header)?;
    Ok(ToMaster::Pixels { header, bytes: body })
}

/// The number of bytes is the framebuffer's to check: only it knows how wide the frame is.
fn check_rows(header: &PixelsHeader) -> Result<(), ProtocolError> {
    match header.lease.rows() {
        Some(_) => Ok(()),
        None => Err(ProtocolError::malformed(Kind::Pixels, format!("{} is no run of rows", header.lease))),
    }
}

fn decode_failed(mut body: Bytes) -> Result<ToMaster, ProtocolError> {
    let head = split_head::<FAILED_HEAD_BYTES>(Kind::Failed, &mut body)?;
    Ok(ToMaster::Failed { frame: FrameId(head.as_slice().get_u64_le()), reason: decode_reason(&body) })
}
