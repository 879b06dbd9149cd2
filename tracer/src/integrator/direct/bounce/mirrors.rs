//! Hits of the rays that a plane reflects, found as a tile where one primitive reflects many rays of a tile of the camera.
//!
//! The hits are those of the rays one by one, to the bit, so it does not matter which rays are found together.

use super::place_of;
use super::secondary::Secondary;
use crate::intersect::tile::{Scratch, find_closest};
use crate::rays::{
    BATCH, BLOCKS, EyeTile, HitBlock, MirrorTile, MirroredRay, PictureTile, PrimitiveId, RaySource,
};
use crate::simd::{Simd, each_bit};

/// Least rays of one primitive that are traced as a tile: fewer are faster one by one.
const LEAST_RAYS: usize = 32;

/// Most primitives of a tile whose reflected rays are traced as tiles.
const MOST_MIRRORS: usize = 4;

/// The hits of the reflected rays of a tile, by the tile's blocks and lanes.
pub(super) struct Mirrors {
    hits: Box<[HitBlock; BLOCKS]>,
    found: Box<[HitBlock; BLOCKS]>,
    /// Bits of the rays whose hits are known.
    known: [u32; BLOCKS],
    rays: Box<[MirroredRay; BATCH]>,
}

impl Mirrors {
    pub(super) fn new() -> Self {
        let none = || Box::new(std::array::from_fn(|_| HitBlock::NONE));
        Self { hits: none(), found: none(), known: [0; BLOCKS], rays: Box::new([MirroredRay::NONE; BATCH]) }
    }

    /// Finds hits of those reflected rays of a tile that share a plane with many others.
    pub(super) fn find<S: Simd>(
        &mut self,
        simd: S,
        tile: &EyeTile<'_>,
        reflected: &[Secondary],
        scratch: &mut Scratch,
    ) {
        self.clear();
        let mut rest = reflected;
        for _ in 0..MOST_MIRRORS {
            let Some(next) = rest.iter().position(|secondary| secondary.by_plane && !self.has(secondary))
            else {
                return;
            };
            rest = &rest[next..];
            let mirror = rest[0].starts_on;
            let of_mirror =
                || rest.iter().filter(|secondary| secondary.by_plane && secondary.starts_on == mirror);
            if of_mirror().count() >= LEAST_RAYS {
                self.trace(simd, tile, mirror, of_mirror(), scratch);
            }
            let others = rest.iter().position(|secondary| secondary.starts_on != mirror);
            rest = &rest[others.unwrap_or(rest.len())..];
        }
    }

    /// Forgets all hits.
    pub(super) fn clear(&mut self) {
        self.known = [0; BLOCKS];
    }

    fn has(&self, secondary: &Secondary) -> bool {
        let (block, lane) = place_of(usize::from(secondary.sample));
        self.known[block] >> lane & 1 == 1
    }

    fn trace<'s, S: Simd>(
        &mut self,
        simd: S,
        tile: &EyeTile<'_>,
        mirror: PrimitiveId,
        reflected: impl Iterator<Item = &'s Secondary>,
        scratch: &mut Scratch,
    ) {
        let frame = tile.frame();
        let mut live = [0; BLOCKS];
        let mut on_plane = None;
        for secondary in reflected {
            let (block, lane) = place_of(usize::from(secondary.sample));
            live[block] |= 1 << lane;
            // The depth of a ray of the camera grows by one per t.
            let incident = tile.ray(block, lane);
            self.rays[usize::from(secondary.sample)] = MirroredRay {
                ray: secondary.ray,
                start: secondary.previous_t,
                speed: 1.0 / incident.direction.length(),
            };
            on_plane.get_or_insert(secondary.ray.origin);
        }
        let Some(point) = on_plane else { return };
        let normal = frame.front_normal(mirror, point);
        let plane = (normal, normal.dot(point));
        let mirrored = MirrorTile::new(simd, tile, mirror, plane, live, &self.rays);
        let found = &mut self.found;
        simd.vectorize(
            #[inline(always)]
            || find_closest::<S, dyn PictureTile>(simd, &mirrored, found, scratch),
        );
        for block in 0..BLOCKS {
            for lane in each_bit(live[block]) {
                self.hits[block].put(lane, &self.found[block], lane);
            }
            self.known[block] |= live[block];
        }
    }

    /// Puts the known hits of up to sixteen rays into their lanes, and returns the bits of these lanes.
    pub(super) fn put(&self, rays: &[Secondary], hits: &mut HitBlock) -> u32 {
        let mut known = 0;
        for (lane, secondary) in rays.iter().enumerate() {
            if secondary.by_plane && self.has(secondary) {
                let (block, of_lane) = place_of(usize::from(secondary.sample));
                hits.put(lane, &self.hits[block], of_lane);
                known |= 1 << lane;
            }
        }
        known
    }
}
