//! Contrast of pixels, and the samples that they need in addition to their corners.

use std::ops::Range;

use super::BAND;
use super::corners::Corners;
use crate::simd::{LANES, Simd, SimdBase, bits, f32x16, splat};

/// Contrast of corners, in steps of the encoding, from which a pixel gets one sample more.
const FAINT: f32 = 7.0;

/// Contrast of corners from which the four neighbours of a pixel get one sample more: thin or short details may miss their own
/// corners.
const STRONG: f32 = 14.0;

/// Contrast of the known samples, times n, from which a pixel of n x n samples gets all of them: more samples are to leave
/// smaller errors.
const ALL: f32 = 68.0;

/// The contrast from which a pixel of `grid` x `grid` samples gets all of them.
pub(super) fn limit(grid: u32) -> f32 {
    ALL / grid as f32
}

/// Samples that sixteen pixels need, as bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Needs {
    /// Pixels that get one sample more.
    pub one: u32,
    /// Pixels that get all samples.
    pub all: u32,
}

/// Contrasts of the corners of the pixels of a band, with a border of one pixel without contrast.
pub(super) struct Contrasts {
    stride: usize,
    steps: Vec<f32>,
}

impl Contrasts {
    /// Contrasts of rows of `width` pixels, for [`Contrasts::find`] to set.
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

    /// Sets the contrasts of some rows of the band; the others keep 0.
    #[inline(always)]
    pub(super) fn find<S: Simd>(&mut self, simd: S, corners: &Corners, width: usize, rows: &Range<usize>) {
        for row in rows.clone() {
            for column in (0..width).step_by(LANES) {
                let at = self.at(column, row);
                corners.contrasts(simd, column, row).store_slice(&mut self.steps[at..at + LANES]);
            }
            // Outside the picture.
            let (from, to) = (self.at(width, row), self.at(0, row + 1) - LANES);
            self.steps[from..to].fill(0.0);
        }
    }

    /// Samples that sixteen pixels need; `limit` is the contrast from which they get all.
    #[inline(always)]
    pub(super) fn needs<S: Simd>(&self, simd: S, column: usize, row: usize, limit: f32) -> Needs {
        let at = self.at(column, row);
        let load = |at: usize| f32x16::from_slice(simd, &self.steps[at..at + LANES]);
        let own = load(at);
        let neighbours = load(at - 1).max(load(at + 1));
        let around = neighbours.max(load(at - self.stride)).max(load(at + self.stride));
        let all = bits(own.simd_ge(splat(simd, limit)));
        let one = own.simd_ge(splat(simd, FAINT)) | around.simd_ge(splat(simd, STRONG));
        Needs { one: bits(one) & !all, all }
    }
}
