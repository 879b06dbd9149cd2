//! The shadow term S_j of a tile.

use crate::intersect::tile;
use crate::light::{Emitter, EyeLight, SHADOW_T_MAX};
use crate::rays::{BLOCKS, HitBlock, ShadowTarget, ShadowTile, SurfaceSource};
use crate::simd::{Lanes, Simd};

/// Bits of the lit points of a tile that are in the shadow of a light.
#[inline(always)]
pub(super) fn occluded<S: Simd, R: SurfaceSource>(
    simd: S,
    rays: &R,
    hits: &[HitBlock; BLOCKS],
    light: &EyeLight,
    points: &[[Lanes; 3]; BLOCKS],
    lit: [u32; BLOCKS],
    scratch: &mut tile::Scratch,
) -> [u32; BLOCKS] {
    let (light, t_max) = match light.emitter {
        Emitter::Point { position } | Emitter::Spot { position, .. } => {
            (ShadowTarget::Point(position), SHADOW_T_MAX)
        }
        Emitter::Directional { to_light } => (ShadowTarget::Parallel(to_light), f64::INFINITY),
    };
    // In a tile with the silhouette of an item, the item first and then the surfaces behind it: all points together would be
    // far apart, and everything between them would have to be tested.
    let Some(first) = lit.iter().position(|&lanes| lanes != 0) else { return [0; BLOCKS] };
    let item = hits[first].item.0[lit[first].trailing_zeros() as usize];
    let mut of_item = [0; BLOCKS];
    let mut of_others = [0; BLOCKS];
    for block in first..BLOCKS {
        of_item[block] = lit[block] & hits[block].item.equal(simd, item);
        of_others[block] = lit[block] & !of_item[block];
    }
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
    for live in [of_item, of_others] {
        if live != [0; BLOCKS] {
            shadow.live = live;
            let found = shadow.occluded(simd, scratch);
            for block in 0..BLOCKS {
                occluded[block] |= found[block];
            }
        }
    }
    occluded
}
