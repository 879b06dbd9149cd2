//! Which pixels want more than the samples at their corners.

use std::ops::Range;

use super::BAND;
use super::corners::Corners;
use crate::simd::{LANES, Simd, SimdBase, bits, f32x16, splat};

/// A pixel whose corners differ by this many steps of the encoding is looked at more closely.
const FAINT: f32 = 7.0;

/// So are the four beside a pixel whose corners differ by this many: what is thin or short may miss their own corners.
const STRONG: f32 = 14.0;

/// A pixel of n x n samples gets all of them if those that are known differ by this, divided by n, in steps of the encoding:
/// the more samples, the smaller the errors that they are to leave.
const ALL: f32 = 68.0;

/// The contrast from which a pixel gets all its samples.
pub(super) fn limit(grid: u32) -> f32 {
    ALL / grid as f32
}

/// Bits of sixteen pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Wants {
    /// Those that get one sample more.
    pub one: u32,
    /// Those that get all samples.
    pub all: u32,
}

/// How much the corners of the pixels of a band differ, with a pixel of no contrast around.
pub(super) struct Contrasts {
    stride: usize,
    steps: Vec<f32>,
}

impl Contrasts {
    /// Of rows of that many pixels; for [`Contrasts::find`] to fill.
    pub(super) fn new(width: usize) -> Self {
        let stride = width.next_multiple_of(LANES) + 2 * LANES;
        Self { stride, steps: vec![0.0; (BAND as usize + 2) * stride] }
    }

    #[cfg(test)]
    pub(super) fn put(&mut self, column: usize, row: usize, steps: f32) {
        let at = self.at(column, row);
        self.steps[at] = steps;
    }

    fn at(&self, column: usize, row: usize) -> usize {
        (row + 1) * self.stride + LANES + column
    }

    /// Of some rows of the band; the others have none.
    #[inline(always)]
    pub(super) fn find<S: Simd>(&mut self, simd: S, corners: &Corners, width: usize, rows: &Range<usize>) {
        for row in rows.clone() {
            for column in (0..width).step_by(LANES) {
                let at = self.at(column, row);
                corners.contrasts(simd, column, row).store_slice(&mut self.steps[at..at + LANES]);
            }
            // Beside the picture.
            let (from, to) = (self.at(width, row), self.at(0, row + 1) - LANES);
            self.steps[from..to].fill(0.0);
        }
    }

    /// What sixteen pixels want, if `limit` is the contrast from which they get all samples.
    #[inline(always)]
    pub(super) fn wants<S: Simd>(&self, simd: S, column: usize, row: usize, limit: f32) -> Wants {
        let at = self.at(column, row);
        let load = |at: usize| f32x16::from_slice(simd, &self.steps[at..at + LANES]);
        let own = load(at);
        let beside = load(at - 1).max(load(at + 1));
        let around = beside.max(load(at - self.stride)).max(load(at + self.stride));
        let all = bits(own.simd_ge(splat(simd, limit)));
        let one = own.simd_ge(splat(simd, FAINT)) | around.simd_ge(splat(simd, STRONG));
        Wants { one: bits(one) & !all, all }
    }
}
