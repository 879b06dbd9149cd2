//! Handshakes: successful, refused, mismatched, incomplete.

use std::time::Duration;

use rayfarm_protocol::handshake::{Refusal, as_master, as_worker};
use rayfarm_protocol::transport::{MasterSecurity, WorkerSecurity};
use rayfarm_protocol::{
    Hello, KeyHash, PROTOCOL_VERSION, ProtocolError, Role, ToMaster, ToWorker, Welcome, session,
};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};

fn hello() -> Hello {
    Hello {
        name: "attic".into(),
        threads: 4,
        simd: "baseline".into(),
        software: "0.1.0".into(),
        tags: Vec::new(),
    }
}

fn accept(_: &Hello, _: Option<KeyHash>) -> Result<Welcome, Refusal> {
    Ok(Welcome { worker: 12 })
}

fn preamble(version: u16, role: u8) -> Vec<u8> {
    let mut bytes = b"RAYFARM\n".to_vec();
    bytes.extend(version.to_le_bytes());
    bytes.extend([role, 0]);
    bytes
}

/// Reads everything that the peer sends until it closes, as text.
async fn read_all(mut io: DuplexStream) -> String {
    let mut bytes = Vec::new();
    io.read_to_end(&mut bytes).await.unwrap();
    String::from_utf8_lossy(&bytes).into_owned()
}

#[tokio::test]
async fn a_handshake_through_a_pipe_of_any_width_leads_to_a_session() {
    for width in [1, 3, 12, 4096] {
        let (mut master, mut worker) = duplex(width);
        let hello = hello();
        let (met, welcome) = tokio::join!(
            as_master(&mut master, &MasterSecurity::Plain, accept),
            as_worker(&mut worker, &WorkerSecurity::Plain, &hello)
        );
        assert_eq!(met.unwrap().1, hello);
        assert_eq!(welcome.unwrap().1, Welcome { worker: 12 });
        // The handshake has read no byte of the session.
        let (out, _master_in, _) = session::spawn::<_, ToWorker, ToMaster>(master);
        let (_worker_out, mut received, _) = session::spawn::<_, ToMaster, ToWorker>(worker);
        out.send(ToWorker::Ping { nonce: 1 }).await.unwrap();
        assert_eq!(received.recv().await.unwrap().unwrap(), ToWorker::Ping { nonce: 1 });
    }
}

#[tokio::test]
async fn a_worker_of_another_version_receives_both_numbers_and_the_remedy() {
    let (mut master, mut worker) = duplex(4096);
    worker.write_all(&preamble(PROTOCOL_VERSION + 1, 2)).await.unwrap();
    let error = as_master(&mut master, &MasterSecurity::Plain, accept).await.unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, ProtocolError::Version { theirs, .. } if theirs == PROTOCOL_VERSION + 1));
    assert!(!error.is_final(false) && !error.is_final(true));
    for part in [
        &format!("master has protocol version {PROTOCOL_VERSION}"),
        &format!("worker has version {}", PROTOCOL_VERSION + 1),
        "install the same release",
        "the master's is",
    ] {
        assert!(text.contains(part), "{text}");
    }
    drop(master);
    let received = read_all(worker).await;
    assert!(received.contains(&text), "{received}");
}

#[tokio::test]
async fn a_worker_reports_a_master_of_another_version() {
    let (mut master, mut worker) = duplex(4096);
    master.write_all(&preamble(0, 1)).await.unwrap();
    let error = as_worker(&mut worker, &WorkerSecurity::Plain, &hello()).await.unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, ProtocolError::Version { our_role: Role::Worker, theirs: 0 }), "{text}");
    let both = format!("worker has protocol version {PROTOCOL_VERSION}, the master has version 0");
    assert!(text.contains(&both), "{text}");
    assert!(text.contains("the master's is the older one"), "{text}");
}

