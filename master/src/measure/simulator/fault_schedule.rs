//! Fault schedules: a safety phase with faults, then a liveness phase without.

use rayfarm_scheduler::{Event, FrameId, SegmentPolicy, WorkerId};

use super::clock::{SECOND, SimEvent};
use super::costs::CostProfile;
#[cfg(test)]
use super::machine::Condition;
use super::rng::Rng;
use super::setup::{Corruption, Setup};
use super::world::World;

/// Longest safety phase.
const MAX_FAULT_PHASE: u64 = 40 * SECOND;
/// Every request completes within this time after the last fault: a silent worker is noticed after 10 s, the
/// longest back-off is 30 s, and an average worker renders both frames alone in 4 s.
const LIVENESS_BOUND: u64 = 60 * SECOND;

/// A fault schedule; all of it follows from its seed.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    /// Seed of all random choices.
    pub seed: u64,
}

/// Result of a schedule in which all invariants held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScheduleOutcome {
    /// Frames that completed.
    pub completed: u64,
    /// Frames that were requested.
    pub requested: u64,
    /// Workers that joined.
    pub workers: u64,
    /// Virtual time in nanoseconds.
    pub virtual_ns: u64,
}

/// Runs a schedule and checks the invariants after every event, and progress at the end.
///
/// # Errors
/// The first violated invariant, with its virtual time.
pub fn run_schedule(schedule: Schedule) -> Result<ScheduleOutcome, String> {
    let mut rng = Rng::new(schedule.seed ^ 0x5eed);
    let mut world = World::new(any_setup(&mut rng, schedule.seed));
    world.checking = true;
    world.faults = true;
    world.requests_more = false;
    for _ in 0..world.setup.workers {
        world.join_any();
    }
    world.clock.schedule(0, SimEvent::Fault);
    world.clock.schedule(0, SimEvent::Input);
    let faulty = SECOND + rng.below(MAX_FAULT_PHASE);
    world.run(faulty, |_| false);
    check_invariants(&world)?;

    let requested = world.stop_faults();
    let done_by = world.clock.now + LIVENESS_BOUND;
    world.run(done_by, |world| world.shell.ended.len() as u64 == world.requested);
    check_invariants(&world)?;
    check_liveness(&world, requested)?;

    world.remove_all_workers();
    check_invariants(&world)?;
    if world.scheduler.workers().count() > 0 || world.scheduler.poll_timeout().is_some() {
        return Err("all workers have left, and the scheduler still has a timeout".to_owned());
    }
    world.join(1.0);
    world.run(world.clock.now + LIVENESS_BOUND, |world| world.shell.ended.len() as u64 == world.requested);
    check_invariants(&world)?;
    check_liveness(&world, world.requested)?;
    Ok(ScheduleOutcome {
        completed: world.counters.frames,
        requested: world.requested,
        workers: world.joined(),
        virtual_ns: world.clock.now,
    })
}

fn any_setup(rng: &mut Rng, seed: u64) -> Setup {
    let rows = 1 + rng.below(40) as u32;
    let policies = [
        SegmentPolicy::Adaptive,
        SegmentPolicy::Adaptive,
        SegmentPolicy::Static(rows),
        SegmentPolicy::Smart(rows),
    ];
    let costs = [CostProfile::Flat, CostProfile::Bust, CostProfile::Corner];
    // A separate generator, so that older seeds keep their schedules.
    let mut corruption_rng = Rng::new(seed ^ 0x11e);
    Setup {
        corruption: corruption_rng
            .pick(&[Corruption::Random, Corruption::Predicting, Corruption::Colluding])
            .unwrap_or_default(),
        colocated_workers: corruption_rng.below(6) as u32,
        untrusted_workers: Rng::new(seed ^ 0x7e57).below(8) as u32,
        workers: rng.below(12) as u32,
        threads: 1 + rng.below(8) as u32,
        policy: rng.pick(&policies).unwrap_or_default(),
        pipeline: !rng.one_in(3),
        size: (64 + rng.below(2000) as u32, 1 + rng.below(300) as u32),
        costs: costs.get(rng.below(3) as usize).cloned().unwrap_or(CostProfile::Flat),
        tile_rows: 1 + rng.below(16) as u32,
        frame_seconds: 0.02 + rng.fraction(),
        round_trip: rng.below(20_000_000),
        jitter: rng.below(5_000_000),
        input_rate: 0.5 + 4.0 * rng.fraction(),
        verify_percent: rng.pick(&[0, 0, 5, 30, 100]).unwrap_or(0),
        corrupt_workers: rng.below(3) as u32,
        seed,
        ..Setup::default()
    }
}

