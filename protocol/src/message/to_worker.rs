//! Messages from a master to a worker.

use std::net::SocketAddr;

use bytes::{Buf, BufMut, Bytes};

use super::body::{decode_control, decode_reason, encode_control, encode_reason, expect_empty, split_head};
use super::{FrameAnnounce, Message, Reconnect};
use crate::envelope::{Envelope, Kind};
use crate::limits::{MAX_ASSET_BYTES, MAX_CHUNK_BYTES, MAX_FRAME_SIDE, MAX_VIEW_BYTES};
use crate::token::{ShareKey, Token};
use crate::{AssetId, FrameId, KeyHash, Lease, PixelFormat, ProtocolError};

/// Message from a master to a worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ToWorker {
    /// Announces a frame. Leases of it may follow.
    Frame(FrameAnnounce),
    /// Leases rows of a frame to the worker, which renders and sends them.
    Segment(Lease),
    /// Cancels all frames before a given one.
    Cancel {
        /// The first frame that is not cancelled.
        before: FrameId,
    },
    /// Announces a requested asset, which follows in chunks from the first requested byte to the last.
    AssetBegin {
        /// The asset.
        id: AssetId,
        /// Number of bytes of the whole asset, at most [`MAX_ASSET_BYTES`].
        size: u64,
    },
    /// Delivers a part of an asset.
    AssetChunk {
        /// The asset.
        id: AssetId,
        /// Position of the bytes in the asset.
        offset: u64,
        /// The bytes, 1 to [`MAX_CHUNK_BYTES`] of them.
        bytes: Bytes,
    },
    /// Names another worker that serves a requested asset.
    AssetFrom {
        /// The asset.
        id: AssetId,
        /// Number of bytes of the whole asset, at most [`MAX_ASSET_BYTES`].
        size: u64,
        /// Address at which that worker listens.
        peer: SocketAddr,
        /// Hash of that worker's public key. `None` where connections are plain.
        peer_key: Option<KeyHash>,
        /// Token of the asset at that worker, for the receiver of this message.
        token: Token,
    },
    /// Replies to [`crate::ToMaster::Sharing`]: the worker may serve assets to requests whose token is made of this key.
    /// Sent again at an interval: tokens of the generation before the previous one are invalid then.
    ShareKey {
        /// The key of this generation.
        key: ShareKey,
        /// Number of the generation. It grows by one with each key.
        generation: u64,
    },
    /// Reports that the master does not have a requested asset.
    AssetUnknown {
        /// The asset.
        id: AssetId,
    },
    /// Requests a pong with the same number at once.
    Ping {
        /// The number.
        nonce: u64,
    },
    /// Announces that no more leases follow. The worker finishes those that it has.
    Drain,
    /// Ends the session. No message follows.
    Disconnect {
        /// The reason, as text.
        reason: String,
        /// Whether, and when, the worker may connect again.
        reconnect: Reconnect,
    },
}

const FRAME_HEAD_BYTES: usize = 52;
const CHUNK_HEAD_BYTES: usize = 40;

impl Message for ToWorker {
    const EXPECTED: &'static str = "a message from a master to a worker";

    fn carries(kind: Kind) -> bool {
        match kind {
            Kind::Frame | Kind::Segment | Kind::Cancel | Kind::Ping | Kind::Drain | Kind::Disconnect => true,
            Kind::AssetBegin | Kind::AssetChunk | Kind::AssetUnknown => true,
            Kind::AssetFrom | Kind::ShareKey => true,
            Kind::Hello | Kind::Welcome | Kind::Refused | Kind::Proof => false,
            Kind::NeedAsset | Kind::Pixels | Kind::Failed | Kind::Pong => false,
            Kind::Sharing | Kind::HaveAsset | Kind::PeerRequest => false,
        }
    }

