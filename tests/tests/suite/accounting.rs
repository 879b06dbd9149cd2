//! Tests of the accounting of time: percentages that sum to 100, and a timeline in the format of trace viewers.

use std::collections::BTreeMap;

use rayfarm_tests::{Running, Scenes, master, wait_until};
use serde_json::Value;

const PARTS: [&str; 7] = ["trace", "wait", "encode", "send", "decode", "idle_tail", "scene"];

fn render(scenes: &Scenes, args: &str) -> Running {
    let mut command = master();
    let args = format!("render small.toml --listen 127.0.0.1:0 {args}");
    Running::start(command.args(args.split_whitespace()).current_dir(scenes.path("")))
}

/// Whether these are the percentages of all parts, and sum to 100.
fn sums_to_a_hundred(percent: &[f64]) -> bool {
    percent.len() == PARTS.len()
        && percent.iter().all(|part| (0.0..=100.0).contains(part))
        && (percent.iter().sum::<f64>() - 100.0).abs() < 0.01
}

fn percent(account: &Value) -> Vec<f64> {
    PARTS.iter().map(|part| account["percent"][part].as_f64().unwrap()).collect()
}

#[test]
fn the_parts_of_each_workers_time_sum_to_100_percent() {
    let scenes = Scenes::new();
    let args =
        "-o f-%02d.ppm --frames 20 --local-workers 2 --threads 1 --json --fps-log log.csv --size 320x240";
    let outcome = render(&scenes, args).finish().expect_success();
    let report: Value = serde_json::from_str(&outcome.stdout).unwrap();
    let accounting = &report["accounting"];
    let workers = accounting["workers"].as_array().unwrap();
    assert_eq!(workers.len(), 2);
    for account in workers.iter().chain([accounting]) {
        assert!(sums_to_a_hundred(&percent(account)), "{accounting}");
    }
    assert!(percent(accounting)[0] > 0.0, "the workers have traced: {accounting}");
    let of_all = |field: &str| workers.iter().map(|worker| worker[field].as_u64().unwrap()).sum::<u64>();
    assert!(of_all("rows") >= 20 * 240, "{accounting}");
    assert!(of_all("pixel_bytes") > 0 && of_all("segments") >= 20, "{accounting}");

    let log = String::from_utf8(scenes.read("log.csv")).unwrap();
    let header: Vec<&str> = log.lines().next().unwrap().split(',').collect();
    assert_eq!(header[11..18], PARTS.map(|part| format!("{part}_percent")));
    let mut timed = 0;
    for line in log.lines().skip(1) {
        let columns: Vec<f64> =
            line.split(',').skip(11).take(7).map(|column| column.parse().unwrap()).collect();
        // A frame that is complete at the same time as its predecessor has no time of its own.
        let took_nothing = columns.iter().all(|part| *part == 0.0);
        assert!(sums_to_a_hundred(&columns) || took_nothing, "{line}");
        timed += usize::from(!took_nothing);
    }
    assert!(timed > 0, "{log}");
}

/// Returns the complete events of each track as begin and end in nanoseconds and category.
fn tracks(events: &[Value]) -> BTreeMap<u64, Vec<(i64, i64, String)>> {
    let mut tracks: BTreeMap<u64, Vec<(i64, i64, String)>> = BTreeMap::new();
    for event in events.iter().filter(|event| event["ph"] == "X") {
        let ns = |field: &str| (event[field].as_f64().unwrap() * 1e3).round() as i64;
        let kind = event["cat"].as_str().unwrap().to_owned();
        assert!(ns("dur") >= 0 && event["pid"] == 1, "{event}");
        tracks.entry(event["tid"].as_u64().unwrap()).or_default().push((
            ns("ts"),
            ns("ts") + ns("dur"),
            kind,
        ));
    }
    tracks
}

/// Checks that events of a track are disjoint or nested.
fn assert_nested(events: &[(i64, i64, String)]) {
    let mut events = events.to_vec();
    events.sort_by_key(|(from, to, kind)| (*from, -to, kind == "part"));
    let mut open: Vec<i64> = Vec::new();
    for (from, to, kind) in &events {
        while open.last().is_some_and(|end| end <= from) {
            open.pop();
        }
        assert!(
            open.last().is_none_or(|end| to <= end),
            "{kind} from {from} to {to} overlaps the event that contains its beginning"
        );
        open.push(*to);
    }
}

#[test]
fn a_timeline_has_a_track_per_worker_and_its_events_nest() {
    let scenes = Scenes::new();
    let args = "-o f-%02d.ppm --frames 12 --local-workers 2 --threads 1 --trace trace.json --size 320x240";
    render(&scenes, args).finish().expect_success();
    let events: Vec<Value> = serde_json::from_slice(&scenes.read("trace.json")).unwrap();
    let tracks = tracks(&events);
    let frames = tracks[&0].iter().filter(|(_, _, kind)| kind == "frame").count();
    assert_eq!((tracks.len(), frames), (3, 12));
    tracks.values().for_each(|events| assert_nested(events));
    let segments = tracks[&1].iter().filter(|(_, _, kind)| kind == "segment").count();
    assert!(segments > 0 && tracks[&1].iter().any(|(_, _, kind)| kind == "part"));
    let named = |event: &&Value| event["name"] == "thread_name";
    assert_eq!(events.iter().filter(named).count(), 3);
}

#[test]
fn the_timeline_of_an_interrupted_run_is_complete() {
    for signal in ["INT", "TERM"] {
        let scenes = Scenes::new();
        let master = render(&scenes, "-o f-%07d.ppm --frames 1000000 --trace trace.json --size 32x24");
        // The file does not exist at first, and may be incomplete at any time.
        let written = || std::fs::read(scenes.path("trace.json")).unwrap_or_default();
        let events = || serde_json::from_slice::<Vec<Value>>(&written()).unwrap_or_default();
        wait_until("the timeline has a frame", || events().iter().any(|event| event["cat"] == "frame"));
        master.signal(signal);
        master.finish();
        let events: Vec<Value> = serde_json::from_slice(&scenes.read("trace.json")).unwrap();
        tracks(&events).values().for_each(|events| assert_nested(events));
    }
}

#[test]
fn a_timeline_that_cannot_be_written_is_refused_before_rendering() {
    let scenes = Scenes::new();
    render(&scenes, "-o a.ppm --trace missing/trace.json")
        .finish()
        .expect_failure(2, &["missing/trace.json"]);
    assert!(!scenes.names().contains(&"a.ppm".to_owned()));
}
