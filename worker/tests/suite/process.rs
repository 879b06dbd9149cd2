//! Tests of the program: exit codes, messages, signals.

use std::process::{Output, Stdio};
use std::time::Duration;

use rayfarm_protocol::handshake::{self, Refusal};
use rayfarm_protocol::{Hello, Reconnect, ToMaster, ToWorker};
use tokio::process::{Child, Command};

use crate::common::{Link, Stage, listen};

fn program(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rayfarm-worker"));
    command.args(args).env_remove("RUST_LOG").stdin(Stdio::piped()).stderr(Stdio::piped()).kill_on_drop(true);
    command
}

fn start(address: &str, more: &[&str]) -> Child {
    program(&[&["--master", address, "--threads", "2"], more].concat()).spawn().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[tokio::test]
async fn a_wrong_command_line_is_status_2_with_the_expected_form() {
    for (args, part) in [
        (&[][..], "--master"),
        (&["--master", "farm"], "HOST:PORT"),
        (&["--master", "farm:70000"], "65535"),
        (&["--master", "::1:7117"], "HOST:PORT"),
        (&["--master", "farm:7117", "--threads", "0"], "1..=1024"),
        (&["--master", "farm:7117", "--colour"], "--colour"),
        (&["--master", "farm:7117", "--share", "[fe80::1%nothere0]:1"], "nothere0"),
    ] {
        let output = program(args).output().await.unwrap();
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        assert!(stderr(&output).contains(part), "{args:?}: {}", stderr(&output));
    }
}

#[tokio::test]
async fn an_unreachable_master_is_status_1_with_the_address() {
    let (listener, address) = listen().await;
    drop(listener);
    let output = program(&["--master", &address, "--no-reconnect"]).output().await.unwrap();
    assert_eq!(output.status.code(), Some(1));
    let text = stderr(&output);
    assert!(text.contains(&address), "{text}");
}

#[tokio::test]
async fn an_unknown_scope_is_status_1_with_the_interfaces() {
    let output = program(&["--master", "[fe80::1%nothere0]:7117", "--no-reconnect"]).output().await.unwrap();
    assert_eq!(output.status.code(), Some(1));
    let text = stderr(&output);
    assert!(text.contains("nothere0") && text.contains("lo"), "{text}");
}

#[tokio::test]
async fn a_disconnect_is_status_0() {
    let (listener, address) = listen().await;
    let worker = start(&address, &["--name", "cellar"]);
    let mut link = Link::accept(&listener).await;
    assert_eq!(link.hello.name, "cellar");
    link.check_frame(&Stage::new(), 0, 0.0).await;
    link.out
        .send(ToWorker::Disconnect { reason: "end of the run".into(), reconnect: Reconnect::Never })
        .await
        .unwrap();
    let output = worker.wait_with_output().await.unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(stderr(&output).contains("end of the run"), "{}", stderr(&output));
}

#[tokio::test]
async fn a_worker_waits_for_the_next_master() {
    let (listener, address) = listen().await;
    let stage = Stage::new();
    let worker = start(&address, &[]);
    for (number, reconnect) in
        [Reconnect::NextMaster, Reconnect::NextMaster, Reconnect::Never].into_iter().enumerate()
    {
        let mut link = Link::accept(&listener).await;
        link.check_frame(&stage, 0, number as f64).await;
        assert_eq!(link.requests > 0, number == 0, "assets are kept across masters");
        link.out.send(ToWorker::Disconnect { reason: "end of the run".into(), reconnect }).await.unwrap();
    }
    let output = worker.wait_with_output().await.unwrap();
    assert_eq!(output.status.code(), Some(0));
}

#[tokio::test]
async fn with_once_a_worker_ends_with_its_master() {
    let (listener, address) = listen().await;
    let worker = start(&address, &["--once"]);
    let mut link = Link::accept(&listener).await;
    link.check_frame(&Stage::new(), 0, 0.0).await;
    let disconnect =
        ToWorker::Disconnect { reason: "end of the run".into(), reconnect: Reconnect::NextMaster };
    link.out.send(disconnect).await.unwrap();
    let output = worker.wait_with_output().await.unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(stderr(&output).contains("end of the run"), "{}", stderr(&output));
}

#[tokio::test]
async fn a_temporary_refusal_is_retried() {
    let (listener, address) = listen().await;
    let worker = start(&address, &[]);
    let mut stream = listener.accept().await.unwrap().0;
    let full =
        |_: &Hello, _: Option<rayfarm_protocol::KeyHash>| Err(Refusal::NotNow("the farm is full".into()));
    handshake::as_master(&mut stream, &rayfarm_protocol::transport::MasterSecurity::Plain, full)
        .await
        .unwrap_err();
    let mut link = Link::accept(&listener).await;
    link.check_frame(&Stage::new(), 0, 0.0).await;
    link.out
        .send(ToWorker::Disconnect { reason: "kicked".into(), reconnect: Reconnect::Never })
        .await
        .unwrap();
    let output = worker.wait_with_output().await.unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(stderr(&output).contains("the farm is full"), "{}", stderr(&output));
}

/// Processor time that a process has used, in hundredths of a second.
#[cfg(target_os = "linux")]
fn processor_time(worker: &Child) -> u64 {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", worker.id().unwrap())).unwrap();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
    fields[11].parse::<u64>().unwrap() + fields[12].parse::<u64>().unwrap()
}

#[cfg(target_os = "linux")]
#[tokio::test]
async fn a_waiting_worker_uses_no_processor_time_logs_one_line_and_ends_at_once() {
    let (listener, address) = listen().await;
    drop(listener);
    let worker = start(&address, &[]);
    // Several attempts fail meanwhile.
    tokio::time::sleep(Duration::from_secs(2)).await;
    let before = processor_time(&worker);
    tokio::time::sleep(Duration::from_secs(6)).await;
    assert!(processor_time(&worker) - before <= 3, "hundredths of a second in 6 s");
    let signalled = std::time::Instant::now();
    signal(&worker, "-INT").await;
    let output = worker.wait_with_output().await.unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(signalled.elapsed() < Duration::from_secs(3), "{:?}", signalled.elapsed());
    let text = stderr(&output);
    assert_eq!(text.matches(&address).count(), 1, "{text}");
}

#[tokio::test]
async fn a_worker_ends_at_the_end_of_standard_input() {
    let (listener, address) = listen().await;
    let mut worker = start(&address, &["--exit-with-stdin"]);
    let mut link = Link::accept(&listener).await;
    // Before its session it would end without a disconnect.
    link.check_frame(&Stage::new(), 0, 0.0).await;
    drop(worker.stdin.take());
    assert!(matches!(link.receive(&Stage::new()).await, Some(ToMaster::Disconnect { .. })));
    assert_eq!(worker.wait().await.unwrap().code(), Some(0));
}

#[cfg(unix)]
async fn signal(worker: &Child, name: &str) {
    let id = worker.id().unwrap().to_string();
    assert!(Command::new("kill").args([name, &id]).status().await.unwrap().success());
}

#[cfg(unix)]
#[tokio::test]
async fn a_signal_drains_a_worker_and_its_status_is_0() {
    for name in ["-TERM", "-INT"] {
        let (listener, address) = listen().await;
        let stage = Stage::new();
        let mut worker = start(&address, &[]);
        let mut link = Link::accept(&listener).await;
        // A worker that renders listens for signals already.
        link.check_frame(&stage, 0, 0.0).await;
        signal(&worker, name).await;
        assert_eq!(link.receive(&stage).await, Some(ToMaster::Drain));
        // Leases that the master has sent meanwhile are rendered.
        link.check_frame(&stage, 1, 20.0).await;
        link.out
            .send(ToWorker::Disconnect { reason: "all done".into(), reconnect: Reconnect::Now })
            .await
            .unwrap();
        assert_eq!(worker.wait().await.unwrap().code(), Some(0));
    }
}

#[cfg(unix)]
#[tokio::test]
async fn a_second_signal_ends_a_worker_at_once_with_a_disconnect() {
    let (listener, address) = listen().await;
    let stage = Stage::new();
    let mut worker = start(&address, &[]);
    let mut link = Link::accept(&listener).await;
    link.check_frame(&stage, 0, 0.0).await;
    signal(&worker, "-TERM").await;
    assert_eq!(link.receive(&stage).await, Some(ToMaster::Drain));
    signal(&worker, "-INT").await;
    assert!(matches!(link.receive(&stage).await, Some(ToMaster::Disconnect { .. })));
    assert_eq!(worker.wait().await.unwrap().code(), Some(0));
}
