//! Rendering of simulated workers: rows of each thread, and their duration.

use rayfarm_scheduler::{Cost, FrameId, Lease, WorkerId};

use super::clock::{SECOND, SimEvent, WorkerMessage};
use super::machine::{Band, Condition};
use super::world::World;

impl World {
    /// Gives rows to idle threads.
    pub(super) fn start(&mut self, id: WorkerId) {
        while let Some(machine) = self.machines.get_mut(&id) {
            if machine.condition.is_halted() {
                return;
            }
            let Some(thread) = machine.idle_thread() else { return };
            let Some((lease, rows)) = machine.next_band(self.setup.tile_rows) else { return };
            let speed = machine.thread_speed();
            let last = rows.end == lease.first_row + lease.row_count;
            let lease_seconds = if last { self.setup.lease_cost as f64 / SECOND as f64 } else { 0.0 };
            let (work, cutting) = self.work(lease.frame, rows.clone());
            let nanoseconds = (((work + cutting) / speed + lease_seconds) * SECOND as f64) as u64;
            self.counters.cutting += cutting;
            self.counters.leases += lease_seconds * speed;
            self.counters.trace(self.clock.now, speed);
            let done_at = self.clock.now + nanoseconds;
            if let Some(machine) = self.machines.get_mut(&id) {
                machine.threads[thread] = Some(Band { lease, rows, nanoseconds, speed, stale: false });
            }
            self.clock.schedule(done_at, SimEvent::BandDone { worker: id, thread });
        }
    }

    /// Work of rows, and the work that cutting their tile bands adds.
    fn work(&mut self, frame: FrameId, rows: std::ops::Range<u32>) -> (f64, f64) {
        let height = self.setup.size.1;
        // Constant costs are computed once.
        let key = if self.setup.costs.moves() { frame.0 } else { 0 };
        let costs = self.costs.entry(key).or_insert_with(|| {
            let mut sums = vec![0.0];
            let mut sum = 0.0;
            sums.extend(self.setup.costs.shares(frame.0, height).into_iter().map(|share| {
                sum += share;
                sum
            }));
            sums
        });
        let at = |row: u32| costs.get(row.min(height) as usize).copied().unwrap_or(0.0);
        let tile_rows = self.setup.tile_rows.max(1);
        let band_first = rows.start - rows.start % tile_rows;
        let band_rows = (band_first + tile_rows).min(height) - band_first;
        let left_out = 1.0 - f64::from(rows.end - rows.start) / f64::from(band_rows.max(1));
        let band = at(band_first + tile_rows) - at(band_first);
        let work = (at(rows.end) - at(rows.start)) * self.setup.frame_seconds;
        let cutting = self.setup.tile_share * band * left_out.max(0.0) * self.setup.frame_seconds;
        while self.costs.len() > 16 {
            self.costs.pop_first();
        }
        (work, cutting)
    }

    pub(super) fn band_done(&mut self, id: WorkerId, thread: usize) {
        let Some(machine) = self.machines.get_mut(&id) else { return };
        match machine.condition {
            Condition::Stopped | Condition::Hung | Condition::Endless => {
                return machine.unfinished.push(thread);
            }
            Condition::Vanished => return,
            Condition::Healthy | Condition::Slow(_) | Condition::Stuck => {}
        }
        let Some(band) = machine.threads.get_mut(thread).and_then(Option::take) else { return };
        self.counters.trace(self.clock.now, -band.speed);
        let stuck = machine.condition == Condition::Stuck;
        let whole = if band.stale { None } else { machine.finish(&band) };
        if let Some((lease, trace_ns)) = whole.filter(|_| !stuck) {
            let cost = Cost { trace_ns, primary: u64::from(lease.row_count), ..Cost::default() };
            self.deliver(id, lease, cost);
        }
        self.start(id);
    }

    /// Sends a finished lease to the master; with faults, sometimes twice or invalid.
    fn deliver(&mut self, id: WorkerId, lease: Lease, cost: Cost) {
        let fits = !(self.faults && self.rng.one_in(500));
        let content = self.content(id, &lease);
        self.send_to_master(id, WorkerMessage::Pixels { lease, cost, fits, content });
        if self.faults && self.rng.one_in(300) {
            self.send_to_master(id, WorkerMessage::Pixels { lease, cost, fits, content });
        }
    }

    /// Recovers a machine: it reads the messages that arrived meanwhile, and goes on.
    pub(super) fn recover(&mut self, id: WorkerId) {
        let Some(machine) = self.machines.get_mut(&id) else { return };
        machine.condition = Condition::Healthy;
        let unread = std::mem::take(&mut machine.unread);
        let unfinished = std::mem::take(&mut machine.unfinished);
        for thread in unfinished {
            self.band_done(id, thread);
        }
        for message in unread {
            self.at_worker(id, message);
        }
        self.start(id);
    }
}
