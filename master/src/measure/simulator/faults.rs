//! What goes wrong, and when.

use super::SECOND;
use super::clock::{Happening, Up};
use super::machine::Ailment;
use super::world::World;
use crate::scheduler::{Event, FrameId, WorkerId};

/// Between two faults at most.
const MAX_PAUSE: u64 = SECOND / 2;
/// What stands still or is slow, stays so for this long at most.
const MAX_AILMENT: u64 = 20 * SECOND;
/// Workers that come or go at once, at most.
const MAX_STORM: u64 = 24;
/// Workers at a time; beyond that, nobody else comes.
const MAX_WORKERS: usize = 200;
/// How long a suspended master was away, at most.
const MAX_ABSENCE: u64 = 60 * SECOND;

impl World {
    /// Something goes wrong, and the next thing is planned.
    pub(crate) fn fault(&mut self) {
        if !self.faults {
            return;
        }
        let pause = self.dice.roll(MAX_PAUSE);
        self.clock.plan(self.clock.now + pause, Happening::Fault);
        let ids: Vec<WorkerId> = self.machines.keys().copied().collect();
        let victim = self.dice.pick(&ids);
        match (self.dice.roll(21), victim) {
            (0..4, _) | (_, None) => self.join_any(),
            (4 | 5, Some(id)) => self.lose(id),
            (6, Some(_)) => self.storm(&ids),
            (7 | 8, Some(id)) => self.ail(id, Ailment::Stopped),
            (9, Some(id)) => self.slow_down(id),
            (10, Some(id)) => self.ail(id, Ailment::Stuck),
            (11, Some(id)) => self.vanish(id),
            (12, Some(_)) => self.partition(&ids),
            (13, Some(worker)) => self.tell(Event::DrainRequested { worker }),
            (14, Some(worker)) => self.tell(Event::PauseRequested { worker }),
            (15 | 16, Some(worker)) => self.tell(Event::ResumeRequested { worker }),
            (17, Some(id)) => self.say(id, Up::Drain),
            (18, Some(id)) => {
                let frame = FrameId(self.requested.saturating_sub(self.dice.roll(3)));
                self.say(id, Up::Failed(frame));
            }
            (19, Some(id)) => self.corrupt(id),
            (_, Some(_)) => self.sleep(),
        }
    }

    /// Somebody comes, of any speed.
    pub(crate) fn join_any(&mut self) {
        if self.machines.len() < MAX_WORKERS {
            let speed = 0.1 + 2.0 * self.dice.fraction();
            self.join(speed);
        }
    }

    fn storm(&mut self, ids: &[WorkerId]) {
        for _ in 0..self.dice.roll(MAX_STORM) {
            match self.dice.pick(ids).filter(|id| self.machines.contains_key(id)) {
                Some(id) if self.dice.one_in(2) => self.lose(id),
                _ => self.join_any(),
            }
        }
    }

    fn ail(&mut self, id: WorkerId, ailment: Ailment) {
        let Some(machine) = self.machines.get_mut(&id).filter(|m| m.ailment == Ailment::Healthy) else {
            return;
        };
        machine.ailment = ailment;
        // What is stuck stays so.
        if ailment != Ailment::Stuck {
            let lasts = self.dice.roll(MAX_AILMENT);
            self.clock.plan(self.clock.now + lasts, Happening::Recovered(id));
        }
    }

    fn slow_down(&mut self, id: WorkerId) {
        let times = 2.0 + 20.0 * self.dice.fraction();
        self.ail(id, Ailment::Slow(times));
    }

    /// The worker is gone. Now and then its system still closes the connection, after a while.
    fn vanish(&mut self, id: WorkerId) {
        if let Some(machine) = self.machines.get_mut(&id) {
            machine.ailment = Ailment::Vanished;
        }
        if self.dice.one_in(2) {
            let after = self.dice.roll(MAX_AILMENT);
            self.clock.plan(self.clock.now + after, Happening::Closed(id));
        }
    }

    /// A part of the network is cut off for a while.
    fn partition(&mut self, ids: &[WorkerId]) {
        let lasts = self.dice.roll(MAX_AILMENT);
        for &id in ids {
            let cut_off = self.dice.one_in(3);
            let machine = self.machines.get_mut(&id).filter(|m| cut_off && m.ailment == Ailment::Healthy);
            if let Some(machine) = machine {
                machine.ailment = Ailment::Stopped;
                self.clock.plan(self.clock.now + lasts, Happening::Recovered(id));
            }
        }
    }

    /// The master's machine sleeps; the workers do not.
    fn sleep(&mut self) {
        let away = self.dice.roll(MAX_ABSENCE);
        if self.dice.one_in(4) {
            self.clock.now += away;
            self.tell(Event::Woken);
        }
    }
}
