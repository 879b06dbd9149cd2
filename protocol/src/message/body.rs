//! Bodies of messages: encoded by the codec, or after a head of a fixed layout.

use bytes::Bytes;
use rayfarm_text::{cut, printable_within};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::envelope::{Envelope, Kind};
use crate::limits::{MAX_CONTROL_BYTES, MAX_REASON_BYTES};
use crate::{ProtocolError, codec};

/// Encodes a value as a control message.
pub(crate) fn encode_control<T: Serialize>(kind: Kind, value: &T) -> Result<Envelope, ProtocolError> {
    let body = codec::encode(value).map_err(|source| ProtocolError::Codec { kind, source })?;
    Envelope::new(kind, &[], body.into())
}

/// Decodes the body of a control message.
pub(crate) fn decode_control<T: DeserializeOwned>(kind: Kind, body: &[u8]) -> Result<T, ProtocolError> {
    codec::decode(body, MAX_CONTROL_BYTES).map_err(|source| ProtocolError::Codec { kind, source })
}

/// Encodes a reason as plain UTF-8 after `head`. A reason above its bound is cut, so that the message is always sent.
pub(crate) fn encode_reason(kind: Kind, head: &[u8], reason: &str) -> Result<Envelope, ProtocolError> {
    Envelope::new(kind, head, Bytes::copy_from_slice(cut(reason, MAX_REASON_BYTES).as_bytes()))
}

/// Decodes a peer's reason. Any bytes become printable text within the bound of a reason.
pub(crate) fn decode_reason(body: &[u8]) -> String {
    printable_within(&String::from_utf8_lossy(body), MAX_REASON_BYTES).into_owned()
}

/// Removes a head of `N` bytes from the front of a body.
pub(crate) fn split_head<const N: usize>(kind: Kind, body: &mut Bytes) -> Result<[u8; N], ProtocolError> {
    let head = body.first_chunk::<N>().copied().ok_or_else(|| {
        ProtocolError::malformed(kind, format!("it has {} bytes, its head alone has {N}", body.len()))
    })?;
    bytes::Buf::advance(body, N);
    Ok(head)
}

/// Checks the body of a message without content.
pub(crate) fn expect_empty(kind: Kind, body: &[u8]) -> Result<(), ProtocolError> {
    match body.len() {
        0 => Ok(()),
        more => Err(ProtocolError::malformed(kind, format!("its body has {more} bytes and must be empty"))),
    }
}
