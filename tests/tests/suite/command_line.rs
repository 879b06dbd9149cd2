//! Tests of the commands' output: files, standard output, standard error.

use std::net::SocketAddr;

use rayfarm_tests::{Outcome, Running, Scenes, master};
use rayfarm_tracer::image::{RgbImage, load};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// Runs the master in the folder of scenes, without a display and without the project's models.
fn run(scenes: &Scenes, args: &str) -> Outcome {
    let mut command = master();
    command.args(args.split_whitespace()).current_dir(scenes.path(""));
    for variable in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET", "RUST_LOG"] {
        command.env_remove(variable);
    }
    command.env("RAYFARM_MODELS", scenes.path("no models here"));
    Running::start(&mut command).finish()
}

fn json(scenes: &Scenes, args: &str) -> serde_json::Value {
    let outcome = run(scenes, args).expect_success();
    assert_eq!(outcome.stdout.lines().count(), 1, "{outcome:?}");
    serde_json::from_str(&outcome.stdout).unwrap()
}

fn picture(scenes: &Scenes, name: &str) -> RgbImage {
    load(&scenes.path(name)).unwrap()
}

#[test]
fn a_wrong_command_line_writes_no_file() {
    let scenes = Scenes::new();
    let before = scenes.names();
    for (args, word) in [
        ("", "RAYFARM_MODELS"),
        ("view nowhere.toml", "nowhere.toml"),
        ("bench nowhere.toml", "nowhere.toml"),
        ("compile nowhere.obj -o model.rfm", "nowhere.obj"),
        ("compile bumps.obj -o missing/model.rfm", "missing"),
        ("render small.toml", "--output"),
        ("render small.toml -o .", ".png"),
        ("render small.toml -o a.png --fps-log missing/log.csv", "missing/log.csv"),
        ("--size 5x5 render small.toml -o a.png", "--size"),
    ] {
        let outcome = run(&scenes, args).expect_failure(2, &[word]);
        assert_eq!(outcome.stdout, "", "{args}");
    }
    assert_eq!(scenes.names(), before);
}

#[test]
fn the_json_report_describes_the_written_picture() {
    let scenes = Scenes::new();
    let report = json(&scenes, "render small.toml -o a.png --json --samples 4 --threads 1 --frames 1");
    let picture = picture(&scenes, "a.png");
    assert_eq!((picture.width, picture.height), (160, 120));
    assert_eq!(report["blake3"], blake3::hash(&picture.pixels).to_hex().as_str());
    for (field, value) in
        [("frames", 1), ("width", 160), ("height", 120), ("samples", 4), ("workers", 1), ("threads", 1)]
    {
        assert_eq!(report[field], value, "{field}");
    }
    assert_eq!(report["triangles"], 2 * 2 * 40 * 40);
    assert_eq!(report["rays_per_frame"]["primary"], 160 * 120 * 4);
    assert!(report["rays_per_frame"]["shadow"].as_u64().unwrap() > 0);
    assert!(report["bytes_per_frame"]["received"].as_u64().unwrap() >= 160 * 120 * 3);
    assert!(report["bytes_per_frame"]["sent"].as_u64() >= report["scene_bytes"].as_u64());
    let ms = |name: &str| report["ms_per_frame"][name].as_f64().unwrap();
    assert!(
        0.0 < ms("min") && ms("min") <= ms("median") && ms("median") <= ms("p95") && ms("p95") <= ms("max")
    );
}

#[test]
fn a_sequence_begins_with_the_still_picture() {
    let scenes = Scenes::new();
    run(&scenes, "render small.toml -o still.ppm").expect_success();
    run(&scenes, "render small.toml -o f%02d.ppm --frames 4 --orbit 360 --fps-log log.csv").expect_success();
    run(&scenes, "render small.toml -o s%d.ppm --frames 2 --spin 30").expect_success();
    let orbit = ["f00.ppm", "f01.ppm", "f02.ppm", "f03.ppm"].map(|name| picture(&scenes, name));
    assert!(orbit.windows(2).all(|pair| pair[0] != pair[1]));
    let still = picture(&scenes, "still.ppm");
    assert!(orbit[0] == still && picture(&scenes, "s0.ppm") == still && picture(&scenes, "s1.ppm") != still);
    let log = String::from_utf8(scenes.read("log.csv")).unwrap();
    assert_eq!(log.lines().count(), 5, "{log}");
}

