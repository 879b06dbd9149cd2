//! A Unix socket and its file.

use std::io::ErrorKind;
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use socket2::{Domain, SockAddr, Socket, Type};

/// Connections that wait to be accepted.
const BACKLOG: i32 = 16;

/// A listening socket with access for its owner only. Its file is removed when it is dropped.
#[derive(Debug)]
pub(super) struct SocketFile {
    pub(super) listener: tokio::net::UnixListener,
    path: PathBuf,
    /// Device and inode of the file.
    file: (u64, u64),
}

impl SocketFile {
    /// Creates the socket. The file of a killed run is replaced; the socket of a running one, or any other file, is not.
    pub(super) fn bind(path: &Path) -> Result<Self, String> {
        remove_stale(path)?;
        let problem = |error: std::io::Error| match error.kind() {
            ErrorKind::AddrInUse => "a file of that name exists already; choose another name".to_owned(),
            _ => error.to_string(),
        };
        let socket = Socket::new(Domain::UNIX, Type::STREAM, None).map_err(problem)?;
        socket.bind(&SockAddr::unix(path).map_err(problem)?).map_err(problem)?;
        // No client can connect before the socket listens.
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600)).map_err(problem)?;
        let file = identity(path).ok_or("another process has removed the socket")?;
        socket.listen(BACKLOG).map_err(problem)?;
        socket.set_nonblocking(true).map_err(problem)?;
        let listener = tokio::net::UnixListener::from_std(UnixListener::from(socket)).map_err(problem)?;
        Ok(Self { listener, path: path.to_owned(), file })
    }
}

impl Drop for SocketFile {
    fn drop(&mut self) {
        // Another run may have replaced the file by its own.
        if identity(&self.path) == Some(self.file) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

fn identity(path: &Path) -> Option<(u64, u64)> {
    std::fs::symlink_metadata(path).ok().map(|metadata| (metadata.dev(), metadata.ino()))
}

fn remove_stale(path: &Path) -> Result<(), String> {
    let is_socket = std::fs::symlink_metadata(path).is_ok_and(|metadata| metadata.file_type().is_socket());
    if !is_socket {
        return Ok(());
    }
    match UnixStream::connect(path) {
        Ok(_) => Err("another run accepts commands there; choose another name".to_owned()),
        Err(error) if error.kind() == ErrorKind::ConnectionRefused => std::fs::remove_file(path)
            .map_err(|error| format!("the socket of an earlier run cannot be removed: {error}")),
        Err(error) => Err(format!("a socket exists already, and it cannot be reached: {error}")),
    }
}
