//! The hits of sixteen rays, of any source.

use crate::simd::{Indices, LANES, Simd};

/// Index of no item: the ray hits nothing.
pub(crate) const NO_ITEM: u32 = u32::MAX;

/// A primitive of the scene: an item or a plane, and for models the triangle of its mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PrimitiveId {
    /// Index of the item or plane: see `compile::Items`.
    pub item: u32,
    /// Index of the triangle in a model's mesh; 0 for all others.
    pub triangle: u32,
}

/// The primitives that sixteen rays hit, lane by lane. Their points follow from the rays: see `surface`.
#[derive(Clone)]
pub(crate) struct HitBlock {
    /// Index of the item or plane, or [`NO_ITEM`].
    pub item: Indices,
    /// Index of the triangle in its mesh.
    pub triangle: Indices,
    /// Bits of the rays whose hit coincides with hits of other primitives: see `intersect::coincide`.
    pub coincident: u32,
}

impl HitBlock {
    /// Sixteen rays without hits.
    pub(crate) const NONE: HitBlock =
        HitBlock { item: Indices([NO_ITEM; LANES]), triangle: Indices::ZERO, coincident: 0 };

    /// Bits of the rays that hit something.
    #[inline(always)]
    pub(crate) fn hit<S: Simd>(&self, simd: S) -> u32 {
        0xffff & !self.item.equal(simd, NO_ITEM)
    }

    /// The primitive that a ray hits.
    pub(crate) fn primitive(&self, lane: usize) -> Option<PrimitiveId> {
        let PrimitiveId { item, triangle } = self.slot(lane);
        (item != NO_ITEM).then_some(PrimitiveId { item, triangle })
    }

    /// The primitive in a lane that is known to hit one.
    pub(crate) fn slot(&self, lane: usize) -> PrimitiveId {
        PrimitiveId { item: self.item.0[lane], triangle: self.triangle.0[lane] }
    }

    /// Sets a lane to a lane of another block.
    pub(crate) fn put(&mut self, lane: usize, other: &HitBlock, from: usize) {
        self.set(lane, other.slot(from));
        self.coincident = self.coincident & !(1 << lane) | (other.coincident >> from & 1) << lane;
    }

    /// Sets the primitive that a ray hits.
    pub(crate) fn set(&mut self, lane: usize, primitive: PrimitiveId) {
        self.item.0[lane] = primitive.item;
        self.triangle.0[lane] = primitive.triangle;
    }
}
