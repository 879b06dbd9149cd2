//! Handshakes through TLS: keys, tokens, other transports, relays, replays and limits.

use std::sync::{Arc, LazyLock};
use std::time::Duration;

use proptest::prelude::*;
use rayfarm_protocol::envelope::Kind;
use rayfarm_protocol::handshake::{Refusal, as_master, as_worker};
use rayfarm_protocol::transport::{
    Connection, JoinLine, JoinToken, MasterSecurity, MasterTrust, PrivateKey, PrivateKeyError, WorkerSecurity,
};
use rayfarm_protocol::{
    Hello, KeyHash, PROTOCOL_VERSION, ProtocolError, ToMaster, ToWorker, Welcome, limits, peer, session,
};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, duplex};

const PIPE_BYTES: usize = 4096;

fn hello() -> Hello {
    let tags = vec!["fast".to_owned(), "a\x1b".to_owned()];
    Hello { name: "attic".into(), threads: 4, simd: "avx2".into(), software: "0.1.0".into(), tags }
}

fn accept(_: &Hello, _: Option<KeyHash>) -> Result<Welcome, Refusal> {
    Ok(Welcome { worker: 12 })
}

fn reject_all(_: &Hello, _: Option<KeyHash>) -> Result<Welcome, Refusal> {
    panic!("a peer that has proved nothing reached the decision")
}

/// Security of a master and of a worker that may join it.
fn farm() -> (Arc<MasterTrust>, MasterSecurity, WorkerSecurity) {
    let trust = Arc::new(MasterTrust::new(PrivateKey::generate().unwrap(), JoinToken::random().unwrap()));
    let key = Arc::new(PrivateKey::generate().unwrap());
    let worker = WorkerSecurity::join(key, &trust.join_line("host:7117"));
    (Arc::clone(&trust), MasterSecurity::Tls(trust), worker)
}

type Met<T> = Result<(Connection<DuplexStream>, T), ProtocolError>;

async fn meet(master: &MasterSecurity, worker: &WorkerSecurity) -> (Met<Hello>, Met<Welcome>) {
    let (a, b) = duplex(PIPE_BYTES);
    let hello = hello();
    tokio::join!(as_master(a, master, accept), as_worker(b, worker, &hello))
}

/// Copies bytes between two pipes, and returns those of the first.
async fn relay(a: DuplexStream, b: DuplexStream) -> Vec<u8> {
    let (mut from_a, mut to_a) = tokio::io::split(a);
    let (mut from_b, mut to_b) = tokio::io::split(b);
    let forth = async {
        let (mut seen, mut buffer) = (Vec::new(), [0; 1000]);
        while let Ok(count @ 1..) = from_a.read(&mut buffer).await {
            seen.extend_from_slice(&buffer[..count]);
            if to_b.write_all(&buffer[..count]).await.is_err() {
                break;
            }
        }
        let _ = to_b.shutdown().await;
        seen
    };
    let back = async {
        let _ = tokio::io::copy(&mut from_b, &mut to_a).await;
        let _ = to_a.shutdown().await;
    };
    tokio::join!(forth, back).0
}

// The clock is paused while anything moves: single bytes take longer than the deadline on a busy machine.
#[tokio::test(start_paused = true)]
async fn both_ends_know_the_key_of_the_other_and_a_session_follows() {
    let (trust, master, worker) = farm();
    for width in [16, 100, PIPE_BYTES] {
        let (a, b) = duplex(width);
        let (hello, expected) = (hello(), worker.key_hash());
        let decide = |_: &Hello, key: Option<KeyHash>| {
            assert_eq!(key, expected);
            Ok(Welcome { worker: 12 })
        };
        let (met, welcome) = tokio::join!(as_master(a, &master, decide), as_worker(b, &worker, &hello));
        let ((met, received), (joined, welcome)) = (met.unwrap(), welcome.unwrap());
        assert_eq!((met.peer_key(), joined.peer_key()), (expected, Some(trust.key_hash())));
        assert_eq!((received.tags, welcome.worker), (vec!["fast".to_owned(), "a\\u{1b}".to_owned()], 12));
        let (out, _in, _) = session::spawn::<_, ToWorker, ToMaster>(met);
        let (_out, mut received, _) = session::spawn::<_, ToMaster, ToWorker>(joined);
        // More than the bound on the bytes of a handshake.
        for nonce in 0..2000 {
            out.send(ToWorker::Ping { nonce }).await.unwrap();
            assert_eq!(received.recv().await.unwrap().unwrap(), ToWorker::Ping { nonce });
        }
    }
}

