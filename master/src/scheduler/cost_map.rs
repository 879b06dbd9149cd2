//! What each row of the picture cost last time: the prediction of the policy `adaptive`.
//!
//! Work is counted in rows of average cost, so a speed is average rows a second and means the same from frame to
//! frame. Only ratios between rows matter.

use std::ops::Range;

/// How much of a row's cost the newest frame decides.
const NEWEST: f64 = 0.5;
/// No row is predicted to cost less than this share of the average: empty rows still travel.
const CHEAPEST: f64 = 0.02;

/// Predicted work per row; 1 on average.
#[derive(Debug, Default)]
pub(super) struct CostMap {
    rows: Vec<f64>,
}

impl CostMap {
    /// The predicted work of a row; 1 where nothing is known.
    fn row(&self, row: u32) -> f64 {
        self.rows.get(row as usize).copied().unwrap_or(1.0)
    }

    /// The predicted work of rows.
    pub(super) fn work(&self, rows: Range<u32>) -> f64 {
        rows.map(|row| self.row(row)).sum()
    }

    /// How many rows from `first` on make up `work`; at least one, at most `limit`.
    pub(super) fn rows_for(&self, first: u32, limit: u32, work: f64) -> u32 {
        let mut left = work;
        let mut rows = 0;
        while rows < limit && (rows == 0 || left > 0.0) {
            left -= self.row(first + rows);
            rows += 1;
        }
        rows
    }

    /// Stretches what is known to a picture of `height` rows.
    pub(super) fn resize(&mut self, height: u32) {
        let known = self.rows.len();
        if known == height as usize {
            return;
        }
        let stretched = (0..height as usize).map(|row| self.rows.get(row * known / height as usize).copied());
        self.rows = stretched.map(|cost| cost.unwrap_or(1.0)).collect();
    }

    /// Learns what a segment took: `work` on the scale on which it was predicted.
    pub(super) fn learn(&mut self, rows: Range<u32>, work: f64) {
        let each = work / f64::from(rows.len().max(1) as u32);
        if !each.is_finite() {
            return;
        }
        for cost in self.rows.iter_mut().take(rows.end as usize).skip(rows.start as usize) {
            *cost += NEWEST * (each - *cost);
        }
    }

    /// Scales the average back to 1; done once a frame, so that predictions within it stay comparable.
    pub(super) fn normalise(&mut self) {
        let sum: f64 = self.rows.iter().sum();
        if sum > 0.0 {
            let scale = self.rows.len() as f64 / sum;
            self.rows.iter_mut().for_each(|cost| *cost = (*cost * scale).max(CHEAPEST));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_rows_are_average() {
        let map = CostMap::default();
        assert_eq!(map.work(3..11), 8.0);
        assert_eq!(map.rows_for(3, 100, 7.5), 8);
    }

    #[test]
    fn expensive_rows_make_short_segments() {
        let mut map = CostMap::default();
        map.resize(100);
        for _ in 0..20 {
            map.learn(0..50, 150.0);
            map.learn(50..100, 50.0);
            map.normalise();
        }
        assert!((map.work(0..50) / map.work(50..100) - 3.0).abs() < 0.01);
        assert!(map.rows_for(0, 50, 15.0) * 2 < map.rows_for(50, 50, 15.0));
        assert!((map.work(0..100) - 100.0).abs() < 1e-6);
    }

    #[test]
    fn a_new_height_keeps_the_shape() {
        let mut map = CostMap::default();
        map.resize(2);
        map.learn(0..1, 5.0);
        map.resize(8);
        assert_eq!(map.row(3), 3.0);
        assert_eq!(map.row(4), 1.0);
        map.resize(0);
        assert_eq!(map.work(0..4), 4.0);
    }

    #[test]
    fn at_least_one_row_and_never_beyond_the_limit() {
        let map = CostMap::default();
        assert_eq!(map.rows_for(0, 5, 0.0), 1);
        assert_eq!(map.rows_for(0, 5, f64::INFINITY), 5);
        assert_eq!(map.rows_for(0, 0, 9.0), 0);
    }
}
