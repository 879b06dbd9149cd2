//! The bytes of a peer in a handshake, read by a master and by a worker. After an odd first byte, a correct preamble is sent first.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rayfarm_fuzz::{Peer, block_on};
use rayfarm_protocol::limits::{MAX_NAME_BYTES, MAX_THREADS};
use rayfarm_protocol::{Hello, PROTOCOL_VERSION, Welcome, handshake};

const MASTER: u8 = 1;
const WORKER: u8 = 2;

fuzz_target!(|data: &[u8]| {
    let Some((first, rest)) = data.split_first() else { return };
    let from = |role: u8| {
        let mut bytes = Vec::new();
        if first % 2 == 1 {
            bytes.extend(b"RAYFARM\n");
            bytes.extend(PROTOCOL_VERSION.to_le_bytes());
            bytes.extend([role, 0]);
        }
        bytes.extend(rest);
        bytes
    };
    block_on(async {
        let bytes = from(WORKER);
        let taken = handshake::as_master(&mut Peer(&bytes), &rayfarm_protocol::transport::MasterSecurity::Plain, |_, _| Ok(Welcome { worker: 1 })).await;
        if let Ok((_, hello)) = taken {
            assert!((1..=MAX_THREADS).contains(&hello.threads));
            assert!(
                [&hello.name, &hello.simd, &hello.software].iter().all(|text| text.len() <= MAX_NAME_BYTES)
            );
        }
        let bytes = from(MASTER);
        let hello = Hello { name: "a".into(), threads: 1, simd: "b".into(), software: "c".into(), tags: Vec::new() };
        let _ = handshake::as_worker(&mut Peer(&bytes), &rayfarm_protocol::transport::WorkerSecurity::Plain, &hello).await;
    });
});
