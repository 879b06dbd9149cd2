//! Who is connected: their senders, what they were granted, and the bytes that went to and fro.

use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use rayfarm_protocol::passing::ShareKey;
use rayfarm_protocol::session::{Sender, Traffic};
use rayfarm_protocol::{AssetId, Hello, Reconnect, ToWorker};
use tokio::task::JoinHandle;

use crate::chains::{Chains, Source};
use crate::identity::Identity;
use crate::lease_book::LeaseBook;
use crate::scheduler::WorkerId;
use crate::transfers::Transfers;

/// How long a worker's last messages may take.
const FAREWELL: Duration = Duration::from_secs(1);
/// Kicked workers that are kept out; beyond that, the one kicked longest ago is forgotten.
const MAX_KICKED: usize = 1024;
/// Workers that have left and are still known by name.
const MAX_LEFT: usize = 256;
/// Workers whose trouble is told at a time.
const MAX_TOLD: usize = 4;

/// The sessions that are wanted.
#[derive(Default)]
pub(crate) struct Roster {
    sessions: BTreeMap<WorkerId, Session>,
    /// Traffic of sessions that have ended.
    ended: ByteCount,
    /// Kicked workers: each is refused when it connects again.
    kicked: VecDeque<Kicked>,
    /// Workers that have left lately: one may be found to have sent wrong pixels when it is gone.
    left: VecDeque<Kicked>,
    pub(crate) chains: Chains,
}

/// A worker that was kicked, or has left.
#[derive(Clone, Debug)]
pub(crate) struct Kicked {
    /// Its last number.
    pub(crate) worker: WorkerId,
    pub(crate) identity: Identity,
}

/// A connected worker.
pub(crate) struct Session {
    /// Its name is the one that is shown.
    pub(crate) hello: Hello,
    pub(crate) identity: Identity,
    pub(crate) address: SocketAddr,
    pub(crate) leases: LeaseBook,
    /// Why it could not render, the last time it could not.
    pub(crate) trouble: Option<String>,
    /// Where it passes assets on, and what opens them there.
    pub(crate) sharing: Option<(SocketAddr, ShareKey)>,
    /// Assets on their way to it.
    pub(crate) transfers: Transfers,
    sender: Sender<ToWorker>,
    traffic: Arc<Traffic>,
}

/// Bytes that went over the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ByteCount {
    pub(crate) sent: u64,
    pub(crate) received: u64,
    /// The part of `sent` that says what to draw.
    pub(crate) scene: u64,
}

/// A worker lets its queue fill up, or its session has ended without anybody knowing yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Unreachable;

impl Session {
    /// A session that has shaken hands.
    pub(crate) fn new(
        hello: Hello,
        identity: Identity,
        address: SocketAddr,
        sender: Sender<ToWorker>,
        traffic: Arc<Traffic>,
    ) -> Self {
        Self {
            hello,
            identity,
            address,
            leases: LeaseBook::default(),
            trouble: None,
            sharing: None,
            transfers: Transfers::default(),
            sender,
            traffic,
        }
    }
}

impl Roster {
    pub(crate) fn add(&mut self, worker: WorkerId, session: Session) {
        self.sessions.insert(worker, session);
    }

    pub(crate) fn get(&self, worker: WorkerId) -> Option<&Session> {
        self.sessions.get(&worker)
    }

    pub(crate) fn get_mut(&mut self, worker: WorkerId) -> Option<&mut Session> {
        self.sessions.get_mut(&worker)
    }

    pub(crate) fn len(&self) -> usize {
        self.sessions.len()
    }

    pub(crate) fn ids(&self) -> Vec<WorkerId> {
        self.sessions.keys().copied().collect()
    }

    /// Render threads of all workers.
    pub(crate) fn threads(&self) -> u32 {
        self.sessions.values().fold(0, |sum, session| sum.saturating_add(session.hello.threads))
    }

    /// Why workers could not render, the last time they could not: the first few of them, for people.
    pub(crate) fn troubles(&self) -> String {
        let troubles =
            self.sessions.values().filter_map(|s| Some(format!("{}: {}", s.hello.name, s.trouble.as_ref()?)));
        troubles.take(MAX_TOLD).collect::<Vec<_>>().join("; ")
    }

    /// Queues a message. A worker that does not read what it is sent is dismissed: it is as good as gone.
    pub(crate) fn send(&mut self, worker: WorkerId, message: ToWorker) -> Result<(), Unreachable> {
        let Some(session) = self.sessions.get(&worker) else { return Ok(()) };
        let Err(error) = session.sender.try_send(message) else { return Ok(()) };
        self.log_dismissal(worker, &format!("cannot send to it: {error}"));
        self.end(worker, "you do not read what you are sent", Reconnect::Now);
        Err(Unreachable)
    }

