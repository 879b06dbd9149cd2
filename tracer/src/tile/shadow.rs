//! What lies between a light and each point of a tile.
//!
//! Rays from a point light to the points start in one point again: they are a tile with an uneven grid. So are the
//! parallel rays of a directional light, which start in one point infinitely far away. A point is dark as
//! soon as one triangle is certain to be before it.
//!
//! ```text
//!   light_lens   a lens at the light whose picture suits the tile's points
//!   points       the points in that picture, and what is known of them
//!   blocked      boxes and triangles against them
//! ```

use glam::{DVec3, Vec3};

use super::blocked::Blocked;
use super::light_lens::Extent;
use super::{BLOCKS, Rays, Scratch};
use crate::frame::PreparedFrame;
use crate::simd::{Indices, Lanes, Simd, three};
use crate::trace::{PrimitiveId, Ray};

/// Where shadow rays go.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Source {
    /// To a point.
    Point(DVec3),
    /// Along this direction.
    Parallel(DVec3),
}

/// Points of a tile, and the light that they are asked about.
pub(crate) struct ShadowTile<'a> {
    pub frame: &'a PreparedFrame,
    /// The light, in eye space.
    pub light: Source,
    /// Share of the way to the light on which things are in its way.
    pub t_light: f64,
    /// Where the points stand in the picture of the eye.
    pub grid: &'a Rays,
    /// Points in eye space, indexed `[block][axis]`.
    pub points: &'a [[Lanes; 3]; BLOCKS],
    /// What each point lies on.
    pub item: &'a [Indices; BLOCKS],
    pub triangle: &'a [Indices; BLOCKS],
}

impl ShadowTile<'_> {
    /// Which of the points in `asked` are dark.
    #[inline(always)]
    pub(crate) fn dark<S: Simd>(
        &self,
        simd: S,
        asked: [u32; BLOCKS],
        scratch: &mut Scratch,
    ) -> [u32; BLOCKS] {
        let Scratch { scene_frontier, mesh_frontier, flats, shadow_rays: rays, shadow: points, .. } = scratch;
        points.open = asked;
        points.dark = [0; BLOCKS];
        let extent = Extent::of(simd, self.points, self.grid, &asked);
        let Some(lens) = extent.lens(self.light) else {
            Blocked::new(self, rays, points).ask_all();
            return points.dark;
        };
        points.project(simd, self.points, &extent, &lens, rays);
        let mut blocked = Blocked::new(self, rays, points);
        scene_frontier.find(simd, &self.frame.nodes, &lens, rays, &blocked);
        for leaf in &scene_frontier.leaves {
            if leaf.z_most < blocked.points.least_of_all {
                continue;
            }
            for &item in self.frame.items_of(leaf.index) {
                blocked.turn_to(item);
                blocked.cover_item(simd, &lens, mesh_frontier, flats);
            }
        }
        for plane in 0..self.frame.planes.len() as u32 {
            blocked.turn_to(self.frame.items.first_plane() + plane);
            blocked.ask_item();
        }
        points.dark
    }

    fn point(&self, block: usize, lane: usize) -> Vec3 {
        Vec3::from_array(three!(axis => self.points[block][axis].0[lane]))
    }

    /// The ray from a point to the light, and what it leaves.
    pub(super) fn ray(&self, block: usize, lane: usize) -> (Ray, PrimitiveId) {
        let origin = self.point(block, lane).as_dvec3();
        let leaving = PrimitiveId { item: self.item[block].0[lane], triangle: self.triangle[block].0[lane] };
        let direction = match self.light {
            Source::Point(light) => light - origin,
            Source::Parallel(to_light) => to_light,
        };
        (Ray { origin, direction }, leaving)
    }
}
