//! Tests of the library with a master on 127.0.0.1.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfarm_protocol::transport::{JoinToken, MasterSecurity, MasterTrust, PrivateKey, WorkerSecurity};
use rayfarm_protocol::{PROTOCOL_VERSION, Reconnect, ToMaster, ToWorker, handshake};
use rayfarm_worker::{Share, ShutdownHandle, WorkerError, WorkerOptions, run};
use tokio::io::AsyncWriteExt;
use tokio::net::TcpListener;

use crate::common::{Link, Stage, listen};

fn options(master: &str) -> WorkerOptions {
    WorkerOptions {
        master: master.to_owned(),
        threads: Some(2),
        name: "attic".to_owned(),
        tags: Vec::new(),
        max_segment_bytes: None,
        reconnect: false,
        once: false,
        asset_cache_bytes: 1 << 20,
        compress: None,
        disk_cache: None,
        share: Share::Off,
        security: Default::default(),
    }
}

#[tokio::test]
async fn a_worker_renders_the_same_pixels_as_this_process() {
    let (listener, address) = listen().await;
    let stage = Stage::new();
    let worker = tokio::spawn(run(options(&address), ShutdownHandle::new()));
    let mut link = Link::accept(&listener).await;
    assert_eq!((link.hello.name.as_str(), link.hello.threads), ("attic", 2));
    assert_eq!(link.hello.simd, rayfarm_tracer::simd_level());
    for (frame, spin) in [(0, 0.0), (1, 10.0), (2, -35.5)] {
        link.check_frame(&stage, frame, spin).await;
    }
    assert_eq!(link.requests, 3);
    link.out.send(ToWorker::Disconnect { reason: "done".into(), reconnect: Reconnect::Never }).await.unwrap();
    worker.await.unwrap().unwrap();
}

#[tokio::test]
async fn pixels_are_compressed_where_requested_and_raw_within_a_machine() {
    let stage = Stage::new();
    for (compress, compressed) in [(None, 0), (Some(false), 0), (Some(true), 5)] {
        let (listener, address) = listen().await;
        let options = WorkerOptions { compress, ..options(&address) };
        let worker = tokio::spawn(run(options, ShutdownHandle::new()));
        let mut link = Link::accept(&listener).await;
        link.check_frame(&stage, 0, 3.0).await;
        assert_eq!(link.compressed, compressed, "{compress:?}");
        link.out
            .send(ToWorker::Disconnect { reason: "done".into(), reconnect: Reconnect::Never })
            .await
            .unwrap();
        worker.await.unwrap().unwrap();
    }
}

#[tokio::test]
async fn a_worker_reconnects_and_keeps_its_scene() {
    let (listener, address) = listen().await;
    let stage = Stage::new();
    let shutdown = ShutdownHandle::new();
    let worker = tokio::spawn(run(WorkerOptions { reconnect: true, ..options(&address) }, shutdown.clone()));
    let mut link = Link::accept(&listener).await;
    link.check_frame(&stage, 0, 0.0).await;
    link.out.abort();
    let mut link = Link::accept(&listener).await;
    link.check_frame(&stage, 0, 5.0).await;
    assert_eq!(link.requests, 0);
    shutdown.stop();
    assert!(matches!(link.receive(&stage).await, Some(ToMaster::Disconnect { .. })));
    worker.await.unwrap().unwrap();
}

#[tokio::test]
async fn without_reconnect_a_lost_master_is_an_error() {
    let (listener, address) = listen().await;
    let worker = tokio::spawn(run(options(&address), ShutdownHandle::new()));
    drop(Link::accept(&listener).await);
    let error = worker.await.unwrap().unwrap_err();
    assert!(matches!(error, WorkerError::Lost { .. }), "{error}");
    drop(listener);
    let error = run(options(&address), ShutdownHandle::new()).await.unwrap_err();
    assert!(matches!(error, WorkerError::Connect { .. }) && error.to_string().contains(&address), "{error}");
}

