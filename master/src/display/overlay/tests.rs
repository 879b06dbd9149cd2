use super::*;

fn canvas(width: usize, height: usize) -> Canvas {
    let mut canvas = Canvas::default();
    canvas.resize(width, height);
    canvas.fill(0x0080_8080);
    canvas
}

fn figures() -> Figures {
    Figures {
        fps: Some(31.25),
        fps_range: None,
        frame_time: Duration::from_micros(32_100),
        latency: Some(Duration::from_micros(64_200)),
        size: (1024, 768),
        samples: 4,
        film: None,
        quality: Vec::new(),
        reductions: Vec::new(),
        workers: 2,
        threads: 4,
        triangles: 1_234_567,
        progress: Some(0.421),
    }
}

/// Text on the canvas in `color`, read glyph by glyph at `scale`, from (`x`, `y`).
fn read(canvas: &Canvas, x: usize, y: usize, scale: usize, characters: usize, color: u32) -> String {
    let drawn = |column: usize, character: char| {
        let mut expected = Canvas::default();
        expected.resize(GLYPH * scale, GLYPH * scale);
        expected.text(0, 0, scale, 1, &character.to_string());
        (0..GLYPH * scale).all(|row| {
            (0..GLYPH * scale).all(|dot| {
                let there =
                    canvas.pixels()[(y + row) * canvas.width() + x + column * GLYPH * scale + dot] == color;
                there == (expected.pixels()[row * GLYPH * scale + dot] == 1)
            })
        })
    };
    (0..characters)
        .map(|column| (' '..='~').find(|&character| drawn(column, character)).unwrap_or('\u{fffd}'))
        .collect()
}

#[test]
fn figures_are_legible_on_the_canvas() {
    let mut canvas = canvas(1024, 768);
    draw_figures(&mut canvas, &figures());
    let (scale, at) = (2, 2 * MARGIN * 2);
    let line =
        |index: usize, characters| read(&canvas, at, at + index * LINE * scale, scale, characters, WHITE);
    assert_eq!(line(0, 18), "31.2 FPS  32.1 ms ");
    assert_eq!(line(1, 21), "1024 x 768, 4 samples");
    assert_eq!(line(2, 20), "2 workers, 4 threads");
    assert_eq!(line(3, 19), "1,234,567 triangles");
    assert_eq!(line(4, 15), "latency 64.2 ms");
    assert_eq!(line(5, 16), "next frame: 42 %");
}

#[test]
fn the_range_of_the_rate_and_the_build_have_lines() {
    let lines = Figures { fps_range: Some((20.0, 40.0)), ..figures() }.lines();
    assert_eq!(lines[1], "20.0 to 40.0 FPS");
    let build = &lines[lines.len() - 2];
    assert!(build.contains(env!("CARGO_PKG_VERSION")) && build.contains(simd_level()), "{build}");
    let resting = Figures { fps: None, fps_range: Some((20.0, 40.0)), ..figures() }.lines();
    assert!(!resting.iter().any(|line| line.contains("40.0")), "{resting:?}");
}

#[test]
fn a_fault_of_the_scene_is_legible_at_the_lower_edge() {
    let mut canvas = canvas(640, 480);
    let overlay = Overlay { fault: Some("room.toml:3:1: unknown key".to_owned()), ..Overlay::default() };
    overlay.draw(&mut canvas);
    let drawn = |y: usize| canvas.pixels()[y * 640..(y + 1) * 640].contains(&WHITE);
    assert!((440..480).any(drawn) && !(0..400).any(drawn), "the picture above remains visible");
    let mut small = Canvas::default();
    small.resize(40, 30);
    Overlay { fault: Some("long ".repeat(500)), ..Overlay::default() }.draw(&mut small);
}

#[test]
fn the_quality_controller_and_every_reduced_knob_have_a_line() {
    let reductions = ["scale 1/2", "no shadows"];
    let quality = vec!["moving: loses FLIP 0.050".to_owned()];
    let lines =
        Figures { quality: quality.clone(), reductions: reductions.map(Into::into).to_vec(), ..figures() }
            .lines();
    let expected =
        [&figures().lines()[..2], &quality, &reductions.map(str::to_owned), &figures().lines()[2..]].concat();
    assert_eq!(lines, expected);
}

