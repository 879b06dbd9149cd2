//! One small frame of each scene, one after the other, for valgrind's callgrind.
//!
//! Prints a line per frame, separated by tabs: its name, the variant with which it is compared (variants of one scene
//! only), and its rays. Count the instructions of `counted_frame`, with a dump after each: `valgrind --tool=callgrind
//! --toggle-collect='*counted_frame' --dump-after='*counted_frame'`. Valgrind does not support AVX-512 and hides it
//! from the program, which then uses AVX2; the level is printed on standard error.

mod common;

use common::variants::VARIANTS;
use rayfarm_tracer::scene::FrameView;
use rayfarm_tracer::{PreparedFrame, RayCounts, render_rows, simd_level};

/// Side in pixels: with valgrind a frame takes about fifty times as long.
const SIZE: (u32, u32) = (320, 240);

fn main() {
    let names: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    eprintln!("counting with {}", simd_level());
    let (width, height) = SIZE;
    for workload in common::workloads() {
        if names.is_empty() || names.contains(&workload.name) {
            let (scene, view) = workload.load();
            let frame = common::prepare(&scene, &FrameView { width, height, samples: 1, ..view });
            count(&workload.name, "", &frame);
        }
    }
    for variant in &VARIANTS {
        count(variant.name, variant.baseline, &variant.prepare(width, height));
    }
}

fn count(name: &str, baseline: &str, frame: &PreparedFrame) {
    let mut pixels = common::room_for(frame);
    println!("{name}\t{baseline}\t{}", common::rays(counted_frame(frame, &mut pixels)));
}

/// Counted by callgrind, which finds it by its name.
#[inline(never)]
fn counted_frame(frame: &PreparedFrame, pixels: &mut [u8]) -> RayCounts {
    // Never cancelled.
    render_rows(frame, 0..frame.height(), pixels, &never).unwrap_or_default()
}

fn never() -> bool {
    false
}
