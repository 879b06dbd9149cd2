//! Tests of `tradeoff`: its folder, its report, and no table after an interrupted run.

use rayfarm_tests::{Outcome, Running, Scenes, master};
use rayfarm_tracer::image::{compare, load};

fn start(scenes: &Scenes, args: &str) -> Running {
    let mut command = master();
    command.args(args.split_whitespace()).current_dir(scenes.path("")).env_remove("RUST_LOG");
    Running::start(&mut command)
}

fn run(scenes: &Scenes, args: &str) -> Outcome {
    start(scenes, args).finish()
}

#[test]
fn tradeoff_writes_table_page_plot_and_pictures_and_reads_the_table() {
    let scenes = Scenes::new();
    let outcome = run(&scenes, "tradeoff small.toml -o out --size 32x24 --repeats 2 --threads 2 --json")
        .expect_success();
    let report: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(
        (&report["width"], &report["threads"], &report["repeats"]),
        (&32.into(), &2.into(), &2.into())
    );
    assert_eq!(report["reference_check"]["above_one_step"], 0, "{report}");

    let page = String::from_utf8(scenes.read("out/tradeoff.md")).unwrap();
    let svg = String::from_utf8(scenes.read("out/front.svg")).unwrap();
    let plot = load(&scenes.path("out/front.png")).unwrap();
    assert!(plot.pixels.iter().any(|byte| *byte < 100), "the plot is empty");
    let reference = load(&scenes.path("out/reference.png")).unwrap();
    let rows = report["rows"].as_array().unwrap();
    for row in rows {
        let name = row["setting"].as_str().unwrap();
        assert!(page.contains(&format!("[{name}]({name}.png)")) && svg.contains(name), "{name}");
        let picture = load(&scenes.path(&format!("out/{name}.png"))).unwrap();
        let found = compare(&reference, &picture).unwrap();
        assert_eq!(row["max_error"], found.max, "{name}");
        assert!((row["rmse"].as_f64().unwrap() - found.rmse).abs() < 1e-3, "{name}");
        let errors = load(&scenes.path(&format!("out/{name}-flip.png"))).unwrap();
        assert_eq!((errors.width, errors.height), (32, 24));
        assert!(row["min_ms"].as_f64() > Some(0.0) && row["min_ms"].as_f64() <= row["median_ms"].as_f64());
    }
    let flip = |name: &str| rows.iter().find(|row| row["setting"] == name).unwrap()["flip"].as_f64().unwrap();
    assert!(flip("samples-16") < flip("samples-4") && flip("samples-4") < flip("samples-1"), "{report}");

    let saved = run(&scenes, "tradeoff --saved out/tradeoff.csv --json").expect_success();
    let saved: serde_json::Value = serde_json::from_str(&saved.stdout).unwrap();
    assert_eq!(saved["rows"], report["rows"]);
    let text = run(&scenes, "tradeoff --saved out/tradeoff.csv").expect_success();
    assert!(
        report["front"].as_array().unwrap().iter().all(|name| text.stdout.contains(name.as_str().unwrap()))
    );
}

#[test]
fn a_wrong_command_line_writes_nothing() {
    let scenes = Scenes::new();
    scenes.write("file", "");
    let before = scenes.names();
    for (args, word) in [
        ("tradeoff", "SCENE"),
        ("tradeoff nowhere.toml", "nowhere.toml"),
        ("tradeoff small.toml -o file", "file"),
        ("tradeoff small.toml --repeats 0", "1000"),
        ("tradeoff --saved small.toml", "small.toml"),
        ("tradeoff small.toml --saved file", "--saved"),
    ] {
        run(&scenes, args).expect_failure(2, &[word]);
    }
    assert_eq!(scenes.names(), before);
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_writes_no_table() {
    let scenes = Scenes::new();
    let mut running = start(&scenes, "tradeoff small.toml -o out --size 1600x1200 --repeats 1000");
    running.wait_for("256");
    running.signal("INT");
    running.finish().expect_failure(1, &[]);
    let left: Vec<_> =
        std::fs::read_dir(scenes.path("out")).unwrap().map(|file| file.unwrap().file_name()).collect();
    assert!(left.iter().all(|name| name == "reference.png"), "{left:?}");
}
