//! Masters with few file descriptors: connections of unknown peers lose no frame, and workers that find no place join later.

use std::fs;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use rayfarm_protocol::session;
use rayfarm_protocol::transport::WorkerSecurity;
use rayfarm_protocol::{Hello, ToMaster, ToWorker, handshake};
use rayfarm_tests::{Running, Scenes, free_port, master, wait_until, worker};
use tokio::net::TcpStream;
use tokio::sync::watch;

/// Descriptors that a master keeps for files and for connections in their handshake.
const KEPT: u32 = 64 + 112;

/// A master that renders with external workers, and may open few files.
struct FullFarm {
    scenes: Scenes,
    port: u16,
    frames: usize,
    secure: bool,
    master: Running,
}

impl FullFarm {
    /// Starts to render frames, with room for this number of workers.
    fn start(workers: u32, frames: usize, secure: bool) -> Self {
        let (scenes, port) = (Scenes::new(), free_port());
        let mut render = master();
        render.arg("render").arg(scenes.path("small.toml")).arg("-o").arg(scenes.path("frame-%05d.ppm"));
        render.args(["--frames", &frames.to_string(), "--spin", "3", "--size", "320x240"]);
        render.args(["--no-local-workers", "--listen", &format!("127.0.0.1:{port}")]);
        render.arg("--state").arg(scenes.path("state"));
        if secure {
            render.arg("--secure");
        }
        let mut shell = Command::new("sh");
        let limit = (KEPT + workers).to_string();
        shell
            .args(["-c", "ulimit -n \"$0\" && exec \"$@\"", &limit])
            .arg(render.get_program())
            .args(render.get_args());
        let mut master = Running::start(&mut shell);
        master.wait_for(&format!("allows {workers} workers"));
        Self { scenes, port, frames, secure, master }
    }

    fn worker(&self, name: &str) -> Running {
        let mut command = worker();
        command.args(["--threads", "1", "--name", name, "--no-remember", "--join", "-"]);
        command.env("XDG_STATE_HOME", self.scenes.path(name));
        if !self.secure {
            let mut command = worker();
            let address = format!("127.0.0.1:{}", self.port);
            return Running::start(command.args(["--threads", "1", "--name", name, "--master", &address]));
        }
        let mut worker = Running::start_with_stdin(&mut command);
        worker.write_line(&self.join_line());
        worker
    }

    fn join_line(&self) -> String {
        let mut command = master();
        command.args(["trust", "show", "--listen", &format!("127.0.0.1:{}", self.port), "--state"]);
        let shown = Running::start(command.arg(self.scenes.path("state"))).finish().expect_success().stdout;
        shown.trim().strip_prefix("rayfarm-worker --join ").unwrap().to_owned()
    }

    fn frame(&self, frame: usize) -> PathBuf {
        self.scenes.path(&format!("frame-{frame:05}.ppm"))
    }

    /// Waits for the end and returns all frames.
    fn finish(self) -> Vec<Vec<u8>> {
        let paths: Vec<_> = (0..self.frames).map(|frame| self.frame(frame)).collect();
        self.master.finish().expect_success();
        paths.iter().map(|path| fs::read(path).unwrap()).collect()
    }
}

/// Joins as a worker that answers pings and no lease, again and again, until `ended`.
async fn answer_pings_only(port: u16, name: String, mut ended: watch::Receiver<bool>) {
    let hello = Hello { name, threads: 1, simd: "none".into(), software: "test".into(), tags: Vec::new() };
    let joining = async {
        loop {
            if let Ok(stream) = TcpStream::connect(("127.0.0.1", port)).await
                && let Ok((stream, _)) = handshake::as_worker(stream, &WorkerSecurity::Plain, &hello).await
            {
                let (sender, mut messages, _) = session::spawn::<_, ToMaster, ToWorker>(stream);
                while let Some(Ok(message)) = messages.recv().await {
                    if let ToWorker::Ping { nonce } = message {
                        let _ = sender.send(ToMaster::Pong { nonce, progressed: false }).await;
                    }
                }
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    };
    tokio::select! {
        () = joining => {}
        _ = ended.wait_for(|ended| *ended) => {}
    }
}

/// Opens connections that send nothing, and keeps them open until `ended`.
async fn stay_silent(port: u16, mut ended: watch::Receiver<bool>) {
    let mut silent = Vec::new();
    for _ in 0..300 {
        silent.push(TcpStream::connect(("127.0.0.1", port)).await);
    }
    let _ = ended.wait_for(|ended| *ended).await;
}

#[test]
fn unknown_workers_that_take_all_descriptors_change_no_frame() {
    let expected = {
        let farm = FullFarm::start(1, 60, false);
        let _worker = farm.worker("only");
        farm.finish()
    };
    let farm = FullFarm::start(8, 60, false);
    let port = farm.port;
    let (end, ended) = watch::channel(false);
    let unknown = std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let mut tasks = tokio::task::JoinSet::new();
            for number in 0..40 {
                tasks.spawn(answer_pings_only(port, format!("idle-{number}"), ended.clone()));
            }
            tasks.spawn(stay_silent(port, ended));
            tasks.join_all().await
        });
    });
    wait_until("the unknown workers have all places", || {
        farm.master.stderr().contains("another worker needs the place")
    });
    let _worker = farm.worker("real");
    let frames = farm.finish();
    end.send(true).unwrap();
    unknown.join().unwrap();
    assert!(frames == expected, "the frames differ");
}

/// A worker that finds the farm full waits for a place, and renders when there is one.
fn a_full_farm_is_joined_later(secure: bool) {
    let farm = FullFarm::start(1, 4000, secure);
    let first = farm.worker("first");
    wait_until("the first worker delivers", || farm.frame(1).exists());
    let mut second = farm.worker("second");
    second.wait_for("its limit");
    first.signal("KILL");
    second.wait_for("connected to the master");
    assert!(!farm.frame(3999).exists(), "the run is over before its fault");
    farm.master.signal("INT");
    let outcome = farm.master.finish();
    assert!(outcome.code.is_some(), "{outcome:?}");
}

#[test]
fn a_full_farm_without_tls_is_joined_later() {
    a_full_farm_is_joined_later(false);
}

#[test]
fn a_full_farm_with_tls_is_joined_later() {
    a_full_farm_is_joined_later(true);
}
