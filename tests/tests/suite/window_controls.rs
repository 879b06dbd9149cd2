//! Tests of keys, mouse and size of the window through the frame log: a moved camera traces other numbers of rays.

use std::cell::Cell;
use std::thread::sleep;
use std::time::Duration;

use rayfarm_tests::{Running, Scenes, Screen, master, wait_until};
use rayfarm_tracer::image::load;

/// One sphere, one light and no background: shadow rays are traced only where the lit side of the sphere is visible.
const SPHERE: &str = r#"
    [camera]
    position = [1.0, 1.5, 4.0]
    look_at = [0.0, 0.5, 0.0]

    [material.red]
    diffuse = [0.8, 0.1, 0.1]

    [[light]]
    kind = "point"
    position = [3.0, 5.0, 4.0]

    [[sphere]]
    center = [0.0, 0.5, 0.0]
    radius = 0.5
    material = "red"
"#;

/// A window with the sphere and a log of its frames.
struct View<'a> {
    screen: &'a Screen,
    scenes: Scenes,
    running: Running,
    window: String,
    /// Number of frames in the log before the last input. A view at rest is rendered once.
    before: Cell<usize>,
}

/// Numbers of rays of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Frame {
    primary: u64,
    shadow: u64,
}

impl<'a> View<'a> {
    fn start(screen: &'a Screen) -> Self {
        Self::start_with(screen, "")
    }

    fn start_with(screen: &'a Screen, more: &str) -> Self {
        let scenes = Scenes::new();
        scenes.write("sphere.toml", SPHERE);
        let mut command = master();
        command.args("view sphere.toml --size 320x240 --fps-log log.csv --listen 127.0.0.1:0".split(' '));
        command.args(more.split_whitespace());
        let running = Running::start(screen.attach(command.current_dir(scenes.path(""))));
        let mut window = String::new();
        wait_until("the window exists", || {
            let found = screen.xdotool(&["search", "--onlyvisible", "--name", "rayfarm"]).unwrap_or_default();
            window = found.lines().next().unwrap_or_default().to_owned();
            !window.is_empty()
        });
        let view = Self { screen, scenes, running, window, before: Cell::new(0) };
        // Without a window manager the window below the pointer has the keyboard focus.
        view.point_at(30, 30);
        view.before.set(0);
        view
    }

    /// Runs `xdotool`.
    fn tool(&self, args: &str) {
        self.before.set(self.frames().len());
        let args: Vec<&str> = args.split(' ').collect();
        self.screen.xdotool(&args).unwrap();
    }

    fn point_at(&self, x: u32, y: u32) {
        self.tool(&format!("mousemove --window {} {x} {y}", self.window));
    }

    fn frames(&self) -> Vec<Frame> {
        let Ok(log) = std::fs::read_to_string(self.scenes.path("log.csv")) else { return Vec::new() };
        let complete = log.split_inclusive('\n').skip(1).filter(|line| line.ends_with('\n'));
        complete
            .map(|line| {
                let column = |index| line.split(',').nth(index).unwrap().parse().unwrap();
                Frame { primary: column(6), shadow: column(7) }
            })
            .collect()
    }

    /// Waits for a matching frame after the last input, and calls `act` repeatedly while it waits.
    fn frame_while(&self, what: &str, mut act: impl FnMut(), wanted: impl Fn(&Frame) -> bool) -> Frame {
        let seen = self.before.get();
        let mut found = None;
        wait_until(what, || {
            act();
            found = self.frames().into_iter().skip(seen).find(|frame| wanted(frame));
            found.is_some()
        });
        found.unwrap()
    }

    /// Waits for a matching frame after the last input.
    fn frame(&self, what: &str, wanted: impl Fn(&Frame) -> bool) -> Frame {
        self.frame_while(what, || (), wanted)
    }
}

#[test]
fn keys_mouse_and_size_change_what_is_rendered() {
    let Some(screen) = Screen::start() else { return };
    let view = View::start(&screen);
    let still = view.frame("the first camera", |frame| frame.primary == 320 * 240);

    view.tool("key h key h key o"); // These change the overlay only.
    view.tool("keydown w");
    view.frame("a camera nearer to the sphere", |frame| frame.shadow > still.shadow);
    view.tool("keyup w");
    view.tool("key r");
    view.frame("the first camera, after R", |frame| *frame == still);

    view.tool("click 4");
    view.frame("a camera nearer, by the wheel", |frame| frame.shadow > still.shadow);
    view.tool("key r");
    view.frame("the first camera again", |frame| *frame == still);

    view.tool("mousedown 1");
    let mut x = 30;
    view.frame_while(
        "a camera elsewhere round the sphere, by dragging",
        || {
            x = 30 + (x + 10) % 250;
            view.point_at(x, 60);
        },
        |frame| frame.shadow != still.shadow,
    );
    view.tool("mouseup 1");

    view.tool(&format!("windowsize {} 200 100", view.window));
    view.frame("a frame of the window's new size", |frame| frame.primary == 200 * 100);

    view.point_at(30, 30);
    view.tool("key Escape");
    view.running.finish().expect_success();
}