    /// Says in the log that the master itself ends a session, and why.
    pub(crate) fn log_dismissal(&self, worker: WorkerId, reason: &str) {
        if let Some(Session { hello, address, .. }) = self.sessions.get(&worker) {
            tracing::warn!("{worker} ({}, {address}) is dismissed: {reason}", hello.name);
        }
    }

    /// Says in the log that a worker leaves as it was meant to.
    pub(crate) fn log_departure(&self, worker: WorkerId, reason: &str) {
        if let Some(Session { hello, address, .. }) = self.sessions.get(&worker) {
            tracing::info!("{worker} ({}, {address}) leaves: {reason}", hello.name);
        }
    }

    /// Forgets a session and sees it off in the background: a last word, if there is room for it, then the end.
    pub(crate) fn end(
        &mut self,
        worker: WorkerId,
        reason: &str,
        reconnect: Reconnect,
    ) -> Option<JoinHandle<()>> {
        let Session { sender, traffic, identity, .. } = self.sessions.remove(&worker)?;
        self.ended.add(&traffic);
        self.chains.left(worker);
        self.left.push_back(Kicked { worker, identity });
        while self.left.len() > MAX_LEFT {
            self.left.pop_front();
        }
        let goodbye = ToWorker::Goodbye { reason: reason.to_owned(), reconnect };
        Some(tokio::spawn(async move {
            let last_words = async {
                // A session that has ended already needs none.
                if sender.send(goodbye).await.is_ok() {
                    sender.closed().await;
                }
            };
            let _ = tokio::time::timeout(FAREWELL, last_words).await;
            sender.abort();
        }))
    }

    /// Keeps a worker out from now on, if it is connected or was lately. Its session goes on until it is ended.
    pub(crate) fn bar(&mut self, worker: WorkerId) {
        let here = self.sessions.get(&worker).map(|session| session.identity.clone());
        let gone = || self.left.iter().find(|left| left.worker == worker).map(|left| left.identity.clone());
        let Some(identity) = here.or_else(gone) else { return };
        if !self.is_barred(&identity) {
            self.kicked.push_back(Kicked { worker, identity });
        }
        while self.kicked.len() > MAX_KICKED {
            self.kicked.pop_front();
        }
    }

    /// Whether a worker was kicked.
    pub(crate) fn is_barred(&self, identity: &Identity) -> bool {
        self.kicked.iter().any(|kicked| kicked.identity == *identity)
    }

    /// Lets kicked workers in again. Returns which.
    pub(crate) fn allow(&mut self, which: impl Fn(&Kicked) -> bool) -> Vec<Identity> {
        let (allowed, kicked) = std::mem::take(&mut self.kicked).into_iter().partition::<Vec<_>, _>(which);
        self.kicked = kicked.into();
        allowed.into_iter().map(|kicked| kicked.identity).collect()
    }

    /// Those that are kept out, in the order in which they were kicked.
    pub(crate) fn barred(&self) -> impl Iterator<Item = &Kicked> {
        self.kicked.iter()
    }

    /// Where a worker gets an asset, and what opens it there, if another worker passes it on.
    pub(crate) fn source(
        &mut self,
        now: Duration,
        worker: WorkerId,
        id: AssetId,
        again: bool,
    ) -> Option<(SocketAddr, ShareKey)> {
        // Where a worker of this very machine listens, others cannot connect.
        let is_here = |id: WorkerId| self.sessions.get(&id).map(|s| s.address.ip().is_loopback());
        let here = is_here(worker);
        match self.chains.wanted(now, worker, id, again, |other| is_here(other) == here) {
            Source::Worker(from) => self.sessions.get(&from)?.sharing,
            Source::Master => None,
        }
    }

    /// All bytes up to now.
    pub(crate) fn byte_count(&self) -> ByteCount {
        let mut sum = self.ended;
        self.sessions.values().for_each(|session| sum.add(&session.traffic));
        sum
    }
}

impl ByteCount {
    fn add(&mut self, traffic: &Traffic) {
        self.sent = self.sent.saturating_add(traffic.sent_bytes());
        self.received = self.received.saturating_add(traffic.received_bytes());
        self.scene = self.scene.saturating_add(traffic.scene_sent_bytes());
    }

    /// What came after an earlier count.
    pub(crate) fn since(self, earlier: Self) -> Self {
        Self {
            sent: self.sent.saturating_sub(earlier.sent),
            received: self.received.saturating_sub(earlier.received),
            scene: self.scene.saturating_sub(earlier.scene),
        }
    }
}
