//! The points of a tile as a light sees them, and which of them are known to be dark.

use super::lens::{Lens, ROUNDING};
use super::light_lens::Extent;
use super::{BLOCKS, Rays};
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, SimdBase, bits, fma, mask_of, select, splat, three};

/// Points as the light sees them.
pub(super) struct Points {
    /// Those that are not known to be dark yet.
    pub open: [u32; BLOCKS],
    pub dark: [u32; BLOCKS],
    /// Closeness of the points to the light lies between these.
    pub low: [Lanes; BLOCKS],
    pub high: [Lanes; BLOCKS],
    /// Least of `low` in each block; infinity where no point is open.
    pub least: Lanes,
    /// Least of `least`.
    pub least_of_all: f32,
}

impl Points {
    pub(super) const NONE: Points = Points {
        open: [0; BLOCKS],
        dark: [0; BLOCKS],
        low: [Lanes::ZERO; BLOCKS],
        high: [Lanes::ZERO; BLOCKS],
        least: Lanes::ZERO,
        least_of_all: 0.0,
    };

    /// Where the light sees the points.
    #[inline(always)]
    pub(super) fn project<S: Simd>(
        &mut self,
        simd: S,
        points: &[[Lanes; 3]; BLOCKS],
        extent: &Extent,
        lens: &Lens,
        rays: &mut Rays,
    ) {
        let middle = extent.middle();
        let lens = &lens.relative_to(middle.as_dvec3(), extent.reach_from(middle));
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
                let row = three!(axis => splat(simd, lens.rows[i][axis]));
                let constant = splat(simd, lens.rows[i][3]);
                fma(row[0], p.0[0], fma(row[1], p.0[1], fma(row[2], p.0[2], constant)))
            });
            let one = splat(simd, 1.0);
            let scale = if lens.parallel { one } else { one / g };
            let closeness = if lens.parallel { -g } else { scale };
            rays.x[block].store(a * scale);
            rays.y[block].store(b * scale);
            let error = scale * scale * splat(simd, 2.0 * lens.error[1])
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
        let by_lens = if lens.parallel {
            lens.error[0]
        } else {
            (lens.error[0] + reach * lens.error[1]) / nearest.reduce_min()
        };
        rays.widen(simd, 2.0 * by_lens + 4.0 * ROUNDING * reach);
    }

    pub(super) fn darken(&mut self, block: usize, lanes: u32) {
        self.dark[block] |= lanes;
        self.open[block] &= !lanes;
        if self.open[block] == 0 && self.least.0[block] < f32::INFINITY {
            self.least.0[block] = f32::INFINITY;
            self.least_of_all =
                self.least.0.iter().fold(f32::INFINITY, |least, &of_block| least.min(of_block));
        }
    }

    /// Open points of a block at most as close to the light as `z_most`.
    #[inline(always)]
    pub(super) fn open_before<S: Simd>(&self, simd: S, block: usize, z_most: f32) -> u32 {
        self.open[block] & bits(self.low[block].load(simd).simd_le(splat(simd, z_most)))
    }
}
