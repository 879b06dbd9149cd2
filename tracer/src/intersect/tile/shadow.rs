//! The points of a tile that a light does not reach.
//!
//! Shadow rays from the points of a tile to a point light have that end in common: they are a tile with an uneven grid. So
//! are the parallel rays of a directional light, whose common end is infinitely far away. A point is occluded as soon as one
//! triangle is certain to be in its way.
//!
//! ```text
//!   light_projection   a projection from the light whose picture suits the points
//!   points             the points in that picture, and which of them are occluded
//!   occlusion          boxes and triangles against them
//! ```

use super::light_projection::Extent;
use super::occlusion::OcclusionQuery;
use super::{Picture, Scratch};
use crate::rays::{ALL_BLOCKS, BLOCKS, ShadowTile};
use crate::simd::Simd;

/// What is between the points of a tile and a light.
#[derive(Clone, Copy)]
pub(crate) struct Occlusion {
    /// Bits of the points that are occluded.
    pub occluded: [u32; BLOCKS],
    /// Bits of the points with a surface in their way that light may pass, and no other.
    pub undecided: [u32; BLOCKS],
}

impl ShadowTile<'_> {
    /// What is between the live points and the light.
    pub(crate) fn occlusion<S: Simd>(&self, simd: S, scratch: &mut Scratch) -> Occlusion {
        let occluded = *self.occluded(simd, scratch);
        let undecided = std::array::from_fn(|block| scratch.points.undecided[block] & !occluded[block]);
        Occlusion { occluded, undecided }
    }

    /// Bits of the live points that are occluded. Those behind surfaces that light may pass are not: see [`ShadowTile::occlusion`].
    /// A function of its own on each level: all kinds of shadows call the same one, because it takes long to compile.
    #[inline(never)]
    pub(crate) fn occluded<'s, S: Simd>(&self, simd: S, scratch: &'s mut Scratch) -> &'s [u32; BLOCKS] {
        simd.vectorize(
            #[inline(always)]
            || self.find_occluded(simd, scratch),
        );
        &scratch.points.occluded
    }

    /// Sets the bits of the points that are occluded, and of those behind surfaces that light may pass.
    #[inline(always)]
    fn find_occluded<S: Simd>(&self, simd: S, scratch: &mut Scratch) {
        let Scratch { scene_frontier, mesh_frontier, projected, shadow_rays: rays, points, .. } = scratch;
        points.open = self.live;
        points.occluded = [0; BLOCKS];
        points.undecided = [0; BLOCKS];
        let extent = Extent::of(simd, self.points, self.grid, &self.live);
        let Some(projection) = extent.projection(self.light) else {
            return OcclusionQuery::new(self, rays, points).test_scene();
        };
        points.project(simd, self.points, &extent, &projection, rays);
        let picture = Picture { projection: &projection, rays };
        let mut query = OcclusionQuery::new(self, rays, points);
        scene_frontier.find(simd, &self.frame.nodes, picture, &query);
        let mut lines = None;
        for &leaf in &scene_frontier.leaves {
            if leaf.z_most < query.points.least_of_all {
                continue;
            }
            for &item in self.frame.items_of(leaf.index) {
                if query.turn_to(item) {
                    query.cover_item(simd, leaf, &projection, &mut lines, mesh_frontier, projected);
                }
            }
        }
        for plane in 0..self.frame.planes.len() as u32 {
            if query.turn_to(self.frame.items.first_plane() + plane) {
                query.test_item(ALL_BLOCKS);
            }
        }
    }
}
