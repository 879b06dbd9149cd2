//! Fault schedules: first everything goes wrong, then nothing does.

use super::clock::Happening;
use super::dice::Dice;
#[cfg(test)]
use super::machine::Ailment;
use super::world::World;
use super::{CostProfile, Lie, SECOND, Setup};
use crate::scheduler::{Event, FrameId, SegmentPolicy, WorkerId};

/// Faults happen for this long at most.
const MAX_FAULTY: u64 = 40 * SECOND;
/// Once faults have stopped, what was asked for completes within this: a silent worker is noticed after 10 s, one that
/// cannot render rests for 30 s at most, and an average worker renders both frames alone in 4 s.
const DONE_WITHIN: u64 = 60 * SECOND;

/// A fault schedule: everything in it follows from its seed.
#[derive(Clone, Copy, Debug)]
pub struct Schedule {
    /// The seed.
    pub seed: u64,
}

/// A schedule that was survived.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Survivor {
    /// Frames that completed.
    pub completed: u64,
    /// Frames that were asked for.
    pub requested: u64,
    /// Workers that took part.
    pub workers: u64,
    /// Nanoseconds of virtual time.
    pub lived: u64,
}

/// Lives through a schedule.
///
/// # Errors
/// What did not hold, and when.
pub fn survive(schedule: Schedule) -> Result<Survivor, String> {
    let mut dice = Dice::new(schedule.seed ^ 0x5eed);
    let mut world = World::new(any_setup(&mut dice, schedule.seed));
    world.checking = true;
    world.faults = true;
    world.requests_more = false;
    for _ in 0..world.setup.workers {
        world.join_any();
    }
    world.clock.plan(0, Happening::Fault);
    world.clock.plan(0, Happening::Input);
    let faulty = SECOND + dice.roll(MAX_FAULTY);
    world.run(faulty, |_| false);
    rest(&world)?;

    let requested = world.calm_down();
    let done_by = world.clock.now + DONE_WITHIN;
    world.run(done_by, |world| world.shell.ended.len() as u64 == world.requested);
    rest(&world)?;
    alive(&world, requested)?;

    world.desert();
    rest(&world)?;
    if world.scheduler.workers().count() > 0 || world.scheduler.poll_timeout().is_some() {
        return Err("all workers have left, and it still waits for somebody".to_owned());
    }
    world.join(1.0);
    world.run(world.clock.now + DONE_WITHIN, |world| world.shell.ended.len() as u64 == world.requested);
    rest(&world)?;
    alive(&world, world.requested)?;
    Ok(Survivor {
        completed: world.tally.frames,
        requested: world.requested,
        workers: world.joined(),
        lived: world.clock.now,
    })
}

fn any_setup(dice: &mut Dice, seed: u64) -> Setup {
    let rows = 1 + dice.roll(40) as u32;
    let policies = [
        SegmentPolicy::Adaptive,
        SegmentPolicy::Adaptive,
        SegmentPolicy::Static(rows),
        SegmentPolicy::Smart(rows),
    ];
    let costs = [CostProfile::Flat, CostProfile::Bust, CostProfile::Corner];
    // Dice of their own: what older seeds are known for stays.
    let mut lies = Dice::new(seed ^ 0x11e);
    Setup {
        lie: lies.pick(&[Lie::Half, Lie::Knowing, Lie::Accomplice]).unwrap_or_default(),
        neighbours: lies.roll(6) as u32,
        workers: dice.roll(12) as u32,
        threads: 1 + dice.roll(8) as u32,
        policy: dice.pick(&policies).unwrap_or_default(),
        pipeline: !dice.one_in(3),
        size: (64 + dice.roll(2000) as u32, 1 + dice.roll(300) as u32),
        costs: costs.get(dice.roll(3) as usize).cloned().unwrap_or(CostProfile::Flat),
        tile_rows: 1 + dice.roll(16) as u32,
        frame_seconds: 0.02 + dice.fraction(),
        round_trip: dice.roll(20_000_000),
        jitter: dice.roll(5_000_000),
        input_rate: 0.5 + 4.0 * dice.fraction(),
        verify_percent: dice.pick(&[0, 0, 5, 30, 100]).unwrap_or(0),
        liars: dice.roll(3) as u32,
        seed,
        ..Setup::default()
    }
}

