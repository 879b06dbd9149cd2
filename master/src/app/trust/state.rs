//! The master's state folder: its private key and the token of its farm.

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use rayfarm_protocol::transport::{JoinToken, MasterTrust, PrivateKey, read_private, write_private};
use tokio_util::sync::CancellationToken;

use super::workers::WorkerFiles;
use crate::error::CommandError;

/// Interval at which a running master looks for a new token.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// The folder with the key and the token, the workers that have joined and the revoked keys.
#[derive(Clone, Debug)]
pub(super) struct MasterState {
    folder: PathBuf,
}

impl MasterState {
    /// The state in this folder, or in the user's state folder.
    ///
    /// # Errors
    /// A user without a home folder.
    pub(super) fn at(folder: Option<&Path>) -> Result<Self, CommandError> {
        let folder = folder.map(Path::to_owned).or_else(user_state_folder);
        let folder = folder.ok_or_else(|| {
            CommandError::WrongInput(
                "there is no home folder for the key and the token of this master; name a folder with --state"
                    .to_owned(),
            )
        })?;
        Ok(Self { folder })
    }

    /// The key and the token, which are made where there are none.
    ///
    /// # Errors
    /// Files that cannot be read or written, or that other users can access.
    pub(super) fn trust(&self) -> Result<Arc<MasterTrust>, CommandError> {
        let key = PrivateKey::load_or_create(&self.key_path()).map_err(CommandError::failed)?;
        let token = match self.read_token()? {
            Some(token) => token,
            None => self.new_token()?,
        };
        let trust = MasterTrust::new(key, token);
        let failed = |error| CommandError::Failed(format!("the revoked keys cannot be read: {error}"));
        trust.set_revoked(self.workers().revoked().map_err(failed)?);
        Ok(Arc::new(trust))
    }

    /// The files about workers.
    pub(super) fn workers(&self) -> WorkerFiles {
        WorkerFiles::of(&self.folder)
    }

    /// The token of the web display. Makes one if there is none.
    ///
    /// # Errors
    /// A file that cannot be read or written, or that other users can access.
    #[cfg(feature = "web")]
    pub(super) fn web_token(&self) -> Result<JoinToken, CommandError> {
        let path = self.web_token_path();
        match self.read_token_of(&path)? {
            Some(token) => Ok(token),
            None => self.new_token_of(&path),
        }
    }

    /// Makes a new token, and a new key if requested. The web display has a new token after its next start.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub(super) fn rotate(&self, key: bool) -> Result<(), CommandError> {
        if key {
            match std::fs::remove_file(self.key_path()) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(self.failed("remove", &self.key_path(), &error));
                }
                _ => {}
            }
        }
        match std::fs::remove_file(self.web_token_path()) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(self.failed("remove", &self.web_token_path(), &error));
            }
            _ => {}
        }
        self.new_token().map(|_| ())
    }

    /// Passes a new token and revoked keys on to a running farm, and records the workers that join, until `stop`.
    pub(super) async fn follow(self, trust: Arc<MasterTrust>, stop: CancellationToken) {
        let mut seen = self.token_time();
        let mut log = WorkerLog::default();
        loop {
            tokio::select! {
                () = stop.cancelled() => return,
                () = tokio::time::sleep(LOOK_EVERY) => {}
            }
            log.update(&self.workers(), &trust).await;
            let now = self.token_time();
            if now == seen {
                continue;
            }
            match self.read_token() {
                Ok(Some(token)) => {
                    seen = now;
                    trust.set_token(token);
                    tracing::info!(
                        "the token is new: connected workers stay, and the old join line is refused"
                    );
                }
                Ok(None) => seen = now,
                Err(error) => {
                    seen = now;
                    tracing::warn!("the new token is not used: {error}");
                }
            }
        }
    }

    fn token_time(&self) -> Option<SystemTime> {
        std::fs::metadata(self.token_path()).and_then(|file| file.modified()).ok()
    }

    fn read_token(&self) -> Result<Option<JoinToken>, CommandError> {
        self.read_token_of(&self.token_path())
    }

    fn read_token_of(&self, path: &Path) -> Result<Option<JoinToken>, CommandError> {
        let text = read_private(path).map_err(|error| self.failed("read", path, &error))?;
        text.map(|text| JoinToken::from_str(text.trim())).transpose().map_err(|error| {
            CommandError::Failed(format!(
                "cannot read {}: {error}; `rayfarm-master trust rotate` makes a new token",
                path.display()
            ))
        })
    }

    fn new_token(&self) -> Result<JoinToken, CommandError> {
        self.new_token_of(&self.token_path())
    }

    fn new_token_of(&self, path: &Path) -> Result<JoinToken, CommandError> {
        let token = JoinToken::random().map_err(CommandError::failed)?;
        write_private(path, &format!("{token}\n")).map_err(|error| self.failed("write", path, &error))?;
        Ok(token)
    }

    fn failed(&self, what: &str, path: &Path, error: &std::io::Error) -> CommandError {
        CommandError::Failed(format!("cannot {what} {}: {error}", path.display()))
    }

    fn key_path(&self) -> PathBuf {
        self.folder.join("key.pem")
    }

    fn web_token_path(&self) -> PathBuf {
        self.folder.join("web-token")
    }

    fn token_path(&self) -> PathBuf {
        self.folder.join("token")
    }
}

