//! A Unix socket and its name among the files.

use std::io::ErrorKind;
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use socket2::{Domain, SockAddr, Socket, Type};

/// Connections that wait to be accepted.
const BACKLOG: i32 = 16;

/// A socket that its owner alone can connect to. Its name is removed with it.
#[derive(Debug)]
pub(super) struct SocketFile {
    pub(super) listener: tokio::net::UnixListener,
    path: PathBuf,
    /// Device and number of the file.
    file: (u64, u64),
}

impl SocketFile {
    /// Makes it. The socket of a run that was killed is replaced; one that a run listens at, or any other file, is not.
    pub(super) fn bind(path: &Path) -> Result<Self, String> {
        remove_stale(path)?;
        let told = |error: std::io::Error| match error.kind() {
            ErrorKind::AddrInUse => "there is something of that name already; choose another".to_owned(),
            _ => error.to_string(),
        };
        let socket = Socket::new(Domain::UNIX, Type::STREAM, None).map_err(told)?;
        socket.bind(&SockAddr::unix(path).map_err(told)?).map_err(told)?;
        // Until it listens, no client connects.
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600)).map_err(told)?;
        let file = identity(path).ok_or("the socket has gone")?;
        socket.listen(BACKLOG).map_err(told)?;
        socket.set_nonblocking(true).map_err(told)?;
        let listener = tokio::net::UnixListener::from_std(UnixListener::from(socket)).map_err(told)?;
        Ok(Self { listener, path: path.to_owned(), file })
    }
}

impl Drop for SocketFile {
    fn drop(&mut self) {
        // Another run may have put its own in the place.
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
        Ok(_) => Err("another run takes commands there; choose another name".to_owned()),
        Err(error) if error.kind() == ErrorKind::ConnectionRefused => std::fs::remove_file(path)
            .map_err(|error| format!("a socket of an earlier run is in the way: {error}")),
        Err(error) => Err(format!("there is a socket already, and it cannot be reached: {error}")),
    }
}
