//! The task that writes: control messages first, a flush when both queues are empty, a close at the end.

use std::sync::Arc;

use tokio::io::{AsyncWrite, AsyncWriteExt, BufWriter};
use tokio::sync::mpsc;
use tokio::time::timeout;

use super::Traffic;
use crate::ProtocolError;
use crate::envelope::{Envelope, Kind};
use crate::limits::envelope_deadline;

/// Size of the write buffer, in bytes. Small messages are gathered in it; larger bodies bypass it without a copy.
const BUFFER_BYTES: usize = 8 << 10;

/// State of the writing task.
pub(super) struct Writer<W> {
    io: BufWriter<W>,
    control: mpsc::Receiver<Envelope>,
    bulk: mpsc::Receiver<Envelope>,
    /// A bulk message that was taken from its queue and waits for the control messages sent before it.
    held: Option<Envelope>,
    traffic: Arc<Traffic>,
    disconnected: bool,
}

impl<W: AsyncWrite + Unpin> Writer<W> {
    pub(super) fn new(
        io: W,
        control: mpsc::Receiver<Envelope>,
        bulk: mpsc::Receiver<Envelope>,
        traffic: Arc<Traffic>,
    ) -> Self {
        Self {
            io: BufWriter::with_capacity(BUFFER_BYTES, io),
            control,
            bulk,
            held: None,
            traffic,
            disconnected: false,
        }
    }

    /// Writes until a disconnect is written or every sender is dropped.
    pub(super) async fn run(&mut self) -> Result<(), ProtocolError> {
        while let Some(envelope) = self.next().await? {
            envelope.write(&mut self.io).await?;
            self.traffic.count_sent(&envelope);
            if envelope.kind() == Kind::Disconnect {
                self.disconnected = true;
                break;
            }
        }
        self.finish("receiving the last message", true).await
    }

    /// Whether [`run`](Self::run) ended with a disconnect, and not because every sender was dropped.
    pub(super) fn has_disconnected(&self) -> bool {
        self.disconnected
    }

    /// Waits for the next message, after a flush where none is ready. `None` when every sender is dropped.
    async fn next(&mut self) -> Result<Option<Envelope>, ProtocolError> {
        if let Some(envelope) = self.ready() {
            return Ok(Some(envelope));
        }
        self.finish("receiving a message", false).await?;
        Ok(self.wait().await)
    }

    /// Takes the next message that is queued already.
    fn ready(&mut self) -> Option<Envelope> {
        if self.held.is_none() {
            self.held = self.bulk.try_recv().ok();
        }
        // Checked after the bulk queue: every control message sent before the held message is queued by now.
        self.control.try_recv().ok().or_else(|| self.held.take())
    }

    async fn wait(&mut self) -> Option<Envelope> {
        tokio::select! {
            biased;
            Some(envelope) = self.control.recv() => Some(envelope),
            Some(envelope) = self.bulk.recv() => {
                self.held = Some(envelope);
                self.ready()
            }
            else => None,
        }
    }

    /// Flushes, and closes if `close` is set, within a deadline.
    async fn finish(&mut self, what: &'static str, close: bool) -> Result<(), ProtocolError> {
        let limit = envelope_deadline(BUFFER_BYTES);
        let flushed =
            timeout(limit, async { if close { self.io.shutdown().await } else { self.io.flush().await } });
        match flushed.await {
            Ok(result) => result.map_err(|source| ProtocolError::Io { doing: "sending", source }),
            Err(_) => Err(ProtocolError::Deadline { what, limit }),
        }
    }
}
