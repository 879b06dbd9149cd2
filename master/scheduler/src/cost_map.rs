//! What rows cost in the last frames, and where that is going: the source of the forecasts of the policy `adaptive`.

use super::forecast::{Forecast, Tiles};
use super::motion::{motion, moved};

/// How much of a row's cost the newest frame decides.
const NEWEST: f64 = 0.85;
/// No row is predicted to cost less than this share of the average: empty rows still travel.
const CHEAPEST: f64 = 0.02;

/// Work per row as of the last complete frame; 1 on average.
#[derive(Debug, Default)]
pub(super) struct CostMap {
    rows: Vec<f64>,
    /// What the last complete frame was seen to cost.
    last: Vec<f64>,
    /// By how many rows costs move down from frame to frame.
    velocity: isize,
}

impl CostMap {
    /// What a frame of `height` rows is expected to cost that comes `ahead` frames after the last complete one.
    pub(super) fn forecast(&mut self, height: u32, ahead: usize, tiles: Tiles) -> Forecast {
        self.resize(height as usize);
        Forecast::new(moved(&self.rows, self.velocity.saturating_mul(ahead as isize)), tiles)
    }

    /// Stretches what is known to a picture of `height` rows.
    fn resize(&mut self, height: usize) {
        let known = self.rows.len();
        if known == height {
            return;
        }
        let stretched = (0..height).map(|row| self.rows.get(row * known / height.max(1)).copied());
        self.rows = stretched.map(|cost| cost.unwrap_or(1.0)).collect();
        self.last.clear();
        self.velocity = 0;
    }

    /// A frame is complete: what was seen counts now, scaled so that the average row costs 1.
    pub(super) fn learn(&mut self, frame: &Forecast) {
        let mut now = frame.observed();
        if now.len() != self.rows.len() {
            return;
        }
        scale(&mut now);
        self.velocity = motion(&self.last, &now);
        let before = moved(&self.rows, self.velocity);
        self.rows = before.iter().zip(&now).map(|(before, now)| before + NEWEST * (now - before)).collect();
        scale(&mut self.rows);
        self.last = now;
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

    const TILES: Tiles = Tiles { rows: 16, share: 0.0 };

    /// Lets frames complete that cost, per row, what `cost` says of the frame and the row.
    fn taught(height: u32, frames: u32, cost: impl Fn(u32, u32) -> f64) -> CostMap {
        let mut map = CostMap::default();
        for frame in 0..frames {
            let mut forecast = map.forecast(height, 1, TILES);
            for row in 0..height {
                forecast.learn(row..row + 1, cost(frame, row));
            }
            map.learn(&forecast);
        }
        map
    }

    #[test]
    fn expensive_rows_are_expected_again() {
        let forecast = taught(100, 20, |_, row| if row < 50 { 3.0 } else { 1.0 }).forecast(100, 1, TILES);
        assert!((forecast.work(0..50) / forecast.work(50..100) - 3.0).abs() < 0.01);
        assert!(forecast.rows_for(0, 50, 15.0) * 2 < forecast.rows_for(50, 50, 15.0));
        assert!((forecast.work(0..100) - 100.0).abs() < 1e-6);
    }

    #[test]
    fn costs_that_move_are_expected_farther_on() {
        let hill = |frame: u32, row: u32| {
            let from_centre = f64::from(row) - 150.0 - 10.0 * f64::from(frame);
            1.0 + 20.0 * (-0.5 * (from_centre / 46.0).powi(2)).exp()
        };
        let mut map = taught(768, 12, hill);
        for ahead in 1..=2 {
            let forecast = map.forecast(768, ahead, TILES);
            let dearest =
                (0..768).max_by(|&a, &b| forecast.work(a..a + 1).total_cmp(&forecast.work(b..b + 1)));
            let expected = 150 + 10 * (11 + ahead as u32);
            assert!(dearest.is_some_and(|row| row.abs_diff(expected) <= 3), "{dearest:?}, not {expected}");
        }
    }

    #[test]
    fn a_new_height_keeps_the_shape() {
        let mut map = taught(2, 1, |_, row| if row == 0 { 5.0 } else { 1.0 });
        let ratio = |forecast: &Forecast, a: u32, b: u32| forecast.work(a..a + 1) / forecast.work(b..b + 1);
        let before = ratio(&map.forecast(2, 1, TILES), 0, 1);
        assert!((ratio(&map.forecast(8, 1, TILES), 3, 4) - before).abs() < 1e-9);
        assert_eq!(map.forecast(0, 1, TILES).work(0..4), 4.0);
    }
}
