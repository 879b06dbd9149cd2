//! A farm in virtual time: the real [`Scheduler`](crate::scheduler::Scheduler) and the real book of leases, with
//! simulated workers, links and faults. Everything follows from a seed.
//!
//! Two uses. [`measure`] renders frames with healthy workers and tells how much of their power became picture.
//! [`survive`] lets faults happen first and stops them then: after every event the invariants of
//! [`check`](crate::scheduler::check) hold, and what was asked for completes.
//!
//! Time is in nanoseconds. Work is in average workers' seconds: a frame is `frame_seconds` of it, and a worker of
//! speed 2 does two of it a second.

mod clock;
mod costs;
mod dice;
mod faults;
mod lies;
mod link;
mod machine;
mod passing;
mod pictures;
mod post;
mod render;
mod shell;
mod survival;
mod tally;
mod world;

#[cfg(test)]
mod tests;

pub use costs::CostProfile;
#[cfg(test)]
pub(crate) use dice::Dice;
pub use lies::Lie;
pub use passing::{Passed, PassingSetup, pass};
pub use survival::{Schedule, Survivor, survive};
pub use tally::Measured;

use crate::scheduler::SegmentPolicy;

/// Nanoseconds of a second.
pub(crate) const SECOND: u64 = 1_000_000_000;

/// What is simulated. The defaults are the project's own measure: 1024x768 pixels, a frame of one second of work,
/// gigabit links, 0.2 ms round trip, speeds spread 4 to 1.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Connected workers.
    pub workers: u32,
    /// Render threads of each.
    pub threads: u32,
    /// The fastest worker's speed over the slowest one's; the average is 1.
    pub spread: f64,
    /// How frames are cut.
    pub policy: SegmentPolicy,
    /// Whether idle workers begin the next frame.
    pub pipeline: bool,
    /// Pixels of a row, and rows.
    pub size: (u32, u32),
    /// Which rows cost how much.
    pub costs: CostProfile,
    /// What a frame takes an average worker, in seconds.
    pub frame_seconds: f64,
    /// Rows that are traced together, from multiples of it on: a tile's height. A tile has 256 rays, so it is 16 rows high
    /// with one sample a pixel, and one row with 81 and more.
    pub tile_rows: u32,
    /// What a band of a tile's height costs however few of its rows are traced, as a share.
    pub tile_share: f64,
    /// Bits a second of every link; the master's is shared by all workers.
    pub link_bits: f64,
    /// Raw pixel bytes over bytes on the wire.
    pub compression: f64,
    /// Round trip, in nanoseconds.
    pub round_trip: u64,
    /// What a message takes longer at most, at random, in nanoseconds.
    pub jitter: u64,
    /// What a lease costs its worker besides tracing, in nanoseconds.
    pub lease_cost: u64,
    /// What a segment that arrives costs the master, one at a time, in nanoseconds.
    pub message_cost: u64,
    /// Requests a second of a moving camera; 0: one as soon as a frame is complete.
    pub input_rate: f64,
    /// The share of the segments that is verified, in per cent.
    pub verify_percent: u8,
    /// Workers that send wrong pixels: the first to join.
    pub liars: u32,
    /// How they lie.
    pub lie: Lie,
    /// Workers that share one machine: the first to join. Each of the others has its own.
    pub neighbours: u32,
    /// Frames measured, after some that are not.
    pub frames: u64,
    /// What everything random follows from.
    pub seed: u64,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            workers: 8,
            threads: 1,
            spread: 4.0,
            policy: SegmentPolicy::Adaptive,
            pipeline: true,
            size: (1024, 768),
            costs: CostProfile::Bust,
            frame_seconds: 1.0,
            // The bust takes a second with 100 samples a pixel.
            tile_rows: 1,
            // Measured: see `costs`.
            tile_share: 0.38,
            link_bits: 1e9,
            compression: 9.0,
            round_trip: 200_000,
            jitter: 20_000,
            lease_cost: 20_000,
            message_cost: 10_000,
            input_rate: 0.0,
            verify_percent: 0,
            liars: 0,
            lie: Lie::Half,
            neighbours: 0,
            frames: 30,
            seed: 1,
        }
    }
}

/// Renders `setup.frames` frames with healthy workers, after as many as make the scheduler know them. `None` if they
/// are not done within an hour of virtual time.
pub fn measure(setup: &Setup) -> Option<Measured> {
    world::World::new(setup.clone()).measure()
}
