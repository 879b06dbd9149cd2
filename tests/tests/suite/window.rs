//! The window on a virtual screen: it starts, shows frames, answers keys, ends; and says so where there is no screen.

use std::path::Path;

use rayfarm_tests::{Running, Scenes, Screen, free_port, master, wait_until, worker};
use rayfarm_tracer::image::{RgbImage, load};

/// What the screen shows.
fn shot(screen: &Screen, scenes: &Scenes) -> RgbImage {
    let file = scenes.path("shot.png");
    screen.shoot(&file);
    load(&file).unwrap()
}

/// Colours that the screen shows: an empty screen or a flat window has very few.
fn colors(image: &RgbImage) -> usize {
    let colors: std::collections::BTreeSet<&[u8]> = image.pixels.chunks_exact(3).collect();
    colors.len()
}

fn window_of(screen: &Screen) -> String {
    let mut found = None;
    wait_until("the window is there", || {
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
fn it_shows_frames_answers_keys_and_ends() {
    let Some(screen) = Screen::start() else { return };
    let scenes = Scenes::new();
    let mut command = view(&scenes.path("small.toml"), &["--listen", "127.0.0.1:0"]);
    let window = Running::start(screen.show(&mut command));
    let id = window_of(&screen);
    wait_until("the window shows a picture", || colors(&shot(&screen, &scenes)) > 1000);

    let before = shot(&screen, &scenes);
    screen.xdotool(&["windowfocus", &id]);
    screen.xdotool(&["keydown", "d"]).unwrap();
    wait_until("the picture has moved a lot", || {
        let now = shot(&screen, &scenes);
        let changed = now.pixels.iter().zip(&before.pixels).filter(|(a, b)| a.abs_diff(**b) > 8).count();
        changed > 60_000
    });
    screen.xdotool(&["keyup", "d"]).unwrap();
    screen.xdotool(&["key", "Escape"]).unwrap();
    window.finish().expect_success();
}

#[test]
fn closing_the_window_ends_the_program_and_its_workers() {
    let Some(screen) = Screen::start() else { return };
    let scenes = Scenes::new();
    let mut command = view(&scenes.path("small.toml"), &["--listen", "127.0.0.1:0", "--frames", "5"]);
    Running::start(screen.show(&mut command)).finish().expect_success();
}

#[test]
fn without_a_worker_it_waits_and_a_worker_that_comes_fills_it() {
    let Some(screen) = Screen::start() else { return };
    let scenes = Scenes::new();
    let address = format!("127.0.0.1:{}", free_port());
    let mut command = view(&scenes.path("small.toml"), &["--no-local-workers", "--listen", &address]);
    let window = Running::start(screen.show(&mut command));
    let id = window_of(&screen);
    wait_until("the window says something", || (2..1000).contains(&colors(&shot(&screen, &scenes))));
    let _worker = Running::start(worker().args(["--master", &address]));
    wait_until("the window shows a picture", || colors(&shot(&screen, &scenes)) > 1000);
    screen.xdotool(&["windowfocus", &id]);
    screen.xdotool(&["key", "Escape"]).unwrap();
    window.finish().expect_success();
}

#[test]
fn without_a_screen_it_says_what_to_run_instead() {
    let scenes = Scenes::new();
    let mut command = view(&scenes.path("small.toml"), &["--listen", "127.0.0.1:0"]);
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    Running::start(&mut command).finish().expect_failure(1, &["display", "rayfarm-master render"]);
}
