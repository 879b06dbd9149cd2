//! Commands over a socket: a few connections at a time, each with its own task.

use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpListener;
use tokio::time::{Instant, timeout, timeout_at};
use tokio_util::sync::CancellationToken;

use super::console::{Answer, Console, Then, refused};
use super::lines::{Line, LineSplitter};
use super::slots::{Connection, ConnectionSlots, MAX_CONNECTIONS};
use super::token::TokenFile;
use crate::error::CommandError;

/// Time within which a connection must send the token.
const TOKEN_TIMEOUT: Duration = Duration::from_secs(10);
/// Time without a command after which a connection ends.
const IDLE_TIMEOUT: Duration = Duration::from_secs(600);
/// Time within which a connection must read its answer.
const WRITE_TIMEOUT: Duration = Duration::from_secs(10);

/// Server of the connections of one place.
#[derive(Clone)]
struct Server {
    slots: ConnectionSlots,
    token: Option<Arc<TokenFile>>,
    console: Console,
    stop: CancellationToken,
}

impl Server {
    fn new(token: Option<TokenFile>, console: Console, stop: CancellationToken) -> Self {
        Self { slots: ConnectionSlots::default(), token: token.map(Arc::new), console, stop }
    }

    /// Serves a connection in a task of its own.
    fn serve(&self, mut stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static) {
        let (server, connection) = (self.clone(), self.slots.take());
        tokio::spawn(async move {
            let ended = tokio::select! {
                () = server.stop.cancelled() => return,
                () = connection.replaced.cancelled() => Some(format!(
                    "{MAX_CONNECTIONS} connections may be open, and this one was idle for longest when another one arrived"
                )),
                ended = server.converse(&mut stream, &connection) => ended,
            };
            if let Some(reason) = ended {
                // The client may have closed its end already.
                let _ = write(&mut stream, &refused(&reason, Then::Close)).await;
            }
        });
    }

    /// Accepts connections from `accept` until the run ends.
    async fn listen<S, A, F>(self, accept: A)
    where
        S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
        A: Fn() -> F,
        F: Future<Output = io::Result<S>>,
    {
        let listen = async {
            loop {
                match accept().await {
                    Ok(stream) => self.serve(stream),
                    Err(error) => pause_after(&error).await,
                }
            }
        };
        self.stop.run_until_cancelled(listen).await;
    }

    /// Answers line by line. Returns the reason of the end, where the client is to receive one.
    async fn converse(
        &self,
        stream: &mut (impl AsyncRead + AsyncWrite + Unpin),
        connection: &Connection,
    ) -> Option<String> {
        let mut lines = LineSplitter::default();
        let mut is_trusted = self.token.is_none();
        if is_trusted {
            connection.touch();
        }
        let mut deadline = Instant::now() + if is_trusted { IDLE_TIMEOUT } else { TOKEN_TIMEOUT };
        let mut chunk = [0; 1024];
        loop {
            let Ok(read) = timeout_at(deadline, stream.read(&mut chunk)).await else {
                return Some(if is_trusted { idle() } else { self.wants_token() });
            };
            // A broken connection receives no reason.
            let count = read.ok()?;
            let bytes = chunk.get(..count).unwrap_or_default();
            for byte in bytes.iter().map(|&byte| Some(byte)).chain((count == 0).then_some(None)) {
                let line = match byte {
                    Some(byte) => lines.push(byte),
                    None => lines.end(),
                };
                let Some(line) = line else { continue };
                let answer = match self.opening(is_trusted, &line) {
                    Some(answer) => answer,
                    None => {
                        let console = self.console.clone();
                        tokio::task::spawn_blocking(move || console.answer(&line)).await.ok()?
                    }
                };
                let written = write(stream, &answer).await;
                match answer.then {
                    Then::Listen => written.ok()?,
                    Then::Close => return None,
                    Then::Quit => {
                        self.console.quit();
                        return None;
                    }
                }
                is_trusted = true;
                connection.touch();
                deadline = Instant::now() + IDLE_TIMEOUT;
            }
            if count == 0 {
                return None;
            }
        }
    }

