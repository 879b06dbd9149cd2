//! Tests of bad input: messages with place, problem and remedy, and the specified exit status. No output is written.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::time::Duration;

use rayfarm_tests::{Outcome, Running, Scenes, free_port, master, wait_until, worker};

fn render(scene: &Path, output: &Path, more: &[&str]) -> Outcome {
    let mut command = master();
    command.arg("render").arg(scene).arg("-o").arg(output).args(["--listen", "127.0.0.1:0"]).args(more);
    Running::start(&mut command).finish()
}

/// Renders the small scene with one replacement in its file.
fn render_changed(from: &str, to: &str) -> (Scenes, Outcome) {
    let scenes = Scenes::new();
    let text = String::from_utf8(scenes.read("small.toml")).unwrap();
    assert!(text.contains(from));
    let scene = scenes.write("changed.toml", text.replacen(from, to, 1));
    let outcome = render(&scene, &scenes.path("out.png"), &[]);
    assert!(!scenes.path("out.png").exists());
    (scenes, outcome)
}

#[test]
fn a_missing_scene_is_reported() {
    let scenes = Scenes::new();
    render(&scenes.path("nowhere.toml"), &scenes.path("out.png"), &[]).expect_failure(2, &["nowhere.toml"]);
}

#[test]
fn mistakes_in_a_scene_are_reported_with_line_and_remedy() {
    for (from, to, words) in [
        ("fov = 45.0", "fow = 45.0", &["changed.toml:", "fow", "fov"][..]),
        ("material = \"clay\"", "material = \"clya\"", &["changed.toml:", "clya", "clay"]),
        ("width = 160", "width = 0", &["changed.toml:", "width"]),
        ("width = 160", "width = 99999", &["changed.toml:", "16384"]),
        ("kind = \"point\"", "kind = \"area\"", &["changed.toml:", "area"]),
        ("look_at = [0.0, 0.3, 0.0]", "look_at = [0.0, nan, 0.0]", &["changed.toml:", "look_at"]),
        ("fov = 45.0", "kind = \"fish\"", &["changed.toml:", "fisheye"]),
        ("exponent = 30.0", "reflect = 1.5", &["changed.toml:", "reflect"]),
        ("exponent = 30.0", "roughness = 1.5", &["changed.toml:", "roughness"]),
        (
            "diffuse = [0.7, 0.4, 0.3]",
            "diffuse = { texture = \"clay.png\" }",
            &["changed.toml:", "[[model]]", "texture"],
        ),
        ("bumps.obj", "hills.obj", &["hills.obj"]),
        ("[render]", "[render", &["changed.toml:"]),
    ] {
        render_changed(from, to).1.expect_failure(2, words);
    }
}

#[test]
fn mistakes_in_a_mesh_are_reported_with_their_line() {
    for (mesh, words) in [
        ("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", &["bumps.obj:2"][..]),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", &["bumps.obj:4", "9"]),
        ("# nothing\n", &["bumps.obj"]),
        ("\0\u{1}\u{2}garbage", &["bumps.obj"]),
    ] {
        let scenes = Scenes::new();
        scenes.write("bumps.obj", mesh);
        let outcome = render(&scenes.path("small.toml"), &scenes.path("out.png"), &[]);
        outcome.expect_failure(2, words);
    }
}

#[test]
fn a_wrong_command_line_is_status_2() {
    let scenes = Scenes::new();
    let scene = scenes.path("small.toml");
    for (more, words) in [
        (&["--size", "0x10"][..], &["size"][..]),
        (&["--size", "axb"], &["size"]),
        (&["--samples", "3"], &["samples"]),
        (&["--samples", "1", "--adaptive"], &["--adaptive", "--samples 4"]),
        (&["--segment", "static:0"], &["segment"]),
        (&["--segment", "fast"], &["segment"]),
        (&["--frames", "5"], &["%0"]),
        (&["--nonsense"], &["--nonsense"]),
    ] {
        render(&scene, &scenes.path("out.png"), more).expect_failure(2, words);
    }
    render(&scene, &scenes.path("out.xyz"), &[]).expect_failure(2, &["out.xyz", ".png"]);
    let nowhere = scenes.path("no/such/folder/out.png");
    let outcome = render(&scene, &nowhere, &[]);
    assert!(matches!(outcome.code, Some(1 | 2)) && outcome.stderr.contains("no/such/folder"), "{outcome:?}");
}

