//! Videos and scenes with keys: frames of a video are those of a sequence, and each is the same in any run.

use std::io::BufReader;
use std::process::Command;

use rayfarm_tests::{Outcome, Running, Scenes, master, require, wait_until};
use rayfarm_tracer::image::{RgbImage, load};

const FRAMES: usize = 6;

/// A scene whose camera, group, ball and lamp move within half a second.
const KEYED: &str = r#"
[render]
width = 48
height = 36
[camera]
position = [0, 2, 6]
look_at = [0, 0.5, 0]
[[camera_key]]
time = 0
position = [0, 2, 6]
[[camera_key]]
time = 0.5
position = [3, 2, 5]
[[light]]
key = [{ time = 0, position = [-3, 5, 2] }, { time = 0.5, position = [3, 5, 2] }]
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
[[model]]
file = "bumps.obj"
name = "bumps"
[[group]]
children = ["bumps"]
key = [{ time = 0, translate = [0, 0, 0] }, { time = 0.5, translate = [1, 0.5, 0] }]
[[sphere]]
radius = 0.5
key = [{ time = 0, center = [-1, 1, 1] }, { time = 0.5, center = [1, 1, 1] }]
"#;

fn scenes() -> Scenes {
    let scenes = Scenes::new();
    scenes.write("keyed.toml", KEYED);
    scenes
}

fn command(scenes: &Scenes, scene: &str, output: &str, more: &str) -> Command {
    let mut command = master();
    command.args(["render", scene, "-o", output, "--listen", "127.0.0.1:0"]);
    command.args(more.split_whitespace()).current_dir(scenes.path("")).env_remove("RUST_LOG");
    command
}

fn render(scenes: &Scenes, scene: &str, output: &str, more: &str) -> Outcome {
    Running::start(&mut command(scenes, scene, output, more)).finish()
}

/// Renders the frames of the scene with keys as `all-N.png`, at ten frames a second.
fn expected() -> (Scenes, Vec<RgbImage>) {
    let scenes = scenes();
    render(&scenes, "keyed.toml", "all-%d.png", "--fps 10").expect_success();
    assert!(!scenes.path("all-6.png").exists(), "the last key is frame 5");
    let frames: Vec<_> =
        (0..FRAMES).map(|frame| load(&scenes.path(&format!("all-{frame}.png"))).unwrap()).collect();
    assert!(frames.windows(2).all(|pair| pair[0] != pair[1]), "consecutive frames differ");
    (scenes, frames)
}

