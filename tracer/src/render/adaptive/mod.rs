//! Few samples where nothing changes, all of them where something does.
//!
//! ```text
//!   corners    a sample at each corner of a pixel, which four pixels share
//!   contrast   how much the corners of a pixel differ: its mean will do, or it wants one sample more, or all
//!   gather     the samples of single pixels, together in tiles
//! ```
//!
//! A pixel depends on its place alone: bands and spans stand on a grid of the whole frame, rows beside those that are asked for
//! have their say, and no colour depends on which other rays share its tile.

mod contrast;
mod corners;
mod gather;
#[cfg(test)]
mod tests;

use std::ops::Range;

use super::RayCounts;
use super::dither::Dither;
use super::encode::{Means, Place, write_flat};
use super::traced::Scratch;
use crate::cancel::Cancelled;
use crate::frame::PreparedFrame;
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, each_bit, three};
use crate::srgb;
use crate::stage::{Stage, Watch};
use contrast::{Contrasts, Wants, limit};
use corners::Corners;
use gather::{Gathered, Pattern};

/// Rows of a band.
const BAND: u32 = super::TILE_SIZE;

/// Columns of a band whose pixels are gathered into tiles together: whole cells.
const SPAN: u32 = 32;

/// Columns and rows of pixels that are gathered one after the other: neighbours see the same triangles.
const CELL: u32 = 4;

/// A sample at the centre weighs as much as four corners, of which each belongs to four pixels.
const CENTER_WEIGHT: f32 = 4.0;

/// Rows of one band.
#[inline(always)]
pub(super) fn render_band<S: Simd, W: Watch>(
    simd: S,
    frame: &PreparedFrame,
    rows: Range<u32>,
    out: &mut [u8],
    cancelled: &dyn Fn() -> bool,
    watch: &mut W,
) -> Result<RayCounts, Cancelled> {
    watch.enter(Stage::Visible);
    let mut band = Band::new(frame, rows, cancelled);
    band.render(simd, out, watch)?;
    Ok(band.counts)
}

/// A band of rows under way.
struct Band<'a> {
    frame: &'a PreparedFrame,
    /// First row of the band; `rows` may begin later.
    top: u32,
    /// What is asked for.
    rows: Range<u32>,
    scratch: Scratch<'a>,
    corners: Corners,
    /// What the pixels that are asked for want: by row, then sixteen columns.
    wants: Vec<Wants>,
    gathered: Gathered,
    /// Pixels to be gathered.
    pixels: Vec<[u32; 2]>,
    counts: RayCounts,
}

impl<'a> Band<'a> {
    fn new(frame: &'a PreparedFrame, rows: Range<u32>, cancelled: &'a dyn Fn() -> bool) -> Self {
        let width = frame.width() as usize;
        Self {
            frame,
            top: rows.start / BAND * BAND,
            scratch: Scratch::new(frame, cancelled),
            corners: Corners::new(width),
            wants: vec![Wants::default(); rows.len() * width.div_ceil(LANES)],
            rows,
            gathered: Gathered::new(),
            pixels: Vec::new(),
            counts: RayCounts::default(),
        }
    }

    #[inline(always)]
    fn render<S: Simd, W: Watch>(&mut self, simd: S, out: &mut [u8], watch: &mut W) -> Result<(), Cancelled> {
        self.trace_corners(simd, watch)?;
        self.find_wants(simd);
        self.write_flat(simd, out);
        for left in (0..self.frame.width()).step_by(SPAN as usize) {
            self.sample_centers(simd, left, out, watch)?;
            self.sample_all(simd, left, out, watch)?;
        }
        Ok(())
    }

    /// Rows of the band, counted from its first, whose contrast matters: those that are asked for, and those beside them.
    fn rows_around(&self) -> Range<u32> {
        let end = (self.top + BAND).min(self.frame.height());
        let from = self.rows.start.saturating_sub(1).max(self.top);
        from - self.top..(self.rows.end + 1).min(end) - self.top
    }

    #[inline(always)]
    fn trace_corners<S: Simd, W: Watch>(&mut self, simd: S, watch: &mut W) -> Result<(), Cancelled> {
        let rows = self.rows_around();
        let Self { frame, top, scratch, corners, counts, .. } = self;
        corners.trace(simd, frame, *top, &rows, scratch, counts, watch)
    }

    #[inline(always)]
    fn find_wants<S: Simd>(&mut self, simd: S) {
        let width = self.frame.width() as usize;
        let mut contrasts = Contrasts::new(width);
        let Range { start, end } = self.rows_around();
        contrasts.find(simd, &self.corners, width, &(start as usize..end as usize));
        let limit = limit(self.frame.rays.grid());
        let first = (self.rows.start - self.top) as usize;
        for (i, wants) in self.wants.iter_mut().enumerate() {
            let chunks = width.div_ceil(LANES);
            *wants = contrasts.wants(simd, i % chunks * LANES, first + i / chunks, limit);
        }
    }

