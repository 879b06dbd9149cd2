//! Reading of whole files within limits, and their types.

use std::io;
use std::path::Path;

use super::SceneError;
use super::foreign::{Wanted, head, recognised};
use crate::files::read_within;
use crate::mesh;

/// Largest size of a scene file in bytes.
pub(in crate::scene) const MAX_SCENE_BYTES: u64 = 64 << 20;
/// Largest size of a model in bytes, as text or compiled.
pub(in crate::scene) const MAX_MODEL_BYTES: u64 = 8 << 30;
/// Largest size of a material library in bytes.
pub(in crate::scene) const MAX_LIBRARY_BYTES: u64 = 16 << 20;

/// Type of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::scene) enum Kind {
    /// A scene file.
    Scene,
    /// Wavefront OBJ.
    Obj,
    /// A compiled model.
    Compiled,
}

impl Kind {
    /// Type of a file: of a compiled model by its content, of others by their extension.
    pub(in crate::scene) fn of(path: &Path) -> Result<Self, SceneError> {
        let head = head(path).map_err(|source| unreadable(path, source))?;
        if head.starts_with(&mesh::MAGIC) {
            return Ok(Self::Compiled);
        }
        if let Some(foreign) = recognised(&head) {
            return Err(SceneError::in_file(path, foreign.refusal(Wanted::Model)));
        }
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("toml") => Ok(Self::Scene),
            Some("obj") => Ok(Self::Obj),
            Some("gltf" | "glb") => {
                Err(SceneError::in_file(path, "glTF models are not supported yet; convert it to .obj"))
            }
            Some("mtl") => Err(SceneError::in_file(
                path,
                "a material library, not a model: give the model (.obj) that it belongs to",
            )),
            _ => Err(SceneError::in_file(
                path,
                "neither a scene (.toml) nor a model (.obj, or one made by `rayfarm-master compile`)",
            )),
        }
    }
}

fn unreadable(path: &Path, source: io::Error) -> SceneError {
    SceneError::Read { path: path.to_owned(), source }
}

/// All bytes of a file of at most `limit` bytes. A larger one is refused before it is read.
pub(in crate::scene) fn bytes(path: &Path, limit: u64) -> Result<Vec<u8>, SceneError> {
    let too_large = || SceneError::in_file(path, format!("the file is larger than {limit} bytes, the limit"));
    read_within(path, limit).map_err(|source| unreadable(path, source))?.ok_or_else(too_large)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(name: &str, content: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        (folder, path)
    }

    #[test]
    fn compiled_models_are_recognised_by_content_and_others_by_name() {
        for (name, content, kind) in [
            ("a.toml", &b""[..], Kind::Scene),
            ("a.OBJ", b"v 0 0 0", Kind::Obj),
            ("a.obj", b"RFMESH..", Kind::Compiled),
            ("a", b"RFMESH", Kind::Compiled),
            ("a.obj", b"", Kind::Obj),
        ] {
            let (_folder, path) = file(name, content);
            assert_eq!(Kind::of(&path).unwrap(), kind, "{name}");
        }
    }

    #[test]
    fn other_files_are_refused_by_type() {
        for (name, content, words) in [
            ("a.gltf", &b"{}"[..], "glTF models are not supported yet"),
            ("a.glb", b"glTF\x02", "this is a glTF model (.glb)"),
            ("a.stl", b"solid", "neither a scene (.toml) nor a model (.obj"),
            ("a.obj", b"\x1f\x8b\x08", "this is a gzip archive"),
            ("a.toml", b"<!DOCTYPE html>", "this is a web page"),
            ("a", b"%PDF-1.4", "a model (.obj) or a scene (.toml) was expected"),
            ("a.mtl", b"newmtl a", "give the model (.obj) that it belongs to"),
        ] {
            let (_folder, path) = file(name, content);
            let message = Kind::of(&path).unwrap_err().to_string();
            assert!(message.contains(name) && message.contains(words), "{message}");
        }
        let message = Kind::of(Path::new("no/such.toml")).unwrap_err().to_string();
        assert!(message.starts_with("cannot read no/such.toml: "), "{message}");
    }

    #[test]
    fn files_beyond_the_limit_are_refused() {
        let (_folder, path) = file("a", b"12345");
        assert_eq!(bytes(&path, 5).unwrap(), b"12345");
        assert!(bytes(&path, 4).unwrap_err().to_string().contains("4 bytes"));
    }
}
