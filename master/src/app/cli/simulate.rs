//! Options of `simulate`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use rayfarm_farm::SegmentPolicy;

use super::values::{Size, frame_count, size};
use crate::measure::simulator::{DistributionSetup, Setup};

/// Largest number of simulated workers.
const MAX_WORKERS: i64 = 4096;

/// Options of `simulate`.
#[derive(Clone, Debug, Args)]
pub(crate) struct SimulateArgs {
    /// Number of simulated workers.
    #[arg(long, value_name = "N", default_value = "8", value_parser = clap::value_parser!(u32).range(1..=MAX_WORKERS))]
    workers: u32,
    /// Measure for each of these numbers of workers, such as 1,2,4,8.
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', conflicts_with = "workers",
        value_parser = clap::value_parser!(u32).range(1..=MAX_WORKERS))]
    sweep: Vec<u32>,
    /// Render threads of each worker.
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u32).range(1..=256))]
    threads: u32,
    /// Policy for the size of segments: static:ROWS, smart:ROWS or adaptive.
    #[arg(long, alias = "policy", value_name = "POLICY", default_value = "adaptive")]
    segment: SegmentPolicy,
    /// Frames that workers may begin before the current one is complete.
    #[arg(long, value_name = "0|1", default_value = "1", value_parser = clap::value_parser!(u8).range(0..=1))]
    pipeline: u8,
    /// Number of frames to measure, after some for warming up.
    #[arg(long, value_name = "N", default_value = "30", value_parser = frame_count)]
    frames: u32,
    /// Picture size in pixels.
    #[arg(long, value_name = "WxH", default_value = "1024x768", value_parser = size)]
    size: Size,
    /// Costs of rows.
    #[arg(long, value_enum, value_name = "PROFILE", default_value_t)]
    pub(crate) costs: Profile,
    /// File with the cost of each row, top to bottom, in place of a profile.
    #[arg(long, value_name = "FILE", conflicts_with = "costs")]
    pub(crate) rows: Option<PathBuf>,
    /// Time of a frame on an average worker, in milliseconds.
    #[arg(long, value_name = "MS", default_value = "1000", value_parser = positive)]
    work: f64,
    /// Speed of the fastest worker as a multiple of the slowest one's.
    #[arg(long, value_name = "RATIO", default_value = "4", value_parser = positive)]
    speeds: f64,
    /// Height of a tile, in rows: 16 with one sample per pixel, 1 with as many samples as make a frame take a second.
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u32).range(1..=16))]
    tile_rows: u32,
    /// Part of the cost of a row of tiles that does not depend on the number of rows traced; 0.38 was measured.
    #[arg(long, value_name = "SHARE", default_value = "0.38", value_parser = share)]
    tile_share: f64,
    /// Bits per second of each link.
    #[arg(long, value_name = "BITS", default_value = "1e9", value_parser = positive)]
    link: f64,
    /// Ratio of raw pixel bytes to bytes on the wire.
    #[arg(long, value_name = "RATIO", default_value = "9", value_parser = positive)]
    compression: f64,
    /// Round-trip time, in milliseconds.
    #[arg(long, value_name = "MS", default_value = "0.2", value_parser = positive)]
    rtt: f64,
    /// Requests per second of a moving camera; with 0, each frame is requested when the previous one is complete.
    #[arg(long, value_name = "N", default_value = "0", value_parser = rate)]
    input: f64,
    /// Share of the segments to render twice and compare, in per cent.
    #[arg(long, value_name = "PERCENT", default_value = "0", value_parser = clap::value_parser!(u8).range(0..=100))]
    verify: u8,
    /// Seed of all random numbers.
    #[arg(long, value_name = "N", default_value = "1")]
    pub(crate) seed: u64,
    /// Simulate the transfer of an asset of this many megabytes to all workers instead: from the master alone, and passed on.
    #[arg(long, value_name = "MB", conflicts_with = "faults", value_parser = megabytes)]
    asset: Option<f64>,
    /// Run fault schedules instead, from --seed on: each seed determines all other parameters.
    #[arg(long)]
    pub(crate) faults: bool,
    /// Number of fault schedules.
    #[arg(long, value_name = "N", default_value = "1", requires = "faults")]
    pub(crate) schedules: u64,
    /// Print a line of JSON for each measurement.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Profile of the costs of rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Profile {
    /// Equal costs.
    Flat,
    /// Measured costs of a scanned bust on a plane.
    #[default]
    Bust,
    /// Nearly all costs in one corner, which moves from frame to frame.
    Corner,
}

impl SimulateArgs {
    /// Setups for the transfer of the asset, from the master alone and passed on, for each number of workers.
    pub(crate) fn assets(&self) -> Vec<[DistributionSetup; 2]> {
        let Some(megabytes) = self.asset else { return Vec::new() };
        let setup = |workers, relay| DistributionSetup {
            workers,
            asset_bytes: (megabytes * 1e6) as u64,
            relay,
            link_bits: self.link,
            round_trip: (self.rtt * 1e6) as u64,
            exits: 0,
            hangs: 0,
            seed: self.seed,
        };
        self.counts().into_iter().map(|workers| [setup(workers, false), setup(workers, true)]).collect()
    }

    fn counts(&self) -> Vec<u32> {
        if self.sweep.is_empty() { vec![self.workers] } else { self.sweep.clone() }
    }

    /// Setups to measure, without the costs of rows, for each number of workers.
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
