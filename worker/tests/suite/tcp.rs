//! Tests of the library with a master on 127.0.0.1.

use rayfarm_protocol::{PROTOCOL_VERSION, Reconnect, ToMaster, ToWorker, handshake};
use rayfarm_worker::{Share, ShutdownHandle, WorkerError, WorkerOptions, run};
use tokio::io::AsyncWriteExt;

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

#[tokio::test]
async fn a_refusal_and_another_program_end_a_reconnecting_worker() {
    let reconnecting = |address: &str| WorkerOptions { reconnect: true, ..options(address) };

    let (listener, address) = listen().await;
    let worker = tokio::spawn(run(reconnecting(&address), ShutdownHandle::new()));
    let mut stream = listener.accept().await.unwrap().0;
    handshake::as_master(&mut stream, &rayfarm_protocol::transport::MasterSecurity::Plain, |_, _| {
        Err("the farm is full".into())
    })
    .await
    .unwrap_err();
    let text = worker.await.unwrap().unwrap_err().to_string();
    assert!(text.contains("the farm is full") && text.contains(&address), "{text}");

    let preamble = [b"RAYFARM\n".as_slice(), &(PROTOCOL_VERSION + 1).to_le_bytes(), &[1, 0]].concat();
    for (preamble, part) in [
        (preamble.as_slice(), format!("{}", PROTOCOL_VERSION + 1)),
        (b"HTTP/1.1 400 Bad Request\r\n", "HTTP".to_owned()),
    ] {
        let (listener, address) = listen().await;
        // Another version is retried: the master may be updated.
        let reconnect = part == "HTTP";
        let options = WorkerOptions { reconnect, ..options(&address) };
        let worker = tokio::spawn(run(options, ShutdownHandle::new()));
        let mut stream = listener.accept().await.unwrap().0;
        stream.write_all(preamble).await.unwrap();
        let text = worker.await.unwrap().unwrap_err().to_string();
        assert!(text.contains(&part), "{text}");
    }
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