#[tokio::test]
async fn two_masters_or_two_workers_are_reported() {
    let (mut a, mut b) = duplex(4096);
    let (first, second) = tokio::join!(
        as_master(&mut a, &MasterSecurity::Plain, accept),
        as_master(&mut b, &MasterSecurity::Plain, accept)
    );
    for error in [first.unwrap_err(), second.unwrap_err()] {
        assert!(matches!(error, ProtocolError::SameRole { role: Role::Master }));
        assert!(error.to_string().contains("masters"), "{error}");
    }
    let (mut a, mut b) = duplex(4096);
    let hello = hello();
    let (first, second) = tokio::join!(
        as_worker(&mut a, &WorkerSecurity::Plain, &hello),
        as_worker(&mut b, &WorkerSecurity::Plain, &hello)
    );
    assert!(matches!(first.unwrap_err(), ProtocolError::SameRole { role: Role::Worker }));
    assert!(!second.unwrap_err().is_final(false));
}

#[tokio::test]
async fn a_refusal_carries_its_reason() {
    let (mut master, mut worker) = duplex(64);
    let refuse = |_: &Hello, _: Option<KeyHash>| Err("the farm is full\x1b[2J".into());
    let hello = hello();
    let (met, welcome) = tokio::join!(
        as_master(&mut master, &MasterSecurity::Plain, refuse),
        as_worker(&mut worker, &WorkerSecurity::Plain, &hello)
    );
    assert!(matches!(met, Err(ProtocolError::Refused { .. })));
    let error = welcome.unwrap_err();
    assert!(!error.is_final(false) && error.is_final(true));
    assert_eq!(error.to_string(), "refused by the master: the farm is full\\u{1b}[2J");
}

#[tokio::test]
async fn a_temporary_refusal_is_not_final() {
    let (mut master, mut worker) = duplex(64);
    let refuse = |_: &Hello, _: Option<KeyHash>| Err(Refusal::NotNow("the master ends\x1b[2J".to_owned()));
    let hello = hello();
    let (met, welcome) = tokio::join!(
        as_master(&mut master, &MasterSecurity::Plain, refuse),
        as_worker(&mut worker, &WorkerSecurity::Plain, &hello)
    );
    assert!(matches!(met, Err(ProtocolError::NotNow { .. })));
    let error = welcome.unwrap_err();
    assert!(!error.is_final(false));
    assert_eq!(error.to_string(), "the master does not accept workers now: the master ends\\u{1b}[2J");
}

#[tokio::test]
async fn another_program_is_reported_at_both_ends() {
    let (mut master, mut browser) = duplex(4096);
    browser.write_all(b"GET / HTTP/1.1\r\nHost: farm\r\n\r\n").await.unwrap();
    let error = as_master(&mut master, &MasterSecurity::Plain, accept).await.unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("no rayfarm worker") && text.contains("HTTP") && text.contains("check the address"),
        "{text}"
    );

    let (mut server, mut worker) = duplex(4096);
    server.write_all(b"HTTP/1.1 400 Bad Request\r\n").await.unwrap();
    let error = as_worker(&mut worker, &WorkerSecurity::Plain, &hello()).await.unwrap_err();
    let text = error.to_string();
    assert!(!error.is_final(false) && text.contains("no rayfarm master") && text.contains("HTTP"), "{text}");
}

#[tokio::test(start_paused = true)]
async fn one_wrong_byte_ends_a_handshake() {
    // The peer sends no more and does not close, so only this byte can end the handshake before the deadline.
    let (mut master, mut peer) = duplex(4096);
    peer.write_all(b"x").await.unwrap();
    let error = as_master(&mut master, &MasterSecurity::Plain, accept).await.unwrap_err();
    assert!(matches!(error, ProtocolError::NotRayfarm { .. }), "{error}");
}

