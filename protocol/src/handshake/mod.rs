//! The beginning of a connection: roles, versions, and the master's decision about the worker.
//!
//! 1. Each end sends a preamble (magic, version, role, transport) and reads the preamble of the other, before any codec.
//! 2. Where the versions differ, both ends report both numbers. The master also sends them as plain text.
//! 3. With TLS, both ends prove their keys. The worker checks the hash of the master's key, and then proves the farm's
//!    token by a message that is bound to this TLS session. An end never continues on another transport than its own.
//! 4. The worker sends [`Hello`]. The master replies with [`Welcome`], with a refusal and its reason, or with a disconnect
//!    where it may accept the worker later.
//!
//! One deadline covers all steps: [`HANDSHAKE_DEADLINE`]. No envelope of a handshake has a body longer than
//! [`MAX_CONTROL_BYTES`](crate::limits::MAX_CONTROL_BYTES), and no byte after the handshake is read.

mod preamble;

use rayfarm_text::{cut, printable_within};
use tokio::io::{AsyncRead, AsyncWrite, AsyncWriteExt};
use tokio::time::timeout;
use tokio_rustls::TlsStream;

use crate::envelope::{Envelope, Kind, read_body, read_header};
use crate::limits::{HANDSHAKE_DEADLINE, MAX_NAME_BYTES, MAX_TAG_BYTES, MAX_TAGS, MAX_THREADS};
use crate::message::{
    Reconnect, decode_control, decode_disconnect, decode_reason, encode_control, encode_disconnect,
    encode_reason,
};
use crate::transport::{Bounded, Connection, MasterSecurity, MasterTrust, Proof, WorkerSecurity, tls};
use crate::{Hello, KeyHash, ProtocolError, Role, Welcome};

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
/// With TLS the worker goes on only with the master whose key has the expected hash, and proves the token to it.
///
/// # Errors
/// A peer that is no master, has another version, another transport or another key, refuses the worker, closes, or does
/// not finish in time.
pub async fn as_worker<S>(
    mut io: S,
    security: &WorkerSecurity,
    hello: &Hello,
) -> Result<(Connection<S>, Welcome), ProtocolError>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    within_deadline(async move {
        let ours = Preamble::ours(Role::Worker, security.key_hash().is_some());
        let theirs = exchange_preambles(&mut io, ours).await?;
        let mut io = match security {
            WorkerSecurity::Plain => Connection::Plain(io),
            WorkerSecurity::Tls { key, master, token } => {
                let mut stream = tls::connect(io, key, *master).await?;
                let proof = Proof::of(&stream, [ours.to_bytes(), theirs.to_bytes()], key.hash(), *master)?;
                let envelope = Envelope::new(Kind::Proof, &proof.bytes(token)?, bytes::Bytes::new())?;
                envelope.write(&mut stream).await?;
                Connection::Tls(Box::new(stream))
            }
        };
        send(&mut io, encode_control(Kind::Hello, &cut_hello(hello))?).await?;
        let welcome = receive(&mut io, Kind::Welcome, "a welcome or a refusal").await?;
        io.remove_bound();
        Ok((io, decode_control(Kind::Welcome, &welcome)?))
    })
    .await
}

