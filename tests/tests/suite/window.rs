//! Tests of the window on a virtual screen: frames, keys, end, and the message where there is no screen.

use std::path::Path;

use rayfarm_tests::{Running, Scenes, Screen, free_port, master, wait_until, worker};
use rayfarm_tracer::image::{RgbImage, load};

/// Takes a screenshot.
fn screenshot(screen: &Screen, scenes: &Scenes) -> RgbImage {
    let file = scenes.path("shot.png");
    screen.capture(&file);
    load(&file).unwrap()
}

/// Counts the colours of a screenshot. An empty screen or a flat window has few.
fn colors(image: &RgbImage) -> usize {
    let colors: std::collections::BTreeSet<&[u8]> = image.pixels.chunks_exact(3).collect();
    colors.len()
}

/// Waits for the window and returns its id.
fn window_of(screen: &Screen) -> String {
    let mut found = None;
    wait_until("the window exists", || {
        found = screen.xdotool(&["search", "--name", "rayfarm"]);
        found.as_ref().is_some_and(|ids| !ids.is_empty())
    });
    found.unwrap().lines().next().unwrap().to_owned()
}

fn view(scene: &Path, more: &[&str]) -> std::process::Command {
    let mut command = master();
    command.arg("view").arg(scene).args(["--size", "480x360"]).args(more);
    command
}

#[test]
fn the_window_shows_frames_handles_keys_and_ends() {
    let Some(screen) = Screen::start() else { return };
    let scenes = Scenes::new();
    let mut command = view(&scenes.path("small.toml"), &["--listen", "127.0.0.1:0"]);
    let window = Running::start(screen.attach(&mut command));
    let id = window_of(&screen);
    wait_until("the window shows a picture", || colors(&screenshot(&screen, &scenes)) > 1000);

    let before = screenshot(&screen, &scenes);
    screen.xdotool(&["windowfocus", &id]);
    screen.xdotool(&["keydown", "d"]).unwrap();
    wait_until("the picture has changed", || {
        let now = screenshot(&screen, &scenes);
        let changed = now.pixels.iter().zip(&before.pixels).filter(|(a, b)| a.abs_diff(**b) > 8).count();
        changed > 60_000
    });
    screen.xdotool(&["keyup", "d"]).unwrap();
    screen.xdotool(&["key", "Escape"]).unwrap();
    window.finish().expect_success();
}

#[test]
fn the_program_ends_after_its_last_frame() {
    let Some(screen) = Screen::start() else { return };
    let scenes = Scenes::new();
    let mut command = view(&scenes.path("small.toml"), &["--listen", "127.0.0.1:0", "--frames", "5"]);
    Running::start(screen.attach(&mut command)).finish().expect_success();
}

#[test]
fn without_a_worker_the_window_waits_for_one() {
    let Some(screen) = Screen::start() else { return };
    let scenes = Scenes::new();
    let address = format!("127.0.0.1:{}", free_port());
    let mut command = view(&scenes.path("small.toml"), &["--no-local-workers", "--listen", &address]);
    let window = Running::start(screen.attach(&mut command));
    let id = window_of(&screen);
    wait_until("the window shows a text", || (2..1000).contains(&colors(&screenshot(&screen, &scenes))));
    let _worker = Running::start(worker().args(["--master", &address]));
    wait_until("the window shows a picture", || colors(&screenshot(&screen, &scenes)) > 1000);
    screen.xdotool(&["windowfocus", &id]);
    screen.xdotool(&["key", "Escape"]).unwrap();
    window.finish().expect_success();
}

#[test]
fn without_a_screen_the_message_names_another_command() {
    let scenes = Scenes::new();
    let mut command = view(&scenes.path("small.toml"), &["--listen", "127.0.0.1:0"]);
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    Running::start(&mut command).finish().expect_failure(1, &["display", "rayfarm-master render"]);
}
