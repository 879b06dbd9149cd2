//! Tiles: 256 rays that start at one point, or are parallel, traced together.
//!
//! All primary rays of a pinhole camera start at the eye, and shadow rays of a point light end at it. Projected from there,
//! sixteen by sixteen neighbouring rays are a small square of a picture, and a triangle is three straight lines in that picture.
//! So are parallel rays, those of an orthographic camera and of a directional light, projected along their direction. So the work
//! that a packet tracer does per ray is done once per tile, or once per triangle:
//!
//! ```text
//!   Projection           the picture from the point: (x, y) where a ray crosses the plane at depth 1    rays/projection.rs
//!   NodeTester           boxes outside the tile, or behind all of its hits, are dropped                 projected_boxes.rs
//!   Traversal            the tree, nearest first or level by level                                      traversal.rs
//!   ProjectedTriangles   sixteen triangles at once become lines and a depth plane in the picture        projected_triangles.rs
//!   Outline              a sphere becomes a conic and a range of closeness in the picture                outline.rs
//!   TileQuery            the remaining triangles against blocks of sixteen rays                         query.rs
//! ```
//!
//! [`closest`] finds the closest hits of a tile of a camera, [`shadow`] the points of a tile that a light does not reach,
//! [`shaft`] the tiles without anything between their points and a light with an extent.
//!
//! **Certain or exact.** All of this is `f32`, with an error bound of every number. A ray that is inside all lines, and
//! nearer, by more than the bounds is decided. All others are tested exactly, in `f64`. So rounding never decides a hit, and
//! neither do the level of SIMD, the place of the tile, or the order of the traversal.

mod closest;
mod light_projection;
mod occlusion;
mod outline;
mod points;
mod projected_boxes;
mod projected_triangles;
mod query;
mod shadow;
mod shaft;
#[cfg(test)]
mod tests;
mod traversal;

use crate::rays::{Projection, TileRays};
use closest::Closeness;
pub(crate) use closest::find_closest;
use points::Points;
use projected_triangles::ProjectedTriangles;
pub(crate) use shadow::Occlusion;
pub(crate) use shaft::Shaft;
use traversal::{Frontier, TraversalStack};

/// The rays of a tile in the picture of a projection.
#[derive(Clone, Copy)]
struct Picture<'a> {
    projection: &'a Projection,
    rays: &'a TileRays,
}

/// Memory of tiles while they are traced, kept from tile to tile.
pub(crate) struct Scratch {
    /// Stacks of the traversals of the scene's tree and of a mesh's tree.
    scene_stack: TraversalStack,
    mesh_stack: TraversalStack,
    /// The same for shadow rays.
    scene_frontier: Frontier,
    mesh_frontier: Frontier,
    projected: ProjectedTriangles,
    /// Closeness of the hits of the camera's rays.
    closeness: Closeness,
    /// Shadow rays in the light's picture, and what is known of their points.
    shadow_rays: TileRays,
    points: Points,
}

impl Scratch {
    pub(crate) fn new() -> Self {
        Self {
            scene_stack: TraversalStack::EMPTY,
            mesh_stack: TraversalStack::EMPTY,
            scene_frontier: Frontier::EMPTY,
            mesh_frontier: Frontier::EMPTY,
            projected: ProjectedTriangles::EMPTY,
            closeness: Closeness::NONE,
            shadow_rays: TileRays::empty(),
            points: Points::NONE,
        }
    }
}
