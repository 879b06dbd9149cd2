//! Sizes of the parts of a compiled mesh.

use super::CompiledMesh;
use crate::bvh::WIDTH;

/// Bytes of a compiled mesh by part. They are the same in memory, in a file and on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshMemory {
    /// Number of nodes of the tree, with up to sixteen children each.
    pub nodes: usize,
    /// Lanes of all blocks, sixteen per leaf; some are empty.
    pub lanes: usize,
    /// Bytes of the nodes.
    pub node_bytes: usize,
    /// Bytes of the corners of triangles.
    pub triangle_bytes: usize,
    /// Bytes of the vertex normals and their indices; zero if the mesh has none.
    pub normal_bytes: usize,
    /// Bytes of the texture coordinates; zero if the mesh has none.
    pub uv_bytes: usize,
    /// Bytes of the vertex colours; zero if the mesh has none.
    pub color_bytes: usize,
    /// Bytes of the rest: header, material slots, positions in the source.
    pub rest_bytes: usize,
}

impl MeshMemory {
    /// Sum of all parts.
    pub fn total_bytes(&self) -> usize {
        self.node_bytes
            + self.triangle_bytes
            + self.normal_bytes
            + self.uv_bytes
            + self.color_bytes
            + self.rest_bytes
    }

    /// Lower bound of the bytes that normals would take: their three indices per lane.
    pub fn least_normal_bytes(&self) -> usize {
        self.lanes * size_of::<[u32; 3]>()
    }

    /// Bytes that vertex colours would take.
    pub fn full_color_bytes(&self) -> usize {
        self.lanes * size_of::<[[u8; 3]; 3]>()
    }

    /// Bytes that texture coordinates would take.
    pub fn full_uv_bytes(&self) -> usize {
        self.lanes * size_of::<[glam::Vec2; 3]>()
    }
}

impl CompiledMesh {
    /// Bytes by part.
    pub fn memory(&self) -> MeshMemory {
        let node_bytes = size_of_val(self.nodes());
        let triangle_bytes = size_of_val(self.blocks());
        let normal_bytes = size_of_val(self.indices()) + size_of_val(self.normals());
        let uv_bytes = size_of_val(self.uvs()) + size_of_val(self.uv_repeats());
        let color_bytes = size_of_val(self.colors());
        let named = node_bytes + triangle_bytes + normal_bytes + uv_bytes + color_bytes;
        MeshMemory {
            nodes: self.nodes().len(),
            lanes: self.blocks().len() * WIDTH,
            node_bytes,
            triangle_bytes,
            normal_bytes,
            uv_bytes,
            color_bytes,
            rest_bytes: self.bytes().len() - named,
        }
    }
}
