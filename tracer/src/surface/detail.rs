//! Details of surface points, ray by ray in `f64`: patterns, normal maps, and textures of spheres and planes.

use glam::DVec2;

use super::Surfaces;
use super::footprint::Footprint;
use super::pattern::color_of;
use super::place::Place;
use super::uv::PointUvs;
use crate::rays::{HitBlock, SurfaceSource};
use crate::simd::{LANES, each_bit};

impl Surfaces {
    /// Applies patterns and normal maps to all points.
    #[inline(never)]
    pub(super) fn add_details<R: SurfaceSource>(&mut self, rays: &R, hits: &[HitBlock]) {
        let frame = rays.frame();
        for (block, hits) in hits.iter().enumerate() {
            if let Some(untilted) = &mut self.untilted {
                untilted.clear(block);
            }
            let surface = &mut self.blocks[block];
            for lane in each_bit(surface.hit) {
                let material = &frame.scene().materials[surface.material.0[lane] as usize];
                if material.checker.is_none() && material.normal_map.is_none() {
                    continue;
                }
                let Some(place) = Place::of(rays, block, lane, hits.slot(lane)) else { continue };
                if let (Some(pattern), Some(texels)) = (&material.checker, &mut self.texels) {
                    texels.multiply(block, lane, color_of(pattern, &place));
                }
                if let (Some(map), Some(untilted)) = (&material.normal_map, &mut self.untilted) {
                    untilted.tilt(frame, map, &place, surface, (block, lane));
                }
            }
        }
    }

    /// Sets the texture factors of lanes that hit a sphere or a plane.
    #[inline(never)]
    pub(super) fn texture_exactly<R: SurfaceSource>(
        &mut self,
        rays: &R,
        (block, lanes): (usize, u32),
        hits: &HitBlock,
        footprint: Option<Box<Footprint>>,
    ) {
        let Some(texels) = &mut self.texels else { return };
        let mut uvs = Box::new([DVec2::ZERO; LANES]);
        for lane in each_bit(lanes) {
            let place = Place::of(rays, block, lane, hits.slot(lane));
            uvs[lane] = place.and_then(|place| place.uv()).unwrap_or_default();
        }
        let uv = PointUvs::exact(uvs, footprint);
        texels.fill(rays.frame(), block, lanes, &self.blocks[block].material, &uv);
    }
}
