//! What a compiled mesh holds, and how many bytes each part of it takes.

use super::CompiledMesh;
use crate::bvh::WIDTH;

/// The bytes of a compiled mesh, part by part. They are the same in memory, in a file and on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshMemory {
    /// Nodes of the tree, of up to sixteen children each.
    pub nodes: usize,
    /// Room for triangles in the leaves, sixteen by sixteen; some of it is empty.
    pub lanes: usize,
    /// Bytes of the nodes.
    pub node_bytes: usize,
    /// Bytes of the triangles' corners.
    pub triangle_bytes: usize,
    /// Bytes of the vertex normals and of what names them; zero where the mesh carries none.
    pub normal_bytes: usize,
    /// Bytes of the texture coordinates; zero where the mesh carries none.
    pub uv_bytes: usize,
    /// Bytes of the colours of vertices; zero where the mesh carries none.
    pub color_bytes: usize,
    /// Bytes of the rest: header, material slots, positions in the source.
    pub rest_bytes: usize,
}

impl MeshMemory {
    /// All of it.
    pub fn total_bytes(&self) -> usize {
        self.node_bytes
            + self.triangle_bytes
            + self.normal_bytes
            + self.uv_bytes
            + self.color_bytes
            + self.rest_bytes
    }

    /// What normals would take at least, were they there: the three numbers of each triangle that name them.
    pub fn least_normal_bytes(&self) -> usize {
        self.lanes * size_of::<[u32; 3]>()
    }

    /// What colours of vertices would take, were they there.
    pub fn full_color_bytes(&self) -> usize {
        self.lanes * size_of::<[[u8; 3]; 3]>()
    }

    /// What texture coordinates would take, were they there.
    pub fn full_uv_bytes(&self) -> usize {
        self.lanes * size_of::<[glam::Vec2; 3]>()
    }
}

impl CompiledMesh {
    /// How many bytes each part of it takes.
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
