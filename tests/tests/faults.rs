//! A frame is never lost: workers die, hang and come in the middle of a run, and every picture is the right one.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::process::Command;
use std::sync::OnceLock;

use rayfarm_tests::{Outcome, Running, Scenes, free_port, master, wait_until, worker};

const FRAMES: usize = 100;

/// A `render` of some frames that waits for workers on a port.
fn start_master(scenes: &Scenes, port: u16, prefix: &str) -> Running {
    let mut command = master();
    command.arg("render").arg(scenes.path("small.toml"));
    command.arg("-o").arg(scenes.path(&format!("{prefix}-%03d.ppm")));
    command.args(["--frames", &FRAMES.to_string(), "--orbit", "360", "--size", "320x240"]);
    command.args(["--no-local-workers", "--listen", &format!("127.0.0.1:{port}")]);
    Running::start(&mut command)
}

fn start_worker(port: u16, name: &str) -> Running {
    Running::start(&mut worker_command(port, name))
}

fn worker_command(port: u16, name: &str) -> Command {
    let mut command = worker();
    command.args(["--master", &format!("127.0.0.1:{port}"), "--threads", "1", "--name", name]);
    command
}

/// What the frames must be: rendered by one worker that nothing happens to.
fn undisturbed() -> &'static [Vec<u8>] {
    static CALM: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    CALM.get_or_init(|| {
        let scenes = Scenes::new();
        let port = free_port();
        let master = start_master(&scenes, port, "calm");
        let _worker = start_worker(port, "calm");
        master.finish().expect_success();
        frames(&scenes, "calm")
    })
}

fn frames(scenes: &Scenes, prefix: &str) -> Vec<Vec<u8>> {
    (0..FRAMES).map(|i| scenes.read(&format!("{prefix}-{i:03}.ppm"))).collect()
}

fn wait_for_frame(scenes: &Scenes, prefix: &str, frame: usize) {
    let path = scenes.path(&format!("{prefix}-{frame:03}.ppm"));
    wait_until("a frame is written", || path.exists());
}

/// What happens to a worker after the last frame proves nothing.
fn expect_under_way(scenes: &Scenes, prefix: &str) {
    let last = scenes.path(&format!("{prefix}-{:03}.ppm", FRAMES - 1));
    assert!(!last.exists(), "the run was over before anything happened to its worker: render more");
}

#[test]
fn a_killed_worker_costs_no_frame_and_no_byte() {
    let scenes = Scenes::new();
    let expected = undisturbed();
    let port = free_port();
    let mut master = start_master(&scenes, port, "kill");
    let (victim, _other) = (start_worker(port, "victim"), start_worker(port, "other"));
    master.wait_for("joins: victim");
    master.wait_for("joins: other");
    wait_for_frame(&scenes, "kill", 2);
    victim.signal("KILL");
    expect_under_way(&scenes, "kill");
    master.finish().expect_success();
    assert!(frames(&scenes, "kill") == expected);
}

#[test]
fn a_hung_worker_costs_no_frame_and_no_byte() {
    let scenes = Scenes::new();
    let expected = undisturbed();
    let port = free_port();
    let mut master = start_master(&scenes, port, "hang");
    let (victim, _other) = (start_worker(port, "victim"), start_worker(port, "other"));
    master.wait_for("joins: victim");
    master.wait_for("joins: other");
    wait_for_frame(&scenes, "hang", 2);
    victim.signal("STOP");
    expect_under_way(&scenes, "hang");
    let outcome = master.finish();
    victim.signal("CONT");
    outcome.expect_success();
    assert!(frames(&scenes, "hang") == expected);
}

#[test]
fn when_the_last_worker_dies_the_next_one_goes_on() {
    let scenes = Scenes::new();
    let expected = undisturbed();
    let port = free_port();
    let master = start_master(&scenes, port, "next");
    let first = start_worker(port, "first");
    wait_for_frame(&scenes, "next", 3);
    first.signal("KILL");
    expect_under_way(&scenes, "next");
    drop(first);
    let _second = start_worker(port, "second");
    master.finish().expect_success();
    assert!(frames(&scenes, "next") == expected);
}

#[test]
fn a_worker_waits_for_a_master_that_comes_later_and_is_sent_home_at_the_end() {
    let scenes = Scenes::new();
    let port = free_port();
    let mut early = start_worker(port, "early");
    early.wait_for("again");
    let master = start_master(&scenes, port, "late");
    master.finish().expect_success();
    assert_eq!(frames(&scenes, "late").len(), FRAMES);
    early.finish().expect_success();
}

#[test]
fn local_workers_end_with_their_master_however_it_ends() {
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
        assert_ne!(outcome.code, Some(0), "{name}: the run was not finished");
        let alive = |id: &u32| std::path::Path::new(&format!("/proc/{id}/cmdline")).exists();
        wait_until("the local workers have ended", || !workers.iter().any(alive));
        assert!(!scenes.names().iter().any(|name| name.contains("tmp")), "{:?}", scenes.names());
    }
}

fn wait_for_frame_of(scenes: &Scenes, name: &str) {
    wait_until("a frame is written", || scenes.path(name).exists());
}

#[test]
fn ctrl_c_says_how_far_the_run_came() {
    let scenes = Scenes::new();
    let mut command = master();
    command.arg("render").arg(scenes.path("small.toml")).arg("-o").arg(scenes.path("f-%05d.png"));
    command.args(["--frames", "10000", "--listen", "127.0.0.1:0"]);
    let master = Running::start(&mut command);
    wait_for_frame_of(&scenes, "f-00001.png");
    master.signal("INT");
    let Outcome { stderr, .. } = master.finish();
    assert!(stderr.contains("of 10000 frames"), "{stderr}");
    for name in scenes.names().iter().filter(|name| name.ends_with(".png")) {
        rayfarm_tracer::image::load(&scenes.path(name)).unwrap();
    }
}
