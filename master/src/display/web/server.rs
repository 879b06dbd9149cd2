//! Connections of the web display: accepted, bounded in number and time, encrypted where other machines can connect.

use std::collections::HashMap;
use std::future::Future;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use rayfarm_protocol::admission::host_number;
use rayfarm_protocol::transport::BrowserAcceptor;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio_util::sync::CancellationToken;

/// Most connections at a time, without WebSockets.
const MAX_CONNECTIONS: usize = 64;
/// Most connections of one host at a time, without WebSockets. A browser opens six.
const MAX_CONNECTIONS_PER_HOST: usize = 24;
/// Time for a TLS handshake, for the header of a request, and between two requests.
const HEADER_TIMEOUT: Duration = Duration::from_secs(5);
/// Longest life of a connection; a slow client needs that long for one picture.
const MAX_LIFE: Duration = Duration::from_secs(300);
/// Time for the last response.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(1);
/// Largest header, and the bytes that are read ahead (16 KiB).
const MAX_BUFFER_BYTES: usize = 16 << 10;
/// Most lines of a header.
const MAX_HEADERS: usize = 64;
/// Pause after a failure to accept, such as too many open files.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Accepts connections until `ended` returns.
pub(super) async fn serve(
    listener: TcpListener,
    acceptor: Option<BrowserAcceptor>,
    router: Router,
    ended: impl Future<Output = ()>,
) {
    let stop = CancellationToken::new();
    let slots = Slots::default();
    let tasks = tokio_util::task::TaskTracker::new();
    tokio::pin!(ended);
    loop {
        let accepted = tokio::select! {
            () = &mut ended => break,
            accepted = listener.accept() => accepted,
        };
        let (stream, address) = match accepted {
            Ok(accepted) => accepted,
            Err(error) => {
                tracing::debug!("a connection to the web display cannot be accepted: {error}");
                tokio::time::sleep(ACCEPT_PAUSE).await;
                continue;
            }
        };
        // Without a slot, the connection is closed at once.
        if let Some(slot) = slots.take(address.ip()) {
            let connection = connection(stream, acceptor.clone(), router.clone(), stop.clone());
            tasks.spawn(async move {
                connection.await;
                drop(slot);
            });
        }
    }
    stop.cancel();
    tasks.close();
    // Connections that go on longer end with the runtime.
    let _ = tokio::time::timeout(2 * SHUTDOWN_TIMEOUT, tasks.wait()).await;
}

async fn connection(
    stream: TcpStream,
    acceptor: Option<BrowserAcceptor>,
    router: Router,
    stop: CancellationToken,
) {
    // A failure costs latency only.
    let _ = stream.set_nodelay(true);
    let Some(acceptor) = acceptor else { return requests(stream, router, stop).await };
    match tokio::time::timeout(HEADER_TIMEOUT, acceptor.accept(stream)).await {
        Ok(Ok(stream)) => requests(stream, router, stop).await,
        Ok(Err(error)) => tracing::debug!("a browser's handshake fails: {error}"),
        Err(_) => tracing::debug!("a browser's handshake takes too long"),
    }
}

/// Answers the requests of a connection.
async fn requests<S>(stream: S, router: Router, stop: CancellationToken)
where
    S: AsyncRead + AsyncWrite + Send + Unpin + 'static,
{
    let mut builder = http1::Builder::new();
    builder.timer(TokioTimer::new()).header_read_timeout(HEADER_TIMEOUT);
    builder.max_headers(MAX_HEADERS).max_buf_size(MAX_BUFFER_BYTES);
    let service = TowerToHyperService::new(router);
    let connection = builder.serve_connection(TokioIo::new(stream), service).with_upgrades();
    tokio::pin!(connection);
    let ended = tokio::select! {
        result = connection.as_mut() => Some(result),
        () = stop.cancelled() => None,
        () = tokio::time::sleep(MAX_LIFE) => None,
    };
    let result = match ended {
        Some(result) => result,
        None => {
            connection.as_mut().graceful_shutdown();
            tokio::time::timeout(SHUTDOWN_TIMEOUT, connection).await.unwrap_or(Ok(()))
        }
    };
    if let Err(error) = result {
        tracing::debug!("a connection to the web display ends: {error}");
    }
}

/// Connections by host: one machine has many addresses of IPv6.
#[derive(Debug, Default)]
struct Slots(Arc<Mutex<HashMap<u128, usize>>>);

/// The place of a connection, freed when it is dropped.
#[derive(Debug)]
struct Slot {
    host: u128,
    slots: Arc<Mutex<HashMap<u128, usize>>>,
}

impl Slots {
    /// A slot for a connection of an address; `None` where all are taken.
    fn take(&self, address: IpAddr) -> Option<Slot> {
        let host = host_number(address);
        let mut slots = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let all: usize = slots.values().sum();
        let own = slots.get(&host).copied().unwrap_or(0);
        if all >= MAX_CONNECTIONS || own >= MAX_CONNECTIONS_PER_HOST {
            return None;
        }
        slots.insert(host, own + 1);
        Some(Slot { host, slots: Arc::clone(&self.0) })
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(count) = slots.get_mut(&self.host) {
            *count -= 1;
            if *count == 0 {
                slots.remove(&self.host);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn connections_are_bounded_in_all_and_by_host() {
        let slots = Slots::default();
        let address = |last: u8| IpAddr::from([10, 0, 0, last]);
        let mut taken: Vec<Slot> = (0..100).filter_map(|_| slots.take(address(1))).collect();
        assert_eq!(taken.len(), MAX_CONNECTIONS_PER_HOST);
        taken.extend((2..200).filter_map(|last| slots.take(address(last))));
        assert_eq!(taken.len(), MAX_CONNECTIONS);
        drop(taken.remove(0));
        assert!(slots.take(address(1)).is_some(), "a slot is free again");
        drop(taken);
        assert!(slots.0.lock().unwrap().is_empty());
    }
}
