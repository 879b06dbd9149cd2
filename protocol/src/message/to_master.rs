//! What a worker says.

use bytes::{Buf, Bytes};

use super::Message;
use super::body::{decode_control, decode_reason, encode_control, encode_reason, nothing, split_head};
use crate::envelope::{Envelope, Kind};
use crate::pixels::{PIXELS_HEAD_BYTES, PixelsHeader};
use crate::{AssetId, FrameId, ProtocolError};

/// What a worker says to its master.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ToMaster {
    /// Send me this asset.
    NeedAsset {
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
            Kind::Hello | Kind::Welcome | Kind::Refused => false,
            Kind::Frame | Kind::Segment | Kind::Cancel | Kind::Ping => false,
            Kind::AssetBegin | Kind::AssetChunk | Kind::AssetUnknown => false,
        }
    }

    fn to_envelope(&self) -> Result<Envelope, ProtocolError> {
        match self {
            Self::NeedAsset { id } => encode_control(Kind::NeedAsset, id),
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
            Kind::NeedAsset => Self::NeedAsset { id: decode_control(kind, &body)? },
            Kind::Pixels => decode_pixels(body)?,
            Kind::Pong => Self::Pong { nonce: decode_control(kind, &body)? },
            Kind::Failed => decode_failed(body)?,
            Kind::Drain => nothing(kind, &body).map(|()| Self::Drain)?,
            Kind::Goodbye => Self::Goodbye { reason: decode_reason(&body) },
            Kind::Hello | Kind::Welcome | Kind::Refused => return Err(unexpected(kind)),
            Kind::Frame | Kind::Segment | Kind::Cancel | Kind::Ping => return Err(unexpected(kind)),
            Kind::AssetBegin | Kind::AssetChunk | Kind::AssetUnknown => return Err(unexpected(kind)),
        })
    }
}

fn unexpected(kind: Kind) -> ProtocolError {
    ProtocolError::Unexpected { kind, expected: ToMaster::EXPECTED }
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
