//! Tests of the program with join lines, remembered masters and the doctor.

use std::path::Path;
use std::process::{Output, Stdio};
use std::sync::Arc;
use std::time::Duration;

use rayfarm_protocol::transport::{Connection, JoinToken, KeyHash, MasterSecurity, MasterTrust, PrivateKey};
use rayfarm_protocol::{Hello, Reconnect, ToMaster, ToWorker, Welcome, handshake, session};
use tokio::io::AsyncWriteExt;
use tokio::net::{TcpListener, TcpStream};
use tokio::process::{Child, Command};

use crate::common::listen;

/// A master with TLS, at an address of its own.
struct Farm {
    listener: TcpListener,
    trust: Arc<MasterTrust>,
    line: String,
    token: String,
}

impl Farm {
    async fn new() -> Self {
        let (listener, address) = listen().await;
        let token = JoinToken::random().unwrap();
        let trust = Arc::new(MasterTrust::new(PrivateKey::generate().unwrap(), token));
        let line = trust.join_line(address).to_string();
        Self { listener, trust, line, token: token.to_string() }
    }

    async fn accept(&self) -> (Connection<TcpStream>, Hello, Option<KeyHash>) {
        let (stream, _) = self.listener.accept().await.unwrap();
        let security = MasterSecurity::Tls(Arc::clone(&self.trust));
        let mut key = None;
        let accepted = handshake::as_master(stream, &security, |_, worker| {
            key = worker;
            Ok(Welcome { worker: 1 })
        });
        let (connection, hello) = accepted.await.unwrap();
        (connection, hello, key)
    }

    /// Accepts a worker and disconnects it for good.
    async fn accept_and_end(&self) -> (Hello, Option<KeyHash>) {
        let (connection, hello, key) = self.accept().await;
        let (sender, _receiver, _) = session::spawn::<_, ToWorker, ToMaster>(connection);
        let end = ToWorker::Disconnect { reason: "done".into(), reconnect: Reconnect::Never };
        sender.send(end).await.unwrap();
        sender.closed().await;
        (hello, key)
    }
}

fn start(state: &Path, args: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rayfarm-worker"));
    command.args(args).env_remove("RUST_LOG").env_remove("RAYFARM_JOIN").env_remove("STATE_DIRECTORY");
    command.env("XDG_STATE_HOME", state).env("HOME", state);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).kill_on_drop(true);
    command.spawn().unwrap()
}

async fn finish(mut child: Child) -> Output {
    drop(child.stdin.take());
    tokio::time::timeout(Duration::from_secs(30), child.wait_with_output()).await.unwrap().unwrap()
}

fn text(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

async fn run(state: &Path, args: &[&str]) -> Output {
    finish(start(state, args)).await
}

#[tokio::test]
async fn a_join_line_of_standard_input_is_remembered_and_the_key_is_kept() {
    let (folder, farm) = (tempfile::tempdir().unwrap(), Farm::new().await);
    let state = folder.path();
    let mut child = start(state, &["--join", "-", "--threads", "1", "--name", "attic", "--tags", "fast,big"]);
    child.stdin.as_mut().unwrap().write_all(format!("{}\n", farm.line).as_bytes()).await.unwrap();
    let (hello, first_key) = farm.accept_and_end().await;
    assert_eq!((hello.name.as_str(), hello.tags), ("attic", vec!["fast".to_owned(), "big".to_owned()]));
    let output = finish(child).await;
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    assert!(!text(&output).contains(&farm.token));

    // Without any option the worker joins again, with the same key.
    let child = start(state, &["--threads", "1"]);
    let (_, second_key) = farm.accept_and_end().await;
    assert_eq!(finish(child).await.status.code(), Some(0));
    assert!(first_key.is_some() && first_key == second_key);

    let listed = run(state, &["masters"]).await;
    let shown = text(&listed);
    assert!(shown.contains("127.0.0.1") && !shown.contains(&farm.token), "{shown}");
    assert_eq!(run(state, &["forget", "elsewhere"]).await.status.code(), Some(1));
    assert_eq!(run(state, &["forget", "127.0.0.1"]).await.status.code(), Some(0));
    let output = run(state, &["--threads", "1"]).await;
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output).contains("--join"), "{}", text(&output));
}

#[cfg(unix)]
#[tokio::test]
async fn files_of_the_state_folder_are_private() {
    use std::os::unix::fs::PermissionsExt;
    let (folder, farm) = (tempfile::tempdir().unwrap(), Farm::new().await);
    let child = start(folder.path(), &["--join", &farm.line, "--threads", "1"]);
    farm.accept_and_end().await;
    finish(child).await;
    let state = folder.path().join("rayfarm-worker");
    let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode(&state), 0o700);
    let mut names: Vec<_> = std::fs::read_dir(&state).unwrap().map(|entry| entry.unwrap().path()).collect();
    names.sort();
    assert_eq!(names, [state.join("key.pem"), state.join("masters")]);
    assert!(names.iter().all(|path| mode(path) == 0o600));
}

