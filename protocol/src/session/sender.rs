//! The sending half of a session.

use std::fmt;
use std::marker::PhantomData;

use tokio::sync::mpsc::{self, error::TrySendError as QueueError};
use tokio_util::sync::CancellationToken;

use super::is_bulk;
use crate::ProtocolError;
use crate::envelope::Envelope;
use crate::message::Message;

/// Sends messages of one direction. Clones share the two queues.
pub struct Sender<Out> {
    pub(super) control: mpsc::Sender<Envelope>,
    pub(super) bulk: mpsc::Sender<Envelope>,
    pub(super) abort: CancellationToken,
    pub(super) direction: PhantomData<fn(Out)>,
}

/// Error of [`Sender::send`].
#[derive(Debug, thiserror::Error)]
pub enum SendError {
    /// The session has ended. Its [`Receiver`](super::Receiver) returns the reason.
    #[error("the session has ended")]
    Closed,
    /// The message breaks a bound and was not sent. The session continues.
    #[error(transparent)]
    Invalid(#[from] ProtocolError),
}

/// Error of [`Sender::try_send`].
#[derive(Debug, thiserror::Error)]
pub enum TrySendError<Out> {
    /// The queue is full because the peer reads too slowly. The message is returned.
    #[error("the session's queue is full")]
    Full(Out),
    /// The session has ended. Its [`Receiver`](super::Receiver) returns the reason.
    #[error("the session has ended")]
    Closed,
    /// The message breaks a bound and was not sent. The session continues.
    #[error(transparent)]
    Invalid(#[from] ProtocolError),
}

impl<Out: Message> Sender<Out> {
    /// Queues a message, and waits while its queue is full.
    ///
    /// # Errors
    /// An ended session; a message that breaks a bound.
    pub async fn send(&self, message: Out) -> Result<(), SendError> {
        let envelope = message.to_envelope()?;
        self.queue(&envelope).send(envelope).await.map_err(|_| SendError::Closed)
    }

    /// Queues a message without waiting.
    ///
    /// # Errors
    /// A full queue; an ended session; a message that breaks a bound.
    pub fn try_send(&self, message: Out) -> Result<(), TrySendError<Out>> {
        let envelope = message.to_envelope()?;
        self.queue(&envelope).try_send(envelope).map_err(|error| match error {
            QueueError::Full(_) => TrySendError::Full(message),
            QueueError::Closed(_) => TrySendError::Closed,
        })
    }

    fn queue(&self, envelope: &Envelope) -> &mpsc::Sender<Envelope> {
        if is_bulk(envelope.kind()) { &self.bulk } else { &self.control }
    }
}

impl<Out> Sender<Out> {
    /// Waits until the session accepts no more messages. After a disconnect, everything is written by then, and the peer
    /// has closed or has had [`crate::limits::CLOSE_GRACE`] to do so.
    pub async fn closed(&self) {
        self.control.closed().await;
    }

    /// Ends both directions of the session at once, without a disconnect. Queued messages are dropped.
    pub fn abort(&self) {
        self.abort.cancel();
    }
}

impl<Out> Clone for Sender<Out> {
    fn clone(&self) -> Self {
        let Self { control, bulk, abort, direction } = self;
        Self { control: control.clone(), bulk: bulk.clone(), abort: abort.clone(), direction: *direction }
    }
}

impl<Out> fmt::Debug for Sender<Out> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sender").field("closed", &self.control.is_closed()).finish_non_exhaustive()
    }
}
