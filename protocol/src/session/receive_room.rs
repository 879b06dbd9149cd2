//! Bound of the pixels that all sessions of a process receive at a time.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};

use crate::limits::contended_deadline;

/// Room for bodies with pixels, in bytes, shared by sessions. A session takes the announced size before it reads a body, and waits
/// while the others leave too little. Clones share the room.
#[derive(Clone, Debug)]
pub struct ReceiveRoom(Arc<Room>);

#[derive(Debug)]
struct Room {
    bytes: usize,
    free: Arc<Semaphore>,
    /// Number of sessions that wait.
    waiting: watch::Sender<usize>,
}

impl ReceiveRoom {
    /// A room of that many bytes.
    pub fn new(bytes: usize) -> Self {
        let bytes = bytes.min(Semaphore::MAX_PERMITS);
        Self(Arc::new(Room { bytes, free: Arc::new(Semaphore::new(bytes)), waiting: watch::Sender::new(0) }))
    }

    /// Number of bytes that are not taken.
    pub fn free_bytes(&self) -> usize {
        self.0.free.available_permits()
    }

    /// Takes room for a body, and waits for it in the order of the calls. A body larger than the whole room takes all of it. Cancel
    /// safe. The room is free again when the permit is dropped.
    pub(super) async fn enter(&self, body_bytes: usize) -> Option<OwnedSemaphorePermit> {
        let permits = u32::try_from(body_bytes.min(self.0.bytes)).unwrap_or(u32::MAX);
        if let Ok(permit) = self.0.free.clone().try_acquire_many_owned(permits) {
            return Some(permit);
        }
        let _waiting = Waiting::new(&self.0.waiting);
        // The semaphore is never closed.
        self.0.free.clone().acquire_many_owned(permits).await.ok()
    }

    /// Waits until a body of this size is late while another session waits for room. Returns the time limit.
    pub(super) async fn late(&self, body_bytes: usize) -> Duration {
        let limit = contended_deadline(body_bytes);
        tokio::time::sleep(limit).await;
        // The sender exists as long as `self`.
        let _ = self.0.waiting.subscribe().wait_for(|waiting| *waiting > 0).await;
        limit
    }
}

/// A session that waits, until it is dropped.
struct Waiting<'a>(&'a watch::Sender<usize>);

impl<'a> Waiting<'a> {
    fn new(count: &'a watch::Sender<usize>) -> Self {
        count.send_modify(|waiting| *waiting += 1);
        Self(count)
    }
}

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        self.0.send_modify(|waiting| *waiting -= 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether a future is still pending after a simulated hour.
    async fn is_pending<T>(what: impl Future<Output = T>) -> bool {
        tokio::time::timeout(Duration::from_secs(3600), what).await.is_err()
    }

    #[tokio::test(start_paused = true)]
    async fn bodies_beyond_the_room_wait_until_others_are_dropped() {
        let room = ReceiveRoom::new(100);
        let first = room.enter(60).await.unwrap();
        assert_eq!(room.free_bytes(), 40);
        assert!(is_pending(room.enter(41)).await);
        assert_eq!(room.free_bytes(), 40, "a cancelled wait takes nothing");
        let second = room.enter(40).await.unwrap();
        drop(first);
        let third = room.enter(60).await.unwrap();
        assert_eq!(room.free_bytes(), 0);
        drop((second, third));
        let all = room.enter(1000).await.unwrap();
        assert_eq!(room.free_bytes(), 0, "a larger body takes all of the room, and waits for that");
        drop(all);
        assert_eq!(room.free_bytes(), 100);
    }

    #[tokio::test(start_paused = true)]
    async fn a_slow_body_is_late_only_while_another_session_waits() {
        let room = ReceiveRoom::new(100);
        assert!(is_pending(room.late(10)).await);
        let _slow = room.enter(100).await.unwrap();
        let begun = tokio::time::Instant::now();
        let (late, waits) = tokio::join!(room.late(100), is_pending(room.enter(1)));
        assert_eq!(late, contended_deadline(100));
        assert!(waits && begun.elapsed() >= late);
        assert!(is_pending(room.late(10)).await, "the session that waited is gone");
    }
}
