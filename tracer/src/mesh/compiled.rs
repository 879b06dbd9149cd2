//! A mesh ready to trace: triangles in the order of the tree's leaves, and the tree, in one blob.

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::blob::{AlignedBytes, Header, NO_TRIANGLE, Sections, TriangleBlock};
use super::clean::{CleanMesh, clean};
use super::materials::{decode_materials, encode_materials};
use super::{FORMAT_VERSION, MAX_COORDINATE, Mesh, MeshError, MeshId, NamedMaterial};
use crate::bvh::{self, BuildQuality, WIDTH, WideNode, WideTree};
use crate::cancel::never;
use crate::simd::Lanes;
use crate::texture;

/// What a compiled mesh should carry.
#[derive(Clone, Copy, Debug)]
pub struct CompileOptions {
    /// Vertex normals for smooth shading: the file's, or averaged. A mesh that is only ever drawn flat needs none.
    pub normals: bool,
    /// How much time its tree may take. What is seen does not depend on it.
    pub quality: BuildQuality,
}

impl Default for CompileOptions {
    /// With normals, at the default quality.
    fn default() -> Self {
        Self { normals: true, quality: BuildQuality::Default }
    }
}

/// What cleaning dropped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshReport {
    /// Triangles without an area.
    pub dropped_degenerate: usize,
    /// Copies of a triangle that comes earlier, but for one as its other side that looks different.
    pub dropped_duplicate: usize,
    /// Triangles with a corner that is not finite, or farther out than [`super::MAX_COORDINATE`].
    pub dropped_not_finite: usize,
}

impl MeshReport {
    /// All of them.
    pub fn dropped(&self) -> usize {
        self.dropped_degenerate + self.dropped_duplicate + self.dropped_not_finite
    }
}

