//! The triangles of a mesh against the rays of a tile, whatever is asked of them.

use super::Rays;
use super::lens::Lens;
use super::setup::{Flat, Flats, flat_exact, through};
use super::walk::{Interest, Walk};
use crate::bvh::WIDTH;
use crate::mesh::CompiledMesh;
use crate::simd::{Simd, each_bit};

/// What a tile asks of triangles.
pub(super) trait Question<S: Simd>: Interest<S> {
    /// Whether rays stand on a grid with step 1, so that triangles between them can be left out.
    const ON_GRID: bool;

    /// Triangles must be at least this close to matter; infinity when nothing matters any more.
    fn least_closeness(&self) -> f32;

    /// Blocks of rays that triangles of this closeness or less still matter to.
    fn open_blocks(&self, simd: S, z_most: f32) -> u32;

    /// A triangle against one block of rays.
    fn cover(&mut self, simd: S, flat: &Flat, triangle: u32, block: usize);

    /// All triangles of a leaf are done: time to look at what has been found.
    fn settle(&mut self, simd: S);
}

/// Asks all triangles of a mesh that may matter.
#[inline(always)]
pub(super) fn cover_mesh<S: Simd, Q: Question<S>>(
    simd: S,
    mesh: &CompiledMesh,
    lens: &Lens,
    rays: &Rays,
    question: &mut Q,
) {
    let mut walk = Walk::new(mesh, lens, rays.union);
    let mut flats = Flats::EMPTY;
    while let Some(index) = walk.next(simd, question, question.least_closeness()) {
        let block = &mesh.blocks()[index as usize];
        if Q::ON_GRID {
            flats.set_up::<S, true>(simd, block, lens, rays, question.least_closeness());
        } else {
            flats.set_up::<S, false>(simd, block, lens, rays, question.least_closeness());
        }
        for lane in each_bit(flats.seen) {
            cover_flat(simd, &flats.get(lane), index * WIDTH as u32 + lane as u32, rays, question);
        }
        for lane in each_bit(flats.crossing) {
            if let Some(flat) = flat_exact(lens.parallel, through(lens, block.corners(lane)), rays) {
                cover_flat(simd, &flat, index * WIDTH as u32 + lane as u32, rays, question);
            }
        }
        question.settle(simd);
    }
}

/// Asks one triangle.
#[inline(always)]
pub(super) fn cover_flat<S: Simd, Q: Question<S>>(
    simd: S,
    flat: &Flat,
    triangle: u32,
    rays: &Rays,
    question: &mut Q,
) {
    let blocks = flat.blocks_touched(simd, rays) & question.open_blocks(simd, flat.z_most);
    for block in each_bit(blocks) {
        question.cover(simd, flat, triangle, block);
    }
}