fn rest(world: &World) -> Result<(), String> {
    let at = world.clock.now as f64 / SECOND as f64;
    let (sealed, open) = (world.shell.sealed(), world.scheduler.verification().open);
    if sealed > open {
        return Err(format!("{sealed} seals of {open} audits, at {at:.6} s"));
    }
    world.violation.as_ref().map_or(Ok(()), |what| Err(format!("{what}, at {at:.6} s")))
}

/// Every frame has ended, and the latest of them with a picture.
fn alive(world: &World, latest: u64) -> Result<(), String> {
    let ended = world.shell.ended.len() as u64;
    if ended < world.requested {
        let (requested, waited) = (world.requested, DONE_WITHIN / SECOND);
        return Err(format!("{ended} of {requested} frames have ended {waited} s after the last fault"));
    }
    match world.shell.last_done {
        Some(FrameId(done)) if done == latest => Ok(()),
        last => Err(format!("frame {latest} was the last request, and {last:?} the last picture")),
    }
}

impl World {
    /// No more faults, nor liars among those who come. Whoever is paused goes on, one worker is surely well, and one more
    /// frame is asked for.
    fn calm_down(&mut self) -> u64 {
        self.faults = false;
        self.setup.liars = 0;
        self.setup.input_rate = 0.0;
        self.clock.forget(|happening| matches!(happening, Happening::Input | Happening::Fault));
        let ids: Vec<WorkerId> = self.machines.keys().copied().collect();
        for worker in ids {
            self.tell(Event::ResumeRequested { worker });
        }
        self.join(1.0);
        self.request();
        self.requested
    }

    /// A frame is asked for, and then everybody leaves.
    fn desert(&mut self) {
        self.request();
        let ids: Vec<WorkerId> = self.machines.keys().copied().collect();
        for id in ids {
            self.lose(id);
        }
    }

    /// Renders frames with healthy workers, then so many others come that never answer anything. The worst frame, in
    /// milliseconds, before and after that. `None` where an invariant does not hold.
    #[cfg(test)]
    pub(crate) fn crowded(mut self, newcomers: u32, ailment: Ailment, at: u64) -> Option<[f64; 2]> {
        self.checking = true;
        self.begin();
        self.run(at / 2, |_| false);
        let mut worst = [0.0; 2];
        for (phase, worst) in worst.iter_mut().enumerate() {
            self.tally.restart(self.clock.now);
            for _ in 0..if phase == 1 { newcomers } else { 0 } {
                let id = self.join(1.0);
                self.machines.get_mut(&id)?.ailment = ailment;
            }
            self.run(self.clock.now + at, |_| false);
            *worst = self.tally.measured(self.clock.now, 1.0).worst_frame_ms;
        }
        self.violation.is_none().then_some(worst)
    }

    /// Renders frames with healthy workers, then something happens to one of them at a time. The worst frame, in
    /// milliseconds, before and after that. `None` where an invariant does not hold.
    #[cfg(test)]
    pub(crate) fn struck(mut self, victim: u64, ailment: Option<Ailment>, at: u64) -> Option<[f64; 2]> {
        self.checking = true;
        self.begin();
        self.run(at / 2, |_| false);
        self.tally.restart(self.clock.now);
        self.run(at, |_| false);
        let usual = self.tally.measured(self.clock.now, 1.0).worst_frame_ms;
        match (ailment, self.machines.get_mut(&WorkerId(victim))) {
            (Some(ailment), Some(machine)) => machine.ailment = ailment,
            _ => self.lose(WorkerId(victim)),
        }
        self.tally.restart(self.clock.now);
        self.run(at * 2, |_| false);
        let worst = self.tally.measured(self.clock.now, 1.0).worst_frame_ms;
        self.violation.is_none().then_some([usual, worst])
    }
}
