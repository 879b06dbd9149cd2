//! The programs under test, built with the profile of the test itself.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Returns a command that runs `rayfarm-master`.
pub fn master() -> Command {
    Command::new(folder().join(format!("rayfarm-master{}", std::env::consts::EXE_SUFFIX)))
}

/// Returns a command that runs `rayfarm-worker`.
pub fn worker() -> Command {
    Command::new(folder().join(format!("rayfarm-worker{}", std::env::consts::EXE_SUFFIX)))
}

/// Builds the programs once per process, so that no test runs an outdated one. Returns their folder.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        // <target>/<profile>/deps/<this test>
        let test = std::env::current_exe().unwrap();
        let profile = test.parent().and_then(Path::parent).unwrap().to_path_buf();
        let mut build = Command::new(env!("CARGO"));
        // The same targets as `cargo test` builds, so that their dependencies are built once.
        build.args(["build", "--quiet", "--workspace", "--lib", "--bins", "--examples", "--tests"]);
        build.arg("--target-dir").arg(profile.parent().unwrap());
        if profile.ends_with("release") {
            build.arg("--release");
        }
        build.current_dir(crate::project_root());
        assert!(build.status().unwrap().success(), "the programs do not build: {build:?}");
        profile
    })
}
