//! Tests of trust between master and workers: join lines, tokens that are refused, and secrets that stay secret.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use rayfarm_tests::{Running, Scenes, free_port, master, wait_until, worker};

/// A master with TLS on this machine, and its folders.
struct Farm {
    scenes: Scenes,
    port: u16,
    master: Running,
}

impl Farm {
    /// Starts to render 40 frames by external workers, once `workers` of them are connected.
    fn start(workers: u32) -> Self {
        let (scenes, port) = (Scenes::new(), free_port());
        let mut command = render(&scenes, "frame-%02d.ppm");
        command.args(["--secure", "--listen", &format!("127.0.0.1:{port}"), "--state"]);
        command.arg(scenes.path("state")).args([
            "--no-local-workers",
            "--wait-for-workers",
            &workers.to_string(),
        ]);
        let master = Running::start(&mut command);
        wait_until("the master has a key", || scenes.path("state").join("token").exists());
        Self { scenes, port, master }
    }

    /// What an action of `trust` prints.
    fn trust(&self, action: &[&str]) -> String {
        let mut command = master();
        command.arg("trust").args(action).args(["--listen", &format!("127.0.0.1:{}", self.port), "--state"]);
        Running::start(command.arg(self.scenes.path("state"))).finish().expect_success().stdout
    }

    /// The line that a user pastes, without the program's name.
    fn join_line(&self) -> String {
        let shown = self.trust(&["show"]);
        shown.trim().strip_prefix("rayfarm-worker --join ").unwrap().to_owned()
    }

    /// Starts a worker that reads its join line from standard input.
    fn worker(&self, name: &str, line: &str, more: &[&str]) -> Running {
        let mut command = worker();
        command.args(["--join", "-", "--no-remember", "--threads", "1", "--name", name]).args(more);
        command.env("XDG_STATE_HOME", self.scenes.path(name)).env("XDG_CONFIG_HOME", self.scenes.path(name));
        let mut worker = Running::start_with_stdin(&mut command);
        worker.write_line(line);
        worker
    }

    fn frame(&self, frame: usize) -> PathBuf {
        self.scenes.path(&format!("frame-{frame:02}.ppm"))
    }
}

fn render(scenes: &Scenes, output: &str) -> Command {
    let mut command = master();
    command.arg("render").arg(scenes.path("small.toml")).arg("-o").arg(scenes.path(output));
    command.args(["--frames", "40", "--spin", "3", "--size", "320x240"]);
    command
}

/// Frames that one local worker renders without TLS.
fn plain_frames() -> Vec<Vec<u8>> {
    let scenes = Scenes::new();
    let mut command = render(&scenes, "frame-%02d.ppm");
    Running::start(command.args(["--listen", "127.0.0.1:0"])).finish().expect_success();
    (0..40).map(|frame| fs::read(scenes.path(&format!("frame-{frame:02}.ppm"))).unwrap()).collect()
}

/// Whether the command line of any process on this machine contains a text.
#[cfg(target_os = "linux")]
fn is_in_the_process_list(text: &str) -> bool {
    let processes = fs::read_dir("/proc").unwrap().flatten();
    let lines = processes.filter_map(|process| fs::read(process.path().join("cmdline")).ok());
    lines.into_iter().any(|line| String::from_utf8_lossy(&line).contains(text))
}

#[test]
fn workers_that_join_by_the_line_render_the_same_bytes_and_the_token_stays_secret() {
    let farm = Farm::start(2);
    let line = farm.join_line();
    let token = line.rsplit(':').next().unwrap().to_owned();
    assert_eq!(token.len(), 32);
    let workers = [farm.worker("one", &line, &[]), farm.worker("two", &line, &[])];
    wait_until("a frame is written", || farm.frame(3).exists());
    #[cfg(target_os = "linux")]
    assert!(!is_in_the_process_list(&token));
    let frames: Vec<PathBuf> = (0..40).map(|frame| farm.frame(frame)).collect();
    let outcome = farm.master.finish().expect_success();
    assert!(!outcome.stderr.contains(&token), "{}", outcome.stderr);
    for worker in &workers {
        assert!(!worker.stderr().contains(&token), "{}", worker.stderr());
    }
    let found: Vec<Vec<u8>> = frames.iter().map(|path| fs::read(path).unwrap()).collect();
    assert!(found == plain_frames(), "TLS changes pixels");
}

