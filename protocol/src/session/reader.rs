//! The task that reads, and the user's end of what it read.

use std::sync::Arc;

use tokio::io::{AsyncRead, BufReader, ReadHalf};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio_util::sync::CancellationToken;

use super::Traffic;
use crate::ProtocolError;
use crate::envelope::{read_body, read_header};
use crate::limits::INBOX_BYTES;
use crate::message::Message;

/// A peer's message on its way to the user, with the room it takes in the inbox.
pub(super) struct Delivery<In> {
    pub(super) message: Result<In, ProtocolError>,
    pub(super) _room: Option<OwnedSemaphorePermit>,
}

/// Receives messages of one direction.
pub struct Receiver<In> {
    pub(super) messages: mpsc::Receiver<Delivery<In>>,
}

impl<In> std::fmt::Debug for Receiver<In> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Receiver").finish_non_exhaustive()
    }
}

impl<In: Message> Receiver<In> {
    /// The next message. `None` once the connection has ended: cleanly, or after the error that was handed out before.
    /// Safe to drop half-way, as `select!` does.
    pub async fn recv(&mut self) -> Option<Result<In, ProtocolError>> {
        let Delivery { message, _room } = self.messages.recv().await?;
        if message.is_err() {
            // One error ends a session: nothing that comes after it can be trusted to be in step.
            self.messages.close();
            while self.messages.try_recv().is_ok() {}
        }
        Some(message)
    }
}

/// Reads until the peer closes, fails, or nobody listens any more.
pub(super) async fn run<S, In>(
    io: ReadHalf<S>,
    inbox: mpsc::Sender<Delivery<In>>,
    traffic: Arc<Traffic>,
    abort: CancellationToken,
) where
    S: AsyncRead,
    In: Message,
{
    let mut io = BufReader::new(io);
    let room = Arc::new(Semaphore::new(INBOX_BYTES));
    loop {
        let delivery = tokio::select! {
            biased;
            () = abort.cancelled() => return,
            () = inbox.closed() => return,
            read = read_message(&mut io, &room, &traffic) => match read {
                Ok(None) => return,
                Ok(Some(delivery)) => delivery,
                Err(error) => Delivery { message: Err(error), _room: None },
            },
        };
        let failed = delivery.message.is_err();
        tokio::select! {
            biased;
            () = abort.cancelled() => return,
            sent = inbox.send(delivery) => if failed || sent.is_err() { return },
        }
    }
}

async fn read_message<In: Message>(
    io: &mut (impl AsyncRead + Unpin),
    room: &Arc<Semaphore>,
    traffic: &Traffic,
) -> Result<Option<Delivery<In>>, ProtocolError> {
    let Some(header) = read_header(io).await? else { return Ok(None) };
    if !In::carries(header.kind) {
        return Err(ProtocolError::Unexpected { kind: header.kind, expected: In::EXPECTED });
    }
    // Every body fits: INBOX_BYTES is above every type's limit, and below what one permit can count.
    let permits = u32::try_from(header.body_bytes).unwrap_or(u32::MAX);
    let taken = room.clone().acquire_many_owned(permits).await;
    let body = read_body(io, header).await?;
    traffic.count_received(header);
    Ok(Some(Delivery { message: In::from_body(header.kind, body), _room: taken.ok() }))
}
