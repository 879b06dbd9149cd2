//! Tests of commands to a running master: on standard input, over a connection, by key.

use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::time::Duration;

use rayfarm_tests::{Running, Scenes, Screen, free_port, master, wait_until, worker};
use serde_json::Value;

/// Returns a `render` command of a million frames, which a test ends itself.
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

/// A control connection: commands and replies.
struct ControlClient {
    stream: BufReader<TcpStream>,
}

impl ControlClient {
    /// Connects with the token of a run whose `XDG_RUNTIME_DIR` is the folder of these scenes.
    fn connect(port: u16, scenes: &Scenes) -> Self {
        let token = scenes.path(&format!("rayfarm/control-127.0.0.1-{port}"));
        wait_until("the control port is open", || token.exists());
        let stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        let mut client = Self { stream: BufReader::new(stream) };
        let token = std::fs::read_to_string(token).unwrap();
        assert_eq!(client.command(token.trim())["ok"], true);
        client
    }

    /// Sends a command and returns its reply.
    fn command(&mut self, command: &str) -> Value {
        self.stream.get_mut().write_all(format!("{command}\n").as_bytes()).unwrap();
        let mut line = String::new();
        self.stream.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap()
    }

    /// Returns the workers as `NAME STATE`.
    fn states(&mut self) -> Vec<String> {
        let workers = self.command("workers")["workers"].as_array().unwrap().clone();
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
fn commands_on_standard_input_have_replies_on_standard_output() {
    let scenes = Scenes::new();
    let mut run =
        Running::start_with_stdin(&mut endless(&scenes, &["--listen", "127.0.0.1:0", "--control", "-"]));
    let mut commands = 0;
    let mut send = |run: &mut Running, command: &str| -> Value {
        run.write_line(command);
        commands += 1;
        wait_until("a command has a reply", || run.stdout().matches('\n').count() >= commands);
        serde_json::from_str(run.stdout().lines().last().unwrap()).unwrap()
    };
    wait_until("the local worker is connected", || {
        send(&mut run, "workers")["workers"][0]["state"] == "working"
    });
    assert_eq!(send(&mut run, "help")["ok"], true);
    let wrong = send(&mut run, "fly");
    assert!(wrong["ok"] == false && wrong["error"].as_str().unwrap().contains("fly"), "{wrong}");
    assert_eq!(send(&mut run, "pause")["ok"], true);
    assert_eq!(send(&mut run, "workers")["workers"][0]["state"], "paused");
    assert_eq!(send(&mut run, "resume")["ok"], true);
    assert_eq!(send(&mut run, "quit")["ok"], true);
    run.finish().expect_failure(1, &["1000000"]);
}

#[test]
fn workers_are_paused_drained_and_kicked_over_a_connection() {
    let scenes = Scenes::new();
    let (port, control) = (free_port(), free_port());
    let (listen, place) = (format!("127.0.0.1:{port}"), format!("127.0.0.1:{control}"));
    let mut command = endless(&scenes, &["--no-local-workers", "--listen", &listen, "--control", &place]);
    let run = Running::start(&mut command);
    let mut client = ControlClient::connect(control, &scenes);
    let [_mill, barn, shed] = ["mill", "barn", "shed"].map(|name| worker_called(name, port));
    client.wait_for(&["barn working", "mill working", "shed working"]);
    let mut status = Value::Null;
    wait_until("some frames are done and the frame rate is known", || {
        status = client.command("status");
        status["frames_done"].as_u64().unwrap() > 3 && status["seconds_left"].is_number()
    });
    let number = |name: &str| status[name].as_f64().unwrap();
    assert_eq!((number("frames"), number("workers"), number("threads")), (1e6, 3.0, 3.0));
    assert!(number("fps") > 0.0 && number("elapsed_seconds") > 0.0, "{status}");
    let left = (number("frames") - number("frames_done")) / number("fps");
    assert!((number("seconds_left") / left - 1.0).abs() < 0.01, "{status}");
    assert!(number("received_bytes") >= number("frames_done") * 32.0 * 24.0 * 3.0, "{status}");
    assert!(number("sent_bytes") > number("scene_bytes") && number("scene_bytes") > 0.0, "{status}");

    assert_eq!(client.command("pause mill")["ok"], true);
    client.wait_for(&["barn working", "mill paused", "shed working"]);
    assert_eq!(client.command("drain barn")["ok"], true);
    barn.finish().expect_success();
    assert_eq!(client.command("kick shed")["ok"], true);
    shed.finish().expect_success();
    client.wait_for(&["mill paused"]);
    assert_eq!(client.command("status")["kicked"], serde_json::json!(["shed"]));

    assert_eq!(client.command("resume")["ok"], true);
    client.wait_for(&["mill working"]);
    // Between two frames the status has no frame.
    let mut frame = || client.command("status")["frame"].as_u64();
    let mut then = None;
    wait_until("the remaining worker renders", || {
        then = frame();
        then.is_some()
    });
    wait_until("the remaining worker renders more frames", || {
        frame().is_some_and(|now| now > then.unwrap() + 3)
    });
    assert_eq!(client.command("quit")["ok"], true);
    let outcome = run.finish().expect_failure(1, &["1000000", "--resume"]);
    let drained: Vec<_> = outcome.stderr.lines().filter(|line| line.contains("barn")).collect();
    assert!(drained.len() >= 2, "the log has the beginning and the end of a session: {outcome:?}");
    assert!(
        !drained.iter().any(|line| line.contains("WARN")),
        "a requested drain logs no warning: {drained:?}"
    );
    let is_time = |line: &&str| matches!(line.split_once("Z "), Some((time, _)) if time.len() == 8 && time.split(':').count() == 3);
    assert!(outcome.stderr.lines().filter(is_time).count() > 3, "{outcome:?}");
}

#[test]
fn control_ports_are_on_this_machine_only() {
    let scenes = Scenes::new();
    let run = Running::start(&mut endless(&scenes, &["--control", "0.0.0.0:7118"]));
    run.finish().expect_failure(2, &["127.0.0.1:7118"]);
}

#[test]
fn keys_pause_all_workers_or_the_selected_one() {
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
    let window = Running::start(screen.attach(&mut command));
    let mut client = ControlClient::connect(control, &scenes);
    let mut paused = || {
        let states = client.states();
        (states.len() == 2).then(|| states.iter().filter(|state| state.ends_with("paused")).count())
    };
    wait_until("two workers render", || paused() == Some(0));
    let mut id = String::new();
    wait_until("the window exists", || {
        let found = screen.xdotool(&["search", "--onlyvisible", "--name", "rayfarm"]).unwrap_or_default();
        id = found.lines().next().unwrap_or_default().to_owned();
        !id.is_empty()
    });
    screen.xdotool(&["mousemove", "--window", &id, "30", "30"]).unwrap();
    let press = |keys: &[&str]| screen.xdotool(&[&["key"], keys].concat()).unwrap();
    // A busy window misses a key that is released before it polls, so keys are pressed until they have an effect.
    let mut press_until = |keys: &[&str], count: usize| {
        wait_until(&format!("{count} workers are paused"), || {
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
    wait_until("the window is closed", || {
        screen.xdotool(&["key", "Escape"]);
        screen.xdotool(&["search", "--onlyvisible", "--name", "rayfarm"]).is_none_or(|found| found.is_empty())
    });
    window.finish().expect_success();
}

#[test]
fn a_key_allows_a_kicked_worker_again() {
    let Some(screen) = Screen::start() else { return };
    let scenes = Scenes::new();
    let control = free_port();
    let mut command = master();
    command.args("view small.toml --size 640x480 --listen 127.0.0.1:0".split(' '));
    command.args(["--control", &format!("127.0.0.1:{control}")]).current_dir(scenes.path(""));
    command.env("XDG_RUNTIME_DIR", scenes.path(""));
    let window = Running::start(screen.attach(&mut command));
    let mut client = ControlClient::connect(control, &scenes);
    wait_until("the worker is connected", || client.states().len() == 1);
    let mut id = String::new();
    wait_until("the window exists", || {
        let found = screen.xdotool(&["search", "--onlyvisible", "--name", "rayfarm"]).unwrap_or_default();
        id = found.lines().next().unwrap_or_default().to_owned();
        !id.is_empty()
    });
    screen.xdotool(&["mousemove", "--window", &id, "30", "30"]).unwrap();
    // Pressed until they have an effect: a new window may not have the keyboard focus yet.
    wait_until("the worker is kicked", || {
        screen.xdotool(&["key", "Tab", "k"]).unwrap();
        (0..20).any(|_| {
            std::thread::sleep(Duration::from_millis(100));
            client.states().is_empty()
        })
    });
    std::thread::sleep(Duration::from_secs(2));
    assert!(client.states().is_empty(), "a kicked worker does not return");
    wait_until("the worker is connected again", || {
        screen.xdotool(&["key", "b"]).unwrap();
        (0..20).any(|_| {
            std::thread::sleep(Duration::from_millis(100));
            client.states().len() == 1
        })
    });
    screen.xdotool(&["key", "Escape"]).unwrap();
    window.finish().expect_success();
}
