//! Triangle meshes: as read from a file ([`Mesh`]), and ready to trace ([`CompiledMesh`]).
//!
//! A compiled mesh is one immutable blob of bytes, named by its BLAKE3 hash. It is built once, on the master or by
//! `rayfarm-master compile`, and sent to every worker unchanged: all workers traverse the same tree.

mod blob;
mod build;
mod check;
mod clean;
mod compiled;
mod fans;
mod materials;
mod memory;
mod normals;
#[cfg(test)]
mod tests;

use std::fmt;

use glam::{DVec3, Vec2, Vec3};
use serde::{Deserialize, Serialize};

pub use crate::bvh::BuildQuality;
use crate::cancel::Cancelled;
use crate::material::Material;
use crate::texture::Tiling;
pub(crate) use blob::TriangleBlock;
pub use build::{CompileOptions, MeshReport};
pub use compiled::CompiledMesh;
pub use memory::MeshMemory;

/// First bytes of a compiled mesh, in memory and on disk.
pub const MAGIC: [u8; 6] = *b"RFMESH";

/// Version of the layout of compiled meshes.
pub const FORMAT_VERSION: u16 = 4;

/// The oldest version that is read: without emission, cut-outs and vertex colours.
pub const OLDEST_FORMAT_VERSION: u16 = 3;

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

/// A mesh as read from a file: not cleaned, not indexed for tracing, still in `f64`.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<DVec3>,
    /// One normal per position, zero where it is missing; or empty where the file has none. Missing normals are
    /// averaged over the faces according to `smoothing`.
    pub normals: Vec<Vec3>,
    /// Corners as indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Averaging of missing normals.
    pub smoothing: Smoothing,
    /// One index into `materials` per triangle.
    pub triangle_materials: Vec<u16>,
    /// Texture coordinates of the corners of each triangle, as from [`crate::texture::without_repeats`]; or empty.
    pub uvs: Vec<[Vec2; 3]>,
    /// Whole repeats that were removed from `uvs`, for each triangle; or empty where no texture distinguishes them.
    pub uv_repeats: Vec<Vec2>,
    /// Colours of the corners of each triangle, sRGB; or empty.
    pub colors: Vec<[[u8; 3]; 3]>,
    /// Material slots; never empty when there are triangles.
    pub materials: Vec<NamedMaterial>,
}

/// The faces over which a missing normal is averaged. Two opposite sides of a duplicated surface are never averaged.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Smoothing {
    /// All faces with the same position index.
    #[default]
    Full,
    /// Faces connected at the corner by edges with an angle of at most this many degrees.
    CreaseAngle(f64),
    /// Faces connected at the corner by edges within one group. One group per triangle; 0 is flat.
    Groups(Vec<u32>),
}

/// A material slot of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedMaterial {
    /// Name in the file, for messages.
    pub name: String,
    /// The material without its textures, whose indices need a scene.
    pub material: Material,
    /// Texture of the diffuse colour.
    pub texture: Option<TextureFile>,
    /// Picture of the cut-out; without it the alpha of `texture` cuts out.
    pub cutout: Option<TextureFile>,
    /// Texture of the emission.
    pub emission_texture: Option<TextureFile>,
}

impl NamedMaterial {
    /// A slot without textures.
    pub fn plain(name: impl Into<String>, material: Material) -> Self {
        Self { name: name.into(), material, texture: None, cutout: None, emission_texture: None }
    }

    /// All textures.
    pub fn textures(&self) -> impl Iterator<Item = &TextureFile> {
        [&self.texture, &self.cutout, &self.emission_texture].into_iter().flatten()
    }

    /// The textures, mutable.
    pub fn textures_mut(&mut self) -> impl Iterator<Item = &mut TextureFile> {
        [&mut self.texture, &mut self.cutout, &mut self.emission_texture].into_iter().flatten()
    }
}

/// The picture file of a texture and its tiling.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureFile {
    /// A path with `/` between its parts, relative to the model's folder, or absolute.
    pub file: String,
    /// Placement in texture space.
    pub tiling: Tiling,
}

impl TextureFile {
    /// A picture with one repeat per unit.
    pub fn new(file: impl Into<String>) -> Self {
        Self { file: file.into(), tiling: Tiling::default() }
    }
}

/// Reason why a mesh cannot be compiled, or bytes are no compiled mesh.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// No triangle is left after cleaning.
    #[error(
        "the mesh has no triangle left to trace ({dropped} dropped as degenerate, duplicate or not finite); a model needs at least one triangle with an area"
    )]
    Empty {
        /// Triangles that cleaning dropped.
        dropped: usize,
    },
    /// A limit is exceeded.
    #[error("the mesh has {count} {what}; the limit is {limit}")]
    TooMany {
        /// The limited items.
        what: &'static str,
        /// Their number.
        count: usize,
        /// The limit.
        limit: usize,
    },
    /// An index is out of range, or two arrays of different lengths belong together.
    #[error("the mesh is inconsistent: {0}")]
    Inconsistent(String),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The bytes are no compiled mesh of this version.
    #[error(
        "not a compiled model that this version reads: {0}; compile it again with `rayfarm-master compile MODEL -o FILE`"
    )]
    Format(String),
}