    fn to_envelope(&self) -> Result<Envelope, ProtocolError> {
        match self {
            Self::Frame(announce) => encode_frame(announce),
            Self::Segment(lease) => encode_control(Kind::Segment, &checked_lease(*lease)?),
            Self::Cancel { before } => encode_control(Kind::Cancel, before),
            Self::AssetBegin { id, size } => encode_control(Kind::AssetBegin, &(id, checked_size(*size)?)),
            Self::AssetChunk { id, offset, bytes } => encode_chunk(*id, *offset, bytes),
            Self::AssetUnknown { id } => encode_control(Kind::AssetUnknown, id),
            Self::AssetFrom { id, size, peer, peer_key, token } => {
                encode_control(Kind::AssetFrom, &(id, checked_size(*size)?, peer, peer_key, token))
            }
            Self::ShareKey { key, generation } => encode_control(Kind::ShareKey, &(key, generation)),
            Self::Ping { nonce } => encode_control(Kind::Ping, nonce),
            Self::Drain => Envelope::new(Kind::Drain, &[], Bytes::new()),
            Self::Disconnect { reason, reconnect } => encode_disconnect(reason, *reconnect),
        }
    }

    fn from_body(kind: Kind, body: Bytes) -> Result<Self, ProtocolError> {
        Ok(match kind {
            Kind::Frame => Self::Frame(decode_frame(body)?),
            Kind::Segment => Self::Segment(checked_lease(decode_control(kind, &body)?)?),
            Kind::Cancel => Self::Cancel { before: decode_control(kind, &body)? },
            Kind::AssetBegin => {
                let (id, size) = decode_control(kind, &body)?;
                Self::AssetBegin { id, size: checked_size(size)? }
            }
            Kind::AssetChunk => decode_chunk(body)?,
            Kind::AssetUnknown => Self::AssetUnknown { id: decode_control(kind, &body)? },
            Kind::AssetFrom => {
                let (id, size, peer, peer_key, token) = decode_control(kind, &body)?;
                Self::AssetFrom { id, size: checked_size(size)?, peer, peer_key, token }
            }
            Kind::ShareKey => {
                let (key, generation) = decode_control(kind, &body)?;
                Self::ShareKey { key, generation }
            }
            Kind::Ping => Self::Ping { nonce: decode_control(kind, &body)? },
            Kind::Drain => expect_empty(kind, &body).map(|()| Self::Drain)?,
            Kind::Disconnect => {
                let (reason, reconnect) = decode_disconnect(body)?;
                Self::Disconnect { reason, reconnect }
            }
            Kind::Hello | Kind::Welcome | Kind::Refused | Kind::Proof => return Err(unexpected(kind)),
            Kind::NeedAsset | Kind::Pixels | Kind::Failed | Kind::Pong => return Err(unexpected(kind)),
            Kind::Sharing | Kind::HaveAsset | Kind::PeerRequest => return Err(unexpected(kind)),
        })
    }
}

fn unexpected(kind: Kind) -> ProtocolError {
    ProtocolError::Unexpected { kind, expected: ToWorker::EXPECTED }
}

fn checked_lease(lease: Lease) -> Result<Lease, ProtocolError> {
    match lease.rows() {
        Some(rows) if rows.end <= MAX_FRAME_SIDE => Ok(lease),
        _ => Err(ProtocolError::malformed(Kind::Segment, format!("{lease} has no valid range of rows"))),
    }
}

fn checked_size(size: u64) -> Result<u64, ProtocolError> {
    if size <= MAX_ASSET_BYTES {
        return Ok(size);
    }
    let why = format!("an asset of {size} bytes, at most {MAX_ASSET_BYTES} are allowed");
    Err(ProtocolError::malformed(Kind::AssetBegin, why))
}

fn encode_frame(announce: &FrameAnnounce) -> Result<Envelope, ProtocolError> {
    let announce = checked_frame(announce)?;
    let mut head = [0; FRAME_HEAD_BYTES];
    let mut rest = head.as_mut_slice();
    rest.put_u64_le(announce.frame.0);
    rest.put_slice(&announce.scene.0);
    rest.put_u32_le(announce.width);
    rest.put_u32_le(announce.height);
    rest.put_u32_le(announce.format.code());
    Envelope::new(Kind::Frame, &head, announce.view.clone())
}

