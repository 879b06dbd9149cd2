//! Connections between two workers of one farm, plain or through TLS with the workers' own keys.

use tokio::io::{AsyncRead, AsyncWrite};
use tokio::time::timeout;

use crate::limits::HANDSHAKE_DEADLINE;
use crate::transport::{Connection, WorkerSecurity, tls};
use crate::{KeyHash, ProtocolError};

/// Begins a connection to another worker, whose key has the hash `peer_key`.
///
/// With TLS both workers prove their keys. This worker sends nothing to an end with another key.
///
/// # Errors
/// A key without TLS, or TLS without a key; another key; a peer that does not finish within [`HANDSHAKE_DEADLINE`].
pub async fn connect<S>(
    stream: S,
    security: &WorkerSecurity,
    peer_key: Option<KeyHash>,
) -> Result<Connection<S>, ProtocolError>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    match (security, peer_key) {
        (WorkerSecurity::Plain, None) => Ok(Connection::Plain(stream)),
        (WorkerSecurity::Tls { key, .. }, Some(expected)) => {
            let stream =
                within_deadline(tls::connect(stream, key, expected)).await.map_err(worker_key_error)?;
            let mut connection = Connection::Tls(Box::new(stream));
            // The peer has proved the key that the master named, so it may send an asset.
            connection.remove_bound();
            Ok(connection)
        }
        (WorkerSecurity::Plain, Some(_)) => {
            Err(ProtocolError::Tls { why: "the other worker has a key, and this one uses no TLS".to_owned() })
        }
        (WorkerSecurity::Tls { .. }, None) => {
            Err(ProtocolError::Tls { why: "the master names no key of the other worker".to_owned() })
        }
    }
}

/// Accepts a connection of another worker. With TLS, [`Connection::peer_key`] is the key that the other worker has proved.
///
/// The bytes that are read from the connection stay bounded: after the handshake a worker sends one request only.
///
/// # Errors
/// A peer without TLS where this worker uses it; a peer that does not finish within [`HANDSHAKE_DEADLINE`].
pub async fn accept<S>(stream: S, security: &WorkerSecurity) -> Result<Connection<S>, ProtocolError>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    match security {
        WorkerSecurity::Plain => Ok(Connection::Plain(stream)),
        WorkerSecurity::Tls { key, .. } => {
            let (stream, _) = within_deadline(tls::accept(stream, key)).await?;
            Ok(Connection::Tls(Box::new(stream)))
        }
    }
}

/// Describes another key as that of a worker: the error of the library is about a master.
fn worker_key_error(error: ProtocolError) -> ProtocolError {
    match error {
        ProtocolError::WrongKey { theirs, expected } => ProtocolError::Tls {
            why: format!("the other worker has the key {}, expected {}", theirs.short(), expected.short()),
        },
        error => error,
    }
}

async fn within_deadline<T>(
    work: impl Future<Output = Result<T, ProtocolError>>,
) -> Result<T, ProtocolError> {
    let late = ProtocolError::Deadline { what: "the handshake", limit: HANDSHAKE_DEADLINE };
    timeout(HANDSHAKE_DEADLINE, work).await.unwrap_or(Err(late))
}