/// Performs the master's part of a handshake. `decide` accepts or refuses the worker; with TLS it also receives the hash
/// of the key that the worker has proved.
///
/// # Errors
/// A peer that is no worker, has another version or another transport, does not prove the token, is refused, closes, or
/// does not finish in time.
pub async fn as_master<S, D>(
    mut io: S,
    security: &MasterSecurity,
    decide: D,
) -> Result<(Connection<S>, Hello), ProtocolError>
where
    S: AsyncRead + AsyncWrite + Unpin,
    D: FnOnce(&Hello, Option<KeyHash>) -> Result<Welcome, Refusal>,
{
    within_deadline(async move {
        let ours = Preamble::ours(Role::Master, security.key_hash().is_some());
        let theirs = match exchange_preambles(&mut io, ours).await {
            Ok(theirs) => theirs,
            Err(error) => {
                use ProtocolError::{SameRole, Transport, Version};
                if matches!(error, Version { .. } | SameRole { .. } | Transport { .. }) {
                    send_refusal(&mut io, &error.to_string()).await;
                }
                return Err(error);
            }
        };
        let (mut io, peer_key) = match security {
            MasterSecurity::Plain => (Connection::Plain(io), None),
            MasterSecurity::Tls(trust) => {
                let (stream, key) = accept_proof(io, trust, [theirs.to_bytes(), ours.to_bytes()]).await?;
                (Connection::Tls(Box::new(stream)), Some(key))
            }
        };
        let body = receive(&mut io, Kind::Hello, "a hello").await?;
        let answer = checked_hello(decode_control(Kind::Hello, &body)?)
            .map_err(Refusal::Final)
            .and_then(|hello| decide(&hello, peer_key).map(|welcome| (hello, welcome)));
        match answer {
            Ok((hello, welcome)) => {
                send(&mut io, encode_control(Kind::Welcome, &welcome)?).await?;
                io.remove_bound();
                Ok((io, hello))
            }
            Err(Refusal::Final(reason)) => {
                send_refusal(&mut io, &reason).await;
                Err(ProtocolError::Refused { by: Role::Master, reason })
            }
            Err(Refusal::NotNow(reason)) => {
                // The refusal is the result, whether the worker receives it or not.
                let _ = send(&mut io, encode_disconnect(&reason, Reconnect::Now)?).await;
                let _ = io.shutdown().await;
                Err(ProtocolError::NotNow { reason })
            }
        }
    })
    .await
}

/// Begins TLS as the master, and verifies the worker's proof of the token before any other message.
async fn accept_proof<S>(
    io: S,
    trust: &MasterTrust,
    preambles: [[u8; preamble::PREAMBLE_BYTES]; 2],
) -> Result<(TlsStream<Bounded<S>>, KeyHash), ProtocolError>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let (mut stream, worker) = tls::accept(io, trust.key()).await?;
    let proof = receive(&mut stream, Kind::Proof, "a proof of the token").await?;
    let expected = Proof::of(&stream, preambles, worker, trust.key_hash())?;
    if let Err(error) = expected.verify(&trust.token(), &proof) {
        send_refusal(&mut stream, &error.to_string()).await;
        return Err(error);
    }
    Ok((stream, worker))
}

/// Exchanges preambles, and checks that the roles differ and that versions and transports match.
async fn exchange_preambles<S>(io: &mut S, ours: Preamble) -> Result<Preamble, ProtocolError>
where
    S: AsyncRead + AsyncWrite + Unpin,
{
    let theirs = preamble::exchange(io, ours).await?;
    if theirs.role == ours.role {
        return Err(ProtocolError::SameRole { role: theirs.role });
    }
    if theirs.version != crate::PROTOCOL_VERSION {
        return Err(ProtocolError::Version { our_role: ours.role, theirs: theirs.version });
    }
    if theirs.transport != ours.transport {
        return Err(ProtocolError::Transport { our_role: ours.role, encrypted: ours.transport != 0 });
    }
    Ok(theirs)
}

/// Cuts the texts of a hello to their bounds.
fn cut_hello(hello: &Hello) -> Hello {
    let short = |text: &str| cut(text, MAX_NAME_BYTES).to_owned();
    Hello {
        name: short(&hello.name),
        threads: hello.threads.max(1),
        simd: short(&hello.simd),
        software: short(&hello.software),
        tags: hello.tags.iter().take(MAX_TAGS).map(|tag| cut(tag, MAX_TAG_BYTES).to_owned()).collect(),
    }
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
    if hello.tags.len() > MAX_TAGS || hello.tags.iter().any(|tag| tag.len() > MAX_TAG_BYTES) {
        return Err(format!("a worker has at most {MAX_TAGS} tags of at most {MAX_TAG_BYTES} bytes"));
    }
    let shown = |text: &str| printable_within(text, MAX_NAME_BYTES).into_owned();
    Ok(Hello {
        name: shown(&hello.name),
        threads: hello.threads,
        simd: shown(&hello.simd),
        software: shown(&hello.software),
        tags: hello.tags.iter().map(|tag| printable_within(tag, MAX_TAG_BYTES).into_owned()).collect(),
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
