//! The shadow term S_j of a tile.
//!
//! ```text
//!   partial   shadows that are not all or nothing: of lights with an extent, behind transparent surfaces
//! ```

mod partial;
#[cfg(test)]
mod tests;

use crate::frame::PreparedFrame;
use crate::intersect::tile;
use crate::light::{Emitter, EyeLight, SHADOW_T_MAX};
use crate::rays::{BLOCKS, HitBlock, RayBlock, RaySource, ShadowTarget, ShadowTile, SurfaceSource};
use crate::simd::{Lanes, Simd, each_bit};
pub(super) use partial::add as add_partly_occluded;

/// Whether S_j of a light may be other than 0 and 1.
#[inline(always)]
pub(super) fn is_partial(frame: &PreparedFrame, light: &EyeLight) -> bool {
    light.extent.is_some() || frame.has_translucent_items()
}

/// Bits of the lit points of a tile that are in the shadow of a light.
#[inline(always)]
pub(in crate::integrator) fn occluded<S: Simd, R: SurfaceSource>(
    simd: S,
    rays: &R,
    hits: &[HitBlock; BLOCKS],
    light: &EyeLight,
    points: &[[Lanes; 3]; BLOCKS],
    lit: [u32; BLOCKS],
    scratch: &mut tile::Scratch,
) -> [u32; BLOCKS] {
    let (light, t_max) = target_of(light);
    if !R::COMMON_ORIGIN && !rays.are_neighbours() {
        let frame = rays.frame();
        let tile = ShadowTile { frame, light, t_max, grid: rays.places(), points, hits, live: lit };
        return occluded_one_by_one(&tile);
    }
    let groups = by_item(simd, hits, lit);
    let mut occluded = [0; BLOCKS];
    let mut shadow = ShadowTile {
        frame: rays.frame(),
        light,
        t_max,
        grid: rays.places(),
        points,
        hits,
        live: [0; BLOCKS],
    };
    for live in groups {
        if live != [0; BLOCKS] {
            shadow.live = live;
            // Without surfaces that light may pass: see `is_partial`.
            let found = shadow.occluded(simd, scratch);
            for block in 0..BLOCKS {
                occluded[block] |= found[block];
            }
        }
    }
    occluded
}

/// The shadow rays from some points of a batch to a light without extent.
pub(in crate::integrator) fn tile_of<'a, R: SurfaceSource>(
    rays: &'a R,
    hits: &'a [HitBlock; BLOCKS],
    light: &EyeLight,
    points: &'a [[Lanes; 3]; BLOCKS],
    live: [u32; BLOCKS],
) -> ShadowTile<'a> {
    let (light, t_max) = target_of(light);
    ShadowTile { frame: rays.frame(), light, t_max, grid: rays.places(), points, hits, live }
}

/// Bits of the live points of a tile with anything before the light, ray by ray: faster for points that are far apart.
#[inline(never)]
fn occluded_one_by_one(tile: &ShadowTile<'_>) -> [u32; BLOCKS] {
    let (frame, t_max, lit) = (tile.frame, tile.t_max, tile.live);
    let mut block_rays = RayBlock::new(frame);
    std::array::from_fn(|block| {
        if lit[block] == 0 {
            return 0;
        }
        block_rays.clear();
        for lane in each_bit(lit[block]) {
            block_rays.set(lane, tile.ray(block, lane), t_max, tile.starts_on(block, lane));
        }
        frame.occluded_of(&block_rays)
    })
}

/// The target of the shadow rays to a light's centre, and their upper end.
#[inline(always)]
fn target_of(light: &EyeLight) -> (ShadowTarget, f64) {
    match light.emitter {
        Emitter::Point { position } | Emitter::Spot { position, .. } => {
            (ShadowTarget::Point(position), SHADOW_T_MAX)
        }
        Emitter::Directional { to_light } => (ShadowTarget::Parallel(to_light), f64::INFINITY),
    }
}

/// Divides points into those on the item of the first one, and all others. In a tile with the silhouette of an item, the item
/// comes first and then the surfaces behind it: all points together would be far apart, and everything between them would have
/// to be tested.
#[inline(always)]
fn by_item<S: Simd>(simd: S, hits: &[HitBlock; BLOCKS], points: [u32; BLOCKS]) -> [[u32; BLOCKS]; 2] {
    let mut groups = [[0; BLOCKS]; 2];
    let Some(first) = points.iter().position(|&lanes| lanes != 0) else { return groups };
    let item = hits[first].item.0[points[first].trailing_zeros() as usize];
    for block in first..BLOCKS {
        groups[0][block] = points[block] & hits[block].item.equal(simd, item);
        groups[1][block] = points[block] & !groups[0][block];
    }
    groups
}
