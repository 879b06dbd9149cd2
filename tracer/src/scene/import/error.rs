//! Errors of scene files, models and the files that they name.

use std::io;
use std::path::{Path, PathBuf};

use super::printed::escaped;
use crate::mesh::MeshError;

/// Reason why a scene or model cannot be loaded. Every variant is a fault of the input and names its place.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// A fault at a position of a scene file.
    #[error("{}:{line}:{column}: {}", shown(path), escaped(message))]
    InScene {
        /// The scene file.
        path: PathBuf,
        /// Line, counted from 1.
        line: usize,
        /// Column in characters, counted from 1.
        column: usize,
        /// The fault, what was expected, and what to do.
        message: String,
    },
    /// A fault in a line of a model file.
    #[error("{}:{line}: {}", shown(path), escaped(message))]
    InModel {
        /// The model file.
        path: PathBuf,
        /// Line, counted from 1.
        line: usize,
        /// The fault, what was expected, and what to do.
        message: String,
    },
    /// A fault of a file as a whole.
    #[error("{}: {}", shown(path), escaped(message))]
    InFile {
        /// The file.
        path: PathBuf,
        /// The fault, what was expected, and what to do.
        message: String,
    },
    /// A file that cannot be opened or read.
    #[error("cannot read {}: {source}", shown(path))]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// A model that cannot be compiled, or a compiled one that is broken.
    #[error("{}: {source}", shown(path))]
    Mesh {
        /// The model file.
        path: PathBuf,
        /// Error of the mesh.
        source: MeshError,
    },
}

/// A path for messages, with escapes.
pub(in crate::scene) fn shown(path: &Path) -> String {
    escaped(&path.display().to_string())
}

impl SceneError {
    /// The message without the line of a scene file that only the program knows, because it is being edited; other places remain.
    pub fn message(&self) -> String {
        match self {
            Self::InScene { message, .. } => escaped(message).to_string(),
            other => other.to_string(),
        }
    }

    pub(in crate::scene) fn in_file(path: &Path, message: impl Into<String>) -> Self {
        Self::InFile { path: path.to_owned(), message: message.into() }
    }
}