/// A time far above that of a frame of this scene.
const REST_TIME: Duration = Duration::from_secs(3);

#[test]
fn a_view_at_rest_renders_one_frame_and_a_hidden_window_none() {
    let Some(screen) = Screen::start() else { return };
    let view = View::start(&screen);
    let still = view.frame("the first picture", |frame| frame.primary == 320 * 240);
    sleep(REST_TIME);
    view.tool("key h key h key o key o key c key f");
    sleep(REST_TIME);
    assert_eq!(view.frames(), [still], "the overlay renders no frame");

    view.tool("click 4");
    let nearer = view.frame("a camera nearer, by the wheel", |frame| frame.shadow > still.shadow);
    sleep(REST_TIME);
    let count = view.frames().len();
    assert_eq!(view.frames().last(), Some(&nearer));
    assert!(count <= 3, "one notch of the wheel is one or two views: {:?}", view.frames());

    view.tool(&format!("windowunmap --sync {}", view.window));
    view.tool(&format!("windowsize {} 200 100", view.window));
    sleep(REST_TIME);
    assert_eq!(view.frames().len(), count, "the window is hidden");
    view.tool(&format!("windowmap --sync {}", view.window));
    view.frame("a frame of the size that it has now", |frame| frame.primary == 200 * 100);
    wait_until("the window shows its picture", || {
        let file = view.scenes.path("shot.png");
        screen.capture(&file);
        let shot = load(&file).unwrap();
        let reds = shot.pixels.chunks_exact(3).filter(|rgb| rgb[0] > 100 && rgb[0] / 2 > rgb[1]);
        reds.count() > 100
    });
    view.point_at(30, 30);
    view.tool("key Escape");
    view.running.finish().expect_success();
}

#[test]
fn an_animation_stops_while_the_window_is_hidden() {
    let Some(screen) = Screen::start() else { return };
    let view = View::start_with(&screen, "--spin 1");
    let count = || view.frames().len();
    wait_until("the animation runs", || count() > 20);
    view.tool(&format!("windowunmap --sync {}", view.window));
    let mut last = 0;
    wait_until("the animation stops", || {
        let before = std::mem::replace(&mut last, count());
        sleep(Duration::from_millis(500));
        count() == last && before == last
    });
    sleep(REST_TIME);
    assert_eq!(count(), last, "the window is hidden");
    view.tool(&format!("windowmap --sync {}", view.window));
    wait_until("the animation continues", || count() > last + 20);
    view.point_at(30, 30);
    view.tool("key Escape");
    view.running.finish().expect_success();
}

#[test]
fn continuous_mode_renders_a_still_picture_repeatedly() {
    let Some(screen) = Screen::start() else { return };
    let view = View::start_with(&screen, "--continuous");
    wait_until("frames are rendered", || view.frames().len() > 50);
    view.tool("key Escape");
    view.running.finish().expect_success();
}

#[test]
fn every_requested_frame_is_shown() {
    let Some(screen) = Screen::start() else { return };
    let scenes = Scenes::new();
    let mut command = master();
    let args = "view small.toml --size 64x48 --frames 50 --orbit 360 --fps-log log.csv --listen 127.0.0.1:0";
    command.args(args.split(' ')).current_dir(scenes.path(""));
    Running::start(screen.attach(&mut command)).finish().expect_success();
    let log = String::from_utf8(scenes.read("log.csv")).unwrap();
    assert_eq!(log.lines().count(), 1 + 50, "{log}");
}

#[test]
fn a_screen_without_32_bits_per_pixel_is_refused_with_a_message() {
    for depth in [8, 16] {
        let Some(screen) = Screen::of_depth(depth) else { return };
        let scenes = Scenes::new();
        let mut command = master();
        command.args(["view", "small.toml", "--listen", "127.0.0.1:0"]).current_dir(scenes.path(""));
        let outcome = Running::start(screen.attach(&mut command)).finish();
        outcome.expect_failure(1, &[&format!("{depth} bits per pixel"), "rayfarm-master render small.toml"]);
    }
}
