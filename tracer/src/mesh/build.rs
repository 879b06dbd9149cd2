//! From a mesh to the bytes of a compiled one: cleaning, building the tree, laying out the sections.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::blob::{AlignedBytes, Header, NO_TRIANGLE, TriangleBlock};
use super::clean::{CleanMesh, clean};
use super::materials::encode_materials;
use super::{CompiledMesh, Mesh, MeshError};
use crate::bvh::{self, BuildQuality, WIDTH, WideTree};
use crate::cancel::never;
use crate::simd::Lanes;

/// Options of mesh compilation.
#[derive(Clone, Copy, Debug)]
pub struct CompileOptions {
    /// Whether to include vertex normals for smooth shading: the file's, or averaged. A mesh with flat instances only needs none.
    pub normals: bool,
    /// Effort of building the tree. Pictures do not depend on it.
    pub quality: BuildQuality,
}

impl Default for CompileOptions {
    /// With normals, at the default quality.
    fn default() -> Self {
        Self { normals: true, quality: BuildQuality::Default }
    }
}

/// Triangles that cleaning dropped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshReport {
    /// Degenerate triangles.
    pub dropped_degenerate: usize,
    /// Copies of an earlier triangle, except one as its other side that looks different.
    pub dropped_duplicate: usize,
    /// Triangles with a corner that is not finite, or farther out than [`super::MAX_COORDINATE`].
    pub dropped_not_finite: usize,
}

impl MeshReport {
    /// Number of all dropped triangles.
    pub fn dropped(&self) -> usize {
        self.dropped_degenerate + self.dropped_duplicate + self.dropped_not_finite
    }
}

impl CompiledMesh {
    /// Cleans and centres a mesh and builds its tree, with vertex normals and the texture coordinates that the mesh has.
    ///
    /// # Errors
    /// A mesh that is inconsistent, too large, or has nothing left after cleaning.
    pub fn compile(mesh: &Mesh) -> Result<(Self, MeshReport), MeshError> {
        Self::compile_with(mesh, CompileOptions::default())
    }

    /// [`CompiledMesh::compile`] with options.
    ///
    /// # Errors
    /// As [`CompiledMesh::compile`].
    pub fn compile_with(mesh: &Mesh, options: CompileOptions) -> Result<(Self, MeshReport), MeshError> {
        let (clean, report) = clean(mesh, options.normals)?;
        let boxes: Vec<_> = clean.corners.iter().map(bounds_of_corners).collect();
        let tree = bvh::build_wide(&boxes, WIDTH, options.quality, &never)?;
        let materials = encode_materials(&mesh.materials);

        let mut header = Header::new(clean.center, clean.exponent, clean.bounds);
        header.depth = tree.depth;
        header.node_count = tree.nodes.len() as u32;
        header.block_count = tree.blocks.len() as u32;
        header.triangle_count = clean.corners.len() as u32;
        header.normal_count = clean.normals.len() as u32;
        header.uv_count = if clean.uvs.is_empty() { 0 } else { header.slots() };
        header.repeat_count = if clean.uv_repeats.is_empty() { 0 } else { header.slots() };
        header.color_count = if clean.colors.is_empty() { 0 } else { header.slots() };
        header.material_count = mesh.materials.len() as u32;
        header.material_bytes = materials.len() as u32;
        let bytes = lay_out(&header, &clean, &tree, &materials);
        // The new bytes pass the same checks as bytes from a file or a peer.
        Ok((Self::from_aligned(bytes)?, report))
    }
}

fn bounds_of_corners([a, b, c]: &[Vec3; 3]) -> (Vec3, Vec3) {
    (a.min(*b).min(*c), a.max(*b).max(*c))
}

/// Writes the sections, triangles in the order of the tree's blocks.
fn lay_out(header: &Header, clean: &CleanMesh, tree: &WideTree, materials: &[u8]) -> AlignedBytes {
    let sections = header.sections();
    let mut bytes = AlignedBytes::zeroed(sections.end);
    let out = bytes.as_mut_slice();
    out[..size_of::<Header>()].copy_from_slice(bytemuck::bytes_of(header));
    let blocks: Vec<TriangleBlock> =
        tree.blocks.par_iter().map(|block| block_of(block, &clean.corners)).collect();
    put(out, sections.nodes, &tree.nodes);
    put(out, sections.blocks, &blocks);
    put(out, sections.sources, &in_lanes(tree, &clean.sources, NO_TRIANGLE));
    put(out, sections.slots, &in_lanes(tree, &clean.slots, 0));
    if !clean.normals.is_empty() {
        put(out, sections.indices, &in_lanes(tree, &clean.indices, [0; 3]));
        put(out, sections.normals, &clean.normals);
    }
    if !clean.uvs.is_empty() {
        put(out, sections.uvs, &in_lanes(tree, &clean.uvs, [Vec2::ZERO; 3]));
    }
    if !clean.uv_repeats.is_empty() {
        put(out, sections.repeats, &in_lanes(tree, &clean.uv_repeats, Vec2::ZERO));
    }
    if !clean.colors.is_empty() {
        put(out, sections.colors, &in_lanes(tree, &clean.colors, [[u8::MAX; 3]; 3]));
    }
    out[sections.materials..sections.materials + materials.len()].copy_from_slice(materials);
    bytes
}

fn block_of(triangles: &[u32], corners: &[[Vec3; 3]]) -> TriangleBlock {
    let mut block = TriangleBlock([[Lanes([f32::NAN; WIDTH]); 3]; 3]);
    for (lane, &triangle) in triangles.iter().enumerate() {
        for (corner, position) in corners[triangle as usize].iter().enumerate() {
            for axis in 0..3 {
                block.0[corner][axis].0[lane] = position[axis];
            }
        }
    }
    block
}

/// Sixteen entries per block; lanes without a triangle are `empty`.
fn in_lanes<T: Copy>(tree: &WideTree, items: &[T], empty: T) -> Vec<T> {
    let mut lanes = vec![empty; tree.blocks.len() * WIDTH];
    for (chunk, block) in lanes.chunks_exact_mut(WIDTH).zip(&tree.blocks) {
        for (lane, &triangle) in chunk.iter_mut().zip(block) {
            *lane = items[triangle as usize];
        }
    }
    lanes
}

fn put<T: bytemuck::NoUninit>(out: &mut [u8], start: usize, items: &[T]) {
    let bytes: &[u8] = bytemuck::cast_slice(items);
    out[start..start + bytes.len()].copy_from_slice(bytes);
}
