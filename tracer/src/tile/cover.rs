//! The triangles of a mesh against the rays of a tile, whatever is asked of them.

use super::Rays;
use super::lens::Lens;
use super::setup::Flats;
use super::walk::{Frontier, Interest, Leaf, Walk, WalkStack, open_blocks};
use crate::bvh::WIDTH;
use crate::mesh::{CompiledMesh, TriangleBlock};
use crate::simd::{Simd, each_bit, prefetch, three};

/// What a tile asks of triangles.
pub(super) trait Question<S: Simd>: Interest<S> {
    /// The triangles of `flats` that are seen, against the rays of some blocks. Lane i holds triangle `first` + i.
    fn cover(&mut self, simd: S, flats: &Flats, first: u32, blocks: u32);
}

/// How many leaves ahead memory is asked for the next: a leaf takes some hundred cycles, memory several hundred.
const PREFETCH: usize = 2;

/// Asks all triangles of a mesh that may matter, nearer ones earlier.
#[inline(always)]
pub(super) fn cover_nearest_first<S: Simd, Q: Question<S>>(
    simd: S,
    mesh: &CompiledMesh,
    lens: &Lens,
    rays: &Rays,
    stack: &mut WalkStack,
    flats: &mut Flats,
    question: &mut Q,
) {
    let leaves = mesh.blocks();
    let mut walk = Walk::new(mesh.nodes(), leaves, lens, rays, stack);
    while let Some((index, blocks)) = walk.next(simd, question) {
        cover_leaf(simd, &leaves[index as usize], index, blocks, lens, rays, flats, question);
    }
}

/// Asks all triangles of a mesh that may matter, until nothing matters any more.
#[inline(always)]
pub(super) fn cover_any_order<S: Simd, Q: Question<S>>(
    simd: S,
    mesh: &CompiledMesh,
    lens: &Lens,
    rays: &Rays,
    frontier: &mut Frontier,
    flats: &mut Flats,
    question: &mut Q,
) {
    let leaves = mesh.blocks();
    frontier.find(simd, mesh.nodes(), lens, rays, question);
    for (at, &Leaf { index, blocks, z_most }) in frontier.leaves.iter().enumerate() {
        if let Some(next) = frontier.leaves.get(at + PREFETCH) {
            prefetch(&leaves[next.index as usize]);
        }
        // Much may be known by now.
        let blocks = blocks & open_blocks(simd, question.least(), z_most);
        if blocks != 0 {
            cover_leaf(simd, &leaves[index as usize], index, blocks, lens, rays, flats, question);
        }
    }
}

/// The triangles of one leaf. A function of its own on each level: inlined wherever it is needed, it would fill the
/// instruction cache.
#[inline(never)]
#[expect(clippy::too_many_arguments, reason = "what both walks have at hand")]
fn cover_leaf<S: Simd, Q: Question<S>>(
    simd: S,
    leaf: &TriangleBlock,
    index: u32,
    blocks: u32,
    lens: &Lens,
    rays: &Rays,
    flats: &mut Flats,
    question: &mut Q,
) {
    let first = index * WIDTH as u32;
    let least_closeness = question.least_closeness();
    let crossing = simd.vectorize(
        #[inline(always)]
        || {
            let crossing = if Q::ON_GRID {
                flats.set_up::<S, true>(simd, leaf, lens, rays, least_closeness)
            } else {
                flats.set_up::<S, false>(simd, leaf, lens, rays, least_closeness)
            };
            if flats.seen != 0 {
                question.cover(simd, flats, first, blocks);
            }
            crossing
        },
    );
    for lane in each_bit(crossing) {
        let corners = leaf.corners(lane);
        flats.set_up_exactly(lane, lens, three!(k => corners[k].as_dvec3()), rays);
        cover_set_up(simd, flats, first, blocks, question);
    }
}

/// Triangles that are set up already.
#[inline(never)]
pub(super) fn cover_set_up<S: Simd, Q: Question<S>>(
    simd: S,
    flats: &Flats,
    first: u32,
    blocks: u32,
    question: &mut Q,
) {
    if flats.seen != 0 {
        simd.vectorize(
            #[inline(always)]
            || question.cover(simd, flats, first, blocks),
        );
    }
}
