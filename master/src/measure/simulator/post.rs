//! Messages: over the links, into workers and into the master.

use super::SECOND;
use super::clock::{Down, Happening, Up};
use super::link::bytes;
use super::machine::Ailment;
use super::shell::Answer;
use super::world::World;
use crate::scheduler::{Event, WorkerId};

impl World {
    pub(super) fn at_worker(&mut self, id: WorkerId, message: Down) {
        let Some(machine) = self.machines.get_mut(&id) else { return };
        match (machine.ailment, message) {
            (Ailment::Vanished, _) => {}
            (Ailment::Stopped, _) => machine.unread.push(message),
            (Ailment::Stuck, Down::Lease(_)) => {}
            (_, Down::Lease(lease)) if self.faults && self.dice.one_in(200) => {
                self.say(id, Up::Failed(lease.frame));
            }
            (_, Down::Lease(lease)) => {
                machine.lease(lease);
                self.start(id);
            }
            (_, Down::Cancel(before)) => machine.cancel(before),
            (_, Down::Ping(nonce)) => self.say(id, Up::Pong(nonce)),
            (_, Down::Announce | Down::Drain) => {}
        }
    }

    pub(crate) fn say(&mut self, id: WorkerId, message: Up) {
        let now = self.clock.now;
        let size = self.bytes(&message);
        let jitter = self.jitter();
        let rate = self.bytes_per_second();
        let Some(machine) = self.machines.get_mut(&id) else { return };
        // The first byte reaches the master's link a latency after it left; both links then carry it at once.
        let sent = machine.up.pass(now, size, rate);
        let begun = sent.saturating_sub((size / rate * SECOND as f64) as u64);
        let at = machine.up_order.arrive(begun + machine.latency + jitter);
        self.clock.plan(at, Happening::AtLink(id, message));
    }

    pub(super) fn at_link(&mut self, id: WorkerId, message: Up) {
        let size = self.bytes(&message);
        let rate = self.bytes_per_second();
        let arrived = self.master_in.pass(self.clock.now, size, rate);
        self.tally.link_ns += size / rate * SECOND as f64;
        let costs = matches!(message, Up::Pixels { .. });
        let cost = if costs { self.setup.message_cost as f64 } else { 0.0 };
        self.tally.master_ns += cost;
        let at = self.master.pass(arrived, cost, SECOND as f64);
        self.clock.plan(at, Happening::AtMaster(id, message));
    }

    pub(super) fn at_master(&mut self, worker: WorkerId, message: Up) {
        if !self.shell.books.contains_key(&worker) {
            return;
        }
        match message {
            Up::Pixels { lease, cost, fits, content } => {
                match self.shell.answer(worker, &lease, fits, content) {
                    Answer::Kept => self.tell(Event::SegmentDone { worker, lease, cost }),
                    Answer::Compared(finding) => {
                        self.tell(Event::SegmentVerified { worker, lease, cost, finding });
                    }
                    Answer::Late => {}
                    Answer::Refused => self.lose(worker),
                }
            }
            Up::Pong(nonce) => self.tell(Event::Pong { worker, nonce }),
            Up::Failed(frame) => {
                if let Some(book) = self.shell.books.get_mut(&worker) {
                    book.fail(frame);
                }
                self.tell(Event::WorkerFailed { worker, frame });
            }
            Up::Drain => self.tell(Event::WorkerDrains { worker }),
        }
    }

    pub(super) fn send(&mut self, id: WorkerId, message: Down) {
        let size = match message {
            Down::Announce => bytes::ANNOUNCE,
            Down::Lease(_) | Down::Cancel(_) | Down::Ping(_) | Down::Drain => bytes::CONTROL,
        };
        let sent = self.master_out.pass(self.clock.now, size, self.bytes_per_second());
        let jitter = self.jitter();
        let Some(machine) = self.machines.get_mut(&id) else { return };
        let at = machine.down_order.arrive(sent + machine.latency + jitter);
        self.clock.plan(at, Happening::AtWorker(id, message));
    }

    fn bytes(&self, message: &Up) -> f64 {
        match message {
            Up::Pixels { lease, .. } => {
                let raw = f64::from(lease.row_count) * f64::from(self.setup.size.0) * 3.0;
                bytes::PIXELS_HEAD + raw / self.setup.compression
            }
            Up::Pong(_) | Up::Failed(_) | Up::Drain => bytes::CONTROL,
        }
    }

    fn bytes_per_second(&self) -> f64 {
        self.setup.link_bits / 8.0 * bytes::PAYLOAD_SHARE
    }

    fn jitter(&mut self) -> u64 {
        self.dice.roll(self.setup.jitter.saturating_add(1))
    }
}
