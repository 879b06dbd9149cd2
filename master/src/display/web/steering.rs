//! Which client moves the camera: one at a time. Others request it, and the client that steers hands over.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;
use tokio::sync::watch;

/// Time without input after which a request to steer is granted at once.
const IDLE: Duration = Duration::from_secs(10);

/// Number of a client, never reused.
pub(super) type ClientId = u64;

/// State of steering, as all clients receive it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(super) struct SteeringState {
    /// The client that moves the camera.
    pub(super) steers: Option<ClientId>,
    /// The client that has requested to.
    pub(super) requests: Option<ClientId>,
    /// Number of clients.
    pub(super) clients: usize,
}

/// The clients of one server.
#[derive(Debug)]
pub(super) struct Steering {
    inner: Mutex<Inner>,
    state: watch::Sender<SteeringState>,
    most: usize,
}

#[derive(Debug)]
struct Inner {
    next: ClientId,
    clients: Vec<ClientId>,
    steers: Option<ClientId>,
    requests: Option<ClientId>,
    last_input: Instant,
}

impl Steering {
    /// No client, and at most `most` of them.
    pub(super) fn new(most: usize) -> Self {
        let inner =
            Inner { next: 1, clients: Vec::new(), steers: None, requests: None, last_input: Instant::now() };
        Self { inner: Mutex::new(inner), state: watch::Sender::default(), most }
    }

    /// Adds a client, which steers if it is the only one. `None` where there are too many.
    pub(super) fn join(&self, now: Instant) -> Option<ClientId> {
        self.change(|inner| {
            if inner.clients.len() >= self.most {
                return None;
            }
            let id = inner.next;
            inner.next += 1;
            inner.clients.push(id);
            if inner.steers.is_none() {
                inner.hand_over(Some(id), now);
            }
            Some(id)
        })
    }

    /// Removes a client. The one with a request steers next, or else the one that joined first.
    pub(super) fn leave(&self, id: ClientId, now: Instant) {
        self.change(|inner| {
            inner.clients.retain(|client| *client != id);
            inner.requests.take_if(|client| *client == id);
            if inner.steers == Some(id) {
                let next = inner.requests.or(inner.clients.first().copied());
                inner.hand_over(next, now);
            }
        });
    }

    /// Whether a client may move the camera now. Its input is recorded.
    pub(super) fn input(&self, id: ClientId, now: Instant) -> bool {
        let mut inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        let steers = inner.steers == Some(id);
        if steers {
            inner.last_input = now;
        }
        steers
    }

    /// Requests to steer: granted at once where the client that steers is idle.
    pub(super) fn request(&self, id: ClientId, now: Instant) {
        self.change(|inner| {
            if inner.steers == Some(id) {
                return;
            }
            if inner.steers.is_none() || now.saturating_duration_since(inner.last_input) >= IDLE {
                inner.hand_over(Some(id), now);
            } else {
                inner.requests = Some(id);
            }
        });
    }

    /// Answers the open request of another client, if `id` steers.
    pub(super) fn answer(&self, id: ClientId, grant: bool, now: Instant) {
        self.change(|inner| {
            if inner.steers != Some(id) {
                return;
            }
            if let (Some(next), true) = (inner.requests.take(), grant) {
                inner.hand_over(Some(next), now);
            }
        });
    }

    /// Number of clients.
    pub(super) fn clients(&self) -> usize {
        self.state.borrow().clients
    }

    /// The state and its changes.
    pub(super) fn state(&self) -> watch::Receiver<SteeringState> {
        self.state.subscribe()
    }

    fn change<T>(&self, act: impl FnOnce(&mut Inner) -> T) -> T {
        let mut inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        let result = act(&mut inner);
        let state =
            SteeringState { steers: inner.steers, requests: inner.requests, clients: inner.clients.len() };
        self.state.send_if_modified(|shown| std::mem::replace(shown, state) != state);
        result
    }
}

impl Inner {
    fn hand_over(&mut self, to: Option<ClientId>, now: Instant) {
        self.steers = to;
        self.requests = None;
        self.last_input = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_client_steers_and_hands_over() {
        let (steering, now) = (Steering::new(3), Instant::now());
        let [first, second, third] = [0; 3].map(|_| steering.join(now).unwrap());
        assert_eq!(steering.join(now), None, "too many");
        assert!(steering.input(first, now) && !steering.input(second, now));
        steering.request(second, now);
        assert_eq!(steering.state().borrow().requests, Some(second));
        steering.answer(third, true, now);
        assert!(steering.input(first, now), "only the client that steers answers");
        steering.answer(first, false, now);
        assert!(steering.input(first, now));
        steering.request(second, now);
        steering.answer(first, true, now);
        assert!(steering.input(second, now) && !steering.input(first, now));
        steering.request(third, now);
        steering.leave(second, now);
        assert!(steering.input(third, now), "the request is granted");
        steering.leave(third, now);
        assert!(steering.input(first, now));
        steering.leave(first, now);
        assert_eq!(*steering.state().borrow(), SteeringState::default());
    }

    #[test]
    fn an_idle_client_hands_over_at_once() {
        let (steering, now) = (Steering::new(3), Instant::now());
        let [first, second] = [0; 2].map(|_| steering.join(now).unwrap());
        assert!(steering.input(first, now + IDLE / 2));
        steering.request(second, now + IDLE);
        assert!(!steering.input(second, now + IDLE));
        steering.request(second, now + IDLE / 2 + IDLE);
        assert!(steering.input(second, now + IDLE / 2 + IDLE));
    }
}
