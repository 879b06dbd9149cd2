//! Skeleton of the mesh contract: filled in by its owner.

use std::fmt;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::scene::Material;

/// The name of a compiled mesh: BLAKE3 of its bytes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct MeshId(pub [u8; 32]);

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
    /// Material slots; never empty when there are triangles.
    pub materials: Vec<NamedMaterial>,
}

/// A material slot of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedMaterial {
    /// Name in the file, for messages.
    pub name: String,
    /// What the file says of it.
    pub material: Material,
}
