//! The bytes of a peer in a handshake, read by a master and by a worker, without TLS and with it.
//!
//! After an odd first byte, a correct preamble is sent first. The same bytes also arrive at a master after a complete TLS
//! handshake, in place of the proof.
#![no_main]

use std::sync::{Arc, LazyLock};

use libfuzzer_sys::fuzz_target;
use rayfarm_fuzz::{Peer, block_on};
use rayfarm_protocol::limits::{MAX_NAME_BYTES, MAX_THREADS};
use rayfarm_protocol::transport::{JoinToken, MasterSecurity, MasterTrust, PrivateKey, WorkerSecurity};
use rayfarm_protocol::{Hello, PROTOCOL_VERSION, Welcome, handshake, peer};
use tokio::io::{AsyncReadExt, AsyncWriteExt, duplex};

const MASTER: u8 = 1;
const WORKER: u8 = 2;

/// Keys of a master and of a worker that may join it.
static FARM: LazyLock<(Arc<MasterTrust>, WorkerSecurity)> = LazyLock::new(|| {
    let trust = MasterTrust::new(PrivateKey::generate().expect("a key"), JoinToken([7; 16]));
    let key = Arc::new(PrivateKey::generate().expect("a key"));
    let worker = WorkerSecurity::join(key, &trust.join_line("host:1"));
    (Arc::new(trust), worker)
});

fn preamble(role: u8, transport: u8) -> Vec<u8> {
    [b"RAYFARM\n".as_slice(), &PROTOCOL_VERSION.to_le_bytes(), &[role, transport]].concat()
}

/// A master with TLS reads bytes in place of a TLS handshake.
async fn read_by_secure_ends(to_master: &[u8], to_worker: &[u8], hello: &Hello) {
    let (trust, worker) = &*FARM;
    let master = MasterSecurity::Tls(Arc::clone(trust));
    let unproven = |_: &Hello, _| panic!("a peer that has proved nothing reached the decision");
    assert!(handshake::as_master(&mut Peer(to_master), &master, unproven).await.is_err());
    assert!(handshake::as_worker(&mut Peer(to_worker), worker, hello).await.is_err());
}

/// A master with TLS reads bytes in place of a proof.
async fn read_instead_of_a_proof(bytes: &[u8]) {
    let (trust, worker) = &*FARM;
    let master = MasterSecurity::Tls(Arc::clone(trust));
    let unproven = |_: &Hello, _| panic!("a peer that has proved nothing reached the decision");
    let (a, mut b) = duplex(1 << 16);
    let sending = async {
        b.write_all(&preamble(WORKER, 1)).await.expect("room for a preamble");
        b.read_exact(&mut [0; 12]).await.expect("a preamble");
        let mut stream = peer::connect(b, worker, Some(trust.key_hash())).await.expect("a TLS session");
        let _ = stream.write_all(bytes).await;
        let _ = stream.shutdown().await;
        let _ = stream.read_to_end(&mut Vec::new()).await;
    };
    assert!(tokio::join!(handshake::as_master(a, &master, unproven), sending).0.is_err());
}

fuzz_target!(|data: &[u8]| {
    let Some((first, rest)) = data.split_first() else { return };
    let from = |role: u8, transport: u8| {
        let mut bytes = if first % 2 == 1 { preamble(role, transport) } else { Vec::new() };
        bytes.extend(rest);
        bytes
    };
    let hello = Hello {
        name: "a".into(),
        threads: 1,
        simd: "b".into(),
        software: "c".into(),
        tags: Vec::new(),
    };
    block_on(async {
        let bytes = from(WORKER, 0);
        let accept = |_: &Hello, _| Ok(Welcome { worker: 1 });
        let taken = handshake::as_master(&mut Peer(&bytes), &MasterSecurity::Plain, accept).await;
        if let Ok((_, hello)) = taken {
            assert!((1..=MAX_THREADS).contains(&hello.threads));
            assert!(
                [&hello.name, &hello.simd, &hello.software].iter().all(|text| text.len() <= MAX_NAME_BYTES)
            );
        }
        let _ = handshake::as_worker(&mut Peer(&from(MASTER, 0)), &WorkerSecurity::Plain, &hello).await;
        read_by_secure_ends(&from(WORKER, 1), &from(MASTER, 1), &hello).await;
        read_instead_of_a_proof(rest).await;
    });
});
