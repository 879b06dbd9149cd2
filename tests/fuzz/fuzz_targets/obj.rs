//! A model in OBJ and its library in MTL, separated by a zero byte.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use rayfarm_tracer::mesh::CompiledMesh;
use rayfarm_tracer::scene::{LoadOptions, load_with};
use tempfile::TempDir;

static FOLDER: LazyLock<TempDir> = LazyLock::new(|| tempfile::tempdir().expect("a folder"));

fuzz_target!(|data: &[u8]| {
    // Names of files lead nowhere else.
    if data.windows(2).any(|pair| pair == b"..") {
        return;
    }
    let mut parts = data.splitn(2, |byte| *byte == 0);
    let (model, library) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    let path = FOLDER.path().join("m.obj");
    std::fs::write(&path, [b"mtllib m.mtl\n", model].concat()).expect("a model");
    std::fs::write(FOLDER.path().join("m.mtl"), library).expect("a library");
    match load_with(&path, LoadOptions::default()) {
        Ok(loaded) => {
            for mesh in loaded.meshes {
                CompiledMesh::from_bytes(mesh.bytes()).expect("a compiled mesh is sound");
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
