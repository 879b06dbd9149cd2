//! How connections begin, and how they do not.

use std::time::Duration;

use rayfarm_protocol::handshake::{Refusal, as_master, as_worker};
use rayfarm_protocol::{Hello, PROTOCOL_VERSION, ProtocolError, Role, ToMaster, ToWorker, Welcome, session};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};

fn hello() -> Hello {
    Hello { name: "attic".into(), threads: 4, simd: "baseline".into(), software: "0.1.0".into() }
}

fn take(_: &Hello) -> Result<Welcome, Refusal> {
    Ok(Welcome { worker: 12 })
}

fn preamble(version: u16, role: u8) -> Vec<u8> {
    let mut bytes = b"RAYFARM\n".to_vec();
    bytes.extend(version.to_le_bytes());
    bytes.extend([role, 0]);
    bytes
}

/// Everything the peer said until it closed, as text.
async fn listen(mut io: DuplexStream) -> String {
    let mut heard = Vec::new();
    io.read_to_end(&mut heard).await.unwrap();
    String::from_utf8_lossy(&heard).into_owned()
}

#[tokio::test]
async fn both_sides_meet_through_pipes_of_any_width_and_a_session_follows() {
    for width in [1, 3, 12, 4096] {
        let (mut master, mut worker) = duplex(width);
        let hello = hello();
        let (met, welcome) = tokio::join!(as_master(&mut master, take), as_worker(&mut worker, &hello));
        assert_eq!(met.unwrap(), hello);
        assert_eq!(welcome.unwrap(), Welcome { worker: 12 });
        // Not a byte too many was read: the session starts on an envelope.
        let (out, _master_in, _) = session::spawn::<_, ToWorker, ToMaster>(master);
        let (_worker_out, mut received, _) = session::spawn::<_, ToMaster, ToWorker>(worker);
        out.send(ToWorker::Ping { nonce: 1 }).await.unwrap();
        assert_eq!(received.recv().await.unwrap().unwrap(), ToWorker::Ping { nonce: 1 });
    }
}

#[tokio::test]
async fn a_worker_of_another_version_is_told_both_and_the_remedy() {
    let (mut master, mut worker) = duplex(4096);
    worker.write_all(&preamble(PROTOCOL_VERSION + 1, 2)).await.unwrap();
    let error = as_master(&mut master, take).await.unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, ProtocolError::Version { theirs, .. } if theirs == PROTOCOL_VERSION + 1));
    assert!(error.is_final());
    for part in [
        &format!("master speaks protocol version {PROTOCOL_VERSION}"),
        &format!("worker speaks version {}", PROTOCOL_VERSION + 1),
        "install the same release",
        "the master's is",
    ] {
        assert!(text.contains(part), "{text}");
    }
    drop(master);
    let heard = listen(worker).await;
    assert!(heard.contains(&text), "{heard}");
}

#[tokio::test]
async fn a_master_of_another_version_is_named_by_the_worker() {
    let (mut master, mut worker) = duplex(4096);
    master.write_all(&preamble(0, 1)).await.unwrap();
    let error = as_worker(&mut worker, &hello()).await.unwrap_err();
    let text = error.to_string();
    let both = format!("worker speaks protocol version {PROTOCOL_VERSION}, the master speaks version 0");
    assert!(text.contains(&both), "{text}");
    assert!(text.contains("the master's is the older one"), "{text}");
}

#[tokio::test]
async fn two_masters_or_two_workers_are_named() {
    let (mut a, mut b) = duplex(4096);
    let (first, second) = tokio::join!(as_master(&mut a, take), as_master(&mut b, take));
    for error in [first.unwrap_err(), second.unwrap_err()] {
        assert!(matches!(error, ProtocolError::SameRole { role: Role::Master }));
        assert!(error.to_string().contains("both ends of the connection are masters"), "{error}");
    }
    let (mut a, mut b) = duplex(4096);
    let hello = hello();
    let (first, second) = tokio::join!(as_worker(&mut a, &hello), as_worker(&mut b, &hello));
    assert!(first.unwrap_err().to_string().contains("are workers"));
    assert!(second.unwrap_err().is_final());
}

#[tokio::test]
async fn a_refusal_brings_its_reason() {
    let (mut master, mut worker) = duplex(64);
    let refuse = |_: &Hello| Err("the farm is full\x1b[2J".into());
    let hello = hello();
    let (met, welcome) = tokio::join!(as_master(&mut master, refuse), as_worker(&mut worker, &hello));
    assert!(matches!(met, Err(ProtocolError::Refused { .. })));
    let error = welcome.unwrap_err();
    assert!(error.is_final());
    assert_eq!(error.to_string(), "refused by the master: the farm is full\\u{1b}[2J");
}

#[tokio::test]
async fn a_refusal_for_now_is_not_final() {
    let (mut master, mut worker) = duplex(64);
    let refuse = |_: &Hello| Err(Refusal::NotNow("the master ends\x1b[2J".to_owned()));
    let hello = hello();
    let (met, welcome) = tokio::join!(as_master(&mut master, refuse), as_worker(&mut worker, &hello));
    assert!(matches!(met, Err(ProtocolError::NotNow { .. })));
    let error = welcome.unwrap_err();
    assert!(!error.is_final());
    assert_eq!(error.to_string(), "the master does not take workers now: the master ends\\u{1b}[2J");
}

