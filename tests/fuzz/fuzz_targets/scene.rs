//! A scene file. Errors are reported, and never by a panic.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use rayfarm_tracer::CompiledScene;
use rayfarm_tracer::scene::{LoadOptions, load_with};
use tempfile::TempDir;

static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a folder");
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n";
    std::fs::write(folder.path().join("m.obj"), triangle).expect("a model");
    folder
});

fuzz_target!(|data: &[u8]| {
    // Names of files lead nowhere else.
    if data.windows(2).any(|pair| matches!(pair, b".." | b"\"/" | b"'/")) {
        return;
    }
    let path = FOLDER.path().join("scene.toml");
    std::fs::write(&path, data).expect("a scene");
    match load_with(&path, LoadOptions::default()) {
        Ok(loaded) => {
            loaded.scene.validate().expect("a loaded scene is valid");
            let _ = CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures);
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