fn decode_frame(mut body: Bytes) -> Result<FrameAnnounce, ProtocolError> {
    let head = split_head::<FRAME_HEAD_BYTES>(Kind::Frame, &mut body)?;
    let mut rest = head.as_slice();
    let frame = FrameId(rest.get_u64_le());
    let scene = take_id(&mut rest);
    let (width, height) = (rest.get_u32_le(), rest.get_u32_le());
    let code = rest.get_u32_le();
    let format = PixelFormat::from_code(code)
        .ok_or_else(|| ProtocolError::malformed(Kind::Frame, format!("pixel format {code} is not known")))?;
    let announce = FrameAnnounce { frame, scene, width, height, format, view: body };
    checked_frame(&announce)?;
    Ok(announce)
}

fn checked_frame(announce: &FrameAnnounce) -> Result<&FrameAnnounce, ProtocolError> {
    let FrameAnnounce { width, height, view, .. } = announce;
    if !(1..=MAX_FRAME_SIDE).contains(width) || !(1..=MAX_FRAME_SIDE).contains(height) {
        let why = format!("a frame of {width} x {height} pixels; sides are 1 to {MAX_FRAME_SIDE}");
        return Err(ProtocolError::malformed(Kind::Frame, why));
    }
    if view.len() > MAX_VIEW_BYTES {
        let why = format!("a view of {} bytes, at most {MAX_VIEW_BYTES} are allowed", view.len());
        return Err(ProtocolError::malformed(Kind::Frame, why));
    }
    Ok(announce)
}

pub(crate) fn encode_disconnect(reason: &str, reconnect: Reconnect) -> Result<Envelope, ProtocolError> {
    let code = match reconnect {
        Reconnect::Never => 0,
        Reconnect::Now => 1,
        Reconnect::NextMaster => 2,
    };
    encode_reason(Kind::Disconnect, &[code], reason)
}

pub(crate) fn decode_disconnect(mut body: Bytes) -> Result<(String, Reconnect), ProtocolError> {
    let reconnect = match split_head::<1>(Kind::Disconnect, &mut body)? {
        [0] => Reconnect::Never,
        [1] => Reconnect::Now,
        [2] => Reconnect::NextMaster,
        [other] => {
            let problem = format!("reconnect code {other} is not known");
            return Err(ProtocolError::malformed(Kind::Disconnect, problem));
        }
    };
    Ok((decode_reason(&body), reconnect))
}

fn encode_chunk(id: AssetId, offset: u64, bytes: &Bytes) -> Result<Envelope, ProtocolError> {
    check_chunk(offset, bytes)?;
    let mut head = [0; CHUNK_HEAD_BYTES];
    let mut rest = head.as_mut_slice();
    rest.put_slice(&id.0);
    rest.put_u64_le(offset);
    Envelope::new(Kind::AssetChunk, &head, bytes.clone())
}

fn decode_chunk(mut body: Bytes) -> Result<ToWorker, ProtocolError> {
    let head = split_head::<CHUNK_HEAD_BYTES>(Kind::AssetChunk, &mut body)?;
    let mut rest = head.as_slice();
    let id = take_id(&mut rest);
    let offset = rest.get_u64_le();
    check_chunk(offset, &body)?;
    Ok(ToWorker::AssetChunk { id, offset, bytes: body })
}

fn check_chunk(offset: u64, bytes: &Bytes) -> Result<(), ProtocolError> {
    if !(1..=MAX_CHUNK_BYTES).contains(&bytes.len()) {
        let why = format!("a chunk of {} bytes; 1 to {MAX_CHUNK_BYTES} are allowed", bytes.len());
        return Err(ProtocolError::malformed(Kind::AssetChunk, why));
    }
    match offset.checked_add(bytes.len() as u64) {
        Some(end) if end <= MAX_ASSET_BYTES => Ok(()),
        _ => Err(ProtocolError::malformed(Kind::AssetChunk, "it ends beyond the end of any asset")),
    }
}

fn take_id(rest: &mut &[u8]) -> AssetId {
    let mut id = [0; 32];
    rest.copy_to_slice(&mut id);
    AssetId(id)
}
