//! Departure from a farm: drain, wait for the master's disconnect, disconnect.

use std::time::{Duration, Instant};

use rayfarm_protocol::{ToMaster, ToWorker, session};
use tokio::io::{AsyncRead, AsyncWrite};

use super::report::{Report, millis};

/// Longest wait for the master's answer to the drain.
const DRAIN_TIMEOUT: Duration = Duration::from_secs(3);

/// Longest time to send the disconnect.
const DISCONNECT_TIMEOUT: Duration = Duration::from_secs(1);

/// Leaves the farm, so that the master leases no segment to this connection. Reports the time of the master's answer.
pub(super) async fn leave<S>(io: S, report: &mut Report)
where
    S: AsyncRead + AsyncWrite + Send + Unpin + 'static,
{
    let (sender, mut receiver, _) = session::spawn::<_, ToMaster, ToWorker>(io);
    let begun = Instant::now();
    let answered = tokio::time::timeout(DRAIN_TIMEOUT, async {
        sender.send(ToMaster::Drain).await.ok()?;
        loop {
            match receiver.recv().await {
                Some(Ok(ToWorker::Disconnect { .. })) => return Some(()),
                // A master measures the round trip before anything else.
                Some(Ok(ToWorker::Ping { nonce })) => {
                    sender.send(ToMaster::Pong { nonce, progressed: false }).await.ok()?;
                }
                Some(Ok(_)) => {}
                Some(Err(_)) | None => return None,
            }
        }
    });
    match answered.await {
        Ok(Some(())) => {
            report.ok("session", &format!("joined, and left in {}", millis(begun.elapsed())));
        }
        Ok(None) => {
            report.failed("session", "the master closed the connection", "look into the master's log")
        }
        Err(_) => {
            let why = format!("no answer within {} s", DRAIN_TIMEOUT.as_secs());
            report.failed("session", &why, "the master is overloaded, or the network loses packets");
        }
    }
    let disconnect = async {
        let message = ToMaster::Disconnect { reason: "the checks are done".to_owned() };
        if sender.send(message).await.is_ok() {
            sender.closed().await;
        }
    };
    // The connection is closed in any case.
    let _ = tokio::time::timeout(DISCONNECT_TIMEOUT, disconnect).await;
    sender.abort();
}
