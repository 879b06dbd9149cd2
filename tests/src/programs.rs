//! The programs under test, built as the test itself was built.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// `rayfarm-master`, ready for arguments.
pub fn master() -> Command {
    Command::new(folder().join(format!("rayfarm-master{}", std::env::consts::EXE_SUFFIX)))
}

/// `rayfarm-worker`, ready for arguments.
pub fn worker() -> Command {
    Command::new(folder().join(format!("rayfarm-worker{}", std::env::consts::EXE_SUFFIX)))
}

/// Where cargo puts programs; builds them first, so that no test runs yesterday's.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        // <target>/<profile>/deps/<this test>
        let test = std::env::current_exe().unwrap();
        let profile = test.parent().and_then(Path::parent).unwrap().to_path_buf();
        let mut build = Command::new(env!("CARGO"));
        // With what `cargo test` builds as well: what they share is then built once.
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
