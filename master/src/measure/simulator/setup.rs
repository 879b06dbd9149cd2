//! Setup of a simulation: workers, links, costs of rows and corruption.

use rayfarm_scheduler::SegmentPolicy;

use super::costs::CostProfile;

/// Simulated farm and workload. The defaults are the workload of the reports: 1024x768 pixels, frames of one second of work,
/// gigabit links, 0.2 ms round trip, speeds spread 4 to 1.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Connected workers.
    pub workers: u32,
    /// Render threads of each worker.
    pub threads: u32,
    /// Ratio of the fastest worker's speed to the slowest one's; the average is 1.
    pub spread: f64,
    /// Policy by which frames are cut into segments.
    pub policy: SegmentPolicy,
    /// Whether idle workers begin the next frame.
    pub pipeline: bool,
    /// Pixels per row, and rows.
    pub size: (u32, u32),
    /// Costs of rows.
    pub costs: CostProfile,
    /// Time of a frame on an average worker, in seconds.
    pub frame_seconds: f64,
    /// Rows of a tile band; bands begin at multiples of it. A tile has 256 rays, so it is 16 rows high with one
    /// sample per pixel and one row high with 81 and more.
    pub tile_rows: u32,
    /// The part of a band's cost that does not depend on how many of its rows are traced, 0 to 1.
    pub tile_share: f64,
    /// Bits per second of every link; all workers share the master's link.
    pub link_bits: f64,
    /// Ratio of raw pixel bytes to bytes on the wire.
    pub compression: f64,
    /// Round trip time in nanoseconds.
    pub round_trip: u64,
    /// Largest random delay of a message, in nanoseconds.
    pub jitter: u64,
    /// Cost of a lease for its worker besides tracing, in nanoseconds.
    pub lease_cost: u64,
    /// Cost of an arriving segment for the master, in nanoseconds; segments are handled one at a time.
    pub message_cost: u64,
    /// Requests per second of a moving camera; 0 requests the next frame when one completes.
    pub input_rate: f64,
    /// Share of the segments to verify, in per cent.
    pub verify_percent: u8,
    /// Number of workers that send wrong pixels: the first to join.
    pub corrupt_workers: u32,
    /// Pattern in which corrupt workers send wrong pixels.
    pub corruption: Corruption,
    /// Number of workers on one shared machine: the first to join. Each other worker has its own machine.
    pub colocated_workers: u32,
    /// Number of workers for which the master does not vouch: the first to join.
    pub untrusted_workers: u32,
    /// Frames to measure, after a warm-up.
    pub frames: u64,
    /// Seed of all random choices.
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
            // The bust takes a second with 100 samples per pixel.
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
            corrupt_workers: 0,
            corruption: Corruption::Random,
            colocated_workers: 0,
            untrusted_workers: 0,
            frames: 30,
            seed: 1,
        }
    }
}

/// Pattern in which a corrupt worker sends wrong pixels, and by which it evades verification.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Corruption {
    /// Half of its segments are wrong, at random.
    #[default]
    Random,
    /// It knows the sampling algorithm but not the key: its segments are wrong where another key would not sample
    /// them, and its second renderings are right.
    Predicting,
    /// Half of its first renderings are wrong, and its second renderings confirm the wrong pixels of other
    /// colluding workers.
    Colluding,
}