#[test]
fn a_port_in_use_is_reported_with_the_remedy() {
    let scenes = Scenes::new();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let outcome = render(&scenes.path("small.toml"), &scenes.path("out.png"), &["--listen", &address]);
    outcome.expect_failure(1, &[&address, "--listen"]);
}

#[test]
fn a_cut_compiled_model_is_refused() {
    let scenes = Scenes::new();
    let model = scenes.path("bumps.rfm");
    let mut compile = master();
    compile.arg("compile").arg(scenes.path("bumps.obj")).arg("-o").arg(&model);
    Running::start(&mut compile).finish().expect_success();
    let bytes = scenes.read("bumps.rfm");
    scenes.write("bumps.rfm", &bytes[..bytes.len() / 2]);
    let outcome = render(&model, &scenes.path("out.png"), &[]);
    outcome.expect_failure(2, &["bumps.rfm"]);
}

/// Connections of other programs, of other versions and with oversized or short messages do not disturb a run.
#[test]
fn foreign_connections_do_not_disturb_a_run() {
    let scenes = Scenes::new();
    let port = free_port();
    let mut command = master();
    command.arg("render").arg(scenes.path("small.toml")).arg("-o").arg(scenes.path("f-%03d.ppm"));
    command.args(["--frames", "40", "--size", "320x240", "--local-workers", "1"]);
    command.args(["--listen", &format!("127.0.0.1:{port}")]);
    let mut master = Running::start(&mut command);
    wait_until("a frame is written", || scenes.path("f-000.ppm").exists());

    let hello = |version: u16| {
        // Magic, version, role (2: a worker), nothing.
        let mut bytes = b"RAYFARM\n".to_vec();
        bytes.extend(version.to_le_bytes());
        bytes.extend([2, 0]);
        bytes
    };
    let mut huge = hello(1);
    huge.extend(u32::MAX.to_le_bytes());
    huge.extend([1; 64]);
    for bytes in [b"GET / HTTP/1.1\r\n\r\n".to_vec(), vec![0xff; 4096], hello(999), huge, hello(1)] {
        let Ok(mut stream) = TcpStream::connect(("127.0.0.1", port)) else { continue };
        // The master may close the connection during the write, or send a reason.
        let _ = stream.write_all(&bytes);
        let _ = stream.set_read_timeout(Some(Duration::from_millis(200)));
        let _ = stream.read(&mut [0; 512]);
    }
    master.wait_for("127.0.0.1");
    let outcome = master.finish().expect_success();
    assert!(!outcome.stderr.contains("panicked"), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("999"), "{}", outcome.stderr);
}

#[test]
fn a_worker_reports_another_program_at_the_masters_address() {
    let port = free_port();
    let listener = TcpListener::bind(("127.0.0.1", port)).unwrap();
    let web_server = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let _ = stream.write_all(b"HTTP/1.1 400 Bad Request\r\nServer: something\r\n\r\n");
        let _ = stream.read(&mut [0; 512]);
    });
    let mut command = worker();
    let address = format!("127.0.0.1:{port}");
    command.args(["--master", &address, "--no-reconnect"]);
    Running::start(&mut command).finish().expect_failure(1, &[&address, "HTTP"]);
    web_server.join().unwrap();
    let mut wrong = worker();
    wrong.args(["--master", "no port here"]);
    Running::start(&mut wrong).finish().expect_failure(2, &["HOST:PORT"]);
}
