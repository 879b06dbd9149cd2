//! The worker's own key, which is its identity for masters and for other workers.

use std::path::Path;
use std::sync::Arc;

use rayfarm_protocol::transport::{PrivateKey, PrivateKeyError};

/// Name of the file of the key in the state folder.
const KEY_FILE: &str = "key.pem";

/// Loads the worker's key, or makes one at the first start. Where the folder cannot be used, a key is made for this run
/// only, with a warning.
///
/// # Errors
/// A system without random numbers.
pub(in crate::app) fn load_identity(folder: Option<&Path>) -> Result<Arc<PrivateKey>, PrivateKeyError> {
    let saved = folder.map(|folder| PrivateKey::load_or_create(&folder.join(KEY_FILE)));
    let problem = match saved {
        Some(Ok(key)) => return Ok(Arc::new(key)),
        Some(Err(error)) => error.to_string(),
        None => "the environment names no home folder".to_owned(),
    };
    tracing::warn!(
        "this run has a key of its own, by which no master recognises this worker later: {problem}"
    );
    PrivateKey::generate().map(Arc::new)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_kept_in_the_folder_and_lasts_one_run_without_a_folder() {
        let folder = tempfile::tempdir().unwrap();
        let below = folder.path().join("state");
        let first = load_identity(Some(&below)).unwrap().hash();
        assert_eq!(load_identity(Some(&below)).unwrap().hash(), first);
        // A file is no folder.
        let file = below.join(KEY_FILE);
        let of_run = load_identity(Some(&file)).unwrap().hash();
        assert_ne!(of_run, first);
        assert_ne!(load_identity(None).unwrap().hash(), of_run);
    }
}
