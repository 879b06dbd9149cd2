//! The task that writes: control first, flushes when there is nothing to write, closes at the end.

use std::sync::Arc;

use tokio::io::{AsyncWrite, AsyncWriteExt, BufWriter};
use tokio::sync::mpsc;
use tokio::time::timeout;

use super::Traffic;
use crate::ProtocolError;
use crate::envelope::{Envelope, Kind};
use crate::limits::envelope_deadline;

/// Small messages are gathered up to this; larger bodies go past the buffer uncopied.
const BUFFER_BYTES: usize = 8 << 10;

pub(super) struct Writer<W> {
    io: BufWriter<W>,
    control: mpsc::Receiver<Envelope>,
    bulk: mpsc::Receiver<Envelope>,
    /// A bulk message taken from its queue that lets control go first once more.
    held: Option<Envelope>,
    traffic: Arc<Traffic>,
    said_goodbye: bool,
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
            said_goodbye: false,
        }
    }

    /// Writes until a goodbye was written or every sender is gone.
    pub(super) async fn run(&mut self) -> Result<(), ProtocolError> {
        while let Some(envelope) = self.next().await? {
            envelope.write(&mut self.io).await?;
            self.traffic.count_sent(&envelope);
            if envelope.kind() == Kind::Goodbye {
                self.said_goodbye = true;
                break;
            }
        }
        self.finish("taking the last message", true).await
    }

    /// Whether [`run`](Self::run) ended with a goodbye, and not for want of senders.
    pub(super) fn has_said_goodbye(&self) -> bool {
        self.said_goodbye
    }

    async fn next(&mut self) -> Result<Option<Envelope>, ProtocolError> {
        if let Some(envelope) = self.ready() {
            return Ok(Some(envelope));
        }
        self.finish("taking a message", false).await?;
        Ok(self.wait().await)
    }

    /// What can be written without waiting.
    fn ready(&mut self) -> Option<Envelope> {
        if self.held.is_none() {
            self.held = self.bulk.try_recv().ok();
        }
        // Looked at after the bulk queue: whatever was sent before the held message is in here by now.
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
