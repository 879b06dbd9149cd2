//! The options of `simulate`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::values::{Size, frame_count, size};
use crate::farm::SegmentPolicy;
use crate::simulator::{PassingSetup, Setup};

/// Workers that are simulated at most.
const MAX_WORKERS: i64 = 4096;

/// `simulate`.
#[derive(Clone, Debug, Args)]
pub(crate) struct SimulateArgs {
    /// Simulated workers.
    #[arg(long, value_name = "N", default_value = "8", value_parser = clap::value_parser!(u32).range(1..=MAX_WORKERS))]
    workers: u32,
    /// Measure for each of these numbers of workers, such as 1,2,4,8.
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', conflicts_with = "workers",
        value_parser = clap::value_parser!(u32).range(1..=MAX_WORKERS))]
    sweep: Vec<u32>,
    /// Render threads of each worker.
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u32).range(1..=256))]
    threads: u32,
    /// How frames are cut: static:ROWS, smart:ROWS or adaptive.
    #[arg(long, alias = "policy", value_name = "POLICY", default_value = "adaptive")]
    segment: SegmentPolicy,
    /// Frames that workers may begin before the one on the way is complete.
    #[arg(long, value_name = "0|1", default_value = "1", value_parser = clap::value_parser!(u8).range(0..=1))]
    pipeline: u8,
    /// Frames to measure, after some that are not counted.
    #[arg(long, value_name = "N", default_value = "30", value_parser = frame_count)]
    frames: u32,
    /// Picture size in pixels.
    #[arg(long, value_name = "WxH", default_value = "1024x768", value_parser = size)]
    size: Size,
    /// What rows cost.
    #[arg(long, value_enum, value_name = "PROFILE", default_value_t)]
    pub(crate) costs: Profile,
    /// A file with a number per row, top to bottom, in place of a profile.
    #[arg(long, value_name = "FILE", conflicts_with = "costs")]
    pub(crate) rows: Option<PathBuf>,
    /// What a frame takes an average worker, in milliseconds.
    #[arg(long, value_name = "MS", default_value = "1000", value_parser = positive)]
    work: f64,
    /// The fastest worker's speed over the slowest one's.
    #[arg(long, value_name = "RATIO", default_value = "4", value_parser = positive)]
    speeds: f64,
    /// Rows that are traced together: a tile's height. Frames of a second have so many samples a pixel that it is 1; frames
    /// with one sample have 16.
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u32).range(1..=16))]
    tile_rows: u32,
    /// What a tile's height of rows costs however few of them are traced, as a share: 0.38 was measured.
    #[arg(long, value_name = "SHARE", default_value = "0.38", value_parser = share)]
    tile_share: f64,
    /// Bits a second of every link.
    #[arg(long, value_name = "BITS", default_value = "1e9", value_parser = positive)]
    link: f64,
    /// Raw pixel bytes over bytes on the wire.
    #[arg(long, value_name = "RATIO", default_value = "9", value_parser = positive)]
    compression: f64,
    /// Round trip, in milliseconds.
    #[arg(long, value_name = "MS", default_value = "0.2", value_parser = positive)]
    rtt: f64,
    /// Requests a second of a moving camera; 0 asks for the next frame when one is complete.
    #[arg(long, value_name = "N", default_value = "0", value_parser = rate)]
    input: f64,
    /// Render this share of the segments twice, in per cent, and compare.
    #[arg(long, value_name = "PERCENT", default_value = "0", value_parser = clap::value_parser!(u8).range(0..=100))]
    verify: u8,
    /// What everything random follows from.
    #[arg(long, value_name = "N", default_value = "1")]
    pub(crate) seed: u64,
    /// Send an asset of so many megabytes to all workers instead: from the master alone, and passed on.
    #[arg(long, value_name = "MB", conflicts_with = "faults", value_parser = megabytes)]
    asset: Option<f64>,
    /// Live through fault schedules instead, from --seed on: each chooses everything but the seed itself.
    #[arg(long)]
    pub(crate) faults: bool,
    /// How many fault schedules.
    #[arg(long, value_name = "N", default_value = "1", requires = "faults")]
    pub(crate) schedules: u64,
    /// Print one line of JSON for each measurement.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Named costs of rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Profile {
    /// All the same.
    Flat,
    /// A scanned bust on a ground, as measured.
    #[default]
    Bust,
    /// Nearly all in one corner, which moves from frame to frame.
    Corner,
}

impl SimulateArgs {
    /// The asset to send, from the master alone and passed on, for each number of workers.
    pub(crate) fn assets(&self) -> Vec<[PassingSetup; 2]> {
        let Some(megabytes) = self.asset else { return Vec::new() };
        let setup = |workers, pass_on| PassingSetup {
            workers,
            asset_bytes: (megabytes * 1e6) as u64,
            pass_on,
            link_bits: self.link,
            round_trip: (self.rtt * 1e6) as u64,
            deaths: 0,
            hangs: 0,
            seed: self.seed,
        };
        self.counts().into_iter().map(|workers| [setup(workers, false), setup(workers, true)]).collect()
    }

    fn counts(&self) -> Vec<u32> {
        if self.sweep.is_empty() { vec![self.workers] } else { self.sweep.clone() }
    }

    /// What to measure, but for the costs of rows: one setup for each number of workers.
    pub(crate) fn setups(&self) -> Vec<Setup> {
        let setup = Setup {
            threads: self.threads,
            spread: self.speeds,
            policy: self.segment,
            pipeline: self.pipeline == 1,
            size: (self.size.width, self.size.height),
            frame_seconds: self.work / 1e3,
            tile_rows: self.tile_rows,
            tile_share: self.tile_share,
            link_bits: self.link,
            compression: self.compression,
            round_trip: (self.rtt * 1e6) as u64,
            input_rate: self.input,
            verify_percent: self.verify,
            frames: self.frames.into(),
            seed: self.seed,
            ..Setup::default()
        };
        self.counts().into_iter().map(|workers| Setup { workers, ..setup.clone() }).collect()
    }
}

fn number(text: &str, fits: impl Fn(f64) -> bool, expected: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|&number: &f64| number.is_finite() && fits(number));
    number.ok_or_else(|| format!("expected {expected}"))
}

fn positive(text: &str) -> Result<f64, String> {
    number(text, |number| number > 0.0, "a number above 0")
}

fn megabytes(text: &str) -> Result<f64, String> {
    number(text, |number| number > 0.0 && number <= 2048.0, "a number above 0, up to 2048")
}

fn share(text: &str) -> Result<f64, String> {
    number(text, |number| (0.0..1.0).contains(&number), "a number from 0 to below 1")
}

fn rate(text: &str) -> Result<f64, String> {
    number(text, |number| (0.0..=1e6).contains(&number), "a number from 0 to 1000000")
}