fn check_invariants(world: &World) -> Result<(), String> {
    let at = world.clock.now as f64 / SECOND as f64;
    let (digest_count, open) = (world.shell.digest_count(), world.scheduler.verification().open);
    if digest_count > open {
        return Err(format!("{digest_count} digests of {open} verifications, at {at:.6} s"));
    }
    world.violation.as_ref().map_or(Ok(()), |what| Err(format!("{what}, at {at:.6} s")))
}

/// Checks that every frame has ended and that `latest` is the last complete one.
fn check_liveness(world: &World, latest: u64) -> Result<(), String> {
    let ended = world.shell.ended.len() as u64;
    if ended < world.requested {
        let (requested, waited) = (world.requested, LIVENESS_BOUND / SECOND);
        return Err(format!("{ended} of {requested} frames have ended {waited} s after the last fault"));
    }
    match world.shell.last_done {
        Some(FrameId(done)) if done == latest => Ok(()),
        last => Err(format!("frame {latest} was the last request, and {last:?} the last picture")),
    }
}

impl World {
    /// Stops faults, resumes paused workers, adds one healthy worker and requests one more frame. Returns its
    /// number.
    fn stop_faults(&mut self) -> u64 {
        self.faults = false;
        self.setup.corrupt_workers = 0;
        self.setup.input_rate = 0.0;
        self.clock.cancel(|event| matches!(event, SimEvent::Input | SimEvent::Fault));
        let ids: Vec<WorkerId> = self.machines.keys().copied().collect();
        for worker in ids {
            self.handle(Event::ResumeRequested { worker });
        }
        self.join(1.0);
        self.request();
        self.requested
    }

    /// Requests a frame, and then disconnects all workers.
    fn remove_all_workers(&mut self) {
        self.request();
        let ids: Vec<WorkerId> = self.machines.keys().copied().collect();
        for id in ids {
            self.disconnect(id);
        }
    }

    /// Renders frames with healthy workers, then with many new workers that never answer. Returns the worst frame
    /// time in milliseconds before and after they join; `None` if an invariant is violated.
    #[cfg(test)]
    pub(crate) fn worst_with_silent_joins(
        mut self,
        joining: u32,
        condition: Condition,
        at: u64,
    ) -> Option<[f64; 2]> {
        self.checking = true;
        self.begin();
        self.run(at / 2, |_| false);
        let mut worst = [0.0; 2];
        for (phase, worst) in worst.iter_mut().enumerate() {
            self.counters.restart(self.clock.now);
            for _ in 0..if phase == 1 { joining } else { 0 } {
                let id = self.join(1.0);
                self.machines.get_mut(&id)?.condition = condition;
            }
            self.run(self.clock.now + at, |_| false);
            *worst = self.counters.measured(self.clock.now, 1.0).worst_frame_ms;
        }
        self.violation.is_none().then_some(worst)
    }

    /// Renders frames with healthy workers, then with a fault of one of them (`None`: it disconnects). Returns the
    /// worst frame time in milliseconds before and after the fault; `None` if an invariant is violated.
    #[cfg(test)]
    pub(crate) fn worst_with_fault(
        mut self,
        victim: u64,
        condition: Option<Condition>,
        at: u64,
    ) -> Option<[f64; 2]> {
        self.checking = true;
        self.begin();
        self.run(at / 2, |_| false);
        self.counters.restart(self.clock.now);
        self.run(at, |_| false);
        let usual = self.counters.measured(self.clock.now, 1.0).worst_frame_ms;
        match (condition, self.machines.get_mut(&WorkerId(victim))) {
            (Some(condition), Some(machine)) => machine.condition = condition,
            _ => self.disconnect(WorkerId(victim)),
        }
        self.counters.restart(self.clock.now);
        self.run(at * 2, |_| false);
        let worst = self.counters.measured(self.clock.now, 1.0).worst_frame_ms;
        self.violation.is_none().then_some([usual, worst])
    }
}
