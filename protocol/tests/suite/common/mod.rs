//! Messages that several test files send.
#![allow(clippy::unwrap_used, clippy::panic, reason = "these are tests")]

use bytes::Bytes;
use rayfarm_protocol::message::Message;
use rayfarm_protocol::{Cost, Encoding, FrameId, Lease, PixelsHeader, ToMaster};

/// Encodes a message as it is on the wire.
pub(crate) async fn wire(message: &impl Message) -> Vec<u8> {
    let mut bytes = Vec::new();
    message.to_envelope().unwrap().write(&mut bytes).await.unwrap();
    bytes
}

/// A lease of rows 16 to 23 of frame 4.
pub(crate) fn lease(segment: u32) -> Lease {
    Lease { frame: FrameId(4), segment, attempt: 1, first_row: 16, row_count: 8 }
}

/// Pixels for [`lease`] whose body is `len` bytes of the segment's number.
pub(crate) fn pixels(segment: u32, len: usize) -> ToMaster {
    let times = Cost { trace_ns: 5, wait_ns: 9, encode_ns: 10, span_ns: 11, ..Cost::default() };
    let cost = Cost { primary: 6, shadow: 7, secondary: 8, ..times };
    let header = PixelsHeader { lease: lease(segment), encoding: Encoding::Raw, cost };
    ToMaster::Pixels { header, bytes: Bytes::from(vec![segment as u8; len]) }
}
