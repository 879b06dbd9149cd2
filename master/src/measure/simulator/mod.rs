//! A farm in virtual time: the real [`Scheduler`](rayfarm_scheduler::Scheduler) and lease book, with simulated
//! workers, links and faults. Everything follows from a seed.
//!
//! [`measure`] renders frames with healthy workers and reports how much of their power became picture.
//! [`run_schedule`] runs a phase with faults and a phase without: the invariants of
//! [`check`](rayfarm_scheduler::check) hold after every event, and every request completes.
//!
//! Time is in nanoseconds. The unit of work is a second of an average worker: a frame has `frame_seconds` of it,
//! and a worker of speed 2 does two units per second.

mod clock;
mod corruption;
mod costs;
mod counters;
mod distribution;
mod fault_schedule;
mod faults;
mod link;
mod machine;
mod network;
mod pictures;
mod render;
mod rng;
mod setup;
mod shell;
mod world;

#[cfg(test)]
mod tests;

pub use costs::CostProfile;
pub use counters::Measured;
pub use distribution::{Distribution, DistributionSetup, distribute};
pub use fault_schedule::{Schedule, ScheduleOutcome, run_schedule};
#[cfg(test)]
pub(crate) use rng::Rng;
pub use setup::{Corruption, Setup};

/// Renders `setup.frames` frames with healthy workers after a warm-up, in which the scheduler learns speeds and
/// costs. `None` if they are not done within an hour of virtual time.
pub fn measure(setup: &Setup) -> Option<Measured> {
    world::World::new(setup.clone()).measure()
}