#[tokio::test]
async fn a_master_with_another_key_gets_no_proof() {
    let (_, _, worker) = farm();
    let (other, impostor, _) = farm();
    let (met, joined) = meet(&impostor, &worker).await;
    assert!(matches!(met, Err(ProtocolError::Tls { .. })), "{met:?}");
    let error = joined.unwrap_err();
    assert!(matches!(error, ProtocolError::WrongKey { theirs, .. } if theirs == other.key_hash()), "{error}");
    assert!(!error.is_final(true) && error.to_string().contains(&other.key_hash().short()), "{error}");
}

#[tokio::test]
async fn after_a_rotation_the_old_token_is_refused_and_the_new_one_accepted() {
    let (trust, master, worker) = farm();
    trust.set_token(JoinToken::random().unwrap());
    let (met, joined) = meet(&master, &worker).await;
    assert!(matches!(met, Err(ProtocolError::WrongToken)), "{met:?}");
    let error = joined.unwrap_err();
    assert!(matches!(error, ProtocolError::Refused { .. }) && error.to_string().contains("token"), "{error}");
    let WorkerSecurity::Tls { key, .. } = &worker else { panic!() };
    let worker = WorkerSecurity::join(Arc::clone(key), &trust.join_line("host:1"));
    let (met, joined) = meet(&master, &worker).await;
    assert!(met.is_ok() && joined.is_ok());
}

#[tokio::test]
async fn an_end_with_tls_never_continues_without() {
    let (_, master, worker) = farm();
    for (master, worker) in [(&master, &WorkerSecurity::Plain), (&MasterSecurity::Plain, &worker)] {
        let (met, joined) = meet(master, worker).await;
        for error in [met.unwrap_err(), joined.unwrap_err()] {
            assert!(matches!(error, ProtocolError::Transport { .. }), "{error}");
            assert!(!error.is_final(true) && error.to_string().contains("join line"), "{error}");
        }
    }
}

#[tokio::test]
async fn a_relay_of_bytes_is_harmless_and_its_recording_useless() {
    let (_, master, worker) = farm();
    let ((a, relay_a), (relay_b, b)) = (duplex(PIPE_BYTES), duplex(PIPE_BYTES));
    let recording = tokio::spawn(relay(relay_b, relay_a));
    let hello = hello();
    let (met, joined) = tokio::join!(as_master(a, &master, accept), as_worker(b, &worker, &hello));
    assert_eq!(met.as_ref().unwrap().0.peer_key(), worker.key_hash());
    drop((met, joined));
    let recorded = recording.await.unwrap();
    assert!(recorded.len() > 500, "{}", recorded.len());

    let (a, mut replay) = duplex(1 << 16);
    replay.write_all(&recorded).await.unwrap();
    let error = as_master(a, &master, reject_all).await.unwrap_err();
    assert!(matches!(error, ProtocolError::Tls { .. }), "{error}");
}

#[tokio::test]
async fn a_relay_with_its_own_key_learns_no_proof() {
    let (_, _, worker) = farm();
    let (own, relay_security, _) = farm();
    let ((a, b), hello) = (duplex(PIPE_BYTES), hello());
    let (met, joined) =
        tokio::join!(as_master(a, &relay_security, reject_all), as_worker(b, &worker, &hello));
    assert!(matches!(met, Err(ProtocolError::Tls { .. })), "{met:?}");
    assert!(matches!(joined, Err(ProtocolError::WrongKey { theirs, .. }) if theirs == own.key_hash()));
}

/// Begins TLS with both ends under a key of its own, and passes on what each sends. The preambles are not changed.
async fn relay_decrypted(
    mut worker: DuplexStream,
    mut master: DuplexStream,
    own: &WorkerSecurity,
    master_key: KeyHash,
) {
    let (mut from_worker, mut from_master) = ([0; 12], [0; 12]);
    worker.read_exact(&mut from_worker).await.unwrap();
    master.write_all(&from_worker).await.unwrap();
    master.read_exact(&mut from_master).await.unwrap();
    worker.write_all(&from_master).await.unwrap();
    let (worker, master) =
        tokio::join!(peer::accept(worker, own), peer::connect(master, own, Some(master_key)));
    // Each end closes without a word of TLS where it fails, which is an error of the copy.
    let _ = tokio::io::copy_bidirectional(&mut worker.unwrap(), &mut master.unwrap()).await;
}

