use std::net::SocketAddr;

use rayfarm_farm::SegmentPolicy;
use rayfarm_tracer::scene::knobs::KNOBS;
use rayfarm_tracer::scene::{
    ColorDepth, ExponentPrecision, Filter, FrameView, Integrator, PathSettings, Quality, RenderScale,
    Sampler, Setting, Shading, ToneCurve, Up,
};

use super::*;

fn parse(line: &str) -> Result<Invocation, clap::Error> {
    Invocation::parse(line.split_whitespace().map(OsString::from))
}

fn command(line: &str) -> Command {
    match parse(line) {
        Ok(Invocation::Command(command, _)) => *command,
        other => panic!("{line}: {other:?}"),
    }
}

fn view(line: &str) -> ViewArgs {
    match command(line) {
        Command::View(view) => view,
        other => panic!("{line}: {other:?}"),
    }
}

fn render(line: &str) -> RenderArgs {
    match command(line) {
        Command::Render(render) => render,
        other => panic!("{line}: {other:?}"),
    }
}

fn refused(line: &str) -> String {
    match parse(line) {
        Err(error) => {
            assert_eq!(error.exit_code(), 2, "{line}");
            error.to_string()
        }
        Ok(invocation) => panic!("{line} was taken as {invocation:?}"),
    }
}

/// Samples per pixel of a command line, over a scene with the largest number.
fn samples(quality: &QualityArgs) -> u32 {
    quality.over(Setting::FULL).samples
}

#[test]
fn view_is_the_default_command() {
    assert_eq!(view("rayfarm-master").scene, None);
    for line in ["rayfarm-master a.toml", "rayfarm-master view a.toml"] {
        assert_eq!(view(line).scene, Some("a.toml".into()), "{line}");
    }
    assert_eq!(view("rayfarm-master --size 64x48 a.toml").picture.size, Some(Size { width: 64, height: 48 }));
}

#[test]
fn defaults_are_as_documented() {
    let args = render("rayfarm-master render a.toml -o b.png");
    assert_eq!((args.scene, args.output), ("a.toml".into(), "b.png".into()));
    assert_eq!((args.frames, args.json, args.fps_log), (None, false, None));
    assert_eq!((args.farm.listen, args.farm.local_workers(), args.farm.threads), (None, 1, None));
    assert_eq!(args.farm.segment, SegmentPolicy::Adaptive);
    assert_eq!(args.picture.size, None);
    assert_eq!(args.picture.quality.over(Setting::FULL), Setting::FULL);
    assert_eq!((args.picture.orbit, args.picture.spin), (0.0, 0.0));
    assert_eq!(view("rayfarm-master").frames, None);
}

#[test]
fn every_common_option_is_parsed() {
    let args = render(
        "rayfarm-master render --listen 0.0.0.0:7117 --local-workers 3 --threads 2 --size 1024x768 --samples 9 \
         --segment smart:24 --frames 100 --orbit -90.5 --spin 2 --fps-log log.csv --json -o f%04d.ppm a.obj",
    );
    assert_eq!(args.farm.listen, Some(SocketAddr::from(([0, 0, 0, 0], 7117))));
    assert_eq!((args.farm.local_workers(), args.farm.threads), (3, Some(2)));
    assert_eq!(args.farm.segment, SegmentPolicy::Smart(24));
    assert_eq!(args.picture.size, Some(Size { width: 1024, height: 768 }));
    assert_eq!(samples(&args.picture.quality), 9);
    assert_eq!((args.picture.orbit, args.picture.spin), (-90.5, 2.0));
    assert_eq!((args.frames, args.fps_log, args.json), (Some(100), Some("log.csv".into()), true));
}

