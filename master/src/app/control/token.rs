//! What opens the port for commands: a word in a file that only its owner can read.

use std::fs::{self, DirBuilder, OpenOptions};
use std::io::Write;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use blake3::Hash;

/// The token of one run, and its file, which goes with it.
#[derive(Debug)]
pub(super) struct TokenFile {
    path: PathBuf,
    hash: Hash,
}

impl TokenFile {
    /// Makes up a token and writes it into the first of these folders that takes it, as the line that opens the port.
    ///
    /// # Errors
    /// No random numbers, or no folder that takes it.
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

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether a line is the token's. Takes the same time for every wrong token of a length.
    pub(super) fn opens(&self, line: &str) -> bool {
        let token = line.trim().strip_prefix("token ").map(str::trim);
        token.is_some_and(|token| blake3::hash(token.as_bytes()) == self.hash)
    }
}

impl Drop for TokenFile {
    fn drop(&mut self) {
        // It may be gone already.
        let _ = fs::remove_file(&self.path);
    }
}

/// `control-127.0.0.1-7118`.
fn file_name(address: SocketAddr) -> String {
    format!("control-{}-{}", address.ip().to_string().replace(':', "_"), address.port())
}

/// Writes a file anew: one that is there is a killed run's, because this run has the port.
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

/// Where tokens are kept: the user's folder for what lasts as long as a login, or else the one for state.
pub(super) fn folders() -> Vec<PathBuf> {
    let named = |name| std::env::var_os(name).map(PathBuf::from).filter(|folder| folder.is_absolute());
    let state = named("XDG_STATE_HOME").or_else(|| Some(named("HOME")?.join(".local/state")));
    let folders = [named("XDG_RUNTIME_DIR"), state, named("LOCALAPPDATA")];
    folders.into_iter().flatten().map(|folder| folder.join("rayfarm")).collect()
}
