//! The token for the command port: a word in a file that only its owner can read.

use std::fs::{self, DirBuilder, OpenOptions};
use std::io::Write;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use blake3::Hash;

/// The token of one run. Its file is removed when it is dropped.
#[derive(Debug)]
pub(super) struct TokenFile {
    path: PathBuf,
    hash: Hash,
}

impl TokenFile {
    /// Draws a token and writes it, as the first line of a connection, to the first of these folders that is writable.
    ///
    /// # Errors
    /// No random numbers, or no writable folder.
    pub(super) fn create(folders: &[PathBuf], address: SocketAddr) -> Result<Self, String> {
        let mut secret = [0; 32];
        getrandom::fill(&mut secret).map_err(|error| format!("no random numbers for its token: {error}"))?;
        let token = Hash::from_bytes(secret).to_hex();
        let mut problem = "neither XDG_RUNTIME_DIR nor HOME names a folder for its token".to_owned();
        for folder in folders {
            let path = folder.join(file_name(address));
            match write(folder, &path, &format!("token {token}\n")) {
                Ok(()) => return Ok(Self { path, hash: blake3::hash(token.as_bytes()) }),
                Err(error) => problem = format!("its token cannot be written to {}: {error}", path.display()),
            }
        }
        Err(problem)
    }

    /// Path of the file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether a line has the token. Takes the same time for all wrong tokens of a length.
    pub(super) fn opens(&self, line: &str) -> bool {
        let token = line.trim().strip_prefix("token ").map(str::trim);
        token.is_some_and(|token| blake3::hash(token.as_bytes()) == self.hash)
    }
}

impl Drop for TokenFile {
    fn drop(&mut self) {
        // The file may have been removed already.
        let _ = fs::remove_file(&self.path);
    }
}

/// Name of the file of an address: `control-127.0.0.1-7118`.
fn file_name(address: SocketAddr) -> String {
    format!("control-{}-{}", address.ip().to_string().replace(':', "_"), address.port())
}

/// Creates the file. An existing one belongs to a killed run, because this run has the port, and is replaced.
fn write(folder: &Path, path: &Path, text: &str) -> std::io::Result<()> {
    let (mut builder, mut options) = (DirBuilder::new(), OpenOptions::new());
    builder.recursive(true);
    options.write(true).create_new(true);
    #[cfg(unix)]
    {
        std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    }
    builder.create(folder)?;
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    options.open(path)?.write_all(text.as_bytes())
}

/// Folders for tokens: the user's runtime folder, or else the state folder.
pub(super) fn folders() -> Vec<PathBuf> {
    let named = |name| std::env::var_os(name).map(PathBuf::from).filter(|folder| folder.is_absolute());
    let state = named("XDG_STATE_HOME").or_else(|| Some(named("HOME")?.join(".local/state")));
    let folders = [named("XDG_RUNTIME_DIR"), state, named("LOCALAPPDATA")];
    folders.into_iter().flatten().map(|folder| folder.join("rayfarm")).collect()
}
