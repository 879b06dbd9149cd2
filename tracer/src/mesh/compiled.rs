//! The compiled mesh: triangles in the order of the tree's leaves, and the tree, in one blob.

use glam::{DVec3, Vec2, Vec3};

use super::blob::{AlignedBytes, Header, NO_TRIANGLE, Sections, TriangleBlock};
use super::materials::{decode_materials, encode_materials};
use super::{FORMAT_VERSION, MeshError, MeshId, NamedMaterial};
use crate::bvh::{WIDTH, WideNode};

/// A mesh ready to trace, in mesh space: model = `center` + mesh * 2^`exponent`, coordinates within [-1, 1].
pub struct CompiledMesh {
    bytes: AlignedBytes,
    header: Header,
    sections: Sections,
    materials: Vec<NamedMaterial>,
    id: MeshId,
}

impl std::fmt::Debug for CompiledMesh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CompiledMesh").field("id", &self.id).field("header", &self.header).finish()
    }
}

impl CompiledMesh {
    /// Copies the bytes of a compiled mesh from a file or a peer, and checks everything that tracing relies on, in O(n).
    ///
    /// # Errors
    /// Bytes that are no compiled mesh of this version, or whose tree or indices are out of range.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, MeshError> {
        // Before anything is copied: the header must fit the length.
        Header::read(bytes)?;
        Self::from_aligned(AlignedBytes::copy_of(bytes))
    }

    /// Wraps and checks the bytes of a compiled mesh.
    pub(super) fn from_aligned(bytes: AlignedBytes) -> Result<Self, MeshError> {
        let header = Header::read(bytes.as_slice())?;
        let sections = header.sections();
        let id = MeshId(*blake3::Hasher::new().update_rayon(bytes.as_slice()).finalize().as_bytes());
        let start = sections.materials;
        let materials = decode_materials(
            &bytes.as_slice()[start..start + header.material_bytes as usize],
            header.material_count,
            header.version,
        )?;
        let mesh = Self { bytes, header, sections, materials, id };
        mesh.check()?;
        Ok(mesh)
    }

    /// The bytes as they are stored and sent.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.as_slice()
    }

    /// BLAKE3 of the bytes.
    pub fn id(&self) -> MeshId {
        self.id
    }

    /// Number of triangles after cleaning.
    pub fn triangle_count(&self) -> usize {
        self.header.triangle_count as usize
    }

    /// Number of material slots.
    pub fn material_count(&self) -> usize {
        self.materials.len()
    }

    /// Material slots as in the source file.
    pub fn materials(&self) -> Vec<NamedMaterial> {
        self.materials.clone()
    }

    /// The same mesh with other material slots, of the same number.
    ///
    /// # Errors
    /// Slots with numbers out of range.
    pub fn with_materials(&self, materials: &[NamedMaterial]) -> Result<Self, MeshError> {
        let encoded = encode_materials(materials);
        let mut header = self.header;
        header.version = FORMAT_VERSION;
        header.material_count = materials.len() as u32;
        header.material_bytes = encoded.len() as u32;
        // They are the last section, so the offsets of the others do not change.
        let mut bytes = AlignedBytes::zeroed(header.sections().end);
        let (before, last) = bytes.as_mut_slice().split_at_mut(self.sections.materials);
        before.copy_from_slice(&self.bytes()[..self.sections.materials]);
        before[..size_of::<Header>()].copy_from_slice(bytemuck::bytes_of(&header));
        last.copy_from_slice(&encoded);
        Self::from_aligned(bytes)
    }

    /// Bounds in model space.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let [lo, hi] = self.header.bounds.map(DVec3::from_array);
        (lo, hi)
    }

    /// Whether the mesh has vertex normals for smooth shading.
    pub fn has_normals(&self) -> bool {
        self.header.normal_count > 0
    }

    /// Whether the mesh has texture coordinates.
    pub fn has_uvs(&self) -> bool {
        self.header.uv_count > 0
    }

    /// Whether the mesh has vertex colours.
    pub fn has_colors(&self) -> bool {
        self.header.color_count > 0
    }

    /// Centre in model space: model = `center` + mesh * 2^`exponent`.
    pub fn center(&self) -> DVec3 {
        DVec3::from_array(self.header.center)
    }

    /// Binary exponent of the scale: see [`CompiledMesh::center`].
    pub fn exponent(&self) -> i32 {
        self.header.exponent
    }

    /// Bounds of the tree's root in mesh space.
    pub fn root_bounds(&self) -> (Vec3, Vec3) {
        self.nodes().first().map_or((Vec3::ZERO, Vec3::ZERO), WideNode::bounds)
    }

    pub(crate) fn nodes(&self) -> &[WideNode] {
        self.section(self.sections.nodes, self.header.node_count as usize)
    }

    /// Blocks of sixteen triangles. Triangle i is lane i % 16 of block i / 16.
    pub(crate) fn blocks(&self) -> &[TriangleBlock] {
        self.section(self.sections.blocks, self.header.block_count as usize)
    }

    /// Indices of all triangles: the lanes of the blocks that are not empty.
    pub fn triangles(&self) -> impl Iterator<Item = u32> {
        (0_u32..).zip(self.sources()).filter(|&(_, &source)| source != NO_TRIANGLE).map(|(i, _)| i)
    }

    /// Corners of triangle `i` in mesh space.
    #[inline]
    pub fn corners(&self, i: u32) -> [Vec3; 3] {
        self.blocks()[i as usize / WIDTH].corners(i as usize % WIDTH)
    }

    /// Position of triangle `i` in the source file. Of coincident triangles the first one is visible.
    pub fn source(&self, i: u32) -> u32 {
        self.sources()[i as usize]
    }

    /// Material slot of triangle `i`.
    pub fn slot(&self, i: u32) -> u16 {
        self.slots()[i as usize]
    }

    /// Unit normals at the corners of triangle `i`, if the mesh has them.
    pub fn corner_normals(&self, i: u32) -> Option<[Vec3; 3]> {
        let indices = self.indices().get(i as usize)?;
        Some(indices.map(|index| self.normals()[index as usize]))
    }

    /// Texture coordinates at the corners of triangle `i`, if the mesh has them.
    pub fn corner_uvs(&self, i: u32) -> Option<[Vec2; 3]> {
        self.uvs().get(i as usize).copied()
    }

    /// Whole repeats that were removed from the texture coordinates of triangle `i`; zero if the mesh has none.
    pub fn whole_repeats(&self, i: u32) -> Vec2 {
        self.uv_repeats().get(i as usize).copied().unwrap_or_default()
    }

    /// Colours at the corners of triangle `i`, sRGB, if the mesh has them.
    pub fn corner_colors(&self, i: u32) -> Option<[[u8; 3]; 3]> {
        self.colors().get(i as usize).copied()
    }

    pub(super) fn header(&self) -> &Header {
        &self.header
    }

    fn lanes(&self) -> usize {
        self.header.block_count as usize * WIDTH
    }

    pub(super) fn sources(&self) -> &[u32] {
        self.section(self.sections.sources, self.lanes())
    }

    pub(super) fn slots(&self) -> &[u16] {
        self.section(self.sections.slots, self.lanes())
    }

    pub(super) fn indices(&self) -> &[[u32; 3]] {
        self.section(self.sections.indices, if self.has_normals() { self.lanes() } else { 0 })
    }

    pub(super) fn normals(&self) -> &[Vec3] {
        self.section(self.sections.normals, self.header.normal_count as usize)
    }

    /// Texture coordinates of all lanes; empty if the mesh has none.
    pub(crate) fn uvs(&self) -> &[[Vec2; 3]] {
        self.section(self.sections.uvs, self.header.uv_count as usize)
    }

    /// Whole repeats of all lanes; empty if the mesh has none.
    pub(crate) fn uv_repeats(&self) -> &[Vec2] {
        self.section(self.sections.repeats, self.header.repeat_count as usize)
    }

    /// Colours of all lanes; empty if the mesh has none.
    pub(crate) fn colors(&self) -> &[[[u8; 3]; 3]] {
        self.section(self.sections.colors, self.header.color_count as usize)
    }

    /// The section that starts at `start`. `Header::read` has checked that all sections are inside, and they start on cache
    /// lines, so the cast cannot fail.
    fn section<T: bytemuck::AnyBitPattern>(&self, start: usize, count: usize) -> &[T] {
        bytemuck::cast_slice(&self.bytes.as_slice()[start..start + count * size_of::<T>()])
    }
}
