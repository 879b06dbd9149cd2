//! Time of a frame by stage, on one thread.
//!
//! Prints a line per scene, sample count and stage, separated by tabs: names, samples, milliseconds. The stage
//! `whole` is the same frame without a clock: the overhead of the clock is the sum of the other stages minus `whole`.
//! All times are medians, with the two kinds of frames in turn. `--frames N` sets their number; names of scenes
//! select these.

mod common;

use std::time::{Duration, Instant};

use rayfarm_tracer::scene::FrameView;
use rayfarm_tracer::{PreparedFrame, Stage, Watch, render_rows, render_rows_watched};

fn main() {
    let (frames, names) = arguments();
    println!("scene\tsamples\tstage\tms");
    for workload in common::workloads() {
        if !names.is_empty() && !names.contains(&workload.name) {
            continue;
        }
        let (scene, view) = workload.load();
        for samples in [1, 4] {
            let frame = common::prepare(&scene, &FrameView { samples, ..view });
            for (stage, ms) in median_times(&frame, frames) {
                println!("{}\t{samples}\t{stage}\t{ms:.3}", workload.name);
            }
        }
    }
}

/// The number of frames and the names of scenes. Cargo adds `--bench`.
fn arguments() -> (usize, Vec<String>) {
    let mut frames = 15;
    let mut names = Vec::new();
    let mut given = std::env::args().skip(1).filter(|argument| argument != "--bench");
    while let Some(argument) = given.next() {
        if argument == "--frames" {
            let Some(count) = given.next().and_then(|count| count.parse().ok()).filter(|&count| count > 0)
            else {
                eprintln!("--frames: a number from 1 is expected");
                std::process::exit(2);
            };
            frames = count;
        } else {
            names.push(argument);
        }
    }
    (frames, names)
}

/// Accumulated time of each stage. The clock is read at every stage change.
struct Clock {
    times: [Duration; Stage::ALL.len()],
    stage: Stage,
    since: Instant,
}

impl Clock {
    fn started() -> Self {
        Self { times: Default::default(), stage: Stage::Visible, since: Instant::now() }
    }
}

impl Watch for Clock {
    fn enter(&mut self, stage: Stage) {
        let now = Instant::now();
        self.times[self.stage as usize] += now - self.since;
        (self.stage, self.since) = (stage, now);
    }
}

/// Medians in milliseconds of each stage, and of the whole frame without a clock.
fn median_times(frame: &PreparedFrame, frames: usize) -> Vec<(String, f64)> {
    let mut pixels = common::room_for(frame);
    let rows = 0..frame.height();
    let mut stages = vec![Vec::new(); Stage::ALL.len()];
    let mut wholes = Vec::new();
    // The first one of each kind is a warm-up.
    for round in 0..=frames {
        let mut clock = Clock::started();
        let watched = render_rows_watched(frame, rows.clone(), &mut pixels, &|| false, &mut clock);
        clock.enter(Stage::Visible);
        let started = Instant::now();
        let unwatched = render_rows(frame, rows.clone(), &mut pixels, &|| false);
        let whole = started.elapsed();
        assert!(watched.is_ok() && watched == unwatched, "one frame, rendered twice");
        if round > 0 {
            wholes.push(whole);
            for (times, time) in stages.iter_mut().zip(clock.times) {
                times.push(time);
            }
        }
    }
    let names = Stage::ALL.map(|stage| format!("{stage:?}").to_lowercase());
    let mut medians: Vec<_> = names.into_iter().zip(stages.into_iter().map(median)).collect();
    medians.push(("whole".into(), median(wholes)));
    medians
}

/// A duration in milliseconds.
fn median(mut times: Vec<Duration>) -> f64 {
    times.sort_unstable();
    times[times.len() / 2].as_secs_f64() * 1e3
}
