//! The task that reads, and the receiving half of a session.

use std::sync::Arc;

use tokio::io::{AsyncRead, BufReader, ReadHalf};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio_util::sync::CancellationToken;

use super::{BodyLimit, Traffic};
use crate::ProtocolError;
use crate::envelope::{HEADER_BYTES, Kind, read_body_counted, read_header};
use crate::limits::INBOX_BYTES;
use crate::message::Message;

/// A received message on its way to the user, with its shares of the inbox's bytes and of the room of all sessions.
pub(super) struct Delivery<In> {
    message: Result<In, ProtocolError>,
    _room: [Option<OwnedSemaphorePermit>; 2],
}

impl<In> Delivery<In> {
    /// An error, which takes no room.
    pub(super) fn failed(error: ProtocolError) -> Self {
        Self { message: Err(error), _room: [None, None] }
    }
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
    /// Waits for the next message. Returns `None` after the connection has ended cleanly, and after an error was
    /// returned. Cancel safe.
    pub async fn recv(&mut self) -> Option<Result<In, ProtocolError>> {
        let Delivery { message, _room } = self.messages.recv().await?;
        if message.is_err() {
            // One error ends a session: the bytes after it may not begin at an envelope.
            self.messages.close();
            while self.messages.try_recv().is_ok() {}
        }
        Some(message)
    }
}

/// State of the reading task.
pub(super) struct Reader<S, In> {
    pub(super) io: ReadHalf<S>,
    pub(super) inbox: mpsc::Sender<Delivery<In>>,
    pub(super) traffic: Arc<Traffic>,
    /// Limit of received pixels.
    pub(super) pixels: BodyLimit,
    /// Cancelled when the [`Receiver`] is closed or dropped.
    pub(super) inbox_closed: CancellationToken,
}

impl<S: AsyncRead, In: Message> Reader<S, In> {
    /// Reads until the peer closes or an error occurs, which is delivered. After the receiver is closed, incoming bytes
    /// are discarded: unread bytes would turn this end's close into a reset.
    pub(super) async fn run(self) {
        let mut io = BufReader::new(self.io);
        let room = Arc::new(Semaphore::new(INBOX_BYTES));
        let delivering = async {
            loop {
                let delivery = match read_message(&mut io, &room, &self.traffic, &self.pixels).await {
                    Ok(None) => return,
                    Ok(Some(delivery)) => delivery,
                    Err(error) => Delivery::failed(error),
                };
                let failed = delivery.message.is_err();
                if self.inbox.send(delivery).await.is_err() || failed {
                    return;
                }
            }
        };
        tokio::select! {
            biased;
            () = self.inbox.closed() => {}
            () = delivering => if !self.inbox.is_closed() { return },
        }
        self.inbox_closed.cancel();
        // Ends when the peer closes, or with the session.
        let _ = tokio::io::copy(&mut io, &mut tokio::io::sink()).await;
    }
}

async fn read_message<In: Message>(
    io: &mut (impl AsyncRead + Unpin),
    room: &Arc<Semaphore>,
    traffic: &Traffic,
    pixels: &BodyLimit,
) -> Result<Option<Delivery<In>>, ProtocolError> {
    let Some(header) = read_header(io).await? else { return Ok(None) };
    if !In::carries(header.kind) {
        return Err(ProtocolError::Unexpected { kind: header.kind, expected: In::EXPECTED });
    }
    let is_pixels = header.kind == Kind::Pixels;
    let limit = pixels.bytes();
    if is_pixels && header.body_bytes > limit {
        return Err(ProtocolError::NotLeased { announced: header.body_bytes as u64, limit: limit as u64 });
    }
    // Every body fits: INBOX_BYTES is above the limit of every type, and a u32 can count it.
    let permits = u32::try_from(header.body_bytes).unwrap_or(u32::MAX);
    let in_inbox = room.clone().acquire_many_owned(permits).await.ok();
    let in_all = if is_pixels { pixels.enter(header.body_bytes).await } else { None };
    traffic.count_received(HEADER_BYTES);
    let body = tokio::select! {
        biased;
        body = read_body_counted(io, header, |bytes| traffic.count_received(bytes)) => body?,
        limit = pixels.late(header.body_bytes), if is_pixels => {
            return Err(ProtocolError::Deadline { what: "sending pixels while other workers wait to send", limit });
        }
    };
    Ok(Some(Delivery { message: In::from_body(header.kind, body), _room: [in_inbox, in_all] }))
}
