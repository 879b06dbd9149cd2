//! The body of one message, of a type that the first byte names. What decodes is encoded and decodes to the same message.
#![no_main]

use bytes::Bytes;
use libfuzzer_sys::fuzz_target;
use rayfarm_fuzz::block_on;
use rayfarm_protocol::envelope::{HEADER_BYTES, Kind};
use rayfarm_protocol::message::Message;
use rayfarm_protocol::{ToMaster, ToWorker};

fuzz_target!(|data: &[u8]| {
    let Some((first, body)) = data.split_first() else { return };
    let kind = Kind::ALL[usize::from(*first) % Kind::ALL.len()];
    if body.len() <= kind.limit_bytes() {
        round_trip::<ToWorker>(kind, body);
        round_trip::<ToMaster>(kind, body);
    }
});

fn round_trip<M: Message + PartialEq + std::fmt::Debug>(kind: Kind, body: &[u8]) {
    let Ok(message) = M::from_body(kind, Bytes::copy_from_slice(body)) else { return };
    let envelope = message.to_envelope().expect("a decoded message is within all bounds");
    let mut written = Vec::new();
    block_on(envelope.write(&mut written)).expect("memory takes all bytes");
    let again = M::from_body(kind, Bytes::copy_from_slice(&written[HEADER_BYTES..]));
    assert_eq!(again.expect("an encoded message decodes"), message);
}
