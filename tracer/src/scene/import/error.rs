//! What can be wrong with a scene and the files it names.

use std::io;
use std::path::{Path, PathBuf};

use super::printed::escaped;
use crate::mesh::MeshError;

/// Why a scene or model cannot be loaded. All of them are the input's fault and name the place.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A place in a scene file.
    #[error("{}:{line}:{column}: {}", shown(path), escaped(message))]
    InScene {
        /// The scene file.
        path: PathBuf,
        /// Counted from 1.
        line: usize,
        /// Characters, counted from 1.
        column: usize,
        /// What is wrong, what was expected, what to do.
        message: String,
    },
    /// A line of a model file.
    #[error("{}:{line}: {}", shown(path), escaped(message))]
    InModel {
        /// The model file.
        path: PathBuf,
        /// Counted from 1.
        line: usize,
        /// What is wrong, what was expected, what to do.
        message: String,
    },
    /// A file as a whole.
    #[error("{}: {}", shown(path), escaped(message))]
    InFile {
        /// The file.
        path: PathBuf,
        /// What is wrong, what was expected, what to do.
        message: String,
    },
    /// A file that cannot be opened or read.
    #[error("cannot read {}: {source}", shown(path))]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A model that cannot be compiled, or a compiled one that is broken.
    #[error("{}: {source}", shown(path))]
    Mesh {
        /// The model file.
        path: PathBuf,
        /// What is wrong with it.
        source: MeshError,
    },
}

/// A path as messages print it.
pub(in crate::scene) fn shown(path: &Path) -> String {
    escaped(&path.display().to_string())
}

impl SceneError {
    pub(in crate::scene) fn in_file(path: &Path, message: impl Into<String>) -> Self {
        Self::InFile { path: path.to_owned(), message: message.into() }
    }
}
