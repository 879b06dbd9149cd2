//! A connection to a farm without TLS that answers each lease at once with black pixels and a cost of one nanosecond: its
//! share is bounded, it is banned, and no picture shows its rows.

use std::collections::BTreeMap;
use std::fs;
use std::time::Duration;

use bytes::Bytes;
use rayfarm_protocol::session::{self, Sender};
use rayfarm_protocol::transport::WorkerSecurity;
use rayfarm_protocol::{
    Cost, Encoding, FrameAnnounce, FrameId, Hello, Lease, PixelsHeader, ToMaster, ToWorker, handshake,
};
use rayfarm_tests::{Running, Scenes, free_port, master};
use tokio::net::TcpStream;

const FRAMES: usize = 60;
const ROWS: u32 = 240;

/// What the connections got.
#[derive(Debug, Default)]
struct Received {
    /// Sessions, each under a name of its own.
    sessions: usize,
    /// Rows that were leased, by frame.
    rows: BTreeMap<FrameId, u32>,
    /// Reasons in disconnect messages of the master.
    reasons: Vec<String>,
}

/// Joins as a worker with black pixels again and again, until the master has ended.
async fn send_black_pixels(port: u16) -> Received {
    let mut received = Received::default();
    let mut has_connected = false;
    loop {
        match TcpStream::connect(("127.0.0.1", port)).await {
            Ok(stream) => {
                has_connected = true;
                run_session(stream, &mut received).await;
            }
            Err(_) if has_connected => return received,
            Err(_) => {}
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

async fn run_session(stream: TcpStream, received: &mut Received) {
    let name = format!("night-{}", received.sessions);
    let hello = Hello { name, threads: 64, simd: "none".into(), software: "test".into(), tags: Vec::new() };
    let Ok((stream, _)) = handshake::as_worker(stream, &WorkerSecurity::Plain, &hello).await else { return };
    received.sessions += 1;
    let (sender, mut messages, _) = session::spawn::<_, ToMaster, ToWorker>(stream);
    let mut frames: BTreeMap<FrameId, FrameAnnounce> = BTreeMap::new();
    while let Some(Ok(message)) = messages.recv().await {
        match message {
            ToWorker::Frame(announce) => drop(frames.insert(announce.frame, announce)),
            ToWorker::Segment(lease) => {
                *received.rows.entry(lease.frame).or_default() += lease.row_count;
                let announce = frames.get(&lease.frame).expect("a frame is announced before its leases");
                answer(&sender, lease, announce).await;
            }
            ToWorker::Ping { nonce } => drop(sender.send(ToMaster::Pong { nonce, progressed: true }).await),
            ToWorker::Disconnect { reason, .. } => received.reasons.push(reason),
            _ => {}
        }
    }
}

async fn answer(sender: &Sender<ToMaster>, lease: Lease, announce: &FrameAnnounce) {
    let size = announce.format.row_bytes(announce.width) * lease.row_count as usize;
    let cost = Cost { trace_ns: 1, primary: 1, ..Cost::default() };
    let header = PixelsHeader { lease, encoding: Encoding::Raw, cost };
    // The master may have ended the session.
    let _ = sender.send(ToMaster::Pixels { header, bytes: Bytes::from(vec![0; size]) }).await;
}

/// Renders with one local worker. Returns the frames and standard error.
fn render(port: u16, more: &[&str]) -> (Vec<Vec<u8>>, String) {
    let scenes = Scenes::new();
    let mut command = master();
    command.arg("render").arg(scenes.path("small.toml")).arg("-o").arg(scenes.path("frame-%02d.ppm"));
    command.args(["--frames", &FRAMES.to_string(), "--spin", "3", "--size", &format!("320x{ROWS}")]);
    command.args(["--local-workers", "1", "--threads", "1", "--listen", &format!("127.0.0.1:{port}")]);
    let outcome = Running::start(command.args(more)).finish().expect_success();
    let read = |frame| fs::read(scenes.path(&format!("frame-{frame:02}.ppm"))).unwrap();
    ((0..FRAMES).map(read).collect(), outcome.stderr)
}

#[test]
fn black_pixels_at_once_get_a_bounded_share_and_are_in_no_picture() {
    let (expected, _) = render(0, &[]);
    for policy in ["adaptive", "static:16"] {
        let port = free_port();
        let attack = std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
            runtime.block_on(send_black_pixels(port))
        });
        let (frames, log) = render(port, &["--wait-for-workers", "2", "--segment", policy]);
        let received = attack.join().unwrap();
        assert!(frames == expected, "{policy}: black pixels are in a picture; {received:?}\n{log}");
        let most = received.rows.values().copied().max().unwrap_or(0);
        assert!((1..=ROWS / 4).contains(&most), "{policy}: {most} of {ROWS} rows of a frame");
        assert!(received.reasons.iter().any(|reason| reason.contains("wrong pixels")), "{received:?}");
    }
}
