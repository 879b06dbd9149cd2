//! Skipping of tests on machines that lack a program or a file.
//!
//! A skip is printed and counted, past the capture of the test harness, so that it shows although the test passes. With
//! `RAYFARM_REQUIRE_ALL=1` (or its older name `RAYFARM_REQUIRE_WINDOW`) a missing program fails the test instead.

use std::io::Write;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

/// Environment variables with which no test may be skipped because a program is missing.
const REQUIRE_VARIABLES: [&str; 2] = ["RAYFARM_REQUIRE_ALL", "RAYFARM_REQUIRE_WINDOW"];

/// Number of skips in this process.
static SKIPS: AtomicU32 = AtomicU32::new(0);

/// Checks that programs are installed. Returns `false` where one is missing: the test is to return then.
///
/// # Panics
/// Where a program is missing and no test may be skipped.
#[must_use]
pub fn require(programs: &[&str]) -> bool {
    let missing: Vec<&str> = programs.iter().copied().filter(|program| !is_installed(program)).collect();
    if missing.is_empty() {
        return true;
    }
    let variable = REQUIRE_VARIABLES.into_iter().find(|name| std::env::var_os(name).is_some());
    assert!(variable.is_none(), "not installed: {missing:?}, and {} is set", variable.unwrap_or_default());
    skip(&format!("not installed: {missing:?}"));
    false
}

/// Checks that a file outside the project exists. Returns `false` where it does not: the test is to return then. Such
/// files are no part of the project, so no variable makes them required.
#[must_use]
pub(crate) fn require_file(path: &Path) -> bool {
    let exists = path.exists();
    if !exists {
        skip(&format!("no file {}", path.display()));
    }
    exists
}

fn skip(reason: &str) {
    let number = SKIPS.fetch_add(1, Ordering::Relaxed) + 1;
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test");
    // `eprintln!` would be captured. A failure to print is no failure of the test.
    let _ = writeln!(std::io::stderr(), "skipped ({number} in this process): {test}: {reason}");
}

fn is_installed(program: &str) -> bool {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&paths).any(|folder| folder.join(program).is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn installed_programs_are_found() {
        assert!(is_installed(if cfg!(windows) { "cmd.exe" } else { "sh" }));
        assert!(!is_installed("no-such-program"));
    }
}
