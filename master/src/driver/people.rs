//! Who comes, who goes, and what users want of them.

use std::time::Duration;

use rayfarm_protocol::Hello;
use rayfarm_protocol::handshake::Refusal;

use super::{Driver, Inner, Run};
use crate::farm::{FarmStatus, KickedWorker, RunTotals, TransferStatus, WorkerStatus};
use crate::identity::{Identity, host};
use crate::roster::{Kicked, Session};
use crate::scheduler::{Event, Reconnect, WorkerId};

/// Workers that are let in.
const MAX_WORKERS: usize = 1024;

impl Driver {
    /// How many workers are connected.
    pub(crate) fn worker_count(&self) -> usize {
        self.lock().roster.len()
    }

    /// Whether a session is still wanted.
    pub(crate) fn knows(&self, worker: WorkerId) -> bool {
        self.lock().roster.get(worker).is_some()
    }

    /// A number for a new worker.
    pub(crate) fn next_worker(&self) -> WorkerId {
        let mut inner = self.lock();
        inner.last_worker += 1;
        WorkerId(inner.last_worker)
    }

    /// A session has begun.
    pub(crate) fn join(&self, worker: WorkerId, session: Session) {
        let Hello { name, threads, .. } = session.hello.clone();
        let host = host(session.address.ip());
        let mut inner = self.lock();
        inner.roster.add(worker, session);
        self.drive(&mut inner, Event::WorkerJoined { worker, threads, host });
        inner.accounts.name(worker, &name);
    }

    /// Brings what a user wants of a connected worker; `false` if it is not connected.
    pub(crate) fn command(&self, worker: WorkerId, event: Event) -> bool {
        let mut inner = self.lock();
        let known = inner.roster.get(worker).is_some();
        if known {
            self.drive(&mut inner, event);
        }
        known
    }

    /// Sends a worker away at once and keeps it out; `false` if it is not connected.
    pub(crate) fn kick(&self, worker: WorkerId, reason: &str) -> bool {
        let mut inner = self.lock();
        let known = inner.roster.get(worker).is_some();
        if known {
            inner.roster.log_dismissal(worker, reason);
            inner.roster.bar(worker);
            inner.roster.end(worker, reason, Reconnect::Never);
            self.drive(&mut inner, Event::WorkerLeft { worker });
        }
        known
    }

    /// Lets kicked workers in again. Returns which.
    pub(crate) fn allow(&self, which: impl Fn(&Kicked) -> bool) -> Vec<Identity> {
        self.lock().roster.allow(which)
    }

    /// Why a worker that shakes hands is not let in, if it is not.
    pub(crate) fn refusal(&self, identity: &Identity) -> Option<Refusal> {
        let inner = self.lock();
        if inner.is_ending {
            return Some(Refusal::NotNow("the master ends".to_owned()));
        }
        let count = inner.roster.len();
        if inner.roster.is_barred(identity) {
            return Some(Refusal::Final(format!(
                "a worker called {} was kicked from this master; it is kept out until the master allows it or ends",
                identity.name()
            )));
        }
        let full = || Refusal::NotNow(format!("it has {count} workers already, the most it takes"));
        (count >= MAX_WORKERS).then(full)
    }

    /// A session has ended; its worker is told why, where it still listens.
    pub(crate) fn leave(&self, worker: WorkerId, reason: &str) {
        let mut inner = self.lock();
        inner.roster.end(worker, reason, Reconnect::Now);
        self.drive(&mut inner, Event::WorkerLeft { worker });
    }

    /// A look at everything, for overlays.
    pub(crate) fn status(&self) -> FarmStatus {
        let inner = self.lock();
        let workers = inner.scheduler.workers().filter_map(|record| {
            let session = inner.roster.get(record.worker)?;
            Some(WorkerStatus {
                id: record.worker.0,
                name: session.hello.name.clone(),
                local: session.identity.is_local(),
                address: session.address,
                threads: session.hello.threads,
                segments_done: record.segments_done,
                speed: record.speed,
                state: record.state,
                trouble: session.trouble.clone(),
            })
        });
        let kicked = inner.roster.barred().map(|Kicked { worker, identity }| KickedWorker {
            id: worker.0,
            name: identity.name(),
            address: match identity {
                Identity::Local(_) => None,
                Identity::Remote { address, .. } => Some(*address),
            },
        });
        let progress = inner.scheduler.progress();
        let part =
            progress.map_or(0.0, |progress| f64::from(progress.rows_done) / f64::from(progress.rows.max(1)));
        FarmStatus {
            transfers: transfers(&inner),
            totals: self.totals(&inner, part),
            workers: workers.collect(),
            kicked: kicked.collect(),
            local_gone: 0,
            frame: progress.map(|progress| progress.frame),
            rows_done: progress.map_or(0, |progress| progress.rows_done),
            rows: progress.map_or(0, |progress| progress.rows),
            wrong_frames: inner.delivered.wrong().count(),
            verification: Some(inner.scheduler.verification())
                .filter(|verification| verification.percent > 0),
        }
    }

    /// How many frames the run has.
    pub(crate) fn expect_frames(&self, frames: u64) {
        self.lock().run.frames = Some(frames);
    }

    /// Sums over the run; `part` of a frame is done beside the complete ones.
    fn totals(&self, inner: &Inner, part: f64) -> RunTotals {
        let Run { frames, done, begun, pace } = &inner.run;
        let (now, bytes) = (self.started.elapsed(), inner.roster.byte_count());
        let so_far = *done as f64 + part;
        RunTotals {
            frames_done: *done,
            frames: *frames,
            elapsed: begun.map_or(Duration::ZERO, |begun| now.saturating_sub(begun)),
            fps: pace.per_second(now, so_far),
            left: frames.and_then(|frames| pace.left(now, so_far, frames as f64)),
            sent_bytes: bytes.sent,
            received_bytes: bytes.received,
            scene_bytes: bytes.scene,
        }
    }

    /// Says goodbye to everybody and waits, not for long, until they have heard it. Nobody is let in any more.
    pub(crate) async fn part(&self, reason: &str) {
        let farewells: Vec<_> = {
            let mut inner = self.lock();
            inner.is_ending = true;
            let farewells = inner.roster.ids().into_iter().map(|worker| {
                let farewell = inner.roster.end(worker, reason, Reconnect::NextMaster);
                self.drive(&mut inner, Event::WorkerLeft { worker });
                farewell
            });
            farewells.flatten().collect()
        };
        for farewell in farewells {
            // It bounds itself, and cannot fail.
            let _ = farewell.await;
        }
    }
}

/// What workers wait for that have rendered nothing yet: one that renders has the scene.
fn transfers(inner: &Inner) -> TransferStatus {
    let mut status = TransferStatus::default();
    for record in inner.scheduler.workers().filter(|record| record.segments_done == 0) {
        if let Some(session) = inner.roster.get(record.worker) {
            session.transfers.add_to(&mut status);
        }
    }
    status
}
