//! Throughput of a session over loopback sockets, without TLS and with it:
//!
//! ```text
//! cargo bench -p rayfarm-protocol --bench transport
//! ```
//!
//! A worker sends pixels of 1 MiB to a master, both in this process. Rounds without TLS and with it alternate, because
//! other programs disturb both alike. The table has the megabytes (10^6 bytes) per second of the median round, and the
//! duration of the handshake with its connection.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a benchmark fails by panicking")]

use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::Bytes;
use rayfarm_protocol::transport::{
    Connection, JoinToken, MasterSecurity, MasterTrust, PrivateKey, WorkerSecurity,
};
use rayfarm_protocol::{
    Cost, Encoding, FrameId, Hello, Lease, PixelsHeader, ToMaster, ToWorker, Welcome, handshake, session, tcp,
};
use tokio::net::{TcpListener, TcpStream};

const ROUNDS: usize = 9;
const MESSAGE_BYTES: usize = 1 << 20;
const MESSAGES: usize = 256;

/// Result of one round.
#[derive(Clone, Copy)]
struct Round {
    handshake: Duration,
    transfer: Duration,
}

fn main() {
    let trust = Arc::new(MasterTrust::new(PrivateKey::generate().unwrap(), JoinToken::random().unwrap()));
    let key = Arc::new(PrivateKey::generate().unwrap());
    let secure = WorkerSecurity::join(key, &trust.join_line("host:1"));
    let ends = [(MasterSecurity::Plain, WorkerSecurity::Plain), (MasterSecurity::Tls(trust), secure)];
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap();
    let mut rounds = [Vec::new(), Vec::new()];
    for _ in 0..ROUNDS {
        for ((master, worker), rounds) in ends.iter().zip(&mut rounds) {
            rounds.push(runtime.block_on(run_round(master.clone(), worker.clone())));
        }
    }
    println!("{:10} {:>8} {:>14}", "transport", "MB/s", "handshake ms");
    for (name, rounds) in ["plain", "TLS 1.3"].into_iter().zip(rounds) {
        let transfer = median(rounds.iter().map(|round| round.transfer).collect());
        let handshake = median(rounds.iter().map(|round| round.handshake).collect());
        let megabytes = (MESSAGES * MESSAGE_BYTES) as f64 / 1e6;
        let rate = megabytes / transfer.as_secs_f64();
        println!("{name:10} {rate:>8.0} {:>14.2}", handshake.as_secs_f64() * 1e3);
    }
}

fn median(mut times: Vec<Duration>) -> Duration {
    times.sort();
    times[times.len() / 2]
}

/// Connects, shakes hands, and sends all messages.
async fn run_round(master: MasterSecurity, worker: WorkerSecurity) -> Round {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let begun = Instant::now();
    let accepting = tokio::spawn(async move {
        let (stream, _) = listener.accept().await.unwrap();
        tcp::configure(&stream).unwrap();
        handshake::as_master(stream, &master, |_, _| Ok(Welcome { worker: 1 })).await.unwrap().0
    });
    let stream = TcpStream::connect(address).await.unwrap();
    tcp::configure(&stream).unwrap();
    let hello = Hello {
        name: "bench".into(),
        threads: 1,
        simd: "none".into(),
        software: "bench".into(),
        tags: Vec::new(),
    };
    let joined = handshake::as_worker(stream, &worker, &hello).await.unwrap().0;
    let handshake = begun.elapsed();
    Round { handshake, transfer: transfer(accepting.await.unwrap(), joined).await }
}

/// Time to send all messages from the worker to the master.
async fn transfer(master: Connection<TcpStream>, worker: Connection<TcpStream>) -> Duration {
    let (_to_worker, mut received, _) = session::spawn::<_, ToWorker, ToMaster>(master);
    let (to_master, _from_master, _) = session::spawn::<_, ToMaster, ToWorker>(worker);
    let bytes = Bytes::from(vec![0x5a; MESSAGE_BYTES]);
    let begun = Instant::now();
    tokio::spawn(async move {
        for segment in 0..MESSAGES as u32 {
            let lease = Lease { frame: FrameId(1), segment, attempt: 0, first_row: 0, row_count: 16 };
            let header = PixelsHeader { lease, encoding: Encoding::Raw, cost: Cost::default() };
            to_master.send(ToMaster::Pixels { header, bytes: bytes.clone() }).await.unwrap();
        }
        to_master.closed().await;
    });
    for _ in 0..MESSAGES {
        match received.recv().await {
            Some(Ok(ToMaster::Pixels { bytes, .. })) => assert_eq!(bytes.len(), MESSAGE_BYTES),
            other => panic!("{other:?}"),
        }
    }
    begun.elapsed()
}