#[tokio::test(start_paused = true)]
async fn a_handshake_times_out_after_any_number_of_bytes() {
    let mut whole = preamble(PROTOCOL_VERSION, 2);
    whole.extend([42, 0, 0, 0, 0x01, 0, 0, 0]);
    for sent in 0..whole.len() {
        let (mut master, mut peer) = duplex(4096);
        peer.write_all(&whole[..sent]).await.unwrap();
        let begun = tokio::time::Instant::now();
        let error = as_master(&mut master, &MasterSecurity::Plain, accept).await.unwrap_err();
        assert!(matches!(error, ProtocolError::Deadline { .. }), "{error}");
        assert_eq!(begun.elapsed().as_secs(), if sent == 0 { 1 } else { 5 });
        drop(peer);
    }
}

#[tokio::test]
async fn a_close_after_any_number_of_bytes_is_an_error() {
    let mut whole = preamble(PROTOCOL_VERSION, 2);
    whole.extend([42, 0, 0, 0, 0x01, 0, 0, 0]);
    for sent in 0..whole.len() {
        let (mut master, mut peer) = duplex(4096);
        peer.write_all(&whole[..sent]).await.unwrap();
        drop(peer);
        let error = as_master(&mut master, &MasterSecurity::Plain, accept).await.unwrap_err();
        assert!(matches!(error, ProtocolError::Closed { .. } | ProtocolError::Io { .. }), "{sent}: {error}");
    }
}

#[tokio::test]
async fn envelopes_of_a_handshake_are_small_and_of_few_kinds() {
    for (header, part) in [
        ([1, 16, 0, 0, 0x01, 0, 0, 0], "4097 bytes; at most 4096"),
        ([0xff, 0xff, 0xff, 0xff, 0x21, 0, 0, 0], "4294967295 bytes"),
        ([64, 0, 0, 0, 0x21, 0, 0, 0], "a Pixels message, where a hello was expected"),
        ([0, 0, 0, 0, 0x99, 0, 0, 0], "unknown type 0x99"),
    ] {
        let (mut master, mut peer) = duplex(4096);
        peer.write_all(&preamble(PROTOCOL_VERSION, 2)).await.unwrap();
        peer.write_all(&header).await.unwrap();
        let error = as_master(&mut master, &MasterSecurity::Plain, accept).await.unwrap_err();
        assert!(error.to_string().contains(part), "{error}");
    }
}

#[tokio::test]
async fn invalid_thread_counts_are_refused_and_long_names_are_cut() {
    for (threads, part) in [(0, "at least one render thread"), (65_536, "at most 65535")] {
        let (mut master, mut peer) = duplex(4096);
        let body = rayfarm_protocol::codec::encode(&Hello { threads, ..hello() }).unwrap();
        peer.write_all(&preamble(PROTOCOL_VERSION, 2)).await.unwrap();
        peer.write_all(&[body.len() as u8, 0, 0, 0, 0x01, 0, 0, 0]).await.unwrap();
        peer.write_all(&body).await.unwrap();
        let error = as_master(&mut master, &MasterSecurity::Plain, |_, _| {
            panic!("an invalid hello reached the decision")
        })
        .await
        .unwrap_err();
        assert!(error.to_string().contains(part), "{error}");
    }

    let (mut master, mut worker) = duplex(4096);
    let long = Hello { name: "\n".repeat(9000), ..hello() };
    let (met, welcome) = tokio::join!(
        as_master(&mut master, &MasterSecurity::Plain, accept),
        as_worker(&mut worker, &WorkerSecurity::Plain, &long)
    );
    welcome.unwrap();
    assert_eq!(met.unwrap().1.name, "\\n".repeat(126) + "…");
}

#[tokio::test(start_paused = true)]
async fn a_peer_that_never_reads_times_out() {
    let (mut master, mut peer) = duplex(4);
    peer.write_all(&preamble(PROTOCOL_VERSION, 2)[..4]).await.unwrap();
    let result =
        tokio::time::timeout(Duration::from_secs(60), as_master(&mut master, &MasterSecurity::Plain, accept))
            .await;
    assert!(matches!(result, Ok(Err(ProtocolError::Deadline { .. }))));
}
