//! Commands to a run under way: on standard input, at a port, by key.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::time::Duration;

use rayfarm_tests::{Running, Scenes, Screen, free_port, master, wait_until, worker};
use serde_json::Value;

/// A `render` that no test waits for to end by itself.
fn endless(scenes: &Scenes, more: &[&str]) -> std::process::Command {
    let mut command = master();
    command.arg("render").arg(scenes.path("small.toml")).arg("-o").arg(scenes.path("f-%07d.ppm"));
    command.args(["--frames", "1000000", "--size", "32x24"]).args(more);
    command.env("XDG_RUNTIME_DIR", scenes.path(""));
    command
}

fn worker_called(name: &str, port: u16) -> Running {
    let address = format!("127.0.0.1:{port}");
    Running::start(worker().args(["--master", &address, "--threads", "1", "--name", name]))
}

/// Commands and answers over a connection.
struct Line {
    stream: BufReader<TcpStream>,
}

impl Line {
    /// Shows the token of a run whose `XDG_RUNTIME_DIR` is the folder of these scenes.
    fn to(port: u16, scenes: &Scenes) -> Self {
        let token = scenes.path(&format!("rayfarm/control-127.0.0.1-{port}"));
        wait_until("commands are taken", || token.exists());
        let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        let mut line = Self { stream: BufReader::new(stream) };
        let token = std::fs::read_to_string(token).unwrap();
        assert_eq!(line.ask(token.trim())["ok"], true);
        line
    }

    fn ask(&mut self, command: &str) -> Value {
        self.stream.get_mut().write_all(format!("{command}\n").as_bytes()).unwrap();
        let mut line = String::new();
        self.stream.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap()
    }

    fn states(&mut self) -> Vec<String> {
        let workers = self.ask("workers")["workers"].as_array().unwrap().clone();
        workers
            .iter()
            .map(|worker| {
                format!("{} {}", worker["name"].as_str().unwrap(), worker["state"].as_str().unwrap())
            })
            .collect()
    }

    fn wait_for(&mut self, states: &[&str]) {
        wait_until(&format!("the workers are {states:?}"), || {
            let mut now = self.states();
            now.sort();
            now == states
        });
    }
}

#[test]
fn commands_on_standard_input_are_answered_on_standard_output() {
    let scenes = Scenes::new();
    let mut run =
        Running::start_listening(&mut endless(&scenes, &["--listen", "127.0.0.1:0", "--control", "-"]));
    let mut asked = 0;
    let mut ask = |run: &mut Running, command: &str| -> Value {
        run.say(command);
        asked += 1;
        wait_until("a command is answered", || run.stdout().matches('\n').count() >= asked);
        serde_json::from_str(run.stdout().lines().last().unwrap()).unwrap()
    };
    wait_until("the local worker is there", || ask(&mut run, "workers")["workers"][0]["state"] == "working");
    assert_eq!(ask(&mut run, "help")["ok"], true);
    let wrong = ask(&mut run, "fly");
    assert!(wrong["ok"] == false && wrong["error"].as_str().unwrap().contains("\"fly\""), "{wrong}");
    assert_eq!(ask(&mut run, "pause")["ok"], true);
    assert_eq!(ask(&mut run, "workers")["workers"][0]["state"], "paused");
    assert_eq!(ask(&mut run, "resume")["ok"], true);
    assert_eq!(ask(&mut run, "quit")["ok"], true);
    run.finish().expect_failure(1, &["of 1000000 frames are written"]);
}

#[test]
fn workers_are_paused_sent_home_and_kept_out_over_a_port() {
    let scenes = Scenes::new();
    let (port, control) = (free_port(), free_port());
    let (listen, place) = (format!("127.0.0.1:{port}"), format!("127.0.0.1:{control}"));
    let mut command = endless(&scenes, &["--no-local-workers", "--listen", &listen, "--control", &place]);
    let run = Running::start(&mut command);
    let mut line = Line::to(control, &scenes);
    let [_mill, barn, shed] = ["mill", "barn", "shed"].map(|name| worker_called(name, port));
    line.wait_for(&["barn working", "mill working", "shed working"]);
    let mut status = Value::Null;
    wait_until("some frames are done and the pace is known", || {
        status = line.ask("status");
        status["frames_done"].as_u64().unwrap() > 3 && status["seconds_left"].is_number()
    });
    let number = |name: &str| status[name].as_f64().unwrap();
    assert_eq!((number("frames"), number("workers"), number("threads")), (1e6, 3.0, 3.0));
    assert!(number("fps") > 0.0 && number("elapsed_seconds") > 0.0, "{status}");
    let left = (number("frames") - number("frames_done")) / number("fps");
    assert!((number("seconds_left") / left - 1.0).abs() < 0.01, "{status}");
    assert!(number("received_bytes") >= number("frames_done") * 32.0 * 24.0 * 3.0, "{status}");
    assert!(number("sent_bytes") > number("scene_bytes") && number("scene_bytes") > 0.0, "{status}");

    assert_eq!(line.ask("pause mill")["ok"], true);
    line.wait_for(&["barn working", "mill paused", "shed working"]);
    assert_eq!(line.ask("drain barn")["ok"], true);
    barn.finish().expect_success();
    assert_eq!(line.ask("kick shed")["ok"], true);
    let kicked = shed.finish();
    assert!(kicked.stderr.contains("kicked"), "{kicked:?}");
    line.wait_for(&["mill paused"]);
    assert_eq!(line.ask("status")["kicked"], serde_json::json!(["shed"]));

    assert_eq!(line.ask("resume")["ok"], true);
    line.wait_for(&["mill working"]);
    // Between two frames there is none.
    let mut frame = || line.ask("status")["frame"].as_u64();
    let mut then = None;
    wait_until("the one that is left is at work", || {
        then = frame();
        then.is_some()
    });
    wait_until("the one that is left goes on", || frame().is_some_and(|now| now > then.unwrap() + 3));
    assert_eq!(line.ask("quit")["ok"], true);
    let outcome = run.finish().expect_failure(1, &["frames are written", "--resume"]);
    let drained: Vec<_> = outcome.stderr.lines().filter(|line| line.contains("barn")).collect();
    assert!(drained.iter().any(|line| line.contains("leaves")), "{outcome:?}");
    assert!(!drained.iter().any(|line| line.contains("WARN")), "a wanted drain is no warning: {drained:?}");
    let is_time = |line: &&str| matches!(line.split_once("Z "), Some((time, _)) if time.len() == 8 && time.split(':').count() == 3);
    assert!(outcome.stderr.lines().filter(is_time).count() > 3, "{outcome:?}");
}