#[tokio::test]
async fn a_proof_that_is_relayed_to_another_tls_session_is_wrong() {
    let (trust, master, _) = farm();
    let (_, _, relay_security) = farm();
    // The worst case: the user has pasted a line with the key of the relay and the token of the farm.
    let worker = WorkerSecurity::Tls {
        key: Arc::new(PrivateKey::generate().unwrap()),
        master: relay_security.key_hash().unwrap(),
        token: trust.token(),
    };
    let ((a, relay_a), (relay_b, b)) = (duplex(PIPE_BYTES), duplex(PIPE_BYTES));
    let hello = hello();
    let (met, joined, ()) = tokio::join!(
        as_master(a, &master, reject_all),
        as_worker(b, &worker, &hello),
        relay_decrypted(relay_b, relay_a, &relay_security, trust.key_hash()),
    );
    assert!(matches!(met, Err(ProtocolError::WrongToken)), "{met:?}");
    let error = joined.unwrap_err();
    assert!(error.to_string().contains("token"), "{error}");
}

#[tokio::test]
async fn a_changed_record_ends_the_session() {
    let (_, master, worker) = farm();
    let ((a, mut relay_a), (mut relay_b, b)) = (duplex(PIPE_BYTES), duplex(PIPE_BYTES));
    let hello = hello();
    let meeting = async { tokio::join!(as_master(a, &master, accept), as_worker(b, &worker, &hello)) };
    let (met, joined) = {
        let copying = tokio::io::copy_bidirectional(&mut relay_a, &mut relay_b);
        tokio::select! {
            biased;
            met = meeting => met,
            _ = copying => panic!("an end closed"),
        }
    };
    let (mut master, mut worker) = (met.unwrap().0, joined.unwrap().0);
    master.write_all(b"sixteen bytes...").await.unwrap();
    master.flush().await.unwrap();
    let mut record = vec![0; PIPE_BYTES];
    let count = relay_a.read(&mut record).await.unwrap();
    record[count - 1] ^= 1;
    relay_b.write_all(&record[..count]).await.unwrap();
    let error = worker.read(&mut [0; 16]).await.unwrap_err();
    assert_eq!(error.kind(), std::io::ErrorKind::InvalidData, "{error}");
}

#[tokio::test(start_paused = true)]
async fn silent_peers_have_one_second_and_slow_ones_five() {
    let (_, master, _) = farm();
    let preamble = [b"RAYFARM\n".as_slice(), &PROTOCOL_VERSION.to_le_bytes(), &[2, 1]].concat();
    for (sent, seconds) in [(0, 1), (1, 5), (preamble.len(), 5)] {
        let (a, mut peer) = duplex(PIPE_BYTES);
        peer.write_all(&preamble[..sent]).await.unwrap();
        let begun = tokio::time::Instant::now();
        let error = as_master(a, &master, reject_all).await.unwrap_err();
        assert!(matches!(error, ProtocolError::Deadline { .. }), "{error}");
        assert_eq!(begun.elapsed(), Duration::from_secs(seconds));
    }
}

#[tokio::test]
async fn input_before_the_proof_is_bounded() {
    let (_, master, _) = farm();
    let (a, mut peer) = duplex(64);
    let sending = async {
        let preamble = [b"RAYFARM\n".as_slice(), &PROTOCOL_VERSION.to_le_bytes(), &[2, 1]].concat();
        peer.write_all(&preamble).await.unwrap();
        // Records of 16 KiB with parts of a hello that announces 16 MiB.
        let record = [[0x16, 3, 1, 0x40, 0, 1, 0xff, 0xff, 0xff].as_slice(), &[0; (16 << 10) - 4]].concat();
        let mut sent = 0;
        for byte in record.iter().cycle() {
            if peer.write_all(&[*byte]).await.is_err() || sent > 1 << 20 {
                break;
            }
            sent += 1;
        }
        sent
    };
    let (met, sent) = tokio::join!(as_master(a, &master, reject_all), sending);
    assert!(matches!(met, Err(ProtocolError::Tls { .. })), "{met:?}");
    assert!(sent <= limits::MAX_UNAUTHENTICATED_BYTES + 64, "{sent}");
}

#[test]
fn a_key_file_is_private_and_loads_as_the_same_key() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state").join("key.pem");
    let made = PrivateKey::load_or_create(&path).unwrap();
    assert_eq!(PrivateKey::load_or_create(&path).unwrap().hash(), made.hash());
    assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = |path: &std::path::Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!((mode(&path), mode(path.parent().unwrap())), (0o600, 0o700));
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o640)).unwrap();
        let error = PrivateKey::load_or_create(&path).unwrap_err();
        assert!(matches!(error, PrivateKeyError::Exposed { mode: 0o640, .. }), "{error}");
        assert!(error.to_string().contains("chmod 600"), "{error}");
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).unwrap();
    }
    std::fs::write(&path, "no key").unwrap();
    assert!(matches!(PrivateKey::load_or_create(&path), Err(PrivateKeyError::Content { .. })));
}

