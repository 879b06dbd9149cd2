//! Keys, mouse and size of the window, seen through the frame log: a moved camera traces other rays.

use rayfarm_tests::{Running, Scenes, Screen, master, wait_until};

/// One sphere under one light, nothing behind: shadow rays are traced only where the sphere is seen from its lit side.
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

/// A window that shows the sphere and logs its frames.
struct View<'a> {
    screen: &'a Screen,
    scenes: Scenes,
    running: Running,
    window: String,
}

/// A frame by its rays.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Frame {
    primary: u64,
    shadow: u64,
}

impl<'a> View<'a> {
    fn start(screen: &'a Screen) -> Self {
        let scenes = Scenes::new();
        scenes.write("sphere.toml", SPHERE);
        let mut command = master();
        command.args("view sphere.toml --size 320x240 --fps-log log.csv --listen 127.0.0.1:0".split(' '));
        let running = Running::start(screen.show(command.current_dir(scenes.path(""))));
        let mut window = String::new();
        wait_until("the window is there", || {
            let found = screen.xdotool(&["search", "--onlyvisible", "--name", "rayfarm"]).unwrap_or_default();
            window = found.lines().next().unwrap_or_default().to_owned();
            !window.is_empty()
        });
        let view = Self { screen, scenes, running, window };
        // Without a window manager the keyboard belongs to the window below the pointer.
        view.point_at(30, 30);
        view
    }

    fn tool(&self, args: &str) {
        let args: Vec<&str> = args.split(' ').collect();
        self.screen.xdotool(&args).unwrap();
    }

    fn point_at(&self, x: u32, y: u32) {
        self.tool(&format!("mousemove --window {} {x} {y}", self.window));
    }

    fn frames(&self) -> Vec<Frame> {
        let log = String::from_utf8(self.scenes.read("log.csv")).unwrap();
        let whole = log.split_inclusive('\n').skip(1).filter(|line| line.ends_with('\n'));
        whole
            .map(|line| {
                let column = |index| line.split(',').nth(index).unwrap().parse().unwrap();
                Frame { primary: column(6), shadow: column(7) }
            })
            .collect()
    }

    /// Waits for a frame from now on, doing something again and again meanwhile.
    fn frame_while(&self, what: &str, mut act: impl FnMut(), wanted: impl Fn(&Frame) -> bool) -> Frame {
        let seen = self.frames().len();
        let mut found = None;
        wait_until(what, || {
            act();
            found = self.frames().into_iter().skip(seen).find(|frame| wanted(frame));
            found.is_some()
        });
        found.unwrap()
    }

    fn frame(&self, what: &str, wanted: impl Fn(&Frame) -> bool) -> Frame {
        self.frame_while(what, || (), wanted)
    }
}

#[test]
fn keys_mouse_and_size_change_what_is_rendered() {
    let Some(screen) = Screen::start() else { return };
    let view = View::start(&screen);
    let still = view.frame("the first camera", |frame| frame.primary == 320 * 240);

    view.tool("key h key h key o"); // only the overlay changes
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

#[test]
fn every_frame_that_was_asked_for_is_shown() {
    let Some(screen) = Screen::start() else { return };
    let scenes = Scenes::new();
    let mut command = master();
    let args = "view small.toml --size 64x48 --frames 50 --orbit 360 --fps-log log.csv --listen 127.0.0.1:0";
    command.args(args.split(' ')).current_dir(scenes.path(""));
    Running::start(screen.show(&mut command)).finish().expect_success();
    let log = String::from_utf8(scenes.read("log.csv")).unwrap();
    assert_eq!(log.lines().count(), 1 + 50, "{log}");
}

#[test]
fn a_screen_without_32_bits_a_pixel_is_refused_in_words() {
    for depth in [8, 16] {
        let Some(screen) = Screen::of_depth(depth) else { return };
        let scenes = Scenes::new();
        let mut command = master();
        command.args(["view", "small.toml", "--listen", "127.0.0.1:0"]).current_dir(scenes.path(""));
        let outcome = Running::start(screen.show(&mut command)).finish();
        outcome.expect_failure(1, &[&format!("{depth} bits per pixel"), "rayfarm-master render small.toml"]);
    }
}
