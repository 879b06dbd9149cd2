//! The folder that holds a worker's key and the masters that it remembers.

use std::path::PathBuf;

/// The worker's state folder: systemd's `$STATE_DIRECTORY`, else the user's by the system's convention
/// (`$XDG_STATE_HOME` or `~/.local/state` on Linux). `None` where the environment names no absolute path.
pub(in crate::app) fn state_folder() -> Option<PathBuf> {
    folder_of(|name| std::env::var_os(name).map(PathBuf::from))
}

/// The state folder by the variables of an environment.
fn folder_of(variable: impl Fn(&str) -> Option<PathBuf>) -> Option<PathBuf> {
    let absolute = |name: &str| variable(name).filter(|path| path.is_absolute());
    if let Some(folder) = absolute("STATE_DIRECTORY") {
        return Some(folder);
    }
    let base = if cfg!(windows) {
        absolute("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        absolute("HOME").map(|home| home.join("Library/Application Support"))
    } else {
        absolute("XDG_STATE_HOME").or_else(|| absolute("HOME").map(|home| home.join(".local/state")))
    };
    base.map(|base| base.join("rayfarm-worker"))
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    fn folder(variables: &[(&str, &str)]) -> Option<PathBuf> {
        folder_of(|name| {
            variables.iter().find(|(known, _)| *known == name).map(|(_, value)| PathBuf::from(value))
        })
    }

    #[test]
    fn the_folder_of_systemd_takes_precedence_and_relative_paths_are_ignored() {
        let home = ("HOME", "/home/a");
        assert_eq!(folder(&[home]), Some("/home/a/.local/state/rayfarm-worker".into()));
        let state = ("XDG_STATE_HOME", "/s");
        assert_eq!(folder(&[home, state]), Some("/s/rayfarm-worker".into()));
        assert_eq!(folder(&[home, state, ("STATE_DIRECTORY", "/var/lib/x")]), Some("/var/lib/x".into()));
        assert_eq!(folder(&[("STATE_DIRECTORY", "x"), ("HOME", "../a")]), None);
    }
}
