//! A handshaken connection: one task that writes, one that reads, bounded queues towards the user.
//!
//! Control messages overtake bulk ones (chunks, pixels) in the writer, so that a cancel never waits behind a scene.
//! The order that holds: a bulk message is written after every control message that was sent before it, control
//! messages keep their order, bulk messages keep theirs. [`Goodbye`](crate::ToWorker::Goodbye) counts as bulk: it is
//! the last word, so everything sent before it goes first; then the writer flushes, closes its direction, and waits a
//! moment for the peer to close the other: a connection closed over unread bytes is reset, and takes the goodbye with it.
//!
//! ```text
//! Sender --control queue--> writer --> transport --> reader --inbox--> Receiver
//!        --bulk queue----->
//! ```

mod reader;
mod sender;
mod traffic;
mod writer;

use std::marker::PhantomData;
use std::sync::Arc;

use tokio::io::{AsyncRead, AsyncWrite};
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;

use crate::ProtocolError;
use crate::envelope::Kind;
use crate::limits::{BULK_QUEUE, CONTROL_QUEUE, INBOX_QUEUE, LAST_WORD_GRACE};
use crate::message::Message;

pub use reader::Receiver;
pub use sender::{SendError, Sender, TrySendError};
pub use traffic::Traffic;

/// Starts the two tasks of a session on the current tokio runtime, after a handshake.
///
/// `Out` is what this side says ([`crate::ToWorker`] or [`crate::ToMaster`]), `In` what it hears. The connection ends
/// when a goodbye was written, when every [`Sender`] is gone and their messages are written, at [`Sender::abort`], or
/// when the transport or the peer fails; what was received before that is still handed out.
pub fn spawn<S, Out, In>(io: S) -> (Sender<Out>, Receiver<In>, Arc<Traffic>)
where
    S: AsyncRead + AsyncWrite + Send + Unpin + 'static,
    Out: Message,
    In: Message,
{
    let (read_half, write_half) = tokio::io::split(io);
    let (control, control_queue) = mpsc::channel(CONTROL_QUEUE);
    let (bulk, bulk_queue) = mpsc::channel(BULK_QUEUE);
    let (inbox, messages) = mpsc::channel(INBOX_QUEUE);
    let traffic = Arc::new(Traffic::default());
    let abort = CancellationToken::new();
    let (reading, unheard) = (CancellationToken::new(), CancellationToken::new());

    // Weak: the inbox ends with the reader, though the writer may wait for messages for ever.
    let failures = inbox.downgrade();
    let reader_ends = reading.clone().drop_guard();
    let reader = reader::Reader { io: read_half, inbox, traffic: traffic.clone(), unheard: unheard.clone() };
    let reader_abort = abort.clone();
    tokio::spawn(async move {
        let _reader_ends = reader_ends;
        reader_abort.run_until_cancelled(reader.run()).await;
    });
    let mut writer = writer::Writer::new(write_half, control_queue, bulk_queue, traffic.clone());
    let writer_abort = abort.clone();
    tokio::spawn(async move {
        let result = tokio::select! {
            biased;
            () = writer_abort.cancelled() => return,
            result = writer.run() => result,
        };
        match result {
            Err(error) => report(failures, error, writer_abort).await,
            Ok(()) => {
                if !writer.has_said_goodbye() {
                    tokio::select! {
                        () = unheard.cancelled() => {}
                        () = reading.cancelled() => {}
                    }
                }
                let _ = tokio::time::timeout(LAST_WORD_GRACE, reading.cancelled()).await;
                writer_abort.cancel();
            }
        }
    });

    let sender = Sender { control, bulk, abort, direction: PhantomData };
    (sender, Receiver { messages }, traffic)
}

/// A failed write usually means that the peer has gone, and that its last word lies in our receive buffer: the reader
/// gets a moment to find it before it is stopped and the failure reported.
async fn report<In>(
    failures: mpsc::WeakSender<reader::Delivery<In>>,
    error: ProtocolError,
    abort: CancellationToken,
) {
    tokio::time::sleep(LAST_WORD_GRACE).await;
    let Some(inbox) = failures.upgrade() else { return };
    abort.cancel();
    let _ = inbox.send(reader::Delivery { message: Err(error), _room: None }).await;
}

/// Which of the writer's two queues a message waits in.
fn is_bulk(kind: Kind) -> bool {
    match kind {
        Kind::AssetBegin | Kind::AssetChunk | Kind::Pixels | Kind::Goodbye => true,
        Kind::Hello | Kind::Welcome | Kind::Refused => false,
        Kind::Frame | Kind::Segment | Kind::Cancel | Kind::AssetUnknown => false,
        Kind::AssetFrom | Kind::ShareKey | Kind::Sharing | Kind::HaveAsset | Kind::Fetch => false,
        Kind::NeedAsset | Kind::Failed | Kind::Ping | Kind::Pong | Kind::Drain => false,
    }
}
