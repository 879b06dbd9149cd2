//! Bodies of messages: through the codec, or behind a hand-laid head.

use bytes::Bytes;
use rayfarm_text::{cut, printable_within};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::envelope::{Envelope, Kind};
use crate::limits::{MAX_CONTROL_BYTES, MAX_REASON_BYTES};
use crate::{ProtocolError, codec};

pub(crate) fn encode_control<T: Serialize>(kind: Kind, value: &T) -> Result<Envelope, ProtocolError> {
    let body = codec::encode(value).map_err(|source| ProtocolError::Codec { kind, source })?;
    Envelope::new(kind, &[], body.into())
}

pub(crate) fn decode_control<T: DeserializeOwned>(kind: Kind, body: &[u8]) -> Result<T, ProtocolError> {
    codec::decode(body, MAX_CONTROL_BYTES).map_err(|source| ProtocolError::Codec { kind, source })
}

/// A reason as plain UTF-8 behind `head`, cut to its bound: a long one must not cost the message.
pub(crate) fn encode_reason(kind: Kind, head: &[u8], reason: &str) -> Result<Envelope, ProtocolError> {
    Envelope::new(kind, head, Bytes::copy_from_slice(cut(reason, MAX_REASON_BYTES).as_bytes()))
}

/// A peer's reason: whatever it sent, made printable within its bound.
pub(crate) fn decode_reason(body: &[u8]) -> String {
    printable_within(&String::from_utf8_lossy(body), MAX_REASON_BYTES).into_owned()
}

/// Takes a hand-laid head of `N` bytes off the front.
pub(crate) fn split_head<const N: usize>(kind: Kind, body: &mut Bytes) -> Result<[u8; N], ProtocolError> {
    let head = body.first_chunk::<N>().copied().ok_or_else(|| {
        ProtocolError::malformed(kind, format!("{} bytes, and its head alone has {N}", body.len()))
    })?;
    bytes::Buf::advance(body, N);
    Ok(head)
}

/// Messages without content have an empty body.
pub(crate) fn nothing(kind: Kind, body: &[u8]) -> Result<(), ProtocolError> {
    match body.len() {
        0 => Ok(()),
        more => Err(ProtocolError::malformed(kind, format!("{more} bytes where none belong"))),
    }
}
