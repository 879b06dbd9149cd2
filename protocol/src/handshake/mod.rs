//! How a connection begins: who is there, do the versions agree, is this worker wanted.
//!
//! 1. Both sides send a preamble (magic, version, role) and read the other's, before any codec.
//! 2. Versions differ: both sides know both numbers and say so; the master also sends them as plain text.
//! 3. The worker sends [`Hello`], the master answers [`Welcome`], a refusal with its reason, or a goodbye where it may
//!    take the worker later.
//!
//! All of it has one deadline, [`crate::limits::HANDSHAKE_DEADLINE`], and no envelope in it is longer than
//! [`crate::limits::MAX_CONTROL_BYTES`]. Not a byte behind the handshake is read.

mod preamble;

use rayfarm_text::{cut, printable_within};
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt};
use tokio::time::timeout;

use crate::envelope::{Envelope, Kind, read_body, read_header};
use crate::limits::{HANDSHAKE_DEADLINE, MAX_NAME_BYTES, MAX_THREADS};
use crate::message::{
    Reconnect, decode_control, decode_goodbye, decode_reason, encode_control, encode_goodbye, encode_reason,
};
use crate::{Hello, ProtocolError, Role, Welcome};

use preamble::Preamble;

/// Why a master does not take a worker, for people.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// Trying again gives the same answer.
    Final(String),
    /// It may take the worker later.
    NotNow(String),
}

impl From<String> for Refusal {
    fn from(reason: String) -> Self {
        Self::Final(reason)
    }
}

impl From<&str> for Refusal {
    fn from(reason: &str) -> Self {
        Self::Final(reason.to_owned())
    }
}

/// Introduces a worker to the master at the other end. Overlong texts in `hello` are cut.
///
/// # Errors
/// The peer is no master, is of another version, refuses for good or for now, closes, or is not done within the deadline.
pub async fn as_worker<S>(io: &mut S, hello: &Hello) -> Result<Welcome, ProtocolError>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    within_deadline(async {
        agree(io, Role::Worker).await?;
        let short = |text: &str| cut(text, MAX_NAME_BYTES).to_owned();
        let hello = Hello {
            name: short(&hello.name),
            threads: hello.threads.max(1),
            simd: short(&hello.simd),
            software: short(&hello.software),
        };
        send(io, encode_control(Kind::Hello, &hello)?).await?;
        let welcome = receive(io, Kind::Welcome, "a welcome or a refusal").await?;
        decode_control(Kind::Welcome, &welcome)
    })
    .await
}

/// Hears a worker out and lets `decide` take it or refuse it with a reason.
///
/// # Errors
/// The peer is no worker, is of another version, was refused, closes, or is not done within the deadline.
pub async fn as_master<S, D>(io: &mut S, decide: D) -> Result<Hello, ProtocolError>
where
    S: AsyncRead + AsyncWrite + Unpin,
    D: FnOnce(&Hello) -> Result<Welcome, Refusal>,
{
    within_deadline(async {
        if let Err(error) = agree(io, Role::Master).await {
            if matches!(error, ProtocolError::Version { .. } | ProtocolError::SameRole { .. }) {
                tell(io, &error.to_string()).await;
            }
            return Err(error);
        }
        let body = receive(io, Kind::Hello, "a hello").await?;
        let answer = checked_hello(decode_control(Kind::Hello, &body)?)
            .map_err(Refusal::Final)
            .and_then(|hello| decide(&hello).map(|welcome| (hello, welcome)));
        match answer {
            Ok((hello, welcome)) => {
                send(io, encode_control(Kind::Welcome, &welcome)?).await?;
                Ok(hello)
            }
            Err(Refusal::Final(reason)) => {
                tell(io, &reason).await;
                Err(ProtocolError::Refused { by: Role::Master, reason })
            }
            Err(Refusal::NotNow(reason)) => {
                // Best effort, as for a refusal.
                let _ = send(io, encode_goodbye(&reason, Reconnect::Now)?).await;
                let _ = io.shutdown().await;
                Err(ProtocolError::NotNow { reason })
            }
        }
    })
    .await
}

async fn agree<S>(io: &mut S, our_role: Role) -> Result<(), ProtocolError>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let Preamble { version, role } = preamble::exchange(io, our_role).await?;
    if role == our_role {
        return Err(ProtocolError::SameRole { role });
    }
    if version != crate::PROTOCOL_VERSION {
        return Err(ProtocolError::Version { our_role, theirs: version });
    }
    Ok(())
}

/// A worker's account of itself is printed and shown: it must be short, printable and not absurd.
fn checked_hello(hello: Hello) -> Result<Hello, String> {
    let texts = [("name", &hello.name), ("SIMD level", &hello.simd), ("software version", &hello.software)];
    if let Some((what, text)) = texts.into_iter().find(|(_, text)| text.len() > MAX_NAME_BYTES) {
        return Err(format!("the worker's {what} has {} bytes, at most {MAX_NAME_BYTES} fit", text.len()));
    }
    if hello.threads == 0 {
        return Err("a worker needs at least one render thread".to_owned());
    }
    if hello.threads > MAX_THREADS {
        return Err(format!(
            "the worker claims {} render threads, at most {MAX_THREADS} are believed",
            hello.threads
        ));
    }
    let shown = |text: &str| printable_within(text, MAX_NAME_BYTES).into_owned();
    Ok(Hello {
        name: shown(&hello.name),
        threads: hello.threads,
        simd: shown(&hello.simd),
        software: shown(&hello.software),
    })
}

async fn send(io: &mut (impl AsyncWrite + Unpin), envelope: Envelope) -> Result<(), ProtocolError> {
    envelope.write(io).await?;
    io.flush().await.map_err(|source| ProtocolError::Io { doing: "sending", source })
}

/// Best effort: the error that is told is the one that counts, not that the peer did not hear it.
async fn tell(io: &mut (impl AsyncWrite + Unpin), reason: &str) {
    if let Ok(envelope) = encode_reason(Kind::Refused, &[], reason) {
        let _ = send(io, envelope).await;
        let _ = io.shutdown().await;
    }
}

async fn receive(
    io: &mut (impl AsyncRead + Unpin),
    wanted: Kind,
    expected: &'static str,
) -> Result<bytes::Bytes, ProtocolError> {
    let header = read_header(io).await?.ok_or(ProtocolError::Closed { at: "during the handshake" })?;
    match header.kind {
        kind if kind == wanted => read_body(io, header).await,
        Kind::Refused => {
            let reason = decode_reason(&read_body(io, header).await?);
            Err(ProtocolError::Refused { by: Role::Master, reason })
        }
        Kind::Goodbye if wanted == Kind::Welcome => {
            let (reason, _) = decode_goodbye(read_body(io, header).await?)?;
            Err(ProtocolError::NotNow { reason })
        }
        kind => Err(ProtocolError::Unexpected { kind, expected }),
    }
}

async fn within_deadline<T>(
    work: impl Future<Output = Result<T, ProtocolError>>,
) -> Result<T, ProtocolError> {
    let late = ProtocolError::Deadline { what: "the handshake", limit: HANDSHAKE_DEADLINE };
    timeout(HANDSHAKE_DEADLINE, work).await.unwrap_or(Err(late))
}
