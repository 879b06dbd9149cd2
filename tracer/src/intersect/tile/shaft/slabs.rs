//! Boxes against a shaft, sixteen at a time.

use glam::DVec3;

use crate::simd::{Simd, SimdBase, bits, f32x16, splat};

/// Margin around a shaft, relative to its largest coordinate: sixteen roundings of an `f32`.
const MARGIN: f64 = 1.0 / (1 << 20) as f64;

/// Largest and smallest coordinate of a shaft: products and reciprocals stay in the range of `f32`.
const RANGE: std::ops::Range<f64> = 1e-15..1e15;

/// The hull of two boxes: for s from 0 to 1, a box each of whose six sides moves from the one to the other.
pub(super) struct Slabs {
    /// The lower and the upper sides, by axis.
    sides: [[Side; 3]; 2],
}

/// A side of a shaft along one axis.
#[derive(Clone, Copy)]
struct Side {
    start: f32,
    end: f32,
    /// 1 / (end - start); 0 for sides that hardly move.
    inverse: f32,
}

impl Slabs {
    /// The hull of two boxes, each given by its lower and upper corner; `None` if numbers are out of range.
    pub(super) fn new(start: [DVec3; 2], end: [DVec3; 2]) -> Option<Self> {
        let size =
            [start, end].as_flattened().iter().map(|corner| corner.abs().max_element()).fold(0.0, f64::max);
        let finite = [start, end].as_flattened().iter().all(|corner| corner.is_finite());
        if !(finite && RANGE.contains(&size)) {
            return None;
        }
        let margin = size * MARGIN;
        let sides = [-margin, margin].map(|out| (usize::from(out > 0.0), out)).map(|(corner, out)| {
            [0, 1, 2].map(|axis| {
                let [start, end] = [start, end].map(|ends| (ends[corner][axis] + out) as f32);
                let moves = end - start;
                let inverse = if moves.abs() > margin as f32 { 1.0 / moves } else { 0.0 };
                Side { start, end, inverse }
            })
        });
        Some(Self { sides })
    }

    /// Bits of the boxes that may meet the shaft: for some s, each side of the box is beyond the opposite one of the shaft.
    #[inline(always)]
    pub(super) fn meet<S: Simd>(&self, simd: S, lo: [f32x16<S>; 3], hi: [f32x16<S>; 3]) -> u32 {
        let (mut from, mut to) = (splat(simd, -MARGIN as f32), splat(simd, 1.0 + MARGIN as f32));
        let mut meets = u32::MAX;
        let [lower, upper] = &self.sides;
        for axis in 0..3 {
            // The shaft's lower side is below the box's upper one until it passes it while it rises, or from there while it falls.
            let side = lower[axis];
            let passes = (hi[axis] - splat(simd, side.start)) * splat(simd, side.inverse);
            if side.inverse > 0.0 {
                to = to.min(passes);
            } else if side.inverse < 0.0 {
                from = from.max(passes);
            }
            meets &= bits(hi[axis].simd_ge(splat(simd, side.start.min(side.end))));
            let side = upper[axis];
            let passes = (lo[axis] - splat(simd, side.start)) * splat(simd, side.inverse);
            if side.inverse > 0.0 {
                from = from.max(passes);
            } else if side.inverse < 0.0 {
                to = to.min(passes);
            }
            meets &= bits(lo[axis].simd_le(splat(simd, side.start.max(side.end))));
        }
        meets & bits(from.simd_le(to + splat(simd, MARGIN as f32)))
    }
}
