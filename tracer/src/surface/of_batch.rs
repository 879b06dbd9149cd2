//! The surface points of a batch.

use super::Surfaces;
use crate::rays::{BLOCKS, HitBlock, RayBatch};
use crate::simd::Simd;

impl Surfaces {
    /// [`Surfaces::find`] for a batch. A function of its own on each level, because it takes long to compile.
    #[inline(never)]
    pub(crate) fn find_of_batch<S: Simd>(
        &mut self,
        simd: S,
        batch: &RayBatch<'_>,
        hits: &[HitBlock; BLOCKS],
    ) {
        simd.vectorize(
            #[inline(always)]
            || self.find(simd, batch, hits),
        );
    }
}
