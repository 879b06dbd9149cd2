//! One connected worker.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfarm_protocol::session::{BodyLimit, Sender, Traffic};
use rayfarm_protocol::{Hello, KeyHash, Lease, Reconnect, ToWorker};
use tokio::task::JoinHandle;

use super::causes::Causes;
use super::identity::Identity;
use super::lease_book::{LeaseBook, LeaseStatus};
use crate::assets::peer_endpoint::PeerEndpoint;
use crate::assets::transfers::Transfers;
use crate::bucket::Rate;
use crate::line_budget::LineBudget;

/// Time limit for sending the messages that are queued when a session ends, the disconnect message included.
const DISCONNECT_TIMEOUT: Duration = Duration::from_secs(1);

/// Log lines about failures of one worker.
const FAILURE_LINES: Rate = Rate { burst: 8.0, per_second: 0.2 };

/// The connection of a session.
pub(crate) struct Link {
    pub(crate) address: SocketAddr,
    /// Hash of the worker's public key, where the connection uses TLS. A local worker has one, too.
    pub(crate) key: Option<KeyHash>,
    pub(crate) sender: Sender<ToWorker>,
    pub(crate) traffic: Arc<Traffic>,
    /// Limit of the pixels that the worker may send.
    pub(crate) pixels: BodyLimit,
}

/// A connected worker.
pub(crate) struct Session {
    /// The worker's introduction. Its name is the one to display, never a ticket.
    pub(crate) hello: Hello,
    pub(crate) identity: Identity,
    pub(crate) address: SocketAddr,
    /// Hash of its public key, where the connection uses TLS. A local worker has one, too.
    pub(crate) key: Option<KeyHash>,
    pub(crate) leases: LeaseBook,
    /// Why it last failed to render a frame.
    pub(crate) last_failure: Option<String>,
    /// Where the worker serves assets to other workers.
    pub(crate) peer_server: Option<PeerEndpoint>,
    /// Assets that it has requested.
    pub(crate) transfers: Transfers,
    pub(super) sender: Sender<ToWorker>,
    pub(super) traffic: Arc<Traffic>,
    /// Limit of the pixels that it may send.
    pixels: BodyLimit,
    /// What it may report.
    pub(crate) causes: Causes,
    /// Log lines about its failures.
    pub(crate) failure_lines: LineBudget,
    /// Whether its beginning was logged, and its end will be.
    pub(crate) is_logged: bool,
    /// Numbers of bytes that had arrived at the last two pings, the earlier one first.
    received_at_pings: [u64; 2],
}

impl Session {
    /// A session after its handshake.
    pub(crate) fn new(hello: Hello, identity: Identity, link: Link, is_logged: bool) -> Self {
        let Link { address, key, sender, traffic, pixels } = link;
        Self {
            hello,
            identity,
            address,
            key,
            leases: LeaseBook::default(),
            last_failure: None,
            peer_server: None,
            transfers: Transfers::default(),
            sender,
            traffic,
            pixels,
            causes: Causes::default(),
            failure_lines: LineBudget::new(FAILURE_LINES, Instant::now()),
            is_logged,
            received_at_pings: [0; 2],
        }
    }

    /// Notes that a ping of this number is sent now.
    pub(crate) fn note_ping(&mut self, nonce: u64) {
        self.causes.ping(nonce);
        let [_, last] = self.received_at_pings;
        self.received_at_pings = [last, self.traffic.received_bytes()];
    }

    /// Bounds the pixels that it may send by its leases. Called after each new lease, before the lease is sent.
    pub(crate) fn bound_pixels(&self) {
        self.pixels.set(self.leases.largest());
    }

    /// Checks a reply against its leases.
    pub(crate) fn check_reply(&mut self, lease: &Lease) -> LeaseStatus {
        let status = self.leases.check_reply(lease);
        self.bound_pixels();
        status
    }

    /// Whether bytes have arrived since the last ping but one, whole messages or not.
    pub(crate) fn is_receiving(&self) -> bool {
        self.traffic.received_bytes() > self.received_at_pings[0]
    }
}

/// Sends a disconnect message in the background and closes the connection. The task ends within [`DISCONNECT_TIMEOUT`].
pub(super) fn send_disconnect(
    sender: Sender<ToWorker>,
    reason: &str,
    reconnect: Reconnect,
) -> JoinHandle<()> {
    let message = ToWorker::Disconnect { reason: reason.to_owned(), reconnect };
    tokio::spawn(async move {
        let flush = async {
            // Sending fails where the session has ended already; then there is nothing to flush.
            if sender.send(message).await.is_ok() {
                sender.closed().await;
            }
        };
        let _ = tokio::time::timeout(DISCONNECT_TIMEOUT, flush).await;
        sender.abort();
    })
}
