//! Tests of long runs: begun at any frame, interrupted, resumed. Every frame equals that of a complete run.

use std::time::SystemTime;

use rayfarm_tests::{Outcome, Running, Scenes, master, wait_until};

const FRAMES: usize = 8;

/// Returns a `render small.toml` command over the whole camera path, with this output and these options.
fn command(scenes: &Scenes, output: &str, more: &str) -> std::process::Command {
    let mut command = master();
    command.args(["render", "small.toml", "-o", output, "--frames", &FRAMES.to_string()]);
    command.args(["--orbit", "360", "--spin", "5", "--size", "64x48", "--listen", "127.0.0.1:0"]);
    command.args(more.split_whitespace()).current_dir(scenes.path("")).env_remove("RUST_LOG");
    command
}

fn render(scenes: &Scenes, output: &str, more: &str) -> Outcome {
    Running::start(&mut command(scenes, output, more)).finish()
}

fn json(outcome: &Outcome) -> serde_json::Value {
    serde_json::from_str(&outcome.stdout).unwrap()
}

/// Renders the expected pictures as files `all-N.png`.
fn expected() -> (Scenes, Vec<Vec<u8>>) {
    let scenes = Scenes::new();
    let outcome = render(&scenes, "all-%d.png", "--json").expect_success();
    let report = json(&outcome);
    assert_eq!((&report["frames"], &report["skipped"]), (&FRAMES.into(), &0.into()));
    let ms = report["ms_per_frame"]["median"].as_f64().unwrap();
    let fps = report["fps"].as_f64().unwrap();
    assert!(fps > 0.0 && fps * ms < 1e6, "{report}");
    let pictures: Vec<_> = (0..FRAMES).map(|frame| scenes.read(&format!("all-{frame}.png"))).collect();
    assert!(pictures.windows(2).all(|pair| pair[0] != pair[1]), "consecutive frames differ");
    (scenes, pictures)
}

fn modified(scenes: &Scenes, name: &str) -> SystemTime {
    scenes.path(name).metadata().unwrap().modified().unwrap()
}

#[test]
fn a_run_begins_at_any_frame_of_its_path() {
    let (scenes, pictures) = expected();
    let report =
        json(&render(&scenes, "late-%d.png", "--first-frame 5 --json --fps-log log.csv").expect_success());
    assert_eq!((&report["frames"], &report["skipped"]), (&3.into(), &0.into()));
    for frame in 0..FRAMES {
        let name = format!("late-{frame}.png");
        match frame {
            0..5 => assert!(!scenes.path(&name).exists(), "{name}"),
            _ => assert!(scenes.read(&name) == pictures[frame], "{name}"),
        }
    }
    let log = String::from_utf8(scenes.read("log.csv")).unwrap();
    let numbers: Vec<_> = log.lines().skip(1).map(|line| line.split(',').next().unwrap()).collect();
    assert_eq!(numbers, ["5", "6", "7"]);
    let beyond = render(&scenes, "late-%d.png", "--first-frame 8");
    beyond.expect_failure(2, &["--first-frame 8", "7"]);
}

#[test]
fn resume_renders_missing_and_damaged_frames_only() {
    let (scenes, pictures) = expected();
    for frame in [0, 1, 2, 4] {
        scenes.write(&format!("f-{frame}.png"), &pictures[frame]);
    }
    scenes.write("f-3.png", &pictures[3][..pictures[3].len() - 7]);
    scenes.write("f-6.png", "no picture at all");
    let before = modified(&scenes, "f-2.png");
    let outcome = render(&scenes, "f-%d.png", "--resume --json").expect_success();
    let report = json(&outcome);
    assert_eq!((&report["frames"], &report["skipped"]), (&4.into(), &4.into()));
    for damaged in ["f-3.png", "f-6.png"] {
        assert!(outcome.stderr.contains(damaged), "{outcome:?}");
    }
    assert!(outcome.stderr.contains("4 of 4"), "{outcome:?}");
    assert_eq!(modified(&scenes, "f-2.png"), before);
    for frame in 0..FRAMES {
        assert!(scenes.read(&format!("f-{frame}.png")) == pictures[frame], "{frame}");
    }
    let report = json(&render(&scenes, "f-%d.png", "--resume --json").expect_success());
    assert_eq!((&report["frames"], &report["skipped"]), (&0.into(), &FRAMES.into()));
}

#[test]
fn an_interrupted_run_is_resumed() {
    let (scenes, pictures) = expected();
    let run = Running::start(&mut command(&scenes, "f-%d.png", "--samples 1 --threads 1"));
    wait_until("a frame is written", || scenes.path("f-0.png").exists());
    run.signal("INT");
    let outcome = run.finish();
    assert!(outcome.code == Some(0) || outcome.stderr.contains("--resume"), "{outcome:?}");
    render(&scenes, "f-%d.png", "--resume").expect_success();
    for frame in 0..FRAMES {
        assert!(scenes.read(&format!("f-{frame}.png")) == pictures[frame], "{frame}");
    }
}

#[test]
fn skip_existing_leaves_files_of_any_content() {
    let (scenes, pictures) = expected();
    scenes.write("f-1.png", "any content");
    let outcome = render(&scenes, "f-%d.png", "--skip-existing --json").expect_success();
    assert_eq!(json(&outcome)["skipped"], 1);
    assert_eq!(scenes.read("f-1.png"), b"any content");
    assert!(
        (0..FRAMES)
            .filter(|&frame| frame != 1)
            .all(|frame| scenes.read(&format!("f-{frame}.png")) == pictures[frame])
    );
}

#[test]
fn an_impossible_resume_is_refused_before_rendering() {
    let (scenes, pictures) = expected();
    scenes.write("f-2.png", &pictures[2]);
    let names = scenes.names();
    let size = render(&scenes, "f-%d.png", "--resume --size 32x24");
    size.expect_failure(2, &["f-2.png", "64x48", "32x24", "--size"]);
    render(&scenes, "none", "--resume").expect_failure(2, &["-o none"]);
    render(&scenes, "f-%d.png", "--resume --skip-existing").expect_failure(2, &["--skip-existing"]);
    assert_eq!(scenes.names().len(), names.len());
}

#[test]
fn a_run_without_files_reports_frames_and_rate() {
    let scenes = Scenes::new();
    let outcome = render(&scenes, "none", "").expect_success();
    for words in ["8 of 8", " FPS", "-o none"] {
        assert!(outcome.stderr.contains(words), "{words}: {outcome:?}");
    }
}
