//! The bytes of a compiled mesh: a header, then sections of plain numbers, each aligned to a cache line.
//!
//! Little endian, versioned, without pointers. All bytes are checked once, in one pass, before they are used: they
//! may come from a peer or from a file.

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

use super::{FORMAT_VERSION, MAGIC, MeshError, OLDEST_FORMAT_VERSION};
use crate::bvh::{WIDTH, WideNode};
use crate::simd::{Lanes, three};

/// Source index of a lane without a triangle.
pub(super) const NO_TRIANGLE: u32 = u32::MAX;

/// Sixteen triangles in mesh space, indexed `[corner][axis].0[lane]`. Lanes without a triangle are NaN, which fails
/// every comparison.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct TriangleBlock(pub(crate) [[Lanes; 3]; 3]);

const _: () = assert!(size_of::<TriangleBlock>() == 576);

impl TriangleBlock {
    /// Corners of the triangle in one lane.
    #[inline(always)]
    pub(crate) fn corners(&self, lane: usize) -> [Vec3; 3] {
        three!(k => {
            let [x, y, z] = &self.0[k];
            Vec3::new(x.0[lane], y.0[lane], z.0[lane])
        })
    }
}

/// Alignment of sections, in bytes: one cache line, which is also the alignment of a [`WideNode`].
pub(super) const ALIGN: usize = 64;

/// One cache line of bytes.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
struct Line([u8; ALIGN]);

/// Bytes whose start is aligned to a cache line.
pub(super) struct AlignedBytes {
    lines: Vec<Line>,
    len: usize,
}

impl AlignedBytes {
    pub(super) fn zeroed(len: usize) -> Self {
        // Zero pages of the operating system: nothing is written twice.
        Self { lines: bytemuck::zeroed_vec(len.div_ceil(ALIGN)), len }
    }

    pub(super) fn copy_of(bytes: &[u8]) -> Self {
        let mut copy = Self::zeroed(bytes.len());
        copy.as_mut_slice().copy_from_slice(bytes);
        copy
    }

    pub(super) fn as_slice(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.lines)[..self.len]
    }

    pub(super) fn as_mut_slice(&mut self) -> &mut [u8] {
        &mut bytemuck::cast_slice_mut(&mut self.lines)[..self.len]
    }
}

/// Fixed part of a compiled mesh, 128 bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Header {
    pub magic: [u8; 6],
    pub version: u16,
    pub exponent: i32,
    pub depth: u32,
    pub center: [f64; 3],
    pub bounds: [[f64; 3]; 2],
    pub node_count: u32,
    pub block_count: u32,
    pub triangle_count: u32,
    pub normal_count: u32,
    pub material_count: u32,
    pub material_bytes: u32,
    /// Lanes with texture coordinates: all, or zero.
    pub uv_count: u32,
    /// Lanes with whole repeats of their texture coordinates: all, or zero.
    pub repeat_count: u32,
    /// Lanes with colours: all, or zero.
    pub color_count: u32,
    pub reserved: u32,
}

const _: () = assert!(size_of::<Header>() == 128);

impl Header {
    pub(super) fn new(center: DVec3, exponent: i32, bounds: (DVec3, DVec3)) -> Self {
        Self {
            magic: MAGIC,
            version: FORMAT_VERSION,
            exponent,
            center: center.to_array(),
            bounds: [bounds.0.to_array(), bounds.1.to_array()],
            ..Header::zeroed()
        }
    }

    /// Reads the header, and checks everything that can be checked without the sections.
    pub(super) fn read(bytes: &[u8]) -> Result<Self, MeshError> {
        if !bytes.starts_with(&MAGIC) {
            return Err(MeshError::Format("it does not start with RFMESH".into()));
        }
        let Some(fixed) = bytes.get(..size_of::<Header>()) else {
            return Err(MeshError::Format(format!("{} bytes are too few for a header", bytes.len())));
        };
        let mut header: Header = bytemuck::pod_read_unaligned(fixed);
        if !(OLDEST_FORMAT_VERSION..=FORMAT_VERSION).contains(&header.version) {
            return Err(MeshError::Format(format!(
                "it has format version {}, this program reads versions {OLDEST_FORMAT_VERSION} to {FORMAT_VERSION}",
                header.version
            )));
        }
        if header.version == OLDEST_FORMAT_VERSION {
            // These fields were reserved in that version.
            (header.repeat_count, header.color_count) = (0, 0);
        }
        if !(-220..=220).contains(&header.exponent) {
            return Err(MeshError::Format(format!("its scale 2^{} is out of range", header.exponent)));
        }
        let numbers = header.center.iter().chain(header.bounds.iter().flatten());
        if numbers.into_iter().any(|number| !number.is_finite()) {
            return Err(MeshError::Format("its centre or bounds are not finite".into()));
        }
        for (what, count) in [
            ("texture coordinates", header.uv_count),
            ("whole repeats", header.repeat_count),
            ("colours", header.color_count),
        ] {
            if count != 0 && count != header.slots() {
                return Err(MeshError::Format(format!(
                    "it has {what} for {count} lanes of {}",
                    header.slots()
                )));
            }
        }
        let needed = header.sections().end as u64;
        if bytes.len() as u64 != needed {
            return Err(MeshError::Format(format!(
                "its header announces {needed} bytes, there are {}",
                bytes.len()
            )));
        }
        Ok(header)
    }

    /// Lanes of all blocks, with or without a triangle.
    pub(super) fn slots(&self) -> u32 {
        self.block_count.saturating_mul(WIDTH as u32)
    }

    /// Byte offsets of the sections. `u32` counts of at most 64-byte elements cannot overflow 64-bit sizes.
    pub(super) fn sections(&self) -> Sections {
        let mut end = size_of::<Header>();
        let mut place = |count: u32, element: usize| {
            let start = end.next_multiple_of(ALIGN);
            end = start.saturating_add((count as usize).saturating_mul(element));
            start
        };
        let slots = self.slots();
        let with_normals = if self.normal_count > 0 { slots } else { 0 };
        Sections {
            nodes: place(self.node_count, size_of::<WideNode>()),
            blocks: place(self.block_count, size_of::<TriangleBlock>()),
            sources: place(slots, 4),
            slots: place(slots, 2),
            indices: place(with_normals, 12),
            normals: place(self.normal_count, 12),
            uvs: place(self.uv_count, 24),
            repeats: place(self.repeat_count, 8),
            colors: place(self.color_count, 9),
            materials: place(self.material_bytes, 1),
            end,
        }
    }
}

/// Byte offsets of the sections of a compiled mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sections {
    /// Nodes, [`WideNode`] each.
    pub nodes: usize,
    /// Blocks, [`TriangleBlock`] each.
    pub blocks: usize,
    /// Sources, `u32` per lane of the blocks: the triangle's position in the source file, or [`NO_TRIANGLE`].
    pub sources: usize,
    /// Material slots of triangles, `u16` per lane.
    pub slots: usize,
    /// Normal indices, three `u32` per lane; empty without normals.
    pub indices: usize,
    /// Normals, `Vec3` per vertex.
    pub normals: usize,
    /// Texture coordinates, three `Vec2` per lane; empty without.
    pub uvs: usize,
    /// Whole repeats, `Vec2` per lane; empty where no texture distinguishes them.
    pub repeats: usize,
    /// Vertex colours, three times three sRGB bytes per lane; empty without.
    pub colors: usize,
    /// The material slots themselves: see [`super::materials`].
    pub materials: usize,
    /// Length of all bytes.
    pub end: usize,
}
