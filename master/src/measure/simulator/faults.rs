//! Random faults.

use rayfarm_scheduler::{Event, FrameId, WorkerId};

use super::clock::{SECOND, SimEvent, WorkerMessage};
use super::machine::Condition;
use super::rng::Rng;
use super::world::World;

/// Longest time between two faults.
const MAX_FAULT_INTERVAL: u64 = SECOND / 2;
/// Longest time that a worker is stopped or slow.
const MAX_FAULT_DURATION: u64 = 20 * SECOND;
/// Workers that join or leave at once, at most.
const MAX_CHURN: u64 = 24;
/// Connected workers at most.
const MAX_WORKERS: usize = 200;
/// Longest suspension of the master.
const MAX_SUSPENSION: u64 = 60 * SECOND;

impl World {
    /// Injects a random fault and schedules the next one.
    pub(crate) fn inject_fault(&mut self) {
        if !self.faults {
            return;
        }
        let pause = self.rng.below(MAX_FAULT_INTERVAL);
        self.clock.schedule(self.clock.now + pause, SimEvent::Fault);
        let ids: Vec<WorkerId> = self.machines.keys().copied().collect();
        let victim = self.rng.pick(&ids);
        match (self.rng.below(21), victim) {
            (0..4, _) | (_, None) => self.join_any(),
            (4 | 5, Some(id)) => self.disconnect(id),
            (6, Some(_)) => self.churn(&ids),
            (7 | 8, Some(id)) => self.set_condition(id, Condition::Stopped),
            (9, Some(id)) => self.slow_down(id),
            (10, Some(id)) => self.set_condition(id, self.any_stuck()),
            (11, Some(id)) => self.vanish(id),
            (12, Some(_)) => self.partition(&ids),
            (13, Some(worker)) => self.handle(Event::DrainRequested { worker }),
            (14, Some(worker)) => self.handle(Event::PauseRequested { worker }),
            (15 | 16, Some(worker)) => self.handle(Event::ResumeRequested { worker }),
            (17, Some(id)) => self.send_to_master(id, WorkerMessage::Drain),
            (18, Some(id)) => {
                let frame = FrameId(self.requested.saturating_sub(self.rng.below(3)));
                self.send_to_master(id, WorkerMessage::Failed(frame));
            }
            (19, Some(id)) => self.corrupt(id),
            (_, Some(_)) => self.suspend_master(),
        }
    }

    /// Adds a worker of random speed.
    pub(crate) fn join_any(&mut self) {
        if self.machines.len() < MAX_WORKERS {
            let speed = 0.1 + 2.0 * self.rng.fraction();
            self.join(speed);
        }
    }

    fn churn(&mut self, ids: &[WorkerId]) {
        for _ in 0..self.rng.below(MAX_CHURN) {
            match self.rng.pick(ids).filter(|id| self.machines.contains_key(id)) {
                Some(id) if self.rng.one_in(2) => self.disconnect(id),
                _ => self.join_any(),
            }
        }
    }

    fn set_condition(&mut self, id: WorkerId, condition: Condition) {
        let Some(machine) = self.machines.get_mut(&id).filter(|m| m.condition == Condition::Healthy) else {
            return;
        };
        machine.condition = condition;
        if !condition.is_final() {
            let lasts = self.rng.below(MAX_FAULT_DURATION);
            self.clock.schedule(self.clock.now + lasts, SimEvent::Recovered(id));
        }
    }

    /// A condition in which a worker answers pings and never a lease. From a separate generator, so that older seeds keep
    /// their schedules.
    fn any_stuck(&self) -> Condition {
        let conditions = [Condition::Stuck, Condition::Hung, Condition::Endless];
        Rng::new(self.setup.seed ^ self.clock.now).pick(&conditions).unwrap_or(Condition::Stuck)
    }

    fn slow_down(&mut self, id: WorkerId) {
        let times = 2.0 + 20.0 * self.rng.fraction();
        self.set_condition(id, Condition::Slow(times));
    }

    /// A worker vanishes. In half of the cases its system closes the connection after a while.
    fn vanish(&mut self, id: WorkerId) {
        if let Some(machine) = self.machines.get_mut(&id) {
            machine.condition = Condition::Vanished;
        }
        if self.rng.one_in(2) {
            let after = self.rng.below(MAX_FAULT_DURATION);
            self.clock.schedule(self.clock.now + after, SimEvent::Closed(id));
        }
    }

    /// Cuts workers off the network for a random time.
    fn partition(&mut self, ids: &[WorkerId]) {
        let lasts = self.rng.below(MAX_FAULT_DURATION);
        for &id in ids {
            let cut_off = self.rng.one_in(3);
            let machine = self.machines.get_mut(&id).filter(|m| cut_off && m.condition == Condition::Healthy);
            if let Some(machine) = machine {
                machine.condition = Condition::Stopped;
                self.clock.schedule(self.clock.now + lasts, SimEvent::Recovered(id));
            }
        }
    }

    /// The master's machine is suspended while the workers go on.
    fn suspend_master(&mut self) {
        let away = self.rng.below(MAX_SUSPENSION);
        if self.rng.one_in(4) {
            self.clock.now += away;
            self.handle(Event::Woken);
        }
    }
}