/// Files about workers, and the running farm with which they are synchronized.
#[derive(Default)]
struct WorkerLog {
    /// The last failure, which is logged once.
    failure: Option<String>,
}

impl WorkerLog {
    /// Records workers that have joined, and passes revoked keys on.
    async fn update(&mut self, files: &WorkerFiles, trust: &Arc<MasterTrust>) {
        let (files, trust) = (files.clone(), trust.clone());
        let result = tokio::task::spawn_blocking(move || {
            let revoked = files.revoked()?;
            if *trust.revoked().borrow() != revoked {
                tracing::info!("revoked keys: {}", revoked.len());
                trust.set_revoked(revoked);
            }
            let joined = trust.take_joined();
            joined.iter().try_for_each(|worker| files.add(worker, SystemTime::now()))
        });
        let failure = match result.await {
            Ok(Ok(())) => None,
            Ok(Err(error)) => Some(error.to_string()),
            Err(error) => Some(error.to_string()),
        };
        if let Some(why) = failure.as_ref().filter(|_| failure != self.failure) {
            tracing::warn!("the list of workers and of revoked keys is not up to date: {why}");
        }
        self.failure = failure;
    }
}

/// Folder for the state of this program, by the conventions of the system.
fn user_state_folder() -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let base = if cfg!(windows) {
        variable("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        variable("HOME").map(|home| home.join("Library/Application Support"))
    } else {
        variable("XDG_STATE_HOME").or_else(|| variable("HOME").map(|home| home.join(".local/state")))
    };
    base.map(|base| base.join("rayfarm").join("master"))
}

#[cfg(test)]
mod tests {
    use rayfarm_protocol::transport::{JoinedWorker, KeyHash};

    use super::*;

    fn state(folder: &tempfile::TempDir) -> MasterState {
        MasterState::at(Some(&folder.path().join("state"))).unwrap()
    }

    #[test]
    fn key_and_token_are_made_once_and_rotated_on_request() {
        let folder = tempfile::tempdir().unwrap();
        let line = || state(&folder).trust().unwrap().join_line("h:1");
        let first = line();
        assert!(line() == first, "kept");
        state(&folder).rotate(false).unwrap();
        let second = line();
        assert!(second.key == first.key && second != first);
        state(&folder).rotate(true).unwrap();
        assert!(line().key != first.key);
    }

    #[cfg(feature = "web")]
    #[test]
    fn the_web_token_is_kept_until_a_rotation() {
        let folder = tempfile::tempdir().unwrap();
        let first = state(&folder).web_token().unwrap();
        assert!(state(&folder).web_token().unwrap() == first);
        assert!(state(&folder).trust().unwrap().token() != first, "it opens no farm");
        state(&folder).rotate(false).unwrap();
        assert!(state(&folder).web_token().unwrap() != first);
    }

    #[test]
    fn a_damaged_token_is_an_error_with_the_remedy() {
        let folder = tempfile::tempdir().unwrap();
        state(&folder).trust().unwrap();
        write_private(&state(&folder).token_path(), "no token").unwrap();
        let error = state(&folder).trust().unwrap_err().to_string();
        assert!(error.contains("trust rotate"), "{error}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_running_master_follows_a_rotation() {
        let folder = tempfile::tempdir().unwrap();
        let trust = state(&folder).trust().unwrap();
        let before = trust.join_line("h:1");
        let stop = CancellationToken::new();
        let follow = tokio::spawn(state(&folder).follow(trust.clone(), stop.clone()));
        tokio::time::sleep(LOOK_EVERY * 2).await;
        assert!(trust.join_line("h:1") == before);
        // File systems keep times in steps: the new file must have a later one.
        std::thread::sleep(Duration::from_millis(50));
        state(&folder).rotate(false).unwrap();
        tokio::time::sleep(LOOK_EVERY * 2).await;
        assert!(trust.join_line("h:1") == state(&folder).trust().unwrap().join_line("h:1"));
        assert!(trust.join_line("h:1") != before);
        stop.cancel();
        follow.await.unwrap();
    }

    #[tokio::test]
    async fn a_running_master_records_workers_and_follows_revocations() {
        let folder = tempfile::tempdir().unwrap();
        let trust = state(&folder).trust().unwrap();
        let (files, key) = (state(&folder).workers(), KeyHash([5; 32]));
        let mut log = WorkerLog::default();
        trust.add_joined(JoinedWorker { key, name: "mill".to_owned() });
        log.update(&files, &trust).await;
        let joined = files.joined().unwrap();
        assert_eq!((joined.len(), joined[0].key, joined[0].name.as_str()), (1, key, "mill"));
        files.revoke(key).unwrap();
        log.update(&files, &trust).await;
        assert!(trust.is_revoked(&key) && state(&folder).trust().unwrap().is_revoked(&key));
        files.allow(key).unwrap();
        log.update(&files, &trust).await;
        assert!(!trust.is_revoked(&key) && log.failure.is_none());
    }
}
