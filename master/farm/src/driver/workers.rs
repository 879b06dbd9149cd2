//! Workers that join and leave, commands to them, and the farm's status.

use std::time::Duration;

use rayfarm_protocol::handshake::Refusal;
use rayfarm_protocol::transport::{JoinedWorker, MasterSecurity};
use rayfarm_protocol::{Hello, KeyHash};
use rayfarm_scheduler::{Event, Reconnect, WorkerId};
use tokio_util::sync::CancellationToken;

use super::{Driver, Inner, Run};
use crate::assets::TransferStatus;
use crate::sessions::identity::{Identity, host};
use crate::sessions::{PastWorker, Session};
use crate::status::{BannedWorker, FarmStatus, RunTotals, WorkerStatus};

/// Most workers of one other host that have delivered nothing yet.
const MAX_UNPROVEN_OF_HOST: usize = 128;

/// Workers that this master has not started and that have delivered nothing, in the order in which they connected.
fn unproven(inner: &Inner) -> impl Iterator<Item = (WorkerId, &Session)> {
    inner.scheduler.workers().filter(|record| record.segments_done == 0).filter_map(|record| {
        let session = inner.sessions.get(record.worker)?;
        (!session.identity.is_local()).then_some((record.worker, session))
    })
}

impl Driver {
    /// Number of connected workers.
    pub(crate) fn worker_count(&self) -> usize {
        self.lock().sessions.len()
    }

    /// Whether a worker's session is current. The master may have ended it before its connection closes.
    pub(crate) fn is_connected(&self, worker: WorkerId) -> bool {
        self.lock().sessions.get(worker).is_some()
    }

    /// The number of the next worker.
    pub(crate) fn next_worker(&self) -> WorkerId {
        let mut inner = self.lock();
        inner.last_worker += 1;
        WorkerId(inner.last_worker)
    }

    /// Adds a session after its handshake.
    pub(crate) fn join(&self, worker: WorkerId, session: Session) {
        let Hello { name, threads, .. } = session.hello.clone();
        let host = host(session.address.ip());
        // A remote worker has a key only where it has proved the token.
        let trusted = session.identity.is_local() || session.key.is_some();
        let key = session.identity.key();
        if let (MasterSecurity::Tls(trust), Some(key)) = (&self.security, key) {
            trust.add_joined(JoinedWorker { key, name: name.clone() });
        }
        let mut inner = self.lock();
        inner.sessions.insert(worker, session);
        self.drive(&mut inner, Event::WorkerJoined { worker, threads, host, trusted });
        inner.accounts.name(worker, &name);
        drop(inner);
        // The key may have been revoked since the handshake.
        if key.is_some_and(|key| self.is_revoked(&key)) {
            self.end(worker, "the key of this worker is revoked");
        }
    }

    /// Disconnects the workers whose keys are revoked, whenever the set of revoked keys changes, until `stop`.
    pub(crate) async fn end_revoked(&self, stop: CancellationToken) {
        let MasterSecurity::Tls(trust) = &self.security else { return };
        let mut revoked = trust.revoked();
        while let Some(Ok(())) = stop.run_until_cancelled(revoked.changed()).await {
            let keys = revoked.borrow_and_update().clone();
            let workers = self
                .lock()
                .sessions
                .ids_with(|session| session.identity.key().is_some_and(|key| keys.contains(&key)));
            for worker in workers {
                self.end(worker, "the key of this worker is revoked");
            }
        }
    }

    fn is_revoked(&self, key: &KeyHash) -> bool {
        matches!(&self.security, MasterSecurity::Tls(trust) if trust.is_revoked(key))
    }

    /// Disconnects a worker for good.
    fn end(&self, worker: WorkerId, reason: &str) {
        let mut inner = self.lock();
        inner.sessions.log_disconnect(worker, reason);
        inner.sessions.disconnect(worker, reason, Reconnect::Never);
        self.drive(&mut inner, Event::WorkerLeft { worker });
    }

    /// Handles a user's command to a worker. Returns whether the worker is connected.
    pub(crate) fn command(&self, worker: WorkerId, event: Event) -> bool {
        let mut inner = self.lock();
        let known = inner.sessions.get(worker).is_some();
        if known {
            self.drive(&mut inner, event);
        }
        known
    }

    /// Disconnects and bans a worker. Returns whether it was connected.
    pub(crate) fn ban(&self, worker: WorkerId, reason: &str) -> bool {
        let mut inner = self.lock();
        let known = inner.sessions.get(worker).is_some();
        if known {
            inner.sessions.log_disconnect(worker, reason);
            inner.sessions.ban(worker);
            inner.sessions.disconnect(worker, reason, Reconnect::Never);
            self.drive(&mut inner, Event::WorkerLeft { worker });
        }
        known
    }

    /// Lifts the bans that `which` selects. Returns the identities.
    pub(crate) fn allow(&self, which: impl Fn(&PastWorker) -> bool) -> Vec<Identity> {
        let mut inner = self.lock();
        let allowed = inner.sessions.allow(which);
        for identity in &allowed {
            if let Identity::Remote { address, .. } = identity {
                self.drive(&mut inner, Event::BanLifted { host: host(*address) });
            }
        }
        allowed
    }