#[test]
fn every_command_that_reads_a_scene_has_the_options_of_models() {
    let options = "--up z --crease-angle 25.5 --allow-parent-textures";
    let all = [
        view(&format!("rayfarm-master {options} a.obj")).models,
        render(&format!("rayfarm-master render {options} a.obj -o b.png")).models,
        match command(&format!("rayfarm-master compile {options} a.obj -o b.rfm")) {
            Command::Compile(args) => args.models,
            other => panic!("{other:?}"),
        },
        match command(&format!("rayfarm-master bench {options} a.obj")) {
            Command::Bench(args) => args.models,
            other => panic!("{other:?}"),
        },
        match command(&format!("rayfarm-master explain {options} a.obj")) {
            Command::Explain(args) => args.models,
            other => panic!("{other:?}"),
        },
        match command(&format!("rayfarm-master check-numerics {options} a.obj")) {
            Command::CheckNumerics(args) => args.models,
            other => panic!("{other:?}"),
        },
        match command(&format!("rayfarm-master tradeoff {options} a.obj")) {
            Command::Tradeoff(args) => args.models,
            other => panic!("{other:?}"),
        },
    ];
    for models in all {
        let options = models.load_options(Some(Size { width: 3, height: 4 }));
        assert_eq!((options.up, options.crease_angle, options.size), (Some(Up::Z), Some(25.5), Some((3, 4))));
        assert!(options.allow_parent_textures);
    }
    assert!(!view("rayfarm-master a.obj").models.load_options(None).allow_parent_textures);
    assert!(refused("rayfarm-master --up x a.obj").contains("y, z"));
    assert!(refused("rayfarm-master --crease-angle 181 a.obj").contains("180"));
}