    /// The answer to the first line of a connection, where that must be the token.
    fn opening(&self, is_trusted: bool, line: &Line) -> Option<Answer> {
        let token = self.token.as_ref().filter(|_| !is_trusted)?;
        let opens = matches!(line, Line::Text(text) if token.opens(text));
        let granted = || Answer { line: "{\"ok\":true}\n".to_owned(), then: Then::Listen };
        Some(if opens { granted() } else { refused(&self.wants_token(), Then::Close) })
    }

    fn wants_token(&self) -> String {
        "the first line must be the token of this run; the master's log names its file".to_owned()
    }
}

fn idle() -> String {
    format!("no command has arrived for {} minutes", IDLE_TIMEOUT.as_secs() / 60)
}

async fn write(stream: &mut (impl AsyncWrite + Unpin), answer: &Answer) -> io::Result<()> {
    let written = timeout(WRITE_TIMEOUT, stream.write_all(answer.line.as_bytes())).await;
    written.unwrap_or_else(|_| Err(io::ErrorKind::TimedOut.into()))
}

/// Listens at a TCP port of this machine. Its token is written to one of `folders`.
pub(super) fn listen_tcp(
    address: SocketAddr,
    folders: &[PathBuf],
    console: Console,
    stop: CancellationToken,
) -> Result<(), CommandError> {
    let refuse = |error: io::Error| {
        CommandError::Failed(format!(
            "cannot accept commands at {address}: {error}; choose another port with --control 127.0.0.1:PORT"
        ))
    };
    let listener = std::net::TcpListener::bind(address).map_err(refuse)?;
    listener.set_nonblocking(true).map_err(refuse)?;
    let listener = TcpListener::from_std(listener).map_err(refuse)?;
    let address = listener.local_addr().map_err(refuse)?;
    let token = TokenFile::create(folders, address).map_err(|problem| {
        CommandError::Failed(format!(
            "cannot accept commands at {address}: {problem}; use a Unix socket, such as --control ./control"
        ))
    })?;
    let (file, ip, port) = (token.path().display(), address.ip(), address.port());
    tracing::info!(
        "commands are accepted at {address}; to send one: (cat '{file}'; echo status) | nc -q 1 {ip} {port}"
    );
    let server = Server::new(Some(token), console, stop);
    let listener = Arc::new(listener);
    tokio::spawn(server.listen(move || {
        let listener = listener.clone();
        async move { listener.accept().await.map(|(stream, _)| stream) }
    }));
    Ok(())
}

/// Listens at a Unix socket that is created for this run and removed after it.
#[cfg(unix)]
pub(super) fn listen_unix(
    path: &Path,
    console: Console,
    stop: CancellationToken,
) -> Result<(), CommandError> {
    let socket = super::socket_file::SocketFile::bind(path).map_err(|problem| {
        CommandError::Failed(format!("cannot accept commands at {}: {problem}", path.display()))
    })?;
    tracing::info!("commands are accepted at {}", path.display());
    let server = Server::new(None, console, stop);
    let socket = Arc::new(socket);
    tokio::spawn(server.listen(move || {
        let socket = socket.clone();
        async move { socket.listener.accept().await.map(|(stream, _)| stream) }
    }));
    Ok(())
}

/// Fails: this system has no Unix sockets.
#[cfg(not(unix))]
pub(super) fn listen_unix(path: &Path, _: Console, _: CancellationToken) -> Result<(), CommandError> {
    Err(CommandError::WrongInput(format!(
        "{}: this system has no Unix sockets; use --control 127.0.0.1:7118",
        path.display()
    )))
}

/// Waits after a failed accept, usually because no file descriptor is free, so that the loop does not spin.
async fn pause_after(error: &std::io::Error) {
    tracing::warn!("a connection for commands was not accepted: {error}");
    tokio::time::sleep(std::time::Duration::from_millis(100)).await;
}