    /// Means of corners, in all pixels.
    #[inline(always)]
    fn write_flat<S: Simd>(&self, simd: S, out: &mut [u8]) {
        let dither = Dither::of(self.frame, &self.rows);
        for y in self.rows.clone() {
            for x in (0..self.frame.width()).step_by(LANES) {
                let Vec3x16(sums) = self.corners.sums(simd, x as usize, (y - self.top) as usize);
                let place = Place::of(self.frame, &self.rows, x, y);
                write_flat(simd, Vec3x16(sums), (self.frame.width() - x) as usize, place, dither, out);
            }
        }
    }

    /// Collects the pixels of a span that want something, cell by cell.
    fn collect(&mut self, left: u32, wanted: impl Fn(&Wants) -> u32) {
        self.pixels.clear();
        for top in (self.top..self.top + BAND).step_by(CELL as usize) {
            for left in (left..(left + SPAN).min(self.frame.width())).step_by(CELL as usize) {
                for y in self.rows.start.max(top)..self.rows.end.min(top + CELL) {
                    let (index, bit) = want(self.frame, &self.rows, [left, y]);
                    let bits = wanted(&self.wants[index]) >> bit & ((1 << CELL) - 1);
                    self.pixels.extend(each_bit(bits).map(|bit| [left + bit as u32, y]));
                }
            }
        }
        // What stands beside the picture wants nothing.
        self.pixels.retain(|&[x, _]| x < self.frame.width());
    }

    /// A sample at the centres of pixels that want one. Where that shows a contrast, they want all.
    #[inline(always)]
    fn sample_centers<S: Simd, W: Watch>(
        &mut self,
        simd: S,
        left: u32,
        out: &mut [u8],
        watch: &mut W,
    ) -> Result<(), Cancelled> {
        self.collect(left, |wants| wants.one);
        let center = [left + SPAN / 2, self.top + BAND / 2];
        let pattern = Pattern::center();
        let limit = limit(self.frame.rays.grid());
        let mut means = Means::of(4.0 + CENTER_WEIGHT, self.frame, &self.rows);
        let pixels = std::mem::take(&mut self.pixels);
        for some in pixels.chunks(pattern.per_tile()) {
            let Self { frame, scratch, gathered, counts, .. } = self;
            let colors = gathered.trace(simd, frame, &pattern, center, some, scratch, counts, watch)?;
            watch.enter(Stage::Encoding);
            let mut encoded = [Lanes::ZERO; 3];
            for (pixel, &[x, y]) in some.iter().enumerate() {
                let (block, lane) = pattern.lane(pixel, 0);
                if lane == 0 {
                    let color = Vec3x16::load(simd, &colors[block]);
                    Vec3x16(three!(channel => srgb::unrounded(simd, color.0[channel]))).store(&mut encoded);
                }
                let (column, row) = (x as usize, (y - self.top) as usize);
                let seen = three!(channel => encoded[channel].0[lane]);
                if self.corners.contrast_with(column, row, seen) >= limit {
                    let (index, bit) = want(frame, &self.rows, [x, y]);
                    self.wants[index].all |= 1 << bit;
                    continue;
                }
                let around = self.corners.sum(column, row);
                let sum = three!(channel => around[channel] + CENTER_WEIGHT * colors[block][channel].0[lane]);
                means.push(simd, sum, Place::of(frame, &self.rows, x, y), out);
            }
        }
        means.finish(simd, out);
        self.pixels = pixels;
        Ok(())
    }

    /// All samples of the pixels that want them: what regular sampling gives.
    #[inline(always)]
    fn sample_all<S: Simd, W: Watch>(
        &mut self,
        simd: S,
        left: u32,
        out: &mut [u8],
        watch: &mut W,
    ) -> Result<(), Cancelled> {
        self.collect(left, |wants| wants.all);
        let center = [left + SPAN / 2, self.top + BAND / 2];
        let pattern = Pattern::full(self.frame.rays.grid());
        let mut means = Means::of(pattern.len() as f32, self.frame, &self.rows);
        let Self { frame, rows, scratch, gathered, pixels, counts, .. } = self;
        for some in pixels.chunks(pattern.per_tile()) {
            let colors = gathered.trace(simd, frame, &pattern, center, some, scratch, counts, watch)?;
            watch.enter(Stage::Encoding);
            for (pixel, &[x, y]) in some.iter().enumerate() {
                means.push(simd, pattern.sum(colors, pixel), Place::of(frame, rows, x, y), out);
            }
        }
        means.finish(simd, out);
        Ok(())
    }
}

/// The index of what a pixel wants, and its bit.
fn want(frame: &PreparedFrame, rows: &Range<u32>, [x, y]: [u32; 2]) -> (usize, usize) {
    let chunks = (frame.width() as usize).div_ceil(LANES);
    ((y - rows.start) as usize * chunks + x as usize / LANES, x as usize % LANES)
}