#[tokio::test]
async fn no_remember_and_local_workers_save_no_join_line() {
    let (folder, farm) = (tempfile::tempdir().unwrap(), Farm::new().await);
    for option in ["--no-remember", "--exit-with-stdin"] {
        let mut child = start(folder.path(), &["--join", "-", "--threads", "1", option]);
        child.stdin.as_mut().unwrap().write_all(format!("{}\n", farm.line).as_bytes()).await.unwrap();
        farm.accept_and_end().await;
        assert_eq!(finish(child).await.status.code(), Some(0), "{option}");
        assert!(!folder.path().join("rayfarm-worker/masters").exists(), "{option}");
    }
}

#[tokio::test]
async fn the_next_remembered_master_is_joined_where_the_last_one_does_not_answer() {
    let folder = tempfile::tempdir().unwrap();
    let (first, last) = (Farm::new().await, Farm::new().await);
    for farm in [&first, &last] {
        let child = start(folder.path(), &["--join", &farm.line, "--threads", "1"]);
        farm.accept_and_end().await;
        finish(child).await;
    }
    drop(last.listener);
    let child = start(folder.path(), &["--threads", "1"]);
    first.accept_and_end().await;
    assert_eq!(finish(child).await.status.code(), Some(0));
}

#[tokio::test]
async fn a_false_master_does_not_end_a_worker() {
    let (folder, farm) = (tempfile::tempdir().unwrap(), Farm::new().await);
    let mut child = start(folder.path(), &["--join", &farm.line, "--threads", "1", "--no-remember"]);
    // Another version; another program; another key; a plain master.
    for bytes in
        [&b"RAYFARM\n\xff\xff\x01\x01"[..], b"HTTP/1.1 400 Bad Request\r\n\r\n", b"RAYFARM\n\x01\0\x01\0"]
    {
        let (mut stream, _) = farm.listener.accept().await.unwrap();
        let _ = stream.write_all(bytes).await;
        drop(stream);
    }
    let (stream, _) = farm.listener.accept().await.unwrap();
    let other = MasterTrust::new(PrivateKey::generate().unwrap(), farm.trust.token());
    let security = MasterSecurity::Tls(Arc::new(other));
    assert!(handshake::as_master(stream, &security, |_, _| Ok(Welcome { worker: 1 })).await.is_err());
    assert!(child.try_wait().unwrap().is_none(), "the worker has ended");
    farm.accept_and_end().await;
    assert_eq!(finish(child).await.status.code(), Some(0));
}

#[tokio::test]
async fn a_wrong_line_is_status_2_and_is_not_repeated() {
    let folder = tempfile::tempdir().unwrap();
    let token = "0123456789abcdef0123456789abcdef";
    for line in [format!("rf1:farm:0:{}:{token}", "ab".repeat(32)), token.to_owned(), String::new()] {
        let mut child = start(folder.path(), &["--join", "-"]);
        child.stdin.as_mut().unwrap().write_all(format!("{line}\n").as_bytes()).await.unwrap();
        let output = finish(child).await;
        assert_eq!(output.status.code(), Some(2), "{}", text(&output));
        assert!(!text(&output).contains(token), "{}", text(&output));
    }
    let both = run(folder.path(), &["--join", "-", "--master", "farm:1"]).await;
    assert_eq!(both.status.code(), Some(2));
}

#[tokio::test]
async fn the_doctor_leaves_the_farm_in_order_and_names_the_failed_check() {
    let (folder, farm) = (tempfile::tempdir().unwrap(), Farm::new().await);
    let child = start(folder.path(), &["doctor", "--join", &farm.line]);
    // The connections that measure the round trip are closed before the handshake.
    for _ in 0..4 {
        drop(farm.listener.accept().await.unwrap());
    }
    let (connection, hello, _) = farm.accept().await;
    assert_eq!((hello.name.as_str(), hello.threads), ("doctor", 1));
    let (sender, mut receiver, _) = session::spawn::<_, ToWorker, ToMaster>(connection);
    assert_eq!(receiver.recv().await.unwrap().unwrap(), ToMaster::Drain);
    let end = ToWorker::Disconnect { reason: "drained".into(), reconnect: Reconnect::Never };
    sender.send(end).await.unwrap();
    let output = finish(child).await;
    assert_eq!(output.status.code(), Some(0), "{}", text(&output));
    assert!(text(&output).contains("key and token  ok"), "{}", text(&output));

    drop(farm.listener);
    let output = run(folder.path(), &["doctor", "--join", &farm.line]).await;
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output).contains("port           FAILED"), "{}", text(&output));
}
