//! Closest hits and any hits of blocks of any sixteen rays.
//!
//! Rays of bounces have neither origins nor directions in common, so each walks the trees by itself, and the sixteen
//! children of a node fill the lanes. A block is dispatched to its level of SIMD once.
//!
//! ```text
//!   few   scenes of few primitives: all rays against one primitive at a time
//! ```

mod few;
#[cfg(test)]
mod tests;

use super::Hit;
use super::single::{Any, Stack, with_stack};
use crate::frame::PreparedFrame;
use crate::rays::{HitBlock, RayBlock, RaySource};
use crate::simd::{Simd, dispatch, each_bit};

impl PreparedFrame {
    /// Finds the closest hits of some live rays of a block. Their lanes of `hits` must have none.
    pub(crate) fn closest_hits_of(&self, block: &RayBlock<'_>, lanes: u32, hits: &mut HitBlock) {
        let mut undecided = lanes & block.live(0);
        if let Some(few) = &self.few {
            undecided = dispatch!(self.level, simd => few.find_closest(simd, block, undecided, hits));
        }
        if undecided != 0 {
            with_stack(
                |stack| dispatch!(self.level, simd => self.find_nearest(simd, stack, block, undecided, hits)),
            );
        }
        for lane in each_bit(hits.coincident & lanes) {
            let (nearest, starts_on) = (hits.slot(lane), block.starts_on(0, lane));
            let (preferred, others) =
                self.preferred(&block.ray(0, lane), nearest, block.t_max(lane), starts_on);
            hits.coincident &= !(u32::from(!others) << lane);
            hits.set(lane, preferred);
        }
    }

    /// Bits of the live rays of a block that hit anything.
    pub(crate) fn any_hits_of(&self, block: &RayBlock<'_>) -> u32 {
        self.hits_of(block, false)
    }

    /// Bits of the live rays of a block that hit anything that does not let all light pass.
    pub(crate) fn occluded_of(&self, block: &RayBlock<'_>) -> u32 {
        self.hits_of(block, true)
    }

    fn hits_of(&self, block: &RayBlock<'_>, of_light: bool) -> u32 {
        let [occluded, undecided] = match &self.few {
            Some(few) if !(of_light && self.has_passages()) => {
                dispatch!(self.level, simd => few.find_any(simd, block))
            }
            _ => [0, block.live(0)],
        };
        if undecided == 0 {
            return occluded;
        }
        let found = with_stack(
            |stack| dispatch!(self.level, simd => self.find_any(simd, stack, block, undecided, of_light)),
        );
        occluded | found
    }

    /// The exact hit of a ray whose primitive is known.
    pub(crate) fn hit_in(&self, block: &RayBlock<'_>, hits: &HitBlock, lane: usize) -> Option<Hit> {
        self.hit_of(&block.ray(0, lane), hits.primitive(lane)?, block.starts_on(0, lane))
    }

    /// Finds the nearest hits; `coincident` has the rays whose hit may coincide with others.
    #[inline(always)]
    fn find_nearest<S: Simd>(
        &self,
        simd: S,
        mut stack: Stack,
        block: &RayBlock<'_>,
        lanes: u32,
        hits: &mut HitBlock,
    ) {
        for lane in each_bit(block.live(0) & lanes) {
            let (ray, starts_on) = (block.ray(0, lane), block.starts_on(0, lane));
            let found = self.nearest(simd, stack.above(), &ray, block.t_max(lane), starts_on);
            if let Some((primitive, tied)) = found {
                hits.set(lane, primitive);
                hits.coincident |= u32::from(tied) << lane;
            }
        }
    }

    #[inline(always)]
    fn find_any<S: Simd>(
        &self,
        simd: S,
        mut stack: Stack,
        block: &RayBlock<'_>,
        lanes: u32,
        of_light: bool,
    ) -> u32 {
        let mut occluded = 0;
        for lane in each_bit(lanes) {
            let (ray, starts_on) = (&block.ray(0, lane), block.starts_on(0, lane));
            let any = Any { of_light, frame: self, ray, t_max: block.t_max(lane), starts_on };
            let hit = self.hits_any(simd, stack.above(), &any);
            occluded |= u32::from(hit) << lane;
        }
        occluded
    }
}