#[test]
fn animated_png_has_the_frames_of_the_sequence_bit_for_bit() {
    let (scenes, frames) = expected();
    render(&scenes, "keyed.toml", "a.apng", "--fps 10 --local-workers 2").expect_success();
    let file = BufReader::new(std::fs::File::open(scenes.path("a.apng")).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    assert_eq!(reader.info().animation_control().unwrap().num_frames, FRAMES as u32);
    for (number, frame) in frames.iter().enumerate() {
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        assert!(pixels == frame.pixels, "frame {number}");
        let control = reader.info().frame_control().unwrap();
        assert_eq!((control.delay_num, control.delay_den), (1, 10));
    }
}

#[test]
fn a_gif_shows_the_frames_of_the_sequence() {
    let (scenes, frames) = expected();
    render(&scenes, "keyed.toml", "a.gif", "--fps 10").expect_success();
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(std::fs::File::open(scenes.path("a.gif")).unwrap()).unwrap();
    let width = frames[0].width as usize;
    let mut shown = vec![0; frames[0].pixels.len()];
    for (number, expected) in frames.iter().enumerate() {
        let frame = decoder.read_next_frame().unwrap().unwrap();
        assert_eq!(frame.delay, 10);
        for (at, rgba) in frame.buffer.chunks_exact(4).enumerate().filter(|(_, rgba)| rgba[3] > 0) {
            let (x, y) = (at % usize::from(frame.width), at / usize::from(frame.width));
            let first = 3 * ((y + usize::from(frame.top)) * width + x + usize::from(frame.left));
            shown[first..first + 3].copy_from_slice(&rgba[..3]);
        }
        let squares = shown.iter().zip(&expected.pixels).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
        let error = (squares.sum::<f64>() / shown.len() as f64).sqrt();
        assert!(error < 6.0, "frame {number} differs by {error} of 255");
    }
    assert!(decoder.read_next_frame().unwrap().is_none());
}

#[test]
fn frames_with_keys_are_the_same_in_resumed_and_late_runs() {
    let (scenes, _) = expected();
    let picture = |name: &str| scenes.read(name);
    let before: Vec<_> = (0..FRAMES).map(|frame| picture(&format!("all-{frame}.png"))).collect();
    std::fs::remove_file(scenes.path("all-1.png")).unwrap();
    scenes.write("all-4.png", &before[4][..before[4].len() / 2]);
    let outcome = render(&scenes, "keyed.toml", "all-%d.png", "--fps 10 --resume --json").expect_success();
    let report: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!((&report["frames"], &report["skipped"]), (&2.into(), &4.into()));
    render(&scenes, "keyed.toml", "late-%d.png", "--fps 10 --first-frame 3 --verify 100 --local-workers 2")
        .expect_success();
    for (frame, before) in before.iter().enumerate() {
        assert!(picture(&format!("all-{frame}.png")) == *before, "{frame}");
        assert!(frame < 3 || picture(&format!("late-{frame}.png")) == *before, "{frame}");
    }
}

#[test]
fn mp4_and_webm_have_all_frames() {
    if !require(&["ffmpeg", "ffprobe"]) {
        return;
    }
    let (scenes, frames) = expected();
    for name in ["a.mp4", "a.webm"] {
        render(&scenes, "keyed.toml", name, "--fps 10").expect_success();
        let mut probe = Command::new("ffprobe");
        probe.args(["-v", "error", "-count_frames", "-select_streams", "v:0", "-of", "csv=p=0"]);
        probe.args(["-show_entries", "stream=width,height,avg_frame_rate,nb_read_frames"]);
        let probed = probe.arg(scenes.path(name)).output().unwrap();
        assert_eq!(String::from_utf8_lossy(&probed.stdout).trim(), "48,36,10/1,6", "{name}");
        let mut decode = Command::new("ffmpeg");
        decode.args(["-v", "error", "-i"]).arg(scenes.path(name));
        decode.args(["-f", "rawvideo", "-pix_fmt", "rgb24", "-"]);
        let decoded = decode.output().unwrap().stdout;
        assert_eq!(decoded.len(), FRAMES * frames[0].pixels.len());
        for (shown, expected) in decoded.chunks(frames[0].pixels.len()).zip(&frames) {
            let differences = shown.iter().zip(&expected.pixels).map(|(a, b)| u64::from(a.abs_diff(*b)));
            let mean = differences.sum::<u64>() as f64 / shown.len() as f64;
            assert!(mean < 8.0, "{name}: {mean} of 255");
        }
    }
    // Odd sides are padded.
    render(&scenes, "keyed.toml", "odd.mp4", "--size 47x35 --frames 2").expect_success();
}

#[test]
fn videos_that_cannot_be_written_are_refused_before_rendering() {
    let scenes = scenes();
    let names = scenes.names().len();
    let refused = |output: &str, more: &str, code: i32, words: &[&str]| {
        render(&scenes, "keyed.toml", output, more).expect_failure(code, words);
    };
    refused("a.gif", "--resume", 2, &["--resume", "frame-%04d.png"]);
    refused("a.gif", "--skip-existing", 2, &["--skip-existing"]);
    refused("a.apng", "--verify 10", 2, &["--verify"]);
    refused("a.gif", "--fps 60", 2, &["50", ".apng"]);
    refused("a%d.gif", "", 2, &["leave the number out"]);
    refused("a.gif", "--fps 0", 2, &["--fps", "0.1 to 1000"]);
    for output in ["a.mp4", "a.webm"] {
        let mut command = command(&scenes, "keyed.toml", output, "");
        Running::start(command.env("PATH", ""))
            .finish()
            .expect_failure(1, &["ffmpeg", "install", ".gif or .apng"]);
    }
    scenes.write("stretched.toml", KEYED.replace("translate = [1, 0.5, 0]", "scale = [1, 1]"));
    render(&scenes, "stretched.toml", "none", "").expect_failure(2, &["stretched.toml:", "scale"]);
    std::fs::remove_file(scenes.path("stretched.toml")).unwrap();
    assert_eq!(scenes.names().len(), names, "{:?}", scenes.names());
}

#[cfg(unix)]
#[test]
fn a_broken_ffmpeg_is_reported_with_its_words() {
    use std::os::unix::fs::PermissionsExt;
    let scenes = scenes();
    let names = scenes.names().len() + 1;
    let script = scenes.write("ffmpeg", "#!/bin/sh\necho 'no such codec today' >&2\nexit 3\n");
    std::fs::set_permissions(script, std::fs::Permissions::from_mode(0o755)).unwrap();
    let mut command = command(&scenes, "keyed.toml", "a.mp4", "");
    let outcome = Running::start(command.env("PATH", scenes.path(""))).finish();
    outcome.expect_failure(1, &["no such codec today", "exit status: 3"]);
    assert_eq!(scenes.names().len(), names, "{:?}", scenes.names());
}

#[test]
fn an_interrupted_video_leaves_neither_file_nor_encoder() {
    let scenes = scenes();
    let names = scenes.names().len();
    let mut outputs = vec!["a.apng", "a.gif"];
    if require(&["ffmpeg"]) {
        outputs.push("a.mp4");
    }
    for output in outputs {
        let run = Running::start(&mut command(&scenes, "keyed.toml", output, "--frames 100000 --threads 1"));
        wait_until("the video is begun", || scenes.names().len() > names);
        let children = run.children();
        run.signal("INT");
        let outcome = run.finish();
        assert_eq!(outcome.code, Some(1), "{outcome:?}");
        assert!(outcome.stderr.contains("whole or not at all"), "{outcome:?}");
        assert_eq!(scenes.names().len(), names, "{output}: {:?}", scenes.names());
        for child in children {
            let alive = std::fs::read_to_string(format!("/proc/{child}/comm")).unwrap_or_default();
            assert!(!alive.contains("ffmpeg"), "{output}: ffmpeg still runs");
        }
    }
}
