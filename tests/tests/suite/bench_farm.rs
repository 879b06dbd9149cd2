//! Tests of `scripts/bench_farm.py --quick`: each experiment writes its tables and plots, and a report with links to them.

use std::path::Path;
use std::process::Command;

use rayfarm_tests::{Outcome, Running, master, project_root, require};

/// Runs the script with the programs under test. Requires Python.
fn bench_farm(folder: &Path, arguments: &[&str]) -> Option<Outcome> {
    if !require(&["python3"]) {
        return None;
    }
    let programs = Path::new(master().get_program()).parent().unwrap().to_owned();
    let mut command = Command::new("python3");
    command.arg(project_root().join("scripts/bench_farm.py")).arg("--quick").args(arguments);
    command.arg("--programs").arg(programs).arg("--out").arg(folder).env_remove("RUST_LOG");
    Some(Running::start(&mut command).finish())
}

/// Runs experiments, and checks that they write these tables and plots and a report with links to them.
fn expect_experiment(name: &str, tables: &[&str], plots: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let Some(outcome) = bench_farm(folder.path(), &["--only", name]) else { return };
    outcome.expect_success();
    let report = std::fs::read_to_string(folder.path().join("report.md")).unwrap();
    for table in tables {
        let text = std::fs::read_to_string(folder.path().join(format!("{table}.csv"))).unwrap();
        assert!(text.lines().count() > 3, "{table}: {text}");
        assert!(report.contains(&format!("({table}.csv)")), "{report}");
    }
    for plot in plots {
        let picture = rayfarm_tracer::image::load(&folder.path().join(format!("{plot}.png"))).unwrap();
        assert!(picture.pixels.iter().any(|byte| *byte < 100), "{plot} is empty");
        let svg = std::fs::read_to_string(folder.path().join(format!("{plot}.svg"))).unwrap();
        assert!(svg.contains("frames per second"), "{plot}: {svg}");
        assert!(report.contains(&format!("({plot}.png)")), "{report}");
    }
}

#[test]
fn segment_sizes() {
    expect_experiment("segment-size", &["segment-size"], &["segment-size"]);
}

#[test]
fn segment_sizes_by_workers_and_workers() {
    let plots = ["segment-size-static", "segment-size-smart", "workers"];
    expect_experiment("segment-size-by-workers,workers", &["segment-size-by-workers", "workers"], &plots);
}

#[test]
fn threads() {
    expect_experiment("threads", &["threads"], &["threads"]);
}

#[test]
fn tree_qualities() {
    let tables = ["tree-quality", "tree-quality-frames"];
    expect_experiment("tree-quality", &tables, &["tree-quality-frames"]);
}

#[test]
fn simulated_workers() {
    let tables = ["simulated-bust", "simulated-corner-efficiency", "simulated-corner-all"];
    expect_experiment("simulated", &tables, &["simulated-bust", "simulated-corner"]);
}

#[test]
fn a_dry_run_writes_nothing_and_an_unknown_name_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let Some(outcome) = bench_farm(folder.path(), &["--dry-run"]) else { return };
    assert!(outcome.expect_success().stdout.lines().count() > 20);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    let refused = bench_farm(folder.path(), &["--only", "everything"]).unwrap();
    refused.expect_failure(2, &["everything", "segment-size"]);
}