#[test]
fn errors_of_a_join_line_name_the_wrong_part_and_not_the_token() {
    let (key, token) = ("ab".repeat(32), "cd".repeat(16));
    for (line, part) in [
        (format!("rf2:h:1:{key}:{token}"), "begins with"),
        ("rf1:h:1".to_owned(), "has the form"),
        (format!("rf1::1:{key}:{token}"), "host"),
        (format!("rf1:::1:1:{key}:{token}"), "host"),
        (format!("rf1:h:0:{key}:{token}"), "port"),
        (format!("rf1:h:+1:{key}:{token}"), "port"),
        (format!("rf1:h:1:{}:{token}", &key[1..]), "key"),
        (format!("rf1:h:1:{key}:{}", &token[1..]), "token"),
        (format!("rf1:h:1:{key}:{token} more"), "has the form"),
    ] {
        let error = line.parse::<JoinLine>().unwrap_err().to_string();
        assert!(error.contains(part) && !error.contains(&token), "{line}: {error}");
    }
    let line: JoinLine = format!("rf1:[fe80::1%eth0]:1:{key}:{token}").parse().unwrap();
    assert_eq!(line.address, "[fe80::1%eth0]:1");
    assert!(!format!("{line:?}").contains(&token));
}

/// Keys for all cases of a property.
static FARM: LazyLock<(Arc<MasterTrust>, MasterSecurity, WorkerSecurity)> = LazyLock::new(farm);

/// The error of a master whose peer sends these bytes after preambles and TLS.
fn error_of_master(bytes: &[u8]) -> ProtocolError {
    let (trust, master, worker) = &*FARM;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
    runtime.block_on(async {
        let (a, mut b) = duplex(1 << 16);
        let sending = async {
            let preamble = [b"RAYFARM\n".as_slice(), &PROTOCOL_VERSION.to_le_bytes(), &[2, 1]].concat();
            b.write_all(&preamble).await.unwrap();
            b.read_exact(&mut [0; 12]).await.unwrap();
            let mut stream = peer::connect(b, worker, Some(trust.key_hash())).await.unwrap();
            let _ = stream.write_all(bytes).await;
            let _ = stream.shutdown().await;
            // A refusal has room in the pipe.
            let _ = stream.read_to_end(&mut Vec::new()).await;
        };
        tokio::join!(as_master(a, master, reject_all), sending).0.unwrap_err()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn arbitrary_proofs_of_any_length_are_wrong(proof in prop::collection::vec(any::<u8>(), 0..=64)) {
        let head = (proof.len() as u32).to_le_bytes();
        let error = error_of_master(&[&head[..], &[Kind::Proof as u8, 0, 0, 0], &proof].concat());
        let is_expected = match proof.len() {
            length if length > limits::PROOF_BYTES => matches!(error, ProtocolError::TooLong { .. }),
            _ => matches!(error, ProtocolError::WrongToken),
        };
        prop_assert!(is_expected, "{} bytes: {}", proof.len(), error);
    }

    #[test]
    fn arbitrary_bytes_instead_of_a_proof_end_the_handshake(
        bytes in prop::collection::vec(any::<u8>(), 0..3000),
    ) {
        let error = error_of_master(&bytes);
        prop_assert!(!error.is_final(true), "{}", error);
    }
}

proptest! {
    #[test]
    fn join_lines_round_trip(
        host in "[a-z][a-z0-9.-]{0,40}|[0-9]{1,3}\\.1\\.2\\.3|\\[[0-9a-f]{1,4}::1\\]",
        port in 1..=u16::MAX,
        key: [u8; 32],
        token: [u8; 16],
    ) {
        let line = JoinLine { address: format!("{host}:{port}"), key: KeyHash(key), token: JoinToken(token) };
        for text in [line.to_string(), format!(" rayfarm-worker --join {line}\n"), format!("--join='{line}'")] {
            prop_assert_eq!(&text.parse::<JoinLine>().unwrap(), &line);
        }
    }

    #[test]
    fn arbitrary_text_is_no_join_line_or_one_that_round_trips(text in "(rf1:)?[ -~äö:]{0,200}") {
        if let Ok(line) = text.parse::<JoinLine>() {
            prop_assert_eq!(line.to_string().parse::<JoinLine>().unwrap(), line);
        }
    }
}
