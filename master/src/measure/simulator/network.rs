//! Messages over the links, into workers and into the master.

use rayfarm_scheduler::{Event, WorkerId};

use super::clock::{MasterMessage, SECOND, SimEvent, WorkerMessage};
use super::link::bytes;
use super::machine::Condition;
use super::shell::ReplyOutcome;
use super::world::World;

impl World {
    pub(super) fn at_worker(&mut self, id: WorkerId, message: MasterMessage) {
        let Some(machine) = self.machines.get_mut(&id) else { return };
        match (machine.condition, message) {
            (Condition::Vanished, _) => {}
            (Condition::Stopped, _) => machine.unread.push(message),
            (Condition::Stuck, MasterMessage::Lease(_)) => {}
            (_, MasterMessage::Lease(lease)) if self.faults && self.rng.one_in(200) => {
                self.send_to_master(id, WorkerMessage::Failed(lease.frame));
            }
            (_, MasterMessage::Lease(lease)) => {
                machine.lease(lease);
                self.start(id);
            }
            (_, MasterMessage::Cancel(before)) => machine.cancel(before),
            (_, MasterMessage::Ping(nonce)) => {
                let progressed = machine.report_progress();
                self.send_to_master(id, WorkerMessage::Pong { nonce, progressed });
            }
            (_, MasterMessage::Announce | MasterMessage::Drain) => {}
        }
    }

    pub(crate) fn send_to_master(&mut self, id: WorkerId, message: WorkerMessage) {
        let now = self.clock.now;
        let size = self.bytes(&message);
        let jitter = self.jitter();
        let rate = self.bytes_per_second();
        let Some(machine) = self.machines.get_mut(&id) else { return };
        // The first byte reaches the master's link a latency after it left; both links then carry the message at
        // once.
        let sent = machine.up.pass(now, size, rate);
        let begun = sent.saturating_sub((size / rate * SECOND as f64) as u64);
        let at = machine.up_order.arrive(begun + machine.latency + jitter);
        self.clock.schedule(at, SimEvent::AtLink(id, message));
    }

    pub(super) fn at_link(&mut self, id: WorkerId, message: WorkerMessage) {
        let size = self.bytes(&message);
        let rate = self.bytes_per_second();
        let arrived = self.master_in.pass(self.clock.now, size, rate);
        self.counters.link_ns += size / rate * SECOND as f64;
        let costs = matches!(message, WorkerMessage::Pixels { .. });
        let cost = if costs { self.setup.message_cost as f64 } else { 0.0 };
        self.counters.master_ns += cost;
        let at = self.master.pass(arrived, cost, SECOND as f64);
        self.clock.schedule(at, SimEvent::AtMaster(id, message));
    }

    pub(super) fn at_master(&mut self, worker: WorkerId, message: WorkerMessage) {
        if !self.shell.books.contains_key(&worker) {
            return;
        }
        match message {
            WorkerMessage::Pixels { lease, cost, fits, content } => {
                match self.shell.reply(worker, &lease, fits, content) {
                    ReplyOutcome::Kept => self.handle(Event::SegmentDone { worker, lease, cost }),
                    ReplyOutcome::Compared(finding) => {
                        self.handle(Event::SegmentVerified { worker, lease, cost, finding });
                    }
                    ReplyOutcome::Late => {}
                    ReplyOutcome::Invalid => self.disconnect(worker),
                }
            }
            WorkerMessage::Pong { nonce, progressed } => {
                self.handle(Event::Pong { worker, nonce, progressed });
            }
            WorkerMessage::Failed(frame) => {
                if let Some(book) = self.shell.books.get_mut(&worker) {
                    book.fail(frame);
                }
                self.handle(Event::WorkerFailed { worker, frame });
            }
            WorkerMessage::Drain => self.handle(Event::WorkerDrains { worker }),
        }
    }

    pub(super) fn send_to_worker(&mut self, id: WorkerId, message: MasterMessage) {
        let size = match message {
            MasterMessage::Announce => bytes::ANNOUNCE,
            MasterMessage::Lease(_)
            | MasterMessage::Cancel(_)
            | MasterMessage::Ping(_)
            | MasterMessage::Drain => bytes::CONTROL,
        };
        let sent = self.master_out.pass(self.clock.now, size, self.bytes_per_second());
        let jitter = self.jitter();
        let Some(machine) = self.machines.get_mut(&id) else { return };
        let at = machine.down_order.arrive(sent + machine.latency + jitter);
        self.clock.schedule(at, SimEvent::AtWorker(id, message));
    }

    fn bytes(&self, message: &WorkerMessage) -> f64 {
        match message {
            WorkerMessage::Pixels { lease, .. } => {
                let raw = f64::from(lease.row_count) * f64::from(self.setup.size.0) * 3.0;
                bytes::PIXELS_HEAD + raw / self.setup.compression
            }
            WorkerMessage::Pong { .. } | WorkerMessage::Failed(_) | WorkerMessage::Drain => bytes::CONTROL,
        }
    }

    fn bytes_per_second(&self) -> f64 {
        self.setup.link_bits / 8.0 * bytes::PAYLOAD_SHARE
    }

    fn jitter(&mut self) -> u64 {
        self.rng.below(self.setup.jitter.saturating_add(1))
    }
}