#[test]
fn the_other_commands_are_parsed() {
    match command("rayfarm-master compile bust.obj -o bust.rfm") {
        Command::Compile(args) => {
            assert_eq!((args.model, args.output), ("bust.obj".into(), "bust.rfm".into()));
        }
        other => panic!("{other:?}"),
    }
    match command("rayfarm-master bench a.toml --threads 1 --frames 5 --samples 4 --json") {
        Command::Bench(args) => {
            assert_eq!((args.threads, args.frames, args.json), (Some(1), 5, true));
            assert_eq!(samples(&args.picture.quality), 4);
        }
        other => panic!("{other:?}"),
    }
    match command("rayfarm-master explain a.toml --size 64x48 --samples 4 --json") {
        Command::Explain(args) => {
            assert_eq!((args.scene, args.json), ("a.toml".into(), true));
            assert_eq!(samples(&args.quality), 4);
            assert_eq!(args.size, Some(Size { width: 64, height: 48 }));
        }
        other => panic!("{other:?}"),
    }
    for (line, scene, rays) in [
        ("rayfarm-master check-numerics", None, None),
        ("rayfarm-master check-numerics a.obj --rays 10000000", Some("a.obj".into()), Some(10_000_000)),
    ] {
        match command(line) {
            Command::CheckNumerics(args) => {
                assert_eq!((args.scene, args.rays, args.ray, args.json), (scene, rays, None, false));
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn the_last_of_two_equal_options_counts() {
    assert_eq!(render("rayfarm-master render a.toml -o b.png --frames 2 --frames 3").frames, Some(3));
    assert_eq!(samples(&view("rayfarm-master --samples 4 --samples 9").picture.quality), 9);
}

#[test]
fn no_local_workers_means_zero() {
    assert_eq!(view("rayfarm-master --no-local-workers").farm.local_workers(), 0);
    assert_eq!(view("rayfarm-master --local-workers 0").farm.local_workers(), 0);
}

#[test]
fn the_local_worker_gets_its_arguments_untouched() {
    match parse("rayfarm-master local-worker --master 127.0.0.1:1 --help") {
        Ok(Invocation::LocalWorker(args)) => {
            assert_eq!(args, [LOCAL_WORKER, "--master", "127.0.0.1:1", "--help"])
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn wrong_use_is_status_2_and_says_what_was_expected() {
    for (line, hint) in [
        ("rayfarm-master --size 0x5", "1024x768"),
        ("rayfarm-master --size 800", "1024x768"),
        ("rayfarm-master --size 800x", "1024x768"),
        ("rayfarm-master --size 16385x1", "16384"),
        ("rayfarm-master --samples 0", "expected a whole number from 1 to 65536"),
        ("rayfarm-master --samples 65537", "expected a whole number from 1 to 65536"),
        ("rayfarm-master --samples 4294967296", "expected a whole number from 1 to 65536"),
        ("rayfarm-master --integrator paths", "possible values: direct, path"),
        ("rayfarm-master --tone filmic", "possible values: srgb, agx, aces, neutral"),
        ("rayfarm-master --seed 4294967296", "--seed"),
        ("rayfarm-master --max-noise 1.5", "from 0 to 1"),
        ("rayfarm-master --max-noise nan", "from 0 to 1"),
        ("rayfarm-master --exposure 65", "expected stops from -64 to 64"),
        ("rayfarm-master --aperture=-1", "expected a radius from 0"),
        ("rayfarm-master --focus-distance 0", "expected a distance above 0"),
        ("rayfarm-master --frames 0", "from 1"),
        ("rayfarm-master --threads 0", "from 1"),
        ("rayfarm-master --local-workers -1", "-1"),
        ("rayfarm-master --local-workers 2 --no-local-workers", "cannot be used with"),
        ("rayfarm-master --listen 7117", "0.0.0.0:7117"),
        ("rayfarm-master --listen example.org:7117", "0.0.0.0:7117"),
        ("rayfarm-master --segment static", "static:ROWS"),
        ("rayfarm-master --segment smart:0", "smart:ROWS"),
        ("rayfarm-master --orbit nan", "degrees"),
        ("rayfarm-master --spin inf", "degrees"),
        ("rayfarm-master --colour", "--colour"),
        ("rayfarm-master a.toml b.toml", "b.toml"),
        ("rayfarm-master render a.toml", "--output"),
        ("rayfarm-master render -o b.png", "<SCENE>"),
        ("rayfarm-master compile a.obj", "--output"),
        ("rayfarm-master bench", "<SCENE>"),
        ("rayfarm-master explain", "<SCENE>"),
        ("rayfarm-master check-numerics --rays 0", "from 1"),
        ("rayfarm-master check-numerics --ray=-1", "--ray"),
        ("rayfarm-master check-numerics --ray 1 --json", "cannot be used with"),
        ("rayfarm-master view --json", "--json"),
        ("rayfarm-master -v -q", "cannot be used with"),
        ("rayfarm-master --size 5x5 render a.toml -o b.png", "--size <WxH> precedes render"),
        ("rayfarm-master a.toml render b.toml -o b.png", "[SCENE] precedes render"),
    ] {
        let message = refused(line);
        assert!(message.contains(hint), "{line}: {message}");
    }
}

#[test]
fn log_options_precede_or_follow_the_command() {
    for line in
        ["rayfarm-master render a.toml -o b.png -v", "rayfarm-master -v a.toml", "rayfarm-master view -v"]
    {
        match parse(line) {
            Ok(Invocation::Command(_, log)) => assert!(log.verbose && !log.quiet, "{line}"),
            other => panic!("{line}: {other:?}"),
        }
    }
}

#[test]
fn help_and_version_are_no_errors() {
    for line in ["rayfarm-master --help", "rayfarm-master render --help", "rayfarm-master --version"] {
        assert_eq!(parse(line).unwrap_err().exit_code(), 0, "{line}");
    }
}

#[test]
fn clap_accepts_the_definition() {
    Cli::command().debug_assert();
}

#[test]
fn a_run_has_a_timeline_and_control() {
    let observability =
        render("rayfarm-master render a.toml -o a.png --trace t.json --control -").observability;
    assert_eq!(observability.timeline, Some("t.json".into()));
    assert_eq!(view("rayfarm-master --timeline t.json").observability.timeline, Some("t.json".into()));
    assert_eq!(observability.control, Some(Place::StandardInput));
    assert!(view("rayfarm-master --control 127.0.0.1:7118").observability.control.is_some());
    assert!(refused("rayfarm-master --control 0.0.0.0:7118").contains("127.0.0.1:7118"));
}

#[test]
fn knobs_are_parsed_and_override_the_scene() {
    let all = "--samples 9 --adaptive --shadows off --shading diffuse --filter nearest --exponent fast --colors reduced --scale 3/4 \
               --dither --max-depth 7 --min-contribution 0.02 --shadow-samples 5 --smooth-terminator off";
    let integrator = Integrator::Direct;
    let full = Setting { integrator, samples: 4, scale: RenderScale::Full, quality: Quality::default() };
    let reduced = Setting {
        integrator,
        samples: 9,
        scale: RenderScale::ThreeQuarters,
        quality: Quality {
            adaptive: true,
            shadows: false,
            shading: Shading::Diffuse,
            filter: Some(Filter::Nearest),
            exponent: ExponentPrecision::Fast,
            colors: ColorDepth::Reduced,
            dither: true,
            max_depth: 7,
            min_contribution: 0.02,
            shadow_samples: 5,
            smooth_terminator: false,
        },
    };
    let args = render(&format!("rayfarm-master render a.toml -o b.png {all}")).picture.quality;
    assert_eq!(args.over(full), reduced);
    assert!(args.selects("adaptive", "on") && !args.selects("adaptive", "off"));
    let none = view("rayfarm-master a.toml").picture.quality;
    assert_eq!(none.over(reduced), reduced);
    let back = "--samples 04 --adaptive=off --shadows on --shading full --filter bilinear --exponent exact --colors exact --scale 1 \
                --dither=off --max-depth 05 --min-contribution 4e-3 --shadow-samples 16 --smooth-terminator on";
    let back = view(&format!("rayfarm-master {back} a.toml")).picture.quality;
    let bilinear = Quality { filter: Some(Filter::Bilinear), ..full.quality };
    assert_eq!(back.over(reduced), Setting { quality: bilinear, ..full });
    let half = view("rayfarm-master --scale 0.5 a.toml").picture.quality;
    assert_eq!(half.over(full).scale, RenderScale::Half);
    for command in ["bench", "explain"] {
        parse(&format!("rayfarm-master {command} a.toml {all}")).unwrap();
    }
    for (wrong, known) in [
        ("--shadows", "a value is required"),
        ("--shadows yes", "on, off"),
        ("--adaptive=yes", "on, off"),
        ("--scale 0.6", "1, 3/4"),
        ("--colors 565", "reduced"),
        ("--max-depth 65", "expected a whole number from 0 to 64"),
        ("--max-depth 1.0", "expected a whole number from 0 to 64"),
        ("--max-depth=-1", "expected a whole number from 0 to 64"),
        ("--min-contribution 1.01", "expected a number from 0 to 1"),
        ("--min-contribution nan", "expected a number from 0 to 1"),
        ("--shadow-samples 0", "expected a whole number from 1 to 1024"),
        ("--shadow-samples 1025", "expected a whole number from 1 to 1024"),
        ("--smooth-terminator", "a value is required"),
        ("--sampler random", "sobol, independent"),
        ("--roulette", "a value is required"),
        ("--clamp-indirect=-1", "expected a number from 0 to 1000000"),
        ("--shading normal", "diffuse, normals, depth, item, albedo"),
    ] {
        let message = refused(&format!("rayfarm-master bench a.toml {wrong}"));
        assert!(message.contains(known), "{message}");
    }
}

#[test]
fn options_of_light_override_the_scene() {
    let view = FrameView::default();
    let light =
        |options: &str| render(&format!("rayfarm-master render a.toml -o b.png {options}")).picture.light;
    assert_eq!(light("").over(view), view);
    let all = "--integrator path --seed 7 --max-noise 0.02 --aperture 0.5 --focus-distance 3 --exposure -1.5 --tone agx";
    let shown = light(all).over(view);
    let settings = PathSettings { seed: 7, max_noise: 0.02, ..PathSettings::DEFAULT };
    assert_eq!(shown.integrator, Integrator::Path(settings));
    assert_eq!((shown.lens.aperture, shown.lens.focus_distance), (0.5, Some(3.0)));
    assert_eq!((shown.tone.exposure, shown.tone.curve), (-1.5, ToneCurve::Agx));
    assert_eq!((shown.samples, shown.quality.max_depth), (64, 8), "the defaults of the path integrator");
    assert_eq!(shown.validate(), Ok(()));
    // Settings of the scene's own paths remain.
    let independent = PathSettings { sampler: Sampler::Independent, seed: 3, ..settings };
    let own = FrameView { samples: 10, integrator: Integrator::Path(independent), ..shown };
    assert_eq!(light("--integrator path").over(own), own);
    let back = light("--integrator direct").over(FrameView { samples: 64, ..own });
    assert_eq!((back.integrator, back.samples, back.quality.max_depth), (Integrator::Direct, 1, 5));
    let kept = FrameView { quality: Quality { max_depth: 3, ..view.quality }, samples: 9, ..view };
    let kept = light("--integrator path").over(kept);
    assert_eq!((kept.samples, kept.quality.max_depth), (9, 3));
}

#[test]
fn options_of_light_without_effect_are_named() {
    let view = FrameView::default();
    let idle = |options: &str| -> Vec<&str> {
        let picture = render(&format!("rayfarm-master render a.toml -o b.png {options}")).picture;
        let view = picture.light.over(view);
        let of_light = picture.light.idle_on(&view).into_iter().map(|(option, _)| option);
        of_light.chain(picture.quality.idle_with(&view.integrator)).collect()
    };
    let paths = "--seed 1 --max-noise 0.1 --aperture 1 --focus-distance 2 --sampler sobol --roulette off --clamp-indirect 10";
    let named = ["seed", "max-noise", "aperture", "focus-distance", "sampler", "roulette", "clamp-indirect"];
    assert_eq!(idle(paths), named);
    assert_eq!(idle(&format!("--integrator path {paths}")), [""; 0]);
    assert_eq!(idle("--integrator path --focus-distance 2"), ["focus-distance"]);
    let direct = "--adaptive --shadows off --exponent fast --min-contribution 0.1 --samples 4 --max-depth 3";
    assert_eq!(idle(direct), [""; 0]);
    let named = ["adaptive", "shadows", "min-contribution", "exponent"];
    assert_eq!(idle(&format!("--integrator path {direct}")), named);
}

#[test]
fn every_word_of_the_table_is_a_value_of_its_option() {
    for (knob, (_, integrator)) in KNOBS.iter().flat_map(|knob| Integrator::WORDS.map(|word| (knob, word))) {
        let usual = Setting { integrator, samples: 4, scale: RenderScale::Full, quality: Quality::default() };
        for word in knob.words() {
            let line = format!("rayfarm-master render a.toml -o b.png --{}={word}", knob.option);
            let found = render(&line).picture.quality.over(usual);
            assert!(knob.value(word).unwrap().is_of(&found), "{line}");
        }
    }
}

#[test]
fn every_knob_of_the_table_is_an_option_with_its_summary() {
    for name in ["view", "render", "bench", "explain"] {
        let cli = Cli::command();
        let command = cli.find_subcommand(name).unwrap();
        for knob in KNOBS {
            let option = command.get_arguments().find(|arg| arg.get_long() == Some(knob.option)).unwrap();
            let help = option.get_help().unwrap().to_string();
            assert!(knob.summary.starts_with(&help), "{name} --{}: {help}", knob.option);
        }
    }
}

#[test]
fn a_rate_and_an_error_are_numbers_in_their_range() {
    let args = view("rayfarm-master --target-fps 60 --max-error 0.05").quality_control;
    assert_eq!((args.target_fps, args.error.max_error), (Some(60.0), Some(0.05)));
    assert_eq!(render("rayfarm-master render a.toml -o b.png --max-error 0").error.max_error, Some(0.0));
    for wrong in
        ["--target-fps 0", "--target-fps fast", "--target-fps nan", "--max-error=-1", "--max-error 2"]
    {
        let message = refused(&format!("rayfarm-master {wrong}"));
        assert!(message.contains("such as"), "{message}");
    }
}

#[test]
fn the_first_display_is_the_first_one_named() {
    let kinds = |line: &str| view(line).display.kinds();
    assert_eq!(kinds("rayfarm-master view"), [DisplayKind::Window]);
    #[cfg(feature = "web")]
    {
        let (window, web) = (DisplayKind::Window, DisplayKind::Web);
        assert_eq!(kinds("rayfarm-master view --display web"), [web]);
        assert_eq!(kinds("rayfarm-master view --web 127.0.0.1:0"), [web]);
        assert_eq!(kinds("rayfarm-master view --display window --web [::1]:80"), [window, web]);
        assert_eq!(kinds("rayfarm-master view --display web,window,web --web [::1]:80"), [web, window]);
        let address = |line: &str| view(line).display.web_address().to_string();
        assert_eq!(address("rayfarm-master view --display web"), "127.0.0.1:8080");
        assert_eq!(address("rayfarm-master view --web 0.0.0.0:81"), "0.0.0.0:81");
        assert!(refused("rayfarm-master view --web localhost:80").contains("digits"));
    }
}