/// Accepts the next connection and sends bytes instead of a handshake. Returns the time of the connection.
async fn answer(listener: &TcpListener, bytes: &[u8]) -> Instant {
    let mut stream = listener.accept().await.unwrap().0;
    let accepted = Instant::now();
    stream.write_all(bytes).await.unwrap();
    accepted
}

/// Accepts the next connection and refuses the worker.
async fn refuse(listener: &TcpListener, security: &MasterSecurity) -> Instant {
    let stream = listener.accept().await.unwrap().0;
    let accepted = Instant::now();
    let refused = handshake::as_master(stream, security, |_, _| Err("the farm is full".into()));
    refused.await.unwrap_err();
    accepted
}

fn other_version() -> Vec<u8> {
    [b"RAYFARM\n".as_slice(), &(PROTOCOL_VERSION + 1).to_le_bytes(), &[1, 0]].concat()
}

#[tokio::test]
async fn a_false_master_ends_a_worker_without_reconnect_only() {
    // Another version, another program, and a refusal that no key has authenticated.
    let version = (PROTOCOL_VERSION + 1).to_string();
    for (bytes, part) in
        [(other_version(), version.as_str()), (b"HTTP/1.1 400 Bad Request\r\n".to_vec(), "HTTP")]
    {
        let (listener, address) = listen().await;
        let worker = tokio::spawn(run(options(&address), ShutdownHandle::new()));
        answer(&listener, &bytes).await;
        let text = worker.await.unwrap().unwrap_err().to_string();
        assert!(text.contains(part) && text.contains(&address), "{text}");
    }
    let (listener, address) = listen().await;
    let worker = tokio::spawn(run(options(&address), ShutdownHandle::new()));
    refuse(&listener, &MasterSecurity::Plain).await;
    let text = worker.await.unwrap().unwrap_err().to_string();
    assert!(text.contains("the farm is full") && text.contains(&address), "{text}");
}

#[tokio::test]
async fn a_false_master_is_retried_with_a_growing_delay_until_the_true_one_answers() {
    let (listener, address) = listen().await;
    let shutdown = ShutdownHandle::new();
    let worker = tokio::spawn(run(WorkerOptions { reconnect: true, ..options(&address) }, shutdown.clone()));
    let first = answer(&listener, &other_version()).await;
    let second = answer(&listener, b"HTTP/1.1 400 Bad Request\r\n").await;
    let third = refuse(&listener, &MasterSecurity::Plain).await;
    // Delays of 0.5 s and 1 s, each less up to a quarter.
    let (delay, next) = (second - first, third - second);
    assert!(delay >= Duration::from_millis(370) && next >= Duration::from_millis(740), "{delay:?}, {next:?}");
    let mut link = Link::accept(&listener).await;
    link.check_frame(&Stage::new(), 0, 0.0).await;
    shutdown.stop();
    assert!(matches!(link.receive(&Stage::new()).await, Some(ToMaster::Disconnect { .. })));
    worker.await.unwrap().unwrap();
}

#[tokio::test]
async fn a_refusal_of_the_master_with_the_expected_key_ends_a_worker() {
    let (listener, address) = listen().await;
    let trust = Arc::new(MasterTrust::new(PrivateKey::generate().unwrap(), JoinToken::random().unwrap()));
    let key = Arc::new(PrivateKey::generate().unwrap());
    let security = WorkerSecurity::join(key, &trust.join_line(address.clone()));
    let options = WorkerOptions { reconnect: true, security, ..options(&address) };
    let worker = tokio::spawn(run(options, ShutdownHandle::new()));
    // The false master comes first.
    answer(&listener, &other_version()).await;
    refuse(&listener, &MasterSecurity::Tls(trust)).await;
    let text = worker.await.unwrap().unwrap_err().to_string();
    assert!(text.contains("the farm is full"), "{text}");
}

#[tokio::test]
async fn a_stop_while_waiting_to_reconnect_is_no_error() {
    let (listener, address) = listen().await;
    drop(listener);
    let shutdown = ShutdownHandle::new();
    let worker = tokio::spawn(run(WorkerOptions { reconnect: true, ..options(&address) }, shutdown.clone()));
    tokio::task::yield_now().await;
    shutdown.stop();
    worker.await.unwrap().unwrap();
}
