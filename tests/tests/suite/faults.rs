//! Tests of faults: workers that are killed, hang or join in the middle of a run. No frame is lost, and no byte of a
//! picture changes.

use std::path::PathBuf;

use rayfarm_tests::{Outcome, Running, Scenes, free_port, master, wait_until, worker};

/// A `render` of some frames by external workers.
struct Run {
    scenes: Scenes,
    port: u16,
    frames: usize,
    master: Running,
}

impl Run {
    /// Starts a master that begins to render when `workers` workers are connected.
    fn start(frames: usize, workers: u32) -> Self {
        Self::start_on(free_port(), frames, workers)
    }

    fn start_on(port: u16, frames: usize, workers: u32) -> Self {
        let scenes = Scenes::new();
        let mut command = master();
        command.arg("render").arg(scenes.path("small.toml")).arg("-o").arg(scenes.path("frame-%05d.ppm"));
        command.args(["--frames", &frames.to_string(), "--spin", "3", "--size", "320x240"]);
        command.args(["--no-local-workers", "--listen", &format!("127.0.0.1:{port}")]);
        command.args(["--wait-for-workers", &workers.to_string()]);
        Self { scenes, port, frames, master: Running::start(&mut command) }
    }

    fn worker(&self, name: &str) -> Running {
        start_worker(self.port, name)
    }

    fn path(&self, frame: usize) -> PathBuf {
        self.scenes.path(&format!("frame-{frame:05}.ppm"))
    }

    fn wait_for_frame(&self, frame: usize) {
        wait_until("a frame is written", || self.path(frame).exists());
    }

    fn is_over(&self) -> bool {
        self.path(self.frames - 1).exists()
    }

    /// Waits for the end and returns all frames.
    fn finish(self) -> Vec<Vec<u8>> {
        let paths: Vec<_> = (0..self.frames).map(|frame| self.path(frame)).collect();
        self.master.finish().expect_success();
        paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
    }
}

fn start_worker(port: u16, name: &str) -> Running {
    let mut command = worker();
    command.args(["--master", &format!("127.0.0.1:{port}"), "--threads", "1", "--name", name]);
    Running::start(&mut command)
}

/// Renders the expected frames, with one worker and no fault.
fn undisturbed(frames: usize) -> Vec<Vec<u8>> {
    let run = Run::start(frames, 1);
    let _worker = run.worker("only");
    run.finish()
}

/// Runs with a fault and compares every frame with a run without one. A fault after the last frame tests nothing, and the
/// speed of the machine is unknown: where `disturbed` returns `None` because the run was over first, it is called again
/// with more frames.
fn expect_same_frames(disturbed: impl Fn(usize) -> Option<Vec<Vec<u8>>>) {
    let tries = [100, 400, 1600, 6400].into_iter();
    let (frames, pictures) = tries
        .filter_map(|frames| Some((frames, disturbed(frames)?)))
        .next()
        .expect("every run was over before its fault");
    assert!(pictures == undisturbed(frames));
}

#[test]
fn a_killed_worker_changes_no_frame() {
    expect_same_frames(|frames| {
        let run = Run::start(frames, 2);
        let (victim, _other) = (run.worker("victim"), run.worker("other"));
        run.wait_for_frame(2);
        victim.signal("KILL");
        (!run.is_over()).then(|| run.finish())
    });
}

#[test]
fn a_hung_worker_changes_no_frame() {
    expect_same_frames(|frames| {
        let run = Run::start(frames, 2);
        let (victim, _other) = (run.worker("victim"), run.worker("other"));
        run.wait_for_frame(2);
        victim.signal("STOP");
        let pictures = (!run.is_over()).then(|| run.finish());
        victim.signal("CONT");
        pictures
    });
}

#[test]
fn a_run_continues_with_a_worker_that_joins_after_the_last_one_was_killed() {
    expect_same_frames(|frames| {
        let run = Run::start(frames, 1);
        let first = run.worker("first");
        run.wait_for_frame(3);
        first.signal("KILL");
        let is_running = !run.is_over();
        drop(first);
        let _second = run.worker("second");
        is_running.then(|| run.finish())
    });
}

#[test]
fn a_worker_waits_for_a_later_master_and_ends_with_it() {
    let port = free_port();
    let mut command = worker();
    let address = format!("127.0.0.1:{port}");
    command.args(["--master", &address, "--threads", "1", "--once"]);
    let mut early = Running::start(&mut command);
    // The message about the first attempt, which has failed.
    early.wait_for(&address);
    assert_eq!(Run::start_on(port, 3, 1).finish().len(), 3);
    early.finish().expect_success();
}

#[test]
fn a_worker_serves_one_master_after_another_until_it_is_interrupted() {
    let port = free_port();
    let mut worker = start_worker(port, "persistent");
    // The message about the first attempt, which has failed.
    worker.wait_for(&format!("127.0.0.1:{port}"));
    let first = Run::start_on(port, 3, 1).finish();
    // A killed master sends no disconnect. The worker reconnects all the same.
    let killed = Run::start_on(port, 10_000, 1);
    killed.wait_for_frame(1);
    killed.master.signal("KILL");
    drop(killed);
    assert!(Run::start_on(port, 3, 1).finish() == first);
    worker.signal("INT");
    let outcome = worker.finish().expect_success();
    assert!(outcome.stderr.lines().count() <= 10, "{outcome:?}");
}

#[test]
fn local_workers_end_with_their_master() {
    for name in ["KILL", "INT", "TERM"] {
        let scenes = Scenes::new();
        let mut command = master();
        command.arg("render").arg(scenes.path("small.toml")).arg("-o").arg(scenes.path("f-%05d.ppm"));
        command.args(["--frames", "10000", "--local-workers", "2", "--listen", "127.0.0.1:0"]);
        let master = Running::start(&mut command);
        wait_for_frame_of(&scenes, "f-00001.ppm");
        let workers = master.children();
        assert_eq!(workers.len(), 2, "before {name}");
        master.signal(name);
        let outcome = master.finish();
        assert_ne!(outcome.code, Some(0), "{name}: the run is not complete");
        let alive = |id: &u32| std::path::Path::new(&format!("/proc/{id}/cmdline")).exists();
        wait_until("the local workers have ended", || !workers.iter().any(alive));
        assert!(!scenes.names().iter().any(|name| name.contains("tmp")), "{:?}", scenes.names());
    }
}

fn wait_for_frame_of(scenes: &Scenes, name: &str) {
    wait_until("a frame is written", || scenes.path(name).exists());
}

#[test]
fn an_interrupted_run_reports_its_progress() {
    let scenes = Scenes::new();
    let mut command = master();
    command.arg("render").arg(scenes.path("small.toml")).arg("-o").arg(scenes.path("f-%05d.png"));
    command.args(["--frames", "10000", "--listen", "127.0.0.1:0"]);
    let master = Running::start(&mut command);
    wait_for_frame_of(&scenes, "f-00001.png");
    master.signal("INT");
    let Outcome { stderr, .. } = master.finish();
    assert!(stderr.contains("of 10000"), "{stderr}");
    for name in scenes.names().iter().filter(|name| name.ends_with(".png")) {
        rayfarm_tracer::image::load(&scenes.path(name)).unwrap();
    }
}