#[test]
fn bench_and_render_trace_the_same_rays() {
    let scenes = Scenes::new();
    let alone = json(&scenes, "bench small.toml --frames 2 --threads 2 --json");
    let farm = json(&scenes, "render small.toml -o a.png --json");
    for field in ["blake3", "rays_per_frame", "triangles"] {
        assert_eq!(alone[field], farm[field], "{field}");
    }
}

#[test]
fn a_compiled_model_renders_like_its_source() {
    let scenes = Scenes::new();
    scenes.write("triangle.obj", TRIANGLE);
    let outcome = run(&scenes, "compile triangle.obj -o triangle.rfm").expect_success();
    assert!(outcome.stdout.contains("triangle.rfm") && outcome.stdout.contains("1 triangle"), "{outcome:?}");
    run(&scenes, "render triangle.obj -o source.ppm --size 40x30").expect_success();
    run(&scenes, "render triangle.rfm -o compiled.ppm --size 40x30").expect_success();
    assert!(picture(&scenes, "source.ppm") == picture(&scenes, "compiled.ppm"));
}

#[test]
fn standard_output_has_the_requested_report_only() {
    let scenes = Scenes::new();
    let outcome = run(&scenes, "render small.toml -o a.png").expect_success();
    assert_eq!(outcome.stdout, "");
    assert!(outcome.stderr.contains("1 of 1"), "{outcome:?}");
    let quiet = run(&scenes, "render small.toml -o a.png --quiet").expect_success();
    assert_eq!((quiet.stdout.as_str(), quiet.stderr.as_str()), ("", ""));
}

#[test]
fn an_output_folder_is_checked_before_the_scene_is_read() {
    let scenes = Scenes::new();
    if cfg!(target_os = "linux") {
        run(&scenes, "render nowhere.toml -o /proc/a.png").expect_failure(2, &["/proc"]);
    }
    run(&scenes, "render nowhere.toml -o missing/a.png").expect_failure(2, &["missing"]);
}

#[test]
fn a_master_that_listens_at_all_addresses_lists_reachable_ones() {
    let scenes = Scenes::new();
    let outcome = run(&scenes, "render small.toml -o a.png --size 16x12 --listen 0.0.0.0:0").expect_success();
    // The first line with addresses; later ones name those of workers.
    let addresses_of = |line: &str| -> Vec<SocketAddr> {
        let words = line.split_whitespace().map(|word| word.trim_matches([',', ';', '.', '(', ')']));
        words.filter_map(|word| word.parse().ok()).collect()
    };
    let addresses = outcome.stderr.lines().map(addresses_of).find(|addresses| !addresses.is_empty()).unwrap();
    for address in &addresses {
        assert!(!address.ip().is_unspecified() && address.port() != 0, "{outcome:?}");
        // An address of this machine alone is listed where there is no other one.
        assert!(addresses.len() == 1 || !address.ip().is_loopback(), "{outcome:?}");
    }
    let outcome = run(&scenes, "render small.toml -o a.png --listen [fe80::1%nothere0]:7117");
    outcome.expect_failure(2, &["nothere0"]);
    let outcome = run(&scenes, "render small.toml -o a.png --control [fe80::1%nothere0]:7117");
    outcome.expect_failure(2, &["nothere0"]);
}

/// `cargo build` at the root builds both programs, and `cargo run` runs the master.
#[test]
fn the_root_builds_both_programs_and_runs_the_master() {
    let mut command = std::process::Command::new(env!("CARGO"));
    command.args(["metadata", "--no-deps", "--format-version", "1", "--offline"]);
    let outcome =
        Running::start(command.current_dir(rayfarm_tests::project_root())).finish().expect_success();
    let metadata: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    let packages = metadata["packages"].as_array().unwrap();
    let built: Vec<_> = metadata["workspace_default_members"].as_array().unwrap().iter().collect();
    let built = packages.iter().filter(|package| built.contains(&&package["id"]));
    let mut names: Vec<_> = built.clone().map(|package| package["name"].as_str().unwrap()).collect();
    names.sort_unstable();
    assert_eq!(names, ["rayfarm-master", "rayfarm-worker"]);
    let runs: Vec<_> = built.filter_map(|package| package["default_run"].as_str()).collect();
    assert_eq!(runs, ["rayfarm-master"]);
}