#[test]
fn commands_are_taken_from_this_machine_only() {
    let scenes = Scenes::new();
    let run = Running::start(&mut endless(&scenes, &["--control", "0.0.0.0:7118"]));
    run.finish().expect_failure(2, &["other machines", "127.0.0.1:7118"]);
}

#[test]
fn keys_pause_all_workers_and_the_one_selected() {
    let Some(screen) = Screen::start() else { return };
    let scenes = Scenes::new();
    let control = free_port();
    let mut command = master();
    command.args([
        "view",
        "small.toml",
        "--size",
        "640x480",
        "--listen",
        "127.0.0.1:0",
        "--local-workers",
        "2",
    ]);
    command.args(["--control", &format!("127.0.0.1:{control}")]).current_dir(scenes.path(""));
    command.env("XDG_RUNTIME_DIR", scenes.path(""));
    let window = Running::start(screen.show(&mut command));
    let mut line = Line::to(control, &scenes);
    let mut paused = || {
        let states = line.states();
        (states.len() == 2).then(|| states.iter().filter(|state| state.ends_with("paused")).count())
    };
    wait_until("two workers are at work", || paused() == Some(0));
    let mut id = String::new();
    wait_until("the window is there", || {
        let found = screen.xdotool(&["search", "--onlyvisible", "--name", "rayfarm"]).unwrap_or_default();
        id = found.lines().next().unwrap_or_default().to_owned();
        !id.is_empty()
    });
    screen.xdotool(&["mousemove", "--window", &id, "30", "30"]).unwrap();
    let press = |keys: &[&str]| screen.xdotool(&[&["key"], keys].concat()).unwrap();
    // A key that is up again before a busy window has looked is lost: these are pressed until they show.
    let mut press_until = |keys: &[&str], count: usize| {
        wait_until(&format!("{count} workers pause"), || {
            press(keys);
            (0..30).any(|_| {
                std::thread::sleep(Duration::from_millis(100));
                paused() == Some(count)
            })
        });
    };
    press_until(&["p"], 2);
    press_until(&["p"], 0);
    press_until(&["Tab", "p"], 1);
    press(&["f", "c", "c"]);
    wait_until("the window has gone", || {
        screen.xdotool(&["key", "Escape"]);
        screen.xdotool(&["search", "--onlyvisible", "--name", "rayfarm"]).is_none_or(|found| found.is_empty())
    });
    window.finish().expect_success();
}

#[test]
fn a_key_brings_the_only_worker_back_that_was_kicked() {
    let Some(screen) = Screen::start() else { return };
    let scenes = Scenes::new();
    let control = free_port();
    let mut command = master();
    command.args("view small.toml --size 640x480 --listen 127.0.0.1:0".split(' '));
    command.args(["--control", &format!("127.0.0.1:{control}")]).current_dir(scenes.path(""));
    command.env("XDG_RUNTIME_DIR", scenes.path(""));
    let window = Running::start(screen.show(&mut command));
    let mut line = Line::to(control, &scenes);
    wait_until("the worker is there", || line.states().len() == 1);
    let mut id = String::new();
    wait_until("the window is there", || {
        let found = screen.xdotool(&["search", "--onlyvisible", "--name", "rayfarm"]).unwrap_or_default();
        id = found.lines().next().unwrap_or_default().to_owned();
        !id.is_empty()
    });
    screen.xdotool(&["mousemove", "--window", &id, "30", "30"]).unwrap();
    // Pressed again until it is heard: a window that has just appeared may not have the keyboard yet.
    wait_until("the worker is sent away", || {
        screen.xdotool(&["key", "Tab", "k"]).unwrap();
        (0..20).any(|_| {
            std::thread::sleep(Duration::from_millis(100));
            line.states().is_empty()
        })
    });
    std::thread::sleep(Duration::from_secs(2));
    assert!(line.states().is_empty(), "it is kept out");
    wait_until("the worker is back", || {
        screen.xdotool(&["key", "b"]).unwrap();
        (0..20).any(|_| {
            std::thread::sleep(Duration::from_millis(100));
            line.states().len() == 1
        })
    });
    screen.xdotool(&["key", "Escape"]).unwrap();
    window.finish().expect_success();
}
