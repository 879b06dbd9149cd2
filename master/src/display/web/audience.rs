//! The clients that show the picture. Without any, the viewer requests no frames for this display.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;

use crate::viewer::{InputAction, ViewerHandle};

/// Pause before an action is sent again that did not fit into the viewer's queue.
const RETRY_PAUSE: Duration = Duration::from_millis(20);

/// Number of clients that show the picture.
#[derive(Clone, Debug)]
pub(super) struct Audience(Arc<watch::Sender<usize>>);

/// One client that shows the picture, until this value is dropped.
#[derive(Debug)]
pub(super) struct Looking(Audience);

impl Audience {
    /// No client.
    pub(super) fn new() -> Self {
        Self(Arc::new(watch::Sender::new(0)))
    }

    /// Adds a client.
    pub(super) fn look(&self) -> Looking {
        self.0.send_modify(|count| *count += 1);
        Looking(self.clone())
    }

    /// Reports to the viewer whether any client shows the picture, now and at every change. Never returns.
    pub(super) async fn report(&self, viewer: &ViewerHandle) {
        let mut counts = self.0.subscribe();
        let mut reported = None;
        loop {
            let visible = *counts.borrow_and_update() > 0;
            while reported != Some(visible) {
                if viewer.send(vec![InputAction::SetVisible(visible)]) {
                    reported = Some(visible);
                } else {
                    tokio::time::sleep(RETRY_PAUSE).await;
                }
            }
            if counts.changed().await.is_err() {
                return;
            }
        }
    }

    /// Waits until a client shows the picture.
    pub(super) async fn is_there(&self) {
        // The sender is alive: it belongs to `self`.
        let _ = self.0.subscribe().wait_for(|count| *count > 0).await;
    }
}

impl Drop for Looking {
    fn drop(&mut self) {
        self.0.0.send_modify(|count| *count -= 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn clients_are_counted_until_they_leave() {
        let audience = Audience::new();
        let waiting = audience.clone();
        let waiting = tokio::spawn(async move { waiting.is_there().await });
        let (first, second) = (audience.look(), audience.look());
        waiting.await.unwrap();
        drop(first);
        assert_eq!(*audience.0.borrow(), 1);
        drop(second);
        assert_eq!(*audience.0.borrow(), 0);
    }
}
