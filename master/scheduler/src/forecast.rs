//! Predicted and observed cost of one frame's rows.
//!
//! The unit of work is a row of average cost, so the unit of speed is average rows per second in every frame. Only
//! ratios between rows matter.

use std::ops::Range;

/// Share of a segment's observed cost that is spread evenly over its rows; the rest follows the prediction.
const EVEN_SHARE: f64 = 0.5;

/// Tile bands, in which workers trace rows. Rays of a band share their traversal, so cutting a band adds cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tiles {
    /// Rows of a band; bands begin at multiples of it.
    pub(super) rows: u32,
    /// The part of a band's cost that does not depend on how many of its rows are traced, 0 to 1.
    pub(super) share: f64,
}

/// Predicted work of each row of one frame, 1 on average; made when the frame begins.
#[derive(Debug)]
pub(super) struct Forecast {
    rows: Vec<f64>,
    /// Prefix sums of `rows`.
    sums: Vec<f64>,
    /// Observed work of each row, where a segment has reported it.
    observed: Vec<Option<f64>>,
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
        Self {
            sums,
            observed: vec![None; rows.len()],
            rows,
            tiles: Tiles { rows: tiles.rows.max(1), ..tiles },
        }
    }

    /// Predicted work of rows without the cost of cut bands.
    fn uncut_work(&self, rows: Range<u32>) -> f64 {
        match (self.sums.get(rows.start as usize), self.sums.get(rows.end as usize)) {
            (Some(before), Some(after)) => after - before,
            _ => f64::from(rows.end.saturating_sub(rows.start)),
        }
    }

    /// Predicted work of rows that are traced as one lease, with the cost of cut bands.
    pub(super) fn work(&self, rows: Range<u32>) -> f64 {
        let uncut = self.uncut_work(rows.clone());
        if rows.is_empty() {
            return uncut;
        }
        let bands = [rows.start / self.tiles.rows, (rows.end - 1) / self.tiles.rows];
        let last = if bands[0] == bands[1] { 1 } else { 2 };
        uncut + bands[..last].iter().map(|&band| self.cut_cost(band, &rows)).sum::<f64>()
    }

    /// Cost that is added to a band because only some of its rows are traced together.
    fn cut_cost(&self, band: u32, rows: &Range<u32>) -> f64 {
        let height = self.rows.len().max(rows.end as usize) as u32;
        let (first, end) = (band * self.tiles.rows, ((band + 1) * self.tiles.rows).min(height));
        let traced = rows.end.min(end).saturating_sub(rows.start.max(first));
        let left_out = 1.0 - f64::from(traced) / f64::from((end - first).max(1));
        self.tiles.share * left_out * self.uncut_work(first..end)
    }

    /// Work of the most expensive band among rows. One thread traces a band, so no number of threads is faster.
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

    /// Number of rows from `first` on whose work is at least `work`; 1 to `limit`.
    pub(super) fn rows_for(&self, first: u32, limit: u32, work: f64) -> u32 {
        let (mut low, mut high) = (limit.min(1), limit);
        while low < high {
            let middle = low + (high - low) / 2;
            if self.uncut_work(first..first + middle) < work { low = middle + 1 } else { high = middle }
        }
        low
    }

    /// Records the actual work of a segment, on the scale of the prediction. Later frames use it, this one does not.
    pub(super) fn learn(&mut self, rows: Range<u32>, work: f64) {
        let ratio = work / self.work(rows.clone());
        let even = ratio * self.uncut_work(rows.clone()) / f64::from(rows.len().max(1) as u32);
        if !ratio.is_finite() || !even.is_finite() {
            return;
        }
        let costs = self.rows.iter().zip(&mut self.observed);
        for (cost, observed) in costs.take(rows.end as usize).skip(rows.start as usize) {
            *observed = Some(EVEN_SHARE * even + (1.0 - EVEN_SHARE) * ratio * *cost);
        }
    }

    /// Observed work of every row; predicted work where none was observed.
    pub(super) fn observed(&self) -> Vec<f64> {
        self.rows
            .iter()
            .zip(&self.observed)
            .map(|(expected, observed)| observed.unwrap_or(*expected))
            .collect()
    }
}

/// Predicted load of a lease.
#[derive(Clone, Copy, Debug)]
pub(super) struct Load {
    pub(super) work: f64,
    /// Work of the most expensive band among its rows.
    pub(super) longest_band: f64,
    /// Tile bands.
    pub(super) bands: u32,
}

impl Load {
    pub(super) fn of(forecast: &Forecast, rows: Range<u32>) -> Self {
        let bands = (rows.len() as u32).div_ceil(forecast.tiles.rows);
        Self { work: forecast.work(rows.clone()), longest_band: forecast.longest_band(rows), bands }
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
    fn rows_for_work_are_at_least_one_and_at_most_the_limit() {
        let forecast = forecast(vec![1.0; 8], 0.0);
        assert_eq!(forecast.rows_for(0, 5, 0.0), 1);
        assert_eq!(forecast.rows_for(0, 5, f64::INFINITY), 5);
        assert_eq!(forecast.rows_for(0, 0, 9.0), 0);
        assert_eq!(forecast.rows_for(3, 5, 3.5), 4);
    }

    #[test]
    fn half_of_the_observed_work_is_spread_evenly() {
        let mut forecast = forecast(vec![1.0, 3.0, 1.0], 0.0);
        forecast.learn(0..2, 8.0);
        assert_eq!(forecast.observed(), [3.0, 5.0, 1.0]);
        assert_eq!(forecast.work(0..2), 4.0, "this frame keeps its prediction");
    }

    #[test]
    fn unknown_rows_are_average() {
        assert_eq!(forecast(Vec::new(), 0.3).work(16..32), 16.0);
    }
}
