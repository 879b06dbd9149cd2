//! Reading whole files within a bound, and telling apart what they are.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use super::SceneError;
use crate::mesh;

/// Bytes of a scene file.
pub(super) const MAX_SCENE_BYTES: u64 = 64 << 20;
/// Bytes of a model, as text or compiled.
pub(super) const MAX_MODEL_BYTES: u64 = 8 << 30;
/// Bytes of a material library.
pub(super) const MAX_LIBRARY_BYTES: u64 = 16 << 20;

/// What a file is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// A scene file.
    Scene,
    /// Wavefront OBJ.
    Obj,
    /// A compiled model.
    Compiled,
}

impl Kind {
    /// A compiled model is known by its content, whatever its name; the others by their extension.
    pub(super) fn of(path: &Path) -> Result<Self, SceneError> {
        if first_bytes(path).map_err(|source| unreadable(path, source))? == mesh::MAGIC {
            return Ok(Self::Compiled);
        }
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("toml") => Ok(Self::Scene),
            Some("obj") => Ok(Self::Obj),
            Some("gltf" | "glb") => {
                Err(SceneError::in_file(path, "glTF models are not supported yet; convert it to .obj"))
            }
            _ => Err(SceneError::in_file(
                path,
                "neither a scene (.toml) nor a model (.obj, or one made by `rayfarm-master compile`)",
            )),
        }
    }
}

fn first_bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    File::open(path)?.take(mesh::MAGIC.len() as u64).read_to_end(&mut head)?;
    Ok(head)
}

fn unreadable(path: &Path, source: io::Error) -> SceneError {
    SceneError::Read { path: path.to_owned(), source }
}

/// All bytes of a file of at most `limit` bytes. A larger one is refused before any of it is read.
pub(super) fn bytes(path: &Path, limit: u64) -> Result<Vec<u8>, SceneError> {
    let too_large = || SceneError::in_file(path, format!("the file is larger than {limit} bytes, the limit"));
    let read = || {
        let file = File::open(path)?;
        // Room for all of it at once: a compiled model may have hundreds of megabytes.
        let announced = file.metadata()?.len();
        if announced > limit {
            return Ok(None);
        }
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(usize::try_from(announced).unwrap_or(usize::MAX))?;
        // What announces nothing (a pipe) or grows meanwhile is counted as it comes.
        file.take(limit + 1).read_to_end(&mut bytes)?;
        Ok(Some(bytes).filter(|bytes| bytes.len() as u64 <= limit))
    };
    read().map_err(|source| unreadable(path, source))?.ok_or_else(too_large)
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
    fn compiled_models_are_known_by_content_and_others_by_name() {
        for (name, content, kind) in [
            ("a.toml", &b""[..], Kind::Scene),
            ("a.OBJ", b"v 0 0 0", Kind::Obj),
            ("a.obj", b"RFMESH..", Kind::Compiled),
            ("a", b"RFMESH", Kind::Compiled),
        ] {
            let (_folder, path) = file(name, content);
            assert_eq!(Kind::of(&path).unwrap(), kind, "{name}");
        }
    }

    #[test]
    fn other_files_are_refused_with_what_is_known() {
        let (_folder, path) = file("a.glb", b"glTF");
        assert!(Kind::of(&path).unwrap_err().to_string().contains("not supported yet"));
        let (_folder, path) = file("a.stl", b"solid");
        let message = Kind::of(&path).unwrap_err().to_string();
        assert!(
            message.contains("a.stl") && message.contains(".toml") && message.contains(".obj"),
            "{message}"
        );
        let message = Kind::of(Path::new("no/such.toml")).unwrap_err().to_string();
        assert!(message.starts_with("cannot read no/such.toml: "), "{message}");
    }

    #[test]
    fn files_beyond_the_limit_are_refused() {
        let (_folder, path) = file("a", b"12345");
        assert_eq!(bytes(&path, 5).unwrap(), b"12345");
        assert!(bytes(&path, 4).unwrap_err().to_string().contains("larger than 4 bytes"));
    }
}