#[tokio::test]
async fn something_else_gets_a_clear_error_on_both_sides() {
    let (mut master, mut browser) = duplex(4096);
    browser.write_all(b"GET / HTTP/1.1\r\nHost: farm\r\n\r\n").await.unwrap();
    let error = as_master(&mut master, take).await.unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("no rayfarm worker") && text.contains("HTTP") && text.contains("check the address"),
        "{text}"
    );

    let (mut server, mut worker) = duplex(4096);
    server.write_all(b"HTTP/1.1 400 Bad Request\r\n").await.unwrap();
    let error = as_worker(&mut worker, &hello()).await.unwrap_err();
    let text = error.to_string();
    assert!(error.is_final() && text.contains("no rayfarm master") && text.contains("HTTP"), "{text}");
}

#[tokio::test(start_paused = true)]
async fn a_single_wrong_byte_is_enough() {
    // Nothing else comes and nothing closes: an answer before the deadline can only be due to the byte.
    let (mut master, mut peer) = duplex(4096);
    peer.write_all(b"x").await.unwrap();
    let error = as_master(&mut master, take).await.unwrap_err();
    assert!(matches!(error, ProtocolError::NotRayfarm { .. }), "{error}");
}

#[tokio::test(start_paused = true)]
async fn silence_has_a_deadline_at_every_byte() {
    let mut whole = preamble(PROTOCOL_VERSION, 2);
    whole.extend([42, 0, 0, 0, 0x01, 0, 0, 0]);
    for said in 0..whole.len() {
        let (mut master, mut peer) = duplex(4096);
        peer.write_all(&whole[..said]).await.unwrap();
        let begun = tokio::time::Instant::now();
        let error = as_master(&mut master, take).await.unwrap_err();
        assert!(matches!(error, ProtocolError::Deadline { .. }), "{error}");
        assert_eq!(begun.elapsed().as_secs(), 5);
        drop(peer);
    }
}

#[tokio::test]
async fn closing_anywhere_is_an_error_and_no_hang() {
    let mut whole = preamble(PROTOCOL_VERSION, 2);
    whole.extend([42, 0, 0, 0, 0x01, 0, 0, 0]);
    for said in 0..whole.len() {
        let (mut master, mut peer) = duplex(4096);
        peer.write_all(&whole[..said]).await.unwrap();
        drop(peer);
        let error = as_master(&mut master, take).await.unwrap_err();
        assert!(matches!(error, ProtocolError::Closed { .. } | ProtocolError::Io { .. }), "{said}: {error}");
    }
}

#[tokio::test]
async fn before_the_handshake_is_done_frames_are_small_and_of_few_kinds() {
    for (header, part) in [
        ([1, 16, 0, 0, 0x01, 0, 0, 0], "4097 bytes; at most 4096"),
        ([0xff, 0xff, 0xff, 0xff, 0x21, 0, 0, 0], "4294967295 bytes"),
        ([64, 0, 0, 0, 0x21, 0, 0, 0], "a Pixels message, where a hello was expected"),
        ([0, 0, 0, 0, 0x99, 0, 0, 0], "unknown type 0x99"),
    ] {
        let (mut master, mut peer) = duplex(4096);
        peer.write_all(&preamble(PROTOCOL_VERSION, 2)).await.unwrap();
        peer.write_all(&header).await.unwrap();
        let error = as_master(&mut master, take).await.unwrap_err();
        assert!(error.to_string().contains(part), "{error}");
    }
}

#[tokio::test]
async fn absurd_hellos_are_refused_and_long_names_cut_by_honest_workers() {
    for (threads, part) in [(0, "at least one render thread"), (65_536, "at most 65535")] {
        let (mut master, mut peer) = duplex(4096);
        let body = rayfarm_protocol::codec::encode(&Hello { threads, ..hello() }).unwrap();
        peer.write_all(&preamble(PROTOCOL_VERSION, 2)).await.unwrap();
        peer.write_all(&[body.len() as u8, 0, 0, 0, 0x01, 0, 0, 0]).await.unwrap();
        peer.write_all(&body).await.unwrap();
        let error = as_master(&mut master, |_| panic!("nobody may decide on this")).await.unwrap_err();
        assert!(error.to_string().contains(part), "{error}");
    }

    let (mut master, mut worker) = duplex(4096);
    let long = Hello { name: "\n".repeat(9000), ..hello() };
    let (met, welcome) = tokio::join!(as_master(&mut master, take), as_worker(&mut worker, &long));
    welcome.unwrap();
    assert_eq!(met.unwrap().name, "\\n".repeat(126) + "…");
}

#[tokio::test(start_paused = true)]
async fn a_peer_that_never_reads_does_not_hold_the_master() {
    let (mut master, mut peer) = duplex(4);
    peer.write_all(&preamble(PROTOCOL_VERSION, 2)[..4]).await.unwrap();
    let result = tokio::time::timeout(Duration::from_secs(60), as_master(&mut master, take)).await;
    assert!(matches!(result, Ok(Err(ProtocolError::Deadline { .. }))));
}
