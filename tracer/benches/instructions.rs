//! Renders one small frame of each scene, one after the other: for valgrind's callgrind to count.
//!
//! Prints a line for each: its name, what it stands beside (variants of one scene only) and its rays, separated by tabs.
//! `counted_frame` is what to count, and where to begin anew:
//! `valgrind --tool=callgrind --toggle-collect='*counted_frame' --dump-after='*counted_frame'`. Valgrind knows no AVX-512 and
//! hides it from the program, which then takes AVX2 by itself; the level is told on standard error.

mod common;

use common::variants::VARIANTS;
use rayfarm_tracer::scene::FrameView;
use rayfarm_tracer::{PreparedFrame, RayCounts, render_rows, simd_level};

/// Pixels: a frame takes about fifty times as long as without valgrind.
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
        count(variant.name, variant.beside, &variant.prepare(width, height));
    }
}

fn count(name: &str, beside: &str, frame: &PreparedFrame) {
    let mut pixels = common::room_for(frame);
    println!("{name}\t{beside}\t{}", common::rays(counted_frame(frame, &mut pixels)));
}

/// Its name is what callgrind looks for.
#[inline(never)]
fn counted_frame(frame: &PreparedFrame, pixels: &mut [u8]) -> RayCounts {
    // Nothing cancels it.
    render_rows(frame, 0..frame.height(), pixels, &never).unwrap_or_default()
}

fn never() -> bool {
    false
}
