//! Triangle meshes: as a file describes them ([`Mesh`]), and ready to trace ([`CompiledMesh`]).
//!
//! A compiled mesh is one immutable blob of bytes, named by its BLAKE3 hash. It is made once, on the master or by
//! `rayfarm-master compile`, and travels to every worker as it is: all workers walk the same tree.

mod blob;
mod clean;
mod compiled;
mod materials;
mod memory;
#[cfg(test)]
mod tests;

use std::fmt;

use glam::{DVec3, Vec2, Vec3};
use serde::{Deserialize, Serialize};

pub use crate::bvh::BuildQuality;
use crate::scene::Material;
pub(crate) use blob::TriangleBlock;
pub use compiled::{CompileOptions, CompiledMesh, MeshReport};
pub use memory::MeshMemory;

/// First bytes of a compiled mesh, in memory and on disk.
pub const MAGIC: [u8; 6] = *b"RFMESH";

/// Version of the layout of compiled meshes.
pub const FORMAT_VERSION: u16 = 3;

/// Most triangles that one mesh may have: they fill at most 2^28 lanes of blocks, and their indices stay inside `u32`.
pub const MAX_TRIANGLES: usize = 1 << 27;

/// Most material slots that one mesh may have: a slot is a `u16`.
pub const MAX_MATERIALS: usize = 1 << 16;

/// Largest coordinate, in magnitude, that a mesh may have. Squares of squares of it stay finite in `f64`.
pub const MAX_COORDINATE: f64 = 1e60;

/// Longest name of a texture's file in a material slot, in bytes.
pub const MAX_TEXTURE_NAME: usize = 4096;

/// The name of a compiled mesh: BLAKE3 of its bytes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct MeshId(pub [u8; 32]);

impl fmt::Display for MeshId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for MeshId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "MeshId({:02x}{:02x}{:02x}{:02x})", self.0[0], self.0[1], self.0[2], self.0[3])
    }
}

/// A mesh as a file describes it: not cleaned, not indexed for tracing, digits still `f64`.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<DVec3>,
    /// One normal per position, or empty where the file gives none (they are then averaged over the faces).
    pub normals: Vec<Vec3>,
    /// Corners as indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// One index into `materials` per triangle.
    pub triangle_materials: Vec<u16>,
    /// Texture coordinates of the corners of each triangle, as [`crate::texture::without_repeats`] leaves them; or empty.
    pub uvs: Vec<[Vec2; 3]>,
    /// Material slots; never empty when there are triangles.
    pub materials: Vec<NamedMaterial>,
}

/// A material slot of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedMaterial {
    /// Name in the file, for messages.
    pub name: String,
    /// What the file says of it, but for its texture: an index there means nothing without a scene.
    pub material: Material,
    /// The file of its texture: a path with `/` between its parts, relative to the model's folder, or absolute.
    pub texture: Option<String>,
}

/// Why a mesh cannot be compiled, or bytes are no compiled mesh.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// Nothing to trace.
    #[error(
        "the mesh has no triangle left to trace ({dropped} dropped as degenerate, duplicate or not finite); a model needs at least one triangle with an area"
    )]
    Empty {
        /// Triangles that cleaning dropped.
        dropped: usize,
    },
    /// A bound of this module is exceeded.
    #[error("the mesh has {count} {what}; the limit is {limit}")]
    TooMany {
        /// What there are too many of.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// How many there may be.
        limit: usize,
    },
    /// An index points outside, or two arrays that belong together differ in length.
    #[error("the mesh is inconsistent: {0}")]
    Inconsistent(String),
    /// The bytes are no compiled mesh of this version.
    #[error(
        "not a compiled model that this version reads: {0}; compile it again with `rayfarm-master compile MODEL -o FILE`"
    )]
    Format(String),
}
