//! Long runs: begun in the middle, interrupted, gone on with. Every frame is the picture that a run of all has there.

use std::time::SystemTime;

use rayfarm_tests::{Outcome, Running, Scenes, master, wait_until};

const FRAMES: usize = 8;

/// `render small.toml` over the whole path, with these files and options.
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

/// The pictures that are right, as files `all-N.png`.
fn all() -> (Scenes, Vec<Vec<u8>>) {
    let scenes = Scenes::new();
    let outcome = render(&scenes, "all-%d.png", "--json").expect_success();
    let report = json(&outcome);
    assert_eq!((&report["frames"], &report["skipped"]), (&FRAMES.into(), &0.into()));
    let ms = report["ms_per_frame"]["median"].as_f64().unwrap();
    let fps = report["fps"].as_f64().unwrap();
    assert!(fps > 0.0 && fps * ms < 1e6, "{report}");
    let pictures: Vec<_> = (0..FRAMES).map(|frame| scenes.read(&format!("all-{frame}.png"))).collect();
    assert!(pictures.windows(2).all(|pair| pair[0] != pair[1]), "it moves");
    (scenes, pictures)
}

fn modified(scenes: &Scenes, name: &str) -> SystemTime {
    scenes.path(name).metadata().unwrap().modified().unwrap()
}

#[test]
fn a_run_may_begin_at_any_frame_of_its_path() {
    let (scenes, pictures) = all();
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
    beyond.expect_failure(2, &["--first-frame 8", "0 to 7"]);
}

#[test]
fn resume_renders_what_is_missing_or_damaged_and_nothing_else() {
    let (scenes, pictures) = all();
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
        assert!(outcome.stderr.contains(&format!("{damaged}: is not a complete picture")), "{outcome:?}");
    }
    assert!(
        outcome.stderr.contains("4 of 4 frames written") && outcome.stderr.contains("4 were there already")
    );
    assert_eq!(modified(&scenes, "f-2.png"), before);
    for frame in 0..FRAMES {
        assert!(scenes.read(&format!("f-{frame}.png")) == pictures[frame], "{frame}");
    }
    let outcome = render(&scenes, "f-%d.png", "--resume --json").expect_success();
    assert!(outcome.stderr.contains("all 8 frames are there already"), "{outcome:?}");
    assert_eq!(json(&outcome)["frames"], 0);
}

#[test]
fn an_interrupted_run_is_gone_on_with() {
    let (scenes, pictures) = all();
    let run = Running::start(&mut command(&scenes, "f-%d.png", "--samples 1 --threads 1"));
    wait_until("a frame is written", || scenes.path("f-0.png").exists());
    run.signal("INT");
    let outcome = run.finish();
    assert!(outcome.code == Some(0) || outcome.stderr.contains("--resume goes on"), "{outcome:?}");
    render(&scenes, "f-%d.png", "--resume").expect_success();
    for frame in 0..FRAMES {
        assert!(scenes.read(&format!("f-{frame}.png")) == pictures[frame], "{frame}");
    }
}

#[test]
fn existing_files_may_be_left_alone_whatever_they_hold() {
    let (scenes, pictures) = all();
    scenes.write("f-1.png", "not to be looked at");
    let outcome = render(&scenes, "f-%d.png", "--skip-existing --json").expect_success();
    assert_eq!(json(&outcome)["skipped"], 1);
    assert_eq!(scenes.read("f-1.png"), b"not to be looked at");
    assert!(
        (0..FRAMES)
            .filter(|&frame| frame != 1)
            .all(|frame| scenes.read(&format!("f-{frame}.png")) == pictures[frame])
    );
}

#[test]
fn what_cannot_be_gone_on_with_is_refused_before_anything_is_rendered() {
    let (scenes, pictures) = all();
    scenes.write("f-2.png", &pictures[2]);
    let names = scenes.names();
    let size = render(&scenes, "f-%d.png", "--resume --size 32x24");
    size.expect_failure(2, &["f-2.png", "64x48", "32x24", "--size"]);
    render(&scenes, "none", "--resume").expect_failure(2, &["-o none"]);
    render(&scenes, "f-%d.png", "--resume --skip-existing").expect_failure(2, &["--skip-existing"]);
    assert_eq!(scenes.names().len(), names.len());
}

#[test]
fn a_run_without_files_tells_what_it_did() {
    let scenes = Scenes::new();
    let outcome = render(&scenes, "none", "").expect_success();
    for words in ["8 of 8 frames rendered in ", " FPS, median ", "no file is written (-o none)"] {
        assert!(outcome.stderr.contains(words), "{words}: {outcome:?}");
    }
}
