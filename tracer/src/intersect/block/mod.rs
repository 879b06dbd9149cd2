//! Closest hits and any hits of blocks of any sixteen rays.
//!
//! Rays of bounces have neither origins nor directions in common, so each walks the trees by itself, and the sixteen
//! children of a node fill the lanes. A block is dispatched to its level of SIMD once.

#[cfg(test)]
mod tests;

use super::Hit;
use crate::frame::PreparedFrame;
use crate::rays::{HitBlock, RayBlock, RaySource};
use crate::simd::{Simd, dispatch, each_bit};

impl PreparedFrame {
    /// The closest hits of the live rays of a block.
    pub(crate) fn closest_hits_of(&self, block: &RayBlock<'_>) -> HitBlock {
        let mut hits = HitBlock::NONE;
        dispatch!(self.level, simd => self.find_closest(simd, block, &mut hits));
        hits
    }

    /// Bits of the live rays of a block that hit anything.
    pub(crate) fn any_hits_of(&self, block: &RayBlock<'_>) -> u32 {
        dispatch!(self.level, simd => self.find_any(simd, block))
    }

    /// The exact hit of a ray whose primitive is known.
    pub(crate) fn hit_in(&self, block: &RayBlock<'_>, hits: &HitBlock, lane: usize) -> Option<Hit> {
        self.hit_of(&block.ray(0, lane), hits.primitive(lane)?, block.starts_on(0, lane))
    }

    #[inline(always)]
    fn find_closest<S: Simd>(&self, simd: S, block: &RayBlock<'_>, hits: &mut HitBlock) {
        for lane in each_bit(block.live(0)) {
            let ray = block.ray(0, lane);
            let found = self.closest_primitive(simd, &ray, block.t_max(lane), block.starts_on(0, lane));
            if let Some((primitive, coincident)) = found {
                hits.set(lane, primitive);
                hits.coincident |= u32::from(coincident) << lane;
            }
        }
    }

    #[inline(always)]
    fn find_any<S: Simd>(&self, simd: S, block: &RayBlock<'_>) -> u32 {
        let mut occluded = 0;
        for lane in each_bit(block.live(0)) {
            let ray = block.ray(0, lane);
            let hit = self.hits_any(simd, &ray, block.t_max(lane), block.starts_on(0, lane));
            occluded |= u32::from(hit) << lane;
        }
        occluded
    }
}
