//! The points of a tile in a light's picture, and which of them are occluded.

use super::light_projection::Extent;
use crate::rays::{BLOCKS, Projection, ROUNDING, TileRays};
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, SimdBase, bits, fma, mask_of, select, splat, three};

/// Closeness of points to a light, and the state of the occlusion query.
pub(super) struct Points {
    /// Bits of the points that are still to be tested.
    pub open: [u32; BLOCKS],
    /// Bits of the points that are known to be occluded.
    pub occluded: [u32; BLOCKS],
    /// Bits of the points with a surface before the light that light may pass.
    pub undecided: [u32; BLOCKS],
    /// Bounds of the closeness of the points to the light.
    pub low: [Lanes; BLOCKS],
    pub high: [Lanes; BLOCKS],
    /// Least of `low` of the open points in each block; infinity if there are none.
    pub least: Lanes,
    /// Least of `least`.
    pub least_of_all: f32,
}

impl Points {
    pub(super) const NONE: Points = Points {
        open: [0; BLOCKS],
        occluded: [0; BLOCKS],
        undecided: [0; BLOCKS],
        low: [Lanes::ZERO; BLOCKS],
        high: [Lanes::ZERO; BLOCKS],
        least: Lanes::ZERO,
        least_of_all: 0.0,
    };

    /// Projects the open points.
    #[inline(always)]
    pub(super) fn project<S: Simd>(
        &mut self,
        simd: S,
        points: &[[Lanes; 3]; BLOCKS],
        extent: &Extent,
        projection: &Projection,
        rays: &mut TileRays,
    ) {
        let middle = extent.middle();
        let projection = &projection.relative_to(middle.as_dvec3(), extent.reach_from(middle));
        let middle = Vec3x16::splat(simd, middle.to_array());
        let infinite = splat(simd, f32::INFINITY);
        let mut nearest = infinite;
        for block in 0..BLOCKS {
            self.least.0[block] = f32::INFINITY;
            if self.open[block] == 0 {
                continue;
            }
            let p = Vec3x16::load(simd, &points[block]).sub(middle);
            let [a, b, g] = three!(i => {
                let row = three!(axis => splat(simd, projection.rows[i][axis]));
                let constant = splat(simd, projection.rows[i][3]);
                fma(row[0], p.0[0], fma(row[1], p.0[1], fma(row[2], p.0[2], constant)))
            });
            let one = splat(simd, 1.0);
            let scale = if projection.parallel { one } else { one / g };
            let closeness = if projection.parallel { -g } else { scale };
            rays.x[block].store(a * scale);
            rays.y[block].store(b * scale);
            let error = scale * scale * splat(simd, 2.0 * projection.error[1])
                + closeness.abs() * splat(simd, 4.0 * ROUNDING);
            let low = closeness - error;
            self.low[block].store(low);
            self.high[block].store(closeness + error);
            let open = mask_of(simd, self.open[block]);
            nearest = nearest.min(select(open, g, infinite));
            self.least.0[block] = select(open, low, infinite).reduce_min();
        }
        self.least_of_all = self.least.load(simd).reduce_min();
        rays.bound(simd, &self.open);
        let reach = rays.reach();
        let by_projection = if projection.parallel {
            projection.error[0]
        } else {
            (projection.error[0] + reach * projection.error[1]) / nearest.reduce_min()
        };
        rays.widen(simd, 2.0 * by_projection + 4.0 * ROUNDING * reach);
    }

    /// Marks points as occluded.
    pub(super) fn mark_occluded(&mut self, block: usize, lanes: u32) {
        self.occluded[block] |= lanes;
        self.open[block] &= !lanes;
        if self.open[block] == 0 && self.least.0[block] < f32::INFINITY {
            self.least.0[block] = f32::INFINITY;
            self.least_of_all =
                self.least.0.iter().fold(f32::INFINITY, |least, &of_block| least.min(of_block));
        }
    }

    /// Bits of the open points of a block that are at most as close to the light as `z_most`.
    #[inline(always)]
    pub(super) fn open_before<S: Simd>(&self, simd: S, block: usize, z_most: f32) -> u32 {
        self.open[block] & bits(self.low[block].load(simd).simd_le(splat(simd, z_most)))
    }
}
