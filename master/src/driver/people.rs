//! Who comes, who goes, and what users want of them.

use std::net::IpAddr;

use rayfarm_protocol::Hello;

use super::Driver;
use crate::farm::{FarmStatus, WorkerStatus};
use crate::roster::Session;
use crate::scheduler::{Event, Return, WorkerId};

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
        let mut inner = self.lock();
        inner.roster.add(worker, session);
        self.drive(&mut inner, Event::WorkerJoined { worker, threads });
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
            inner.roster.end(worker, reason, Return::Unwanted);
            self.drive(&mut inner, Event::WorkerLeft { worker });
        }
        known
    }

    /// Lets kicked workers of this name in again. Returns how many were kept out.
    pub(crate) fn allow(&self, name: &str) -> usize {
        self.lock().roster.allow(name)
    }

    /// Why a worker that shakes hands is not let in, if it is not.
    pub(crate) fn refusal(&self, hello: &Hello, address: IpAddr) -> Option<String> {
        let inner = self.lock();
        if inner.is_ending {
            return Some("the master ends".to_owned());
        }
        let count = inner.roster.len();
        if inner.roster.is_barred(&hello.name, address) {
            return Some(format!(
                "a worker called {} was kicked from this master; it is kept out until the master allows it or ends",
                hello.name
            ));
        }
        (count >= MAX_WORKERS).then(|| format!("this master has {count} workers already, the most it takes"))
    }

    /// A session has ended; its worker is told why, where it still listens.
    pub(crate) fn leave(&self, worker: WorkerId, reason: &str) {
        let mut inner = self.lock();
        inner.roster.end(worker, reason, Return::Welcome);
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
                address: session.address,
                threads: session.hello.threads,
                segments_done: record.segments_done,
                speed: record.speed,
                state: record.state,
                trouble: session.trouble.clone(),
            })
        });
        let progress = inner.scheduler.progress();
        FarmStatus {
            workers: workers.collect(),
            kicked: inner.roster.barred(),
            frame: progress.map(|progress| progress.frame),
            rows_done: progress.map_or(0, |progress| progress.rows_done),
            rows: progress.map_or(0, |progress| progress.rows),
            verification: Some(inner.scheduler.verification())
                .filter(|verification| verification.percent > 0),
        }
    }

    /// Says goodbye to everybody and waits, not for long, until they have heard it. Nobody is let in any more.
    pub(crate) async fn part(&self, reason: &str) {
        let farewells: Vec<_> = {
            let mut inner = self.lock();
            inner.is_ending = true;
            let farewells = inner.roster.ids().into_iter().map(|worker| {
                let farewell = inner.roster.end(worker, reason, Return::Unwanted);
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
