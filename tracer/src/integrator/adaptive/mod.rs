//! Adaptive sampling: few samples where the picture is smooth, all of them elsewhere.
//!
//! ```text
//!   corners    one sample at each corner of a pixel, shared by four pixels
//!   contrast   contrast of the corners: their mean suffices, or the pixel needs one sample more, or all
//!   gather     samples of single pixels, gathered into tiles
//! ```
//!
//! A pixel depends on its place alone: bands and spans are aligned to the whole frame, rows next to the requested ones take part
//! in the contrast test, and no colour depends on the other rays of its tile.

mod contrast;
mod corners;
mod gather;
#[cfg(test)]
mod tests;

use std::ops::Range;

use super::direct::TileContext;
use super::stage::{Stage, Watch};
use crate::cancel::Cancelled;
use crate::film::{Development, Means, PixelIndex, write_corner_means};
use crate::frame::PreparedFrame;
use crate::rays::{RayCounts, TILE_SIZE};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, each_bit, three};
use crate::srgb;
use contrast::{Contrasts, Needs, limit};
use corners::Corners;
use gather::{Gathered, Pattern};

/// Rows of a band.
const BAND: u32 = TILE_SIZE;

/// Columns of a band whose pixels are gathered together: a multiple of [`CELL`].
const SPAN: u32 = 32;

/// Side of a cell of pixels that are gathered in sequence: neighbours hit the same triangles.
const CELL: u32 = 4;

/// Weight of a sample at the centre: that of four corners, because each corner is shared by four pixels.
const CENTER_WEIGHT: f32 = 4.0;

/// Renders rows of one band.
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
    let mut band = Band::new(frame, rows, cancelled, watch);
    band.render(simd, out)?;
    Ok(band.context.counts)
}

/// A band of rows while it is rendered.
struct Band<'a, W> {
    frame: &'a PreparedFrame,
    /// First row of the band; `rows` may begin later.
    top: u32,
    /// Requested rows.
    rows: Range<u32>,
    context: TileContext<'a, W>,
    corners: Corners,
    /// Samples that the requested pixels need: by row, then sixteen columns.
    needs: Vec<Needs>,
    gathered: Gathered,
    /// Pixels to be gathered.
    pixels: Vec<[u32; 2]>,
}

impl<'a, W: Watch> Band<'a, W> {
    fn new(
        frame: &'a PreparedFrame,
        rows: Range<u32>,
        cancelled: &'a dyn Fn() -> bool,
        watch: &'a mut W,
    ) -> Self {
        let width = frame.width() as usize;
        Self {
            frame,
            top: rows.start / BAND * BAND,
            context: TileContext::new(frame, cancelled, watch),
            corners: Corners::new(width),
            needs: vec![Needs::default(); rows.len() * width.div_ceil(LANES)],
            rows,
            gathered: Gathered::new(),
            pixels: Vec::new(),
        }
    }

    #[inline(always)]
    fn render<S: Simd>(&mut self, simd: S, out: &mut [u8]) -> Result<(), Cancelled> {
        self.corners.trace(simd, self.top, &self.rows_around(), &mut self.context)?;
        self.find_needs(simd);
        self.write_corner_means(simd, out);
        for left in (0..self.frame.width()).step_by(SPAN as usize) {
            self.sample_centers(simd, left, out)?;
            self.sample_all(simd, left, out)?;
        }
        Ok(())
    }

    /// Rows of the band, relative to its first, whose contrast matters: the requested ones and their neighbours.
    fn rows_around(&self) -> Range<u32> {
        let end = (self.top + BAND).min(self.frame.height());
        let from = self.rows.start.saturating_sub(1).max(self.top);
        from - self.top..(self.rows.end + 1).min(end) - self.top
    }

    /// Finds the samples that the requested pixels need.
    #[inline(always)]
    fn find_needs<S: Simd>(&mut self, simd: S) {
        let width = self.frame.width() as usize;
        let mut contrasts = Contrasts::new(width);
        let Range { start, end } = self.rows_around();
        contrasts.find(simd, &self.corners, width, &(start as usize..end as usize));
        let limit = limit(self.frame.rays.grid());
        let first = (self.rows.start - self.top) as usize;
        for (i, needs) in self.needs.iter_mut().enumerate() {
            let chunks = width.div_ceil(LANES);
            *needs = contrasts.needs(simd, i % chunks * LANES, first + i / chunks, limit);
        }
    }

