//! A stream of envelopes: every message that is read can be written.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rayfarm_fuzz::block_on;
use rayfarm_protocol::envelope::{HEADER_BYTES, read_body, read_header};
use rayfarm_protocol::message::Message;
use rayfarm_protocol::{ProtocolError, ToMaster, ToWorker};

fuzz_target!(|data: &[u8]| {
    let _ = block_on(read_all(data));
});

async fn read_all(mut stream: &[u8]) -> Result<(), ProtocolError> {
    while let Some(header) = read_header(&mut stream).await? {
        let body = read_body(&mut stream, header).await?;
        let mut written = Vec::new();
        if ToWorker::carries(header.kind) {
            ToWorker::from_body(header.kind, body.clone())?.to_envelope()?.write(&mut written).await?;
        } else {
            ToMaster::from_body(header.kind, body.clone())?.to_envelope()?.write(&mut written).await?;
        }
        assert!(written.len() >= HEADER_BYTES);
    }
    Ok(())
}