    /// The reason to refuse a worker in its handshake; `None`: it is admitted.
    pub(crate) fn refusal(&self, identity: &Identity) -> Option<Refusal> {
        let mut inner = self.lock();
        if inner.is_ending {
            return Some(Refusal::NotNow("the master ends".to_owned()));
        }
        if inner.sessions.is_banned(identity) {
            return Some(Refusal::Final(format!(
                "worker {} is banned from this master; the ban ends when the master allows the worker or exits",
                identity.name()
            )));
        }
        if identity.key().is_some_and(|key| self.is_revoked(&key)) {
            return Some(Refusal::Final(
                "the key of this worker is revoked; `rayfarm-master trust allow` admits it again".to_owned(),
            ));
        }
        // One host must not take all places: they are for workers that deliver. A refusal for lack of room passes.
        let of_host = unproven(&inner).filter(|(_, session)| identity.is_of_host(session.address.ip()));
        if of_host.count() >= MAX_UNPROVEN_OF_HOST {
            return Some(Refusal::NotNow(format!(
                "{MAX_UNPROVEN_OF_HOST} workers of this host have delivered nothing yet"
            )));
        }
        let count = inner.sessions.len();
        if count < self.max_workers {
            return None;
        }
        let oldest = unproven(&inner).map(|(worker, _)| worker).next();
        let Some(worker) = oldest else {
            return Some(Refusal::NotNow(format!("it has {count} workers, its limit")));
        };
        let reason = "another worker needs the place, and this one has delivered nothing";
        inner.sessions.log_disconnect(worker, reason);
        inner.sessions.disconnect(worker, reason, Reconnect::Now);
        self.drive(&mut inner, Event::WorkerLeft { worker });
        None
    }

    /// Removes a session that has ended. The reason is sent to the worker if its connection still works.
    pub(crate) fn leave(&self, worker: WorkerId, reason: &str) {
        let mut inner = self.lock();
        inner.sessions.disconnect(worker, reason, Reconnect::Now);
        self.drive(&mut inner, Event::WorkerLeft { worker });
    }

    /// The current status, except for local workers that have exited.
    pub(crate) fn status(&self) -> FarmStatus {
        let inner = self.lock();
        let workers = inner.scheduler.workers().filter_map(|record| {
            let session = inner.sessions.get(record.worker)?;
            Some(WorkerStatus {
                id: record.worker.0,
                name: session.hello.name.clone(),
                local: session.identity.is_local(),
                address: session.address,
                threads: session.hello.threads,
                segments_done: record.segments_done,
                speed: record.speed,
                state: record.state,
                last_failure: session.last_failure.clone(),
            })
        });
        let banned = inner.sessions.banned().map(|PastWorker { worker, identity }| BannedWorker {
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
        let (pending, refused) = self.door.counts();
        FarmStatus {
            pending,
            refused,
            transfers: transfers(&inner),
            totals: self.totals(&inner, part),
            workers: workers.collect(),
            banned: banned.collect(),
            local_exited: 0,
            frame: progress.map(|progress| progress.frame),
            rows_done: progress.map_or(0, |progress| progress.rows_done),
            rows: progress.map_or(0, |progress| progress.rows),
            wrong_frames: inner.delivered.wrong().count(),
            verification: Some(inner.scheduler.verification())
                .filter(|verification| verification.percent > 0 || verification.picked > 0),
        }
    }

    /// Sets the number of frames of the run.
    pub(crate) fn expect_frames(&self, frames: u64) {
        self.lock().run.frames = Some(frames);
    }

    /// Sums over the run; `part` is the finished share of the frame in flight, 0 to 1.
    fn totals(&self, inner: &Inner, part: f64) -> RunTotals {
        let Run { frames, done, begun, pace } = &inner.run;
        let (now, bytes) = (self.started.elapsed(), inner.sessions.byte_count());
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

    /// Disconnects all workers and admits no more. Returns when each disconnect message is sent or has timed out.
    pub(crate) async fn disconnect_all(&self, reason: &str) {
        let flushes: Vec<_> = {
            let mut inner = self.lock();
            inner.is_ending = true;
            let flushes = inner.sessions.ids().into_iter().map(|worker| {
                let flush = inner.sessions.disconnect(worker, reason, Reconnect::NextMaster);
                self.drive(&mut inner, Event::WorkerLeft { worker });
                flush
            });
            flushes.flatten().collect()
        };
        for flush in flushes {
            // The task has a time limit and does not panic.
            let _ = flush.await;
        }
    }
}

/// Progress of the scene's transfer to the workers that have finished no segment yet: one that has, has the scene.
fn transfers(inner: &Inner) -> TransferStatus {
    let mut status = TransferStatus::default();
    for record in inner.scheduler.workers().filter(|record| record.segments_done == 0) {
        if let Some(session) = inner.sessions.get(record.worker) {
            session.transfers.add_to(&mut status);
        }
    }
    status
}
