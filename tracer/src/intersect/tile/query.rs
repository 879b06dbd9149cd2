//! The triangles of a mesh against the rays of a tile, for any query.

use super::Picture;
use super::projected_triangles::ProjectedTriangles;
use super::traversal::{Frontier, Leaf, NodeFilter, Traversal, TraversalStack, open_blocks};
use crate::bvh::WIDTH;
use crate::mesh::{CompiledMesh, TriangleBlock};
use crate::simd::{Simd, each_bit, prefetch, three};

/// A query of the rays of a tile about triangles.
pub(super) trait TileQuery<S: Simd>: NodeFilter<S> {
    /// Tests the projected triangles against the rays of some blocks. Lane i holds triangle `first` + i.
    fn cover(&mut self, simd: S, projected: &ProjectedTriangles, first: u32, blocks: u32);
}

/// Leaves between a prefetch and its use: a leaf takes some hundred cycles, memory several hundred.
const PREFETCH: usize = 2;

/// Tests all triangles of a mesh that may matter, nearer ones first.
#[inline(always)]
pub(super) fn cover_nearest_first<S: Simd, Q: TileQuery<S>>(
    simd: S,
    mesh: &CompiledMesh,
    picture: Picture<'_>,
    stack: &mut TraversalStack,
    projected: &mut ProjectedTriangles,
    query: &mut Q,
) {
    let leaves = mesh.blocks();
    let mut traversal = Traversal::new(mesh.nodes(), leaves, picture, stack);
    while let Some((index, blocks)) = traversal.next(simd, query) {
        cover_leaf(simd, picture, leaves, (index, blocks), projected, query);
    }
}

/// Tests all triangles of a mesh that may matter, until none matters any more.
#[inline(always)]
pub(super) fn cover_any_order<S: Simd, Q: TileQuery<S>>(
    simd: S,
    mesh: &CompiledMesh,
    picture: Picture<'_>,
    frontier: &mut Frontier,
    projected: &mut ProjectedTriangles,
    query: &mut Q,
) {
    let leaves = mesh.blocks();
    frontier.find(simd, mesh.nodes(), picture, query);
    for (at, &Leaf { index, blocks, z_most }) in frontier.leaves.iter().enumerate() {
        if let Some(next) = frontier.leaves.get(at + PREFETCH) {
            prefetch(&leaves[next.index as usize]);
        }
        // Earlier leaves may have decided some blocks.
        let blocks = blocks & open_blocks(simd, query.least(), z_most);
        if blocks != 0 {
            cover_leaf(simd, picture, leaves, (index, blocks), projected, query);
        }
    }
}

/// Tests the triangles of one leaf against some blocks. A function of its own on each level: inlined into its callers, it
/// would fill the instruction cache.
#[inline(never)]
fn cover_leaf<S: Simd, Q: TileQuery<S>>(
    simd: S,
    Picture { projection, rays }: Picture<'_>,
    leaves: &[TriangleBlock],
    (index, blocks): (u32, u32),
    projected: &mut ProjectedTriangles,
    query: &mut Q,
) {
    let leaf = &leaves[index as usize];
    let first = index * WIDTH as u32;
    let least_closeness = query.least_closeness();
    let crossing = simd.vectorize(
        #[inline(always)]
        || {
            let crossing = if Q::ON_GRID && rays.on_grid {
                projected.project::<S, true>(simd, leaf, projection, rays, least_closeness)
            } else {
                projected.project::<S, false>(simd, leaf, projection, rays, least_closeness)
            };
            if projected.active != 0 {
                query.cover(simd, projected, first, blocks);
            }
            crossing
        },
    );
    for lane in each_bit(crossing) {
        let corners = leaf.corners(lane);
        projected.project_exactly(lane, projection, three!(k => corners[k].as_dvec3()), rays);
        cover_projected(simd, projected, first, blocks, query);
    }
}

/// Tests triangles that are projected already.
#[inline(never)]
pub(super) fn cover_projected<S: Simd, Q: TileQuery<S>>(
    simd: S,
    projected: &ProjectedTriangles,
    first: u32,
    blocks: u32,
    query: &mut Q,
) {
    if projected.active != 0 {
        simd.vectorize(
            #[inline(always)]
            || query.cover(simd, projected, first, blocks),
        );
    }
}