    /// Writes the means of corners to all pixels.
    #[inline(always)]
    fn write_corner_means<S: Simd>(&self, simd: S, out: &mut [u8]) {
        let development = Development::of(self.frame, &self.rows);
        for y in self.rows.clone() {
            for x in (0..self.frame.width()).step_by(LANES) {
                let Vec3x16(sums) = self.corners.sums(simd, x as usize, (y - self.top) as usize);
                let pixel = PixelIndex::of(self.frame, &self.rows, x, y);
                let columns = (self.frame.width() - x) as usize;
                write_corner_means(simd, Vec3x16(sums), columns, pixel, development.as_ref(), out);
            }
        }
    }

    /// Collects the pixels of a span that need samples, cell by cell.
    fn collect(&mut self, left: u32, needed: impl Fn(&Needs) -> u32) {
        self.pixels.clear();
        for top in (self.top..self.top + BAND).step_by(CELL as usize) {
            for left in (left..(left + SPAN).min(self.frame.width())).step_by(CELL as usize) {
                for y in self.rows.start.max(top)..self.rows.end.min(top + CELL) {
                    let (index, bit) = need_of(self.frame, &self.rows, [left, y]);
                    let bits = needed(&self.needs[index]) >> bit & ((1 << CELL) - 1);
                    self.pixels.extend(each_bit(bits).map(|bit| [left + bit as u32, y]));
                }
            }
        }
        // Pixels outside the picture need none.
        self.pixels.retain(|&[x, _]| x < self.frame.width());
    }

    /// Samples the centres of pixels that need one sample. Those with a contrast then need all.
    #[inline(always)]
    fn sample_centers<S: Simd>(&mut self, simd: S, left: u32, out: &mut [u8]) -> Result<(), Cancelled> {
        self.collect(left, |needs| needs.one);
        let center = [left + SPAN / 2, self.top + BAND / 2];
        let pattern = Pattern::center();
        let limit = limit(self.frame.rays.grid());
        let mut means = Means::of(4.0 + CENTER_WEIGHT, self.frame, &self.rows);
        let pixels = std::mem::take(&mut self.pixels);
        for some in pixels.chunks(pattern.per_tile()) {
            self.gathered.trace(simd, &pattern, center, some, &mut self.context)?;
            self.context.watch.enter(Stage::Encoding);
            let (frame, colors) = (self.frame, &self.context.direct.colors);
            let mut encoded = [Lanes::ZERO; 3];
            for (pixel, &[x, y]) in some.iter().enumerate() {
                let (block, lane) = pattern.lane(pixel, 0);
                if lane == 0 {
                    let color = Vec3x16::load(simd, &colors[block]);
                    Vec3x16(three!(channel => srgb::unrounded(simd, color.0[channel]))).store(&mut encoded);
                }
                let (column, row) = (x as usize, (y - self.top) as usize);
                let center = three!(channel => encoded[channel].0[lane]);
                if self.corners.contrast_with(column, row, center) >= limit {
                    let (index, bit) = need_of(frame, &self.rows, [x, y]);
                    self.needs[index].all |= 1 << bit;
                    continue;
                }
                let around = self.corners.sum(column, row);
                let sum = three!(channel => around[channel] + CENTER_WEIGHT * colors[block][channel].0[lane]);
                means.push(simd, sum, PixelIndex::of(frame, &self.rows, x, y), out);
            }
        }
        means.finish(simd, out);
        self.pixels = pixels;
        Ok(())
    }

    /// Takes all samples of the pixels that need them, as regular sampling does.
    #[inline(always)]
    fn sample_all<S: Simd>(&mut self, simd: S, left: u32, out: &mut [u8]) -> Result<(), Cancelled> {
        self.collect(left, |needs| needs.all);
        let center = [left + SPAN / 2, self.top + BAND / 2];
        let pattern = Pattern::full(self.frame.rays.grid());
        let mut means = Means::of(pattern.len() as f32, self.frame, &self.rows);
        let Self { frame, rows, context, gathered, pixels, .. } = self;
        for some in pixels.chunks(pattern.per_tile()) {
            gathered.trace(simd, &pattern, center, some, context)?;
            context.watch.enter(Stage::Encoding);
            let colors = &context.direct.colors;
            for (pixel, &[x, y]) in some.iter().enumerate() {
                means.push(simd, pattern.sum(colors, pixel), PixelIndex::of(frame, rows, x, y), out);
            }
        }
        means.finish(simd, out);
        Ok(())
    }
}

/// The index of a pixel's needs, and its bit.
fn need_of(frame: &PreparedFrame, rows: &Range<u32>, [x, y]: [u32; 2]) -> (usize, usize) {
    let chunks = (frame.width() as usize).div_ceil(LANES);
    ((y - rows.start) as usize * chunks + x as usize / LANES, x as usize % LANES)
}