/// A mesh ready to trace. Its space is its own: model = `center` + mesh * 2^`exponent`, coordinates within [-1, 1].
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
    /// Cleans, centres and builds, with vertex normals and the texture coordinates that the mesh has.
    ///
    /// # Errors
    /// A mesh that is inconsistent, too large, or has nothing left after cleaning.
    pub fn compile(mesh: &Mesh) -> Result<(Self, MeshReport), MeshError> {
        Self::compile_with(mesh, CompileOptions::default())
    }

    /// Cleans, centres and builds.
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
        // What was just written passes the same gate as what comes from elsewhere.
        Ok((Self::from_aligned(bytes)?, report))
    }

    /// Takes the bytes of a compiled mesh from a file or a peer, and checks all that tracing relies on, in O(n).
    ///
    /// # Errors
    /// Bytes that are no compiled mesh of this version, or whose tree or indices point astray.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, MeshError> {
        // Before anything is copied: the header must fit the length.
        Header::read(bytes)?;
        Self::from_aligned(AlignedBytes::copy_of(bytes))
    }

    fn from_aligned(bytes: AlignedBytes) -> Result<Self, MeshError> {
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

    fn check(&self) -> Result<(), MeshError> {
        let broken = |what: String| Err(MeshError::Format(what));
        if self.header.triangle_count == 0 || self.triangle_count() > super::MAX_TRIANGLES {
            return broken(format!("it announces {} triangles", self.header.triangle_count));
        }
        let depth = bvh::validate_wide(self.nodes(), self.header.block_count)
            .map_err(|error| MeshError::Format(error.to_string()))?;
        if depth != self.header.depth {
            return broken(format!("its tree is {depth} deep, its header says {}", self.header.depth));
        }
        if self.triangles().count() != self.triangle_count() {
            return broken("its blocks do not hold as many triangles as it announces".into());
        }
        self.check_placement()?;
        let sources = self.sources().chunks_exact(WIDTH);
        if !self.blocks().iter().zip(sources).all(|(block, sources)| corners_are_within_one(block, sources)) {
            return broken("a corner lies outside [-1, 1]".into());
        }
        if let Some(slot) = self.slots().iter().find(|&&slot| slot as usize >= self.materials.len()) {
            return broken(format!("a triangle names material slot {slot} of {}", self.materials.len()));
        }
        let normals = self.normals();
        if self.indices().iter().flatten().any(|&index| index as usize >= normals.len()) {
            return broken("a triangle names a normal that is not there".into());
        }
        if !normals.iter().copied().all(is_within_one) {
            return broken("a normal is longer than 1".into());
        }
        if !self.uvs().iter().flatten().copied().all(texture::is_usable) {
            return broken("a texture coordinate is not finite or too large".into());
        }
        if !self.uv_repeats().iter().copied().all(texture::is_usable) {
            return broken("a number of whole repeats is not finite or too large".into());
        }
        Ok(())
    }

    /// Bounds and centre come from the same bytes as the rest, and the scene's own tree is built over them.
    fn check_placement(&self) -> Result<(), MeshError> {
        let (center, (lo, hi)) = (self.center(), self.bounds());
        let reach = DVec3::splat(libm::exp2(f64::from(self.exponent())));
        let inside = center.abs().cmple(DVec3::splat(MAX_COORDINATE)).all()
            && lo.cmple(hi).all()
            && (center - lo).cmple(reach).all()
            && (hi - center).cmple(reach).all();
        if inside {
            Ok(())
        } else {
            Err(MeshError::Format("its bounds do not fit its centre and scale".into()))
        }
    }

    /// The bytes, as they are stored and sent.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.as_slice()
    }

    /// BLAKE3 of the bytes.
    pub fn id(&self) -> MeshId {
        self.id
    }

    /// Triangles after cleaning.
    pub fn triangle_count(&self) -> usize {
        self.header.triangle_count as usize
    }

    /// Material slots.
    pub fn material_count(&self) -> usize {
        self.materials.len()
    }

    /// Material slots, as the file described them.
    pub fn materials(&self) -> Vec<NamedMaterial> {
        self.materials.clone()
    }

    /// The same mesh with other material slots, as many as it has.
    ///
    /// # Errors
    /// Slots that it does not take.
    pub(crate) fn with_materials(&self, materials: &[NamedMaterial]) -> Result<Self, MeshError> {
        let encoded = encode_materials(materials);
        let mut header = self.header;
        header.version = FORMAT_VERSION;
        header.material_count = materials.len() as u32;
        header.material_bytes = encoded.len() as u32;
        // They are the last section: the others stay where they are.
        let mut bytes = AlignedBytes::zeroed(header.sections().end);
        let (before, last) = bytes.as_mut_slice().split_at_mut(self.sections.materials);
        before.copy_from_slice(&self.bytes()[..self.sections.materials]);
        before[..size_of::<Header>()].copy_from_slice(bytemuck::bytes_of(&header));
        last.copy_from_slice(&encoded);
        Self::from_aligned(bytes)
    }

    /// Bounds in the model's own space.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let [lo, hi] = self.header.bounds.map(DVec3::from_array);
        (lo, hi)
    }

    /// Whether smooth shading has vertex normals to interpolate.
    pub fn has_normals(&self) -> bool {
        self.header.normal_count > 0
    }

    /// Whether textures can be laid on it.
    pub fn has_uvs(&self) -> bool {
        self.header.uv_count > 0
    }

    /// Whether its vertices have colours.
    pub fn has_colors(&self) -> bool {
        self.header.color_count > 0
    }

    /// model = `center` + mesh * 2^`exponent`.
    pub fn center(&self) -> DVec3 {
        DVec3::from_array(self.header.center)
    }

    /// See [`CompiledMesh::center`].
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

    /// The triangles, sixteen by sixteen. Triangle i stands in lane i % 16 of block i / 16.
    pub(crate) fn blocks(&self) -> &[TriangleBlock] {
        self.section(self.sections.blocks, self.header.block_count as usize)
    }

    /// Indices of all triangles: those lanes of the blocks that hold one.
    pub fn triangles(&self) -> impl Iterator<Item = u32> {
        (0_u32..).zip(self.sources()).filter(|&(_, &source)| source != NO_TRIANGLE).map(|(i, _)| i)
    }

    /// Corners of triangle `i` in mesh space.
    #[inline]
    pub fn corners(&self, i: u32) -> [Vec3; 3] {
        self.blocks()[i as usize / WIDTH].corners(i as usize % WIDTH)
    }

    /// Position of triangle `i` in the source file. Where it coincides with others, the first of them is seen.
    pub fn source(&self, i: u32) -> u32 {
        self.sources()[i as usize]
    }

    /// Material slot of triangle `i`.
    pub fn slot(&self, i: u32) -> u16 {
        self.slots()[i as usize]
    }

    /// Unit normals at the corners of triangle `i`, where the mesh carries them.
    pub fn corner_normals(&self, i: u32) -> Option<[Vec3; 3]> {
        let indices = self.indices().get(i as usize)?;
        Some(indices.map(|index| self.normals()[index as usize]))
    }

    /// Texture coordinates at the corners of triangle `i`, where the mesh carries them.
    pub fn corner_uvs(&self, i: u32) -> Option<[Vec2; 3]> {
        self.uvs().get(i as usize).copied()
    }

    /// The whole repeats that were taken off the texture coordinates of triangle `i`; zero where the mesh does not carry them.
    pub fn whole_repeats(&self, i: u32) -> Vec2 {
        self.uv_repeats().get(i as usize).copied().unwrap_or_default()
    }

    /// Colours at the corners of triangle `i`, sRGB, where the mesh carries them.
    pub fn corner_colors(&self, i: u32) -> Option<[[u8; 3]; 3]> {
        self.colors().get(i as usize).copied()
    }

    #[cfg(test)]
    pub(super) fn header(&self) -> &Header {
        &self.header
    }

    fn lanes(&self) -> usize {
        self.header.block_count as usize * WIDTH
    }

    fn sources(&self) -> &[u32] {
        self.section(self.sections.sources, self.lanes())
    }

    fn slots(&self) -> &[u16] {
        self.section(self.sections.slots, self.lanes())
    }

    pub(super) fn indices(&self) -> &[[u32; 3]] {
        self.section(self.sections.indices, if self.has_normals() { self.lanes() } else { 0 })
    }

    pub(super) fn normals(&self) -> &[Vec3] {
        self.section(self.sections.normals, self.header.normal_count as usize)
    }

    /// Texture coordinates of all lanes; empty where the mesh carries none.
    pub(crate) fn uvs(&self) -> &[[Vec2; 3]] {
        self.section(self.sections.uvs, self.header.uv_count as usize)
    }

    /// Whole repeats of all lanes; empty where the mesh carries none.
    pub(crate) fn uv_repeats(&self) -> &[Vec2] {
        self.section(self.sections.repeats, self.header.repeat_count as usize)
    }

    /// Colours of all lanes; empty where the mesh carries none.
    pub(crate) fn colors(&self) -> &[[[u8; 3]; 3]] {
        self.section(self.sections.colors, self.header.color_count as usize)
    }

    /// The section that starts at `start`. `Header::read` made sure that all sections lie inside, and they start on
    /// cache lines, so the cast cannot fail.
    fn section<T: bytemuck::AnyBitPattern>(&self, start: usize, count: usize) -> &[T] {
        bytemuck::cast_slice(&self.bytes.as_slice()[start..start + count * size_of::<T>()])
    }
}

/// Component by component: the greatest of several numbers says nothing about those that are NaN.
fn is_within_one(point: Vec3) -> bool {
    point.abs().cmple(Vec3::ONE).all()
}

fn bounds_of_corners([a, b, c]: &[Vec3; 3]) -> (Vec3, Vec3) {
    (a.min(*b).min(*c), a.max(*b).max(*c))
}

/// Whether all triangles of a block lie within [-1, 1], lane by lane without a branch: there may be millions.
fn corners_are_within_one(block: &TriangleBlock, sources: &[u32]) -> bool {
    let mut outside = 0;
    for coordinate in block.0.iter().flatten() {
        for (number, &source) in coordinate.0.iter().zip(sources) {
            // False for NaN.
            outside |= u32::from(!(number.abs() <= 1.0)) & u32::from(source != NO_TRIANGLE);
        }
    }
    outside == 0
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

/// Sixteen entries a block, filled up with `empty`.
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
