//! Commands over a socket: a few connections at a time, each in its own pace.

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio_util::sync::CancellationToken;

use super::console::{Console, Then};
use super::lines::Lines;
use crate::error::CommandError;

/// Connections at a time; whoever comes then is told so.
const MAX_CONNECTIONS: usize = 8;
const FULL: &[u8] = b"{\"ok\":false,\"error\":\"8 connections are open already, the most there may be\"}\n";

/// Who is connected, and how to let others in.
#[derive(Clone)]
struct Door {
    places: Arc<Semaphore>,
    console: Console,
    stop: CancellationToken,
}

impl Door {
    fn new(console: Console, stop: CancellationToken) -> Self {
        Self { places: Arc::new(Semaphore::new(MAX_CONNECTIONS)), console, stop }
    }

    /// Talks to somebody, if there is room.
    fn admit(&self, mut stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static) {
        let Door { places, console, stop } = self.clone();
        tokio::spawn(async move {
            let Ok(_place) = places.try_acquire_owned() else {
                // Whoever does not want to know need not.
                let _ = stream.write_all(FULL).await;
                return;
            };
            // A connection that breaks is over, and that is all.
            let _ = stop.run_until_cancelled(converse(&mut stream, &console)).await;
        });
    }
}

/// Listens at a TCP port of this machine.
pub(super) fn listen_tcp(
    address: SocketAddr,
    console: Console,
    stop: CancellationToken,
) -> Result<(), CommandError> {
    let refuse = |error: std::io::Error| {
        CommandError::Failed(format!(
            "cannot take commands at {address}: {error}; choose another port with --control 127.0.0.1:PORT"
        ))
    };
    let listener = std::net::TcpListener::bind(address).map_err(refuse)?;
    listener.set_nonblocking(true).map_err(refuse)?;
    let listener = TcpListener::from_std(listener).map_err(refuse)?;
    tracing::info!("commands are taken at {}", listener.local_addr().unwrap_or(address));
    let door = Door::new(console, stop);
    tokio::spawn(async move {
        let accept = async {
            loop {
                match listener.accept().await {
                    Ok((stream, _)) => door.admit(stream),
                    Err(error) => pause_after(&error).await,
                }
            }
        };
        door.stop.run_until_cancelled(accept).await;
    });
    Ok(())
}

/// Listens at a Unix socket that is made for this run and removed after it.
#[cfg(unix)]
pub(super) fn listen_unix(
    path: &Path,
    console: Console,
    stop: CancellationToken,
) -> Result<(), CommandError> {
    let socket = SocketFile::bind(path).map_err(|problem| {
        CommandError::Failed(format!("cannot take commands at {}: {problem}", path.display()))
    })?;
    tracing::info!("commands are taken at {}", path.display());
    let door = Door::new(console, stop);
    tokio::spawn(async move {
        let accept = async {
            loop {
                match socket.listener.accept().await {
                    Ok((stream, _)) => door.admit(stream),
                    Err(error) => pause_after(&error).await,
                }
            }
        };
        door.stop.run_until_cancelled(accept).await;
    });
    Ok(())
}

/// There are none.
#[cfg(not(unix))]
pub(super) fn listen_unix(path: &Path, _: Console, _: CancellationToken) -> Result<(), CommandError> {
    Err(CommandError::WrongInput(format!(
        "{}: this system has no Unix sockets; use --control 127.0.0.1:7118",
        path.display()
    )))
}

/// A Unix socket and its name among the files.
#[cfg(unix)]
struct SocketFile {
    listener: tokio::net::UnixListener,
    path: std::path::PathBuf,
}

#[cfg(unix)]
impl SocketFile {
    fn bind(path: &Path) -> Result<Self, String> {
        use std::os::unix::fs::{FileTypeExt, PermissionsExt};
        use std::os::unix::net::{UnixListener, UnixStream};
        let is_socket =
            std::fs::symlink_metadata(path).is_ok_and(|metadata| metadata.file_type().is_socket());
        if is_socket && UnixStream::connect(path).is_err() {
            // A run that was killed has left it behind.
            std::fs::remove_file(path).map_err(|error| error.to_string())?;
        }
        let listener = UnixListener::bind(path).map_err(|error| match error.kind() {
            std::io::ErrorKind::AddrInUse => {
                "there is something of that name already; choose another".to_owned()
            }
            _ => error.to_string(),
        })?;
        let owner_only = std::fs::Permissions::from_mode(0o600);
        std::fs::set_permissions(path, owner_only).map_err(|error| error.to_string())?;
        listener.set_nonblocking(true).map_err(|error| error.to_string())?;
        let listener = tokio::net::UnixListener::from_std(listener).map_err(|error| error.to_string())?;
        Ok(Self { listener, path: path.to_owned() })
    }
}

#[cfg(unix)]
impl Drop for SocketFile {
    fn drop(&mut self) {
        // It may have been removed by somebody else.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Out of file descriptors, usually: not as fast as it can fail.
async fn pause_after(error: &std::io::Error) {
    tracing::warn!("a connection for commands was not accepted: {error}");
    tokio::time::sleep(std::time::Duration::from_millis(100)).await;
}

/// Answers line by line, until either side has enough.
async fn converse(
    stream: &mut (impl AsyncRead + AsyncWrite + Unpin),
    console: &Console,
) -> std::io::Result<()> {
    let mut lines = Lines::default();
    let mut chunk = [0; 1024];
    loop {
        let count = stream.read(&mut chunk).await?;
        let mut said: Vec<_> = chunk[..count].iter().filter_map(|&byte| lines.push(byte)).collect();
        if count == 0 {
            said.extend(lines.end());
        }
        for line in said {
            let answer = console.answer(&line);
            let written = stream.write_all(answer.line.as_bytes()).await;
            match answer.then {
                Then::Listen => written?,
                Then::Close => return written,
                Then::Quit => {
                    console.quit();
                    return written;
                }
            }
        }
        if count == 0 {
            return Ok(());
        }
    }
}