#[test]
fn a_picture_in_passes_has_its_samples_its_error_and_the_time_left() {
    let film = FilmProgress {
        samples: 16,
        of: 64,
        error: Some(0.042),
        target_error: None,
        left: Some(Duration::from_secs(12)),
        is_denoised: false,
    };
    let lines = Figures { film: Some(film), ..figures() }.lines();
    assert_eq!(lines[1..4], ["1024 x 768", "16 of 64 samples, error 4.2 %", "12 s left"]);
    let complete = FilmProgress { samples: 64, left: Some(Duration::ZERO), ..film };
    let lines = Figures { film: Some(complete), ..figures() }.lines();
    assert_eq!(lines[2..4], ["64 of 64 samples, error 4.2 %", "2 workers, 4 threads"]);
    let denoised = FilmProgress { is_denoised: true, ..film };
    let lines = Figures { film: Some(denoised), ..figures() }.lines();
    assert_eq!(lines[2], "16 of 64 samples, error 4.2 %, denoised");
}

#[test]
fn at_rest_the_time_of_the_last_frame_replaces_the_rate() {
    assert_eq!(Figures { fps: None, ..figures() }.speed(), "at rest  32.1 ms");
    assert_eq!(figures().speed(), "31.2 FPS  32.1 ms");
}

#[test]
fn the_message_about_a_kicked_worker_says_how_to_bring_it_back() {
    let kicked = [kicked("local-1")];
    let reachable = Reachable::of(([127, 0, 0, 1], 7117).into());
    let message = waiting_for_workers(&reachable, 1, Some("local worker 1 has left in order"), &kicked);
    let expected = [
        "Waiting for a worker: local worker 1 has left in order.",
        "Kicked: local-1",
        "",
        "B: bring back",
        "",
        "To start one on this machine:",
        "rayfarm-worker --master 127.0.0.1:7117",
    ];
    assert_eq!(message, expected);
    assert!(KEYS.iter().any(|(key, _)| *key == "B"));
}

