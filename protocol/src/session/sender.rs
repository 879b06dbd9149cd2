//! The user's end of the two outgoing queues.

use std::fmt;
use std::marker::PhantomData;

use tokio::sync::mpsc::{self, error::TrySendError as QueueError};
use tokio_util::sync::CancellationToken;

use super::is_bulk;
use crate::ProtocolError;
use crate::envelope::Envelope;
use crate::message::Message;

/// Sends messages of one direction; clones share the queues.
pub struct Sender<Out> {
    pub(super) control: mpsc::Sender<Envelope>,
    pub(super) bulk: mpsc::Sender<Envelope>,
    pub(super) abort: CancellationToken,
    pub(super) direction: PhantomData<fn(Out)>,
}

/// Why a message was not sent.
#[derive(Debug, thiserror::Error)]
pub enum SendError {
    /// The session has ended; its [`Receiver`](super::Receiver) knows why.
    #[error("the session has ended")]
    Closed,
    /// The message breaks a bound and was not sent; the session lives on.
    #[error(transparent)]
    Invalid(#[from] ProtocolError),
}

/// Why a message was not sent at once.
#[derive(Debug, thiserror::Error)]
pub enum TrySendError<Out> {
    /// The queue is full: the peer reads too slowly. Here is the message back.
    #[error("the session's queue is full")]
    Full(Out),
    /// The session has ended; its [`Receiver`](super::Receiver) knows why.
    #[error("the session has ended")]
    Closed,
    /// The message breaks a bound and was not sent; the session lives on.
    #[error(transparent)]
    Invalid(#[from] ProtocolError),
}

impl<Out: Message> Sender<Out> {
    /// Puts a message into its queue, waiting while that is full.
    ///
    /// # Errors
    /// The session has ended, or the message breaks a bound.
    pub async fn send(&self, message: Out) -> Result<(), SendError> {
        let envelope = message.to_envelope()?;
        self.queue(&envelope).send(envelope).await.map_err(|_| SendError::Closed)
    }

    /// Puts a message into its queue if there is room.
    ///
    /// # Errors
    /// The queue is full, the session has ended, or the message breaks a bound.
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
    /// Waits until the session takes no more. After a goodbye this means that everything was written, and that the peer
    /// has closed too or has had [`crate::limits::LAST_WORD_GRACE`] to do so.
    pub async fn closed(&self) {
        self.control.closed().await;
    }

    /// Ends the session at once, in both directions, unwritten messages and all. For a peer that is not worth a goodbye.
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
