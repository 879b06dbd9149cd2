//! A handshaken connection: a task that writes, a task that reads, and bounded queues to the user.
//!
//! The writer prefers control messages to bulk messages (chunks, pixels), so that a cancel never waits for a scene. Three
//! orders are guaranteed: control messages keep their order; bulk messages keep theirs; a bulk message is written after
//! every control message that was sent before it.
//!
//! [`Disconnect`](crate::ToWorker::Disconnect) is a bulk message, so everything that was sent before it is written first.
//! After it the writer flushes and closes its direction, and the session waits up to [`CLOSE_GRACE`] for the peer to close
//! the other direction. A connection that is closed with unread bytes is reset, and a reset discards the disconnect.
//!
//! ```text
//! Sender --control queue--> writer --> transport --> reader --inbox--> Receiver
//!        --bulk queue----->
//! ```

mod body_limit;
mod reader;
mod receive_room;
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
use crate::limits::{BULK_QUEUE, CLOSE_GRACE, CONTROL_QUEUE, INBOX_QUEUE};
use crate::message::Message;

pub use body_limit::BodyLimit;
pub use reader::Receiver;
pub use receive_room::ReceiveRoom;
pub use sender::{SendError, Sender, TrySendError};
pub use traffic::Traffic;

/// Starts the two tasks of a session on the current tokio runtime, after a handshake.
///
/// `Out` and `In` are the outgoing and incoming messages: [`crate::ToWorker`] and [`crate::ToMaster`] on a master, the
/// reverse on a worker. The connection ends after a disconnect was written, after every [`Sender`] was dropped and all
/// queued messages were written, at [`Sender::abort`], and when the transport or the peer fails. Messages that were
/// received before the end are still delivered.
pub fn spawn<S, Out, In>(io: S) -> (Sender<Out>, Receiver<In>, Arc<Traffic>)
where
    S: AsyncRead + AsyncWrite + Send + Unpin + 'static,
    Out: Message,
    In: Message,
{
    spawn_limited(io, BodyLimit::unlimited())
}

/// As [`spawn`], with bounds of received pixels, which the caller sets with each lease and each reply. A longer message ends the session.
pub fn spawn_limited<S, Out, In>(io: S, pixels: BodyLimit) -> (Sender<Out>, Receiver<In>, Arc<Traffic>)
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
    let (reader_ended, inbox_closed) = (CancellationToken::new(), CancellationToken::new());

    // Weak, because the inbox must end with the reader while the writer waits for messages.
    let failures = inbox.downgrade();
    let reader_guard = reader_ended.clone().drop_guard();
    let reader = reader::Reader {
        io: read_half,
        inbox,
        traffic: traffic.clone(),
        pixels,
        inbox_closed: inbox_closed.clone(),
    };
    let reader_abort = abort.clone();
    tokio::spawn(async move {
        let _reader_guard = reader_guard;
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
                if !writer.has_disconnected() {
                    tokio::select! {
                        () = inbox_closed.cancelled() => {}
                        () = reader_ended.cancelled() => {}
                    }
                }
                let _ = tokio::time::timeout(CLOSE_GRACE, reader_ended.cancelled()).await;
                writer_abort.cancel();
            }
        }
    });

    let sender = Sender { control, bulk, abort, direction: PhantomData };
    (sender, Receiver { messages }, traffic)
}

/// Reports a failed write after [`CLOSE_GRACE`]. The peer has usually closed by then, and its disconnect may be in the
/// receive buffer, where the reader finds it first.
async fn report<In>(
    failures: mpsc::WeakSender<reader::Delivery<In>>,
    error: ProtocolError,
    abort: CancellationToken,
) {
    tokio::time::sleep(CLOSE_GRACE).await;
    let Some(inbox) = failures.upgrade() else { return };
    abort.cancel();
    let _ = inbox.send(reader::Delivery::failed(error)).await;
}

/// Whether a message goes through the bulk queue.
fn is_bulk(kind: Kind) -> bool {
    match kind {
        Kind::AssetBegin | Kind::AssetChunk | Kind::Pixels | Kind::Disconnect => true,
        Kind::Hello | Kind::Welcome | Kind::Refused | Kind::Proof => false,
        Kind::Frame | Kind::Segment | Kind::Cancel | Kind::AssetUnknown => false,
        Kind::AssetFrom | Kind::ShareKey | Kind::Sharing | Kind::HaveAsset | Kind::PeerRequest => false,
        Kind::NeedAsset | Kind::Failed | Kind::Ping | Kind::Pong | Kind::Drain => false,
    }
}