/// Contrast of two colours (WCAG 2.1): from 1 to 21.
fn contrast(a: u32, b: u32) -> f64 {
    let luminance = |color: u32| {
        let channels = [16, 8, 0].map(|shift| rayfarm_tracer::srgb::decode((color >> shift) as u8));
        0.2126 * channels[0] + 0.7152 * channels[1] + 0.0722 * channels[2]
    };
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

/// The dots of letters are all pixels that are neither of the picture nor of a panel.
#[test]
fn text_is_legible_on_any_picture_and_below_messages() {
    use rayfarm_farm::accounting::Fading;
    use rayfarm_farm::{FarmStatus, WorkerState, WorkerStatus};
    let worker = |id, state| WorkerStatus {
        id,
        name: format!("mill-{id}"),
        address: ([127, 0, 0, 1], 9).into(),
        threads: 2,
        segments_done: 7,
        speed: 12_345.6,
        state,
        local: false,
        last_failure: None,
    };
    let workers = vec![worker(1, WorkerState::Paused), worker(2, WorkerState::Working)];
    let status = FarmStatus { workers, banned: vec![kicked("barn")], ..FarmStatus::default() };
    let accounts = AccountPanel::new((1024, 768), &status, &Fading::default(), Some(1));
    for message in [None, Some(all_paused())] {
        let overlay = Overlay {
            figures: Some(figures()),
            accounts: Some(accounts.clone()),
            message,
            ..Overlay::default()
        };
        for picture in [0x00ff_ffff, 0x0080_8080, 0, 0x00ff_ff00] {
            let mut canvas = canvas(1024, 768);
            canvas.fill(picture);
            overlay.draw(&mut canvas);
            // Panels darken to a quarter, once or twice; all other pixels are of letters.
            let quarter = |color: u32| color >> 2 & 0x003f_3f3f;
            let grounds = [picture, quarter(picture), quarter(quarter(picture))];
            let letters: std::collections::BTreeSet<u32> =
                canvas.pixels().iter().copied().filter(|color| !grounds.contains(color)).collect();
            let expected: Vec<u32> = [SOFT, WHITE].into_iter().filter(|c| !grounds.contains(c)).collect();
            assert_eq!(letters.iter().copied().collect::<Vec<_>>(), expected, "on {picture:06x}");
            for letter in letters {
                for ground in &grounds[1..] {
                    let contrast = contrast(letter, *ground);
                    assert!(contrast >= 4.5, "{letter:06x} on {ground:06x}: {contrast:.1}");
                }
            }
        }
    }
}

#[test]
fn every_window_size_can_be_drawn_on() {
    let message = waiting_for_workers(
        &Reachable::of(([127, 0, 0, 1], 7117).into()),
        1,
        Some("it ended, 5 times in a row"),
        &[],
    );
    for width in [0, 1, 2, 7, 16, 40, 100, 333, 1024, 5000] {
        for height in [0, 1, 2, 9, 30, 90, 240, 2200] {
            let mut canvas = canvas(width, height);
            draw_figures(&mut canvas, &figures());
            draw_help(&mut canvas);
            Overlay { message: Some(message.clone()), ..Overlay::default() }.draw(&mut canvas);
            assert_eq!(canvas.pixels().len(), width * height);
        }
    }
}

#[test]
fn the_list_of_keys_is_on_a_dark_panel() {
    let mut canvas = canvas(640, 480);
    canvas.fill(0x00ff_ffff);
    draw_help(&mut canvas);
    // The panel in the middle: every line of keys and its margins.
    let columns = 9 + KEYS.iter().map(|(_, what)| what.len()).max().unwrap();
    let (width, height) = (columns * GLYPH + 2 * MARGIN, KEYS.len() * LINE + 2 * MARGIN - (LINE - GLYPH));
    let (left, top) = ((640 - width) / 2, (480 - height) / 2);
    for (row, pixels) in canvas.pixels().chunks(640).enumerate() {
        for (column, &pixel) in pixels.iter().enumerate() {
            let inside = (left..left + width).contains(&column) && (top..top + height).contains(&row);
            let expected: &[u32] = if inside { &[WHITE, 0x003f_3f3f] } else { &[0x00ff_ffff] };
            assert!(expected.contains(&pixel), "{pixel:06x} at {column}, {row}");
        }
    }
    let first = read(&canvas, left + MARGIN, top + MARGIN, 1, 13, WHITE);
    assert_eq!(first, "W A S D  move");
}

#[test]
fn text_grows_with_the_window_as_long_as_it_fits() {
    let scale = |width, height| Panel::fit(&canvas(width, height), &figures().lines()).scale;
    assert_eq!([scale(640, 480), scale(1024, 768), scale(3840, 2160)], [1, 2, 4]);
    assert_eq!(scale(230, 2160), 1, "a narrow window has small text");
}

#[test]
fn long_lines_are_broken_at_spaces_and_long_words_are_cut() {
    assert_eq!(broken("to start one here", 8), ["to start", "one here"]);
    assert_eq!(broken("--master 127.0.0.1:7117", 9), ["--master", "127.0.0.1", ":7117"]);
    assert_eq!(broken("", 5), [""]);
    assert_eq!(broken("ab", 1), ["a", "b"]);
}

#[test]
fn the_waiting_message_says_how_to_start_a_worker() {
    let local = waiting_for_workers(&Reachable::of(([127, 0, 0, 1], 7117).into()), 0, None, &[]);
    assert_eq!(
        local,
        [
            "Waiting for a worker.",
            "",
            "To start one on this machine:",
            "rayfarm-worker --master 127.0.0.1:7117"
        ]
    );
    let elsewhere = waiting_for_workers(&Reachable::of(([192, 0, 2, 7], 9).into()), 2, None, &[]);
    assert_eq!(elsewhere[2], "To start one on any machine:");
    assert_eq!(elsewhere[3], "rayfarm-worker --master 192.0.2.7:9");
}

fn kicked(name: &str) -> rayfarm_farm::BannedWorker {
    rayfarm_farm::BannedWorker { id: 1, name: name.to_owned(), address: None }
}
