//! What one frame's rows are expected to cost, and what they were seen to cost.
//!
//! Work is counted in rows of average cost, so a speed is average rows a second and means the same from frame to
//! frame. Only ratios between rows matter.

use std::ops::Range;

/// How much of a segment's cost is taken to lie evenly over its rows, and not as was expected.
const EVEN: f64 = 0.5;

/// How a worker traces rows: in bands of tiles. Cutting a band costs: its rays share what they look at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tiles {
    /// Rows of a band; bands begin at multiples of it.
    pub(super) rows: u32,
    /// What a band costs however few of its rows are traced, as a share of the whole.
    pub(super) share: f64,
}

/// Predicted work per row of one frame, made when it begins; 1 on average.
#[derive(Debug)]
pub(super) struct Forecast {
    rows: Vec<f64>,
    /// Sums of `rows`: work of the rows before each.
    sums: Vec<f64>,
    /// What its segments have told so far.
    seen: Vec<Option<f64>>,
    pub(super) tiles: Tiles,
}

impl Forecast {
    pub(super) fn new(rows: Vec<f64>, tiles: Tiles) -> Self {
        let mut sum = 0.0;
        let after = rows.iter().map(|cost| {
            sum += cost;
            sum
        });
        let sums = std::iter::once(0.0).chain(after).collect();
        Self { sums, seen: vec![None; rows.len()], rows, tiles: Tiles { rows: tiles.rows.max(1), ..tiles } }
    }

    /// The predicted work of whole bands.
    fn plain(&self, rows: Range<u32>) -> f64 {
        match (self.sums.get(rows.start as usize), self.sums.get(rows.end as usize)) {
            (Some(before), Some(after)) => after - before,
            _ => f64::from(rows.end.saturating_sub(rows.start)),
        }
    }

    /// The predicted work of rows that are traced by themselves: cut bands included.
    pub(super) fn work(&self, rows: Range<u32>) -> f64 {
        let plain = self.plain(rows.clone());
        if rows.is_empty() {
            return plain;
        }
        let bands = [rows.start / self.tiles.rows, (rows.end - 1) / self.tiles.rows];
        let last = if bands[0] == bands[1] { 1 } else { 2 };
        plain + bands[..last].iter().map(|&band| self.cutting(band, &rows)).sum::<f64>()
    }

    /// What a band costs more because only these of its rows are traced together.
    fn cutting(&self, band: u32, rows: &Range<u32>) -> f64 {
        let height = self.rows.len().max(rows.end as usize) as u32;
        let (first, end) = (band * self.tiles.rows, ((band + 1) * self.tiles.rows).min(height));
        let traced = rows.end.min(end).saturating_sub(rows.start.max(first));
        let left_out = 1.0 - f64::from(traced) / f64::from((end - first).max(1));
        self.tiles.share * left_out * self.plain(first..end)
    }

    /// The work of the most expensive band of tiles among rows: no number of threads is faster than one of them.
    pub(super) fn longest_band(&self, rows: Range<u32>) -> f64 {
        let mut first = rows.start;
        let mut longest = 0.0_f64;
        while first < rows.end {
            let end = (first + 1).next_multiple_of(self.tiles.rows).min(rows.end);
            longest = longest.max(self.work(first..end));
            first = end;
        }
        longest
    }

    /// How many rows from `first` on make up `work`; at least one, at most `limit`.
    pub(super) fn rows_for(&self, first: u32, limit: u32, work: f64) -> u32 {
        let (mut low, mut high) = (limit.min(1), limit);
        while low < high {
            let middle = low + (high - low) / 2;
            if self.plain(first..first + middle) < work { low = middle + 1 } else { high = middle }
        }
        low
    }

    /// Learns what a segment took: `work` on the scale on which it was predicted. It counts for later frames.
    pub(super) fn learn(&mut self, rows: Range<u32>, work: f64) {
        let ratio = work / self.work(rows.clone());
        let even = ratio * self.plain(rows.clone()) / f64::from(rows.len().max(1) as u32);
        if !ratio.is_finite() || !even.is_finite() {
            return;
        }
        let costs = self.rows.iter().zip(&mut self.seen);
        for (cost, seen) in costs.take(rows.end as usize).skip(rows.start as usize) {
            *seen = Some(EVEN * even + (1.0 - EVEN) * ratio * *cost);
        }
    }

    /// What every row cost, as far as that was seen; else what it was expected to.
    pub(super) fn observed(&self) -> Vec<f64> {
        self.rows.iter().zip(&self.seen).map(|(expected, seen)| seen.unwrap_or(*expected)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn forecast(rows: Vec<f64>, share: f64) -> Forecast {
        Forecast::new(rows, Tiles { rows: 16, share })
    }

    #[test]
    fn cut_tiles_cost_more_than_whole_ones() {
        let forecast = forecast(vec![1.0; 64], 0.4);
        assert_eq!(forecast.work(16..48), 32.0);
        assert!((forecast.work(16..24) - (8.0 + 0.4 * 0.5 * 16.0)).abs() < 1e-9);
        assert!((forecast.work(8..24) - (16.0 + 2.0 * 0.4 * 0.5 * 16.0)).abs() < 1e-9);
        assert!((forecast.longest_band(8..40) - 16.0).abs() < 1e-9);
    }

    #[test]
    fn at_least_one_row_and_never_beyond_the_limit() {
        let forecast = forecast(vec![1.0; 8], 0.0);
        assert_eq!(forecast.rows_for(0, 5, 0.0), 1);
        assert_eq!(forecast.rows_for(0, 5, f64::INFINITY), 5);
        assert_eq!(forecast.rows_for(0, 0, 9.0), 0);
        assert_eq!(forecast.rows_for(3, 5, 3.5), 4);
    }

    #[test]
    fn what_was_seen_lies_half_evenly_over_a_segment() {
        let mut forecast = forecast(vec![1.0, 3.0, 1.0], 0.0);
        forecast.learn(0..2, 8.0);
        assert_eq!(forecast.observed(), [3.0, 5.0, 1.0]);
        assert_eq!(forecast.work(0..2), 4.0, "it counts for later frames");
    }

    #[test]
    fn rows_that_nobody_knows_are_average() {
        assert_eq!(forecast(Vec::new(), 0.3).work(16..32), 16.0);
    }
}
