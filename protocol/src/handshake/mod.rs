//! The beginning of a connection: roles, versions, and the master's decision about the worker.
//!
//! 1. Each end sends a preamble (magic, version, role) and reads the preamble of the other, before any codec.
//! 2. Where the versions differ, both ends report both numbers. The master also sends them as plain text.
//! 3. The worker sends [`Hello`]. The master replies with [`Welcome`], with a refusal and its reason, or with a disconnect
//!    where it may accept the worker later.
//!
//! One deadline covers all steps: [`HANDSHAKE_DEADLINE`]. No envelope of a handshake has a body longer than
//! [`MAX_CONTROL_BYTES`](crate::limits::MAX_CONTROL_BYTES), and no byte after the handshake is read.

mod preamble;

use rayfarm_text::{cut, printable_within};
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt};
use tokio::time::timeout;

use crate::envelope::{Envelope, Kind, read_body, read_header};
use crate::limits::{HANDSHAKE_DEADLINE, MAX_NAME_BYTES, MAX_THREADS};
use crate::message::{
    Reconnect, decode_control, decode_disconnect, decode_reason, encode_control, encode_disconnect,
    encode_reason,
};
use crate::{Hello, ProtocolError, Role, Welcome};

use preamble::Preamble;

/// Reason, as text, for which a master does not accept a worker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// The master will never accept the worker.
    Final(String),
    /// The master may accept the worker later.
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

/// Performs the worker's part of a handshake. Overlong texts in `hello` are cut.
///
/// # Errors
/// A peer that is no master, has another version, refuses the worker, closes, or does not finish in time.
pub async fn as_worker<S>(io: &mut S, hello: &Hello) -> Result<Welcome, ProtocolError>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    within_deadline(async {
        exchange_preambles(io, Role::Worker).await?;
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

/// Performs the master's part of a handshake. `decide` accepts or refuses the worker.
///
/// # Errors
/// A peer that is no worker, has another version, is refused, closes, or does not finish in time.
pub async fn as_master<S, D>(io: &mut S, decide: D) -> Result<Hello, ProtocolError>
where
    S: AsyncRead + AsyncWrite + Unpin,
    D: FnOnce(&Hello) -> Result<Welcome, Refusal>,
{
    within_deadline(async {
        if let Err(error) = exchange_preambles(io, Role::Master).await {
            if matches!(error, ProtocolError::Version { .. } | ProtocolError::SameRole { .. }) {
                send_refusal(io, &error.to_string()).await;
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
                send_refusal(io, &reason).await;
                Err(ProtocolError::Refused { by: Role::Master, reason })
            }
            Err(Refusal::NotNow(reason)) => {
                // The refusal is the result, whether the worker receives it or not.
                let _ = send(io, encode_disconnect(&reason, Reconnect::Now)?).await;
                let _ = io.shutdown().await;
                Err(ProtocolError::NotNow { reason })
            }
        }
    })
    .await
}

/// Exchanges preambles, and checks that the roles differ and the versions match.
async fn exchange_preambles<S>(io: &mut S, our_role: Role) -> Result<(), ProtocolError>
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

/// Validates a worker's introduction and makes its texts printable, because they are logged and displayed.
fn checked_hello(hello: Hello) -> Result<Hello, String> {
    let texts = [("name", &hello.name), ("SIMD level", &hello.simd), ("software version", &hello.software)];
    if let Some((what, text)) = texts.into_iter().find(|(_, text)| text.len() > MAX_NAME_BYTES) {
        return Err(format!(
            "the worker's {what} has {} bytes, at most {MAX_NAME_BYTES} are allowed",
            text.len()
        ));
    }
    if hello.threads == 0 {
        return Err("a worker needs at least one render thread".to_owned());
    }
    if hello.threads > MAX_THREADS {
        return Err(format!(
            "the worker has {} render threads, at most {MAX_THREADS} are accepted",
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

/// Sends a refusal and closes. A failure to send is ignored: the refusal itself is the error to report.
async fn send_refusal(io: &mut (impl AsyncWrite + Unpin), reason: &str) {
    if let Ok(envelope) = encode_reason(Kind::Refused, &[], reason) {
        let _ = send(io, envelope).await;
        let _ = io.shutdown().await;
    }
}

/// Receives the body of a message of type `wanted`. A refusal or a disconnect of the master becomes an error.
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
        Kind::Disconnect if wanted == Kind::Welcome => {
            let (reason, _) = decode_disconnect(read_body(io, header).await?)?;
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
