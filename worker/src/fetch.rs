//! Gets an asset from another worker. Whatever comes of it, the session hears of it; what is wrong with the other worker is
//! for the master to make up for.

use std::net::SocketAddr;

use bytes::Bytes;
use rayfarm_protocol::AssetId;
use rayfarm_protocol::limits::{MAX_PEER_KEEPALIVES, PEER_CONNECT_TIMEOUT};
use rayfarm_protocol::peer::{Fetch, Passed, Token, ask, next};
use tokio::io::{AsyncRead, AsyncWrite, BufReader};
use tokio::net::TcpStream;
use tokio::sync::mpsc;

/// Where an asset is to be had.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Peer {
    pub(crate) address: SocketAddr,
    pub(crate) token: Token,
}

/// What comes from another worker.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum FromPeer {
    /// A part of an asset.
    Chunk { id: AssetId, offset: u64, bytes: Bytes },
    /// No more of it will come, and why.
    Failed { id: AssetId, why: String },
}

/// Fetches an asset of that size and hands it on, chunk by chunk, as fast as they are taken.
pub(crate) async fn fetch(id: AssetId, size: u64, peer: Peer, out: mpsc::Sender<FromPeer>) {
    let connecting = tokio::time::timeout(PEER_CONNECT_TIMEOUT, TcpStream::connect(peer.address));
    let failed = match connecting.await {
        Ok(Ok(stream)) => fetch_over(stream, id, size, peer, &out).await.err(),
        Ok(Err(error)) => Some(error.to_string()),
        Err(_) => Some(format!("no answer for {} s", PEER_CONNECT_TIMEOUT.as_secs())),
    };
    if let Some(why) = failed {
        let why = format!("{} does not pass it on: {why}", peer.address);
        // Without a session nobody wants to know.
        let _ = out.send(FromPeer::Failed { id, why }).await;
    }
}

async fn fetch_over(
    mut stream: impl AsyncRead + AsyncWrite + Unpin,
    id: AssetId,
    size: u64,
    peer: Peer,
    out: &mpsc::Sender<FromPeer>,
) -> Result<(), String> {
    let told = |error: rayfarm_protocol::ProtocolError| error.to_string();
    ask(&mut stream, &Fetch { id, token: peer.token, offset: 0 }).await.map_err(told)?;
    let mut stream = BufReader::new(stream);
    let (mut offset, mut pulses) = (0, 0);
    while offset < size {
        match next(&mut stream, id).await.map_err(told)? {
            Passed::Begin { size: announced } if announced == size => {}
            Passed::Begin { size: announced } => {
                return Err(format!("it announces {announced} bytes, not {size}"));
            }
            Passed::Unknown => return Err("it does not have it any more".to_owned()),
            Passed::Waits if pulses < MAX_PEER_KEEPALIVES => pulses += 1,
            Passed::Waits => return Err("it has waited for too long itself".to_owned()),
            Passed::Chunk { offset: at, bytes } => {
                let end = at.saturating_add(bytes.len() as u64);
                if at != offset || end > size {
                    return Err(format!("bytes at {at} came where those at {offset} of {size} were due"));
                }
                (offset, pulses) = (end, 0);
                if out.send(FromPeer::Chunk { id, offset: at, bytes }).await.is_err() {
                    return Ok(());
                }
            }
        }
    }
    Ok(())
}
