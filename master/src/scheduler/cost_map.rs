//! What each row of the picture cost last time: the prediction of the policy `adaptive`.
//!
//! Work is counted in rows of average cost, so a speed is average rows a second and means the same from frame to
//! frame. Only ratios between rows matter.

use std::ops::Range;

/// How much of a row's cost the newest frame decides.
const NEWEST: f64 = 0.85;
/// How much of a segment's cost is taken to lie evenly over its rows, and not as was known before.
const EVEN: f64 = 0.5;
/// No row is predicted to cost less than this share of the average: empty rows still travel.
const CHEAPEST: f64 = 0.02;

/// Predicted work per row; 1 on average. Cutting a band of tiles costs: its rays share what they look at.
#[derive(Debug)]
pub(super) struct CostMap {
    rows: Vec<f64>,
    /// Sums of `rows`: work of the rows before each.
    sums: Vec<f64>,
    /// What the frames in flight have told so far.
    seen: Vec<Option<f64>>,
    tile_rows: u32,
    /// What a band of a tile's height costs however few of its rows are traced, as a share of the whole.
    tile_share: f64,
}

impl CostMap {
    pub(super) fn new(tile_rows: u32, tile_share: f64) -> Self {
        Self { rows: Vec::new(), sums: vec![0.0], seen: Vec::new(), tile_rows: tile_rows.max(1), tile_share }
    }

    /// The predicted work of whole rows; 1 each where nothing is known.
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
        let bands = [rows.start / self.tile_rows, (rows.end - 1) / self.tile_rows];
        let last = if bands[0] == bands[1] { 1 } else { 2 };
        plain + bands[..last].iter().map(|&band| self.cutting(band, &rows)).sum::<f64>()
    }

    /// What a band costs more because only these of its rows are traced together.
    fn cutting(&self, band: u32, rows: &Range<u32>) -> f64 {
        let height = self.rows.len().max(rows.end as usize) as u32;
        let (first, end) = (band * self.tile_rows, ((band + 1) * self.tile_rows).min(height));
        let traced = rows.end.min(end).saturating_sub(rows.start.max(first));
        let left_out = 1.0 - f64::from(traced) / f64::from((end - first).max(1));
        self.tile_share * left_out * self.plain(first..end)
    }

    /// The work of the most expensive band of tiles among rows: no number of threads is faster than one of them.
    pub(super) fn longest_band(&self, rows: Range<u32>) -> f64 {
        let mut first = rows.start;
        let mut longest = 0.0_f64;
        while first < rows.end {
            let end = (first + 1).next_multiple_of(self.tile_rows).min(rows.end);
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

    /// Stretches what is known to a picture of `height` rows.
    pub(super) fn resize(&mut self, height: u32) {
        let known = self.rows.len();
        if known == height as usize {
            return;
        }
        let stretched = (0..height as usize).map(|row| self.rows.get(row * known / height as usize).copied());
        self.rows = stretched.map(|cost| cost.unwrap_or(1.0)).collect();
        self.seen = vec![None; height as usize];
        self.sum_up();
    }

    /// Learns what a segment took: `work` on the scale on which it was predicted. It counts from the next frame on.
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

    /// A frame is complete: what was seen counts now, scaled so that the average row costs 1.
    pub(super) fn fold(&mut self) {
        let mut now = self.rows.clone();
        for (cost, seen) in now.iter_mut().zip(&mut self.seen) {
            *cost = seen.take().unwrap_or(*cost);
        }
        scale(&mut now);
        for (cost, now) in self.rows.iter_mut().zip(&now) {
            *cost += NEWEST * (now - *cost);
        }
        scale(&mut self.rows);
        self.sum_up();
    }

    fn sum_up(&mut self) {
        let mut sum = 0.0;
        self.sums.clear();
        self.sums.push(0.0);
        self.sums.extend(self.rows.iter().map(|cost| {
            sum += cost;
            sum
        }));
    }
}

/// Makes the average 1, and the cheapest rows not cheaper than they can be.
fn scale(rows: &mut [f64]) {
    let sum: f64 = rows.iter().sum();
    if sum > 0.0 {
        let scale = rows.len() as f64 / sum;
        rows.iter_mut().for_each(|cost| *cost = (*cost * scale).max(CHEAPEST));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(height: u32) -> CostMap {
        let mut map = CostMap::new(16, 0.0);
        map.resize(height);
        map
    }

    #[test]
    fn unknown_rows_are_average() {
        let map = CostMap::new(16, 0.0);
        assert_eq!(map.work(3..11), 8.0);
        assert_eq!(map.rows_for(3, 100, 7.5), 8);
    }

    #[test]
    fn expensive_rows_make_short_segments() {
        let mut map = map(100);
        for _ in 0..20 {
            map.learn(0..50, 150.0 * map.work(0..100) / 100.0);
            map.learn(50..100, 50.0);
            map.fold();
        }
        assert!((map.work(0..50) / map.work(50..100) - 3.0).abs() < 0.01);
        assert!(map.rows_for(0, 50, 15.0) * 2 < map.rows_for(50, 50, 15.0));
        assert!((map.work(0..100) - 100.0).abs() < 1e-6);
    }

    #[test]
    fn what_a_frame_tells_counts_from_the_next_one_on() {
        let mut map = map(4);
        map.learn(0..2, 6.0);
        assert_eq!(map.work(0..2), 2.0);
        map.fold();
        assert!(map.work(0..2) > 2.5);
    }

    #[test]
    fn a_new_height_keeps_the_shape() {
        let mut map = map(2);
        map.learn(0..1, 5.0);
        map.fold();
        let ratio = map.work(0..1) / map.work(1..2);
        map.resize(8);
        assert!((map.work(3..4) / map.work(4..5) - ratio).abs() < 1e-9);
        map.resize(0);
        assert_eq!(map.work(0..4), 4.0);
    }

    #[test]
    fn cut_tiles_cost_more_than_whole_ones() {
        let mut map = CostMap::new(16, 0.4);
        map.resize(64);
        assert_eq!(map.work(16..48), 32.0);
        assert!((map.work(16..24) - (8.0 + 0.4 * 0.5 * 16.0)).abs() < 1e-9);
        assert!((map.work(8..24) - (16.0 + 2.0 * 0.4 * 0.5 * 16.0)).abs() < 1e-9);
        assert!((map.longest_band(8..40) - 16.0).abs() < 1e-9);
    }

    #[test]
    fn at_least_one_row_and_never_beyond_the_limit() {
        let map = CostMap::new(16, 0.0);
        assert_eq!(map.rows_for(0, 5, 0.0), 1);
        assert_eq!(map.rows_for(0, 5, f64::INFINITY), 5);
        assert_eq!(map.rows_for(0, 0, 9.0), 0);
    }
}