#[test]
fn local_workers_of_a_secure_farm_need_no_help() {
    let scenes = Scenes::new();
    let mut command = render(&scenes, "frame-%02d.ppm");
    command.args(["--secure", "--listen", "127.0.0.1:0", "--local-workers", "2", "--state"]);
    Running::start(command.arg(scenes.path("state"))).finish().expect_success();
    let last = fs::read(scenes.path("frame-39.ppm")).unwrap();
    assert!(Some(&last) == plain_frames().last());
}

#[test]
fn workers_without_the_line_are_refused() {
    let farm = Farm::start(1);
    let line = farm.join_line();
    let (rest, token) = line.rsplit_once(':').unwrap();
    let other_digit = if token.starts_with('0') { "1" } else { "0" };
    let wrong_token = format!("{rest}:{other_digit}{}", &token[1..]);
    farm.worker("guess", &wrong_token, &["--no-reconnect"]).finish().expect_failure(1, &["token"]);
    let (address, key) = rest.rsplit_once(':').unwrap();
    let other_digit = if key.starts_with('0') { "1" } else { "0" };
    let wrong_key = format!("{address}:{other_digit}{}:{token}", &key[1..]);
    farm.worker("deceived", &wrong_key, &["--no-reconnect"]).finish().expect_failure(1, &["key"]);
    let mut plain = worker();
    plain.args(["--master", &format!("127.0.0.1:{}", farm.port), "--no-reconnect"]);
    Running::start(&mut plain).finish().expect_failure(1, &["--join"]);
    assert!(!farm.frame(0).exists(), "no refused worker has rendered");
    let _joined = farm.worker("joined", &line, &[]);
    farm.master.finish().expect_success();
}

#[test]
fn a_rotation_refuses_the_old_line_and_keeps_connected_workers() {
    let farm = Farm::start(2);
    let old = farm.join_line();
    let _connected = farm.worker("connected", &old, &[]);
    wait_until("the worker has joined", || farm.master.stderr().contains("connected"));
    let new = farm.trust(&["rotate"]);
    let new = new.trim().strip_prefix("rayfarm-worker --join ").unwrap();
    assert_ne!(new, old);
    wait_until("the master follows", || farm.master.stderr().contains("the token is new"));
    farm.worker("late", &old, &["--no-reconnect"]).finish().expect_failure(1, &["token"]);
    // The first worker is still connected: the run needs both.
    let _second = farm.worker("second", new, &[]);
    farm.master.finish().expect_success();
}

#[test]
fn a_revoked_worker_is_disconnected_and_refused_until_it_is_allowed() {
    let mut farm = Farm::start(3);
    let line = farm.join_line();
    let state = farm.scenes.path("state");
    let run = |action: &[&str]| {
        let mut command = master();
        Running::start(command.arg("trust").args(action).arg("--state").arg(&state)).finish()
    };
    let revoked = farm.worker("mill", &line, &[]);
    let _other = farm.worker("barn", &line, &[]);
    let listed = || run(&["workers"]).expect_success().stdout;
    wait_until("both are listed", || listed().contains("mill") && listed().contains("barn"));
    run(&["revoke", "silo"]).expect_failure(2, &["trust workers"]);
    let answer = run(&["revoke", "mill"]).expect_success();
    assert!(answer.stderr.contains("trust rotate"), "{answer:?}");
    // It ends, since the refusal is authenticated.
    let ended = revoked.finish();
    assert!(ended.stderr.contains("revoked"), "{ended:?}");
    farm.worker("mill", &line, &[]).finish().expect_failure(1, &["revoked"]);
    let key = answer.stdout.split_whitespace().next().unwrap().to_owned();
    assert!(listed().contains(&format!("{key}  revoked")), "{}", listed());
    run(&["allow", &key[..8]]).expect_success();
    run(&["allow", &key]).expect_failure(2, &["not revoked"]);
    farm.master.wait_for("revoked keys: 0");
    let _again = farm.worker("mill", &line, &[]);
    let _third = farm.worker("silo", &line, &[]);
    farm.master.finish().expect_success();
}

#[test]
fn an_open_farm_says_so_and_a_closed_one_prints_no_secret() {
    let scenes = Scenes::new();
    let run = |more: &[&str]| {
        let mut command = render(&scenes, "out-%02d.ppm");
        command.args(["--frames", "1", "--listen", "0.0.0.0:0"]).args(more);
        Running::start(command.arg("--state").arg(scenes.path("state"))).finish().expect_success().stderr
    };
    let open = run(&["--insecure"]);
    assert!(open.contains("--insecure"), "{open}");
    let closed = run(&[]);
    let token = fs::read_to_string(scenes.path("state").join("token")).unwrap();
    assert!(!closed.contains(token.trim()) && closed.contains("trust show"), "{closed}");
}
