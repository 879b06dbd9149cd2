//! Costs of rows in the last frames and their motion: the source of the forecasts of the policy `adaptive`.

use super::forecast::{Forecast, Tiles};
use super::motion::{motion, moved};

/// Weight of the newest frame in a row's cost (exponential moving average).
const NEWEST_WEIGHT: f64 = 0.85;
/// Lower bound of a row's predicted cost, as a share of the average: empty rows still take time on the wire.
const MIN_COST: f64 = 0.02;

/// Work per row as of the last complete frame; 1 on average.
#[derive(Debug, Default)]
pub(super) struct CostMap {
    rows: Vec<f64>,
    /// Observed costs of the last complete frame.
    last: Vec<f64>,
    /// Rows by which costs move down per frame.
    velocity: isize,
}

impl CostMap {
    /// Forecast for a frame of `height` rows, `ahead` frames after the last complete one.
    pub(super) fn forecast(&mut self, height: u32, ahead: usize, tiles: Tiles) -> Forecast {
        self.resize(height as usize);
        Forecast::new(moved(&self.rows, self.velocity.saturating_mul(ahead as isize)), tiles)
    }

    /// Resamples the known costs to a picture of `height` rows.
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

    /// Learns the observed costs of a complete frame, scaled so that the average row costs 1.
    pub(super) fn learn(&mut self, frame: &Forecast) {
        let mut now = frame.observed();
        if now.len() != self.rows.len() {
            return;
        }
        scale(&mut now);
        self.velocity = motion(&self.last, &now);
        let before = moved(&self.rows, self.velocity);
        self.rows =
            before.iter().zip(&now).map(|(before, now)| before + NEWEST_WEIGHT * (now - before)).collect();
        scale(&mut self.rows);
        self.last = now;
    }
}

/// Scales costs to an average of 1 and applies the lower bound.
fn scale(rows: &mut [f64]) {
    let sum: f64 = rows.iter().sum();
    if sum > 0.0 {
        let scale = rows.len() as f64 / sum;
        rows.iter_mut().for_each(|cost| *cost = (*cost * scale).max(MIN_COST));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TILES: Tiles = Tiles { rows: 16, share: 0.0 };

    /// A map that has learned `frames` frames, whose rows cost `cost(frame, row)`.
    fn learned(height: u32, frames: u32, cost: impl Fn(u32, u32) -> f64) -> CostMap {
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
    fn expensive_rows_are_predicted_again() {
        let forecast = learned(100, 20, |_, row| if row < 50 { 3.0 } else { 1.0 }).forecast(100, 1, TILES);
        assert!((forecast.work(0..50) / forecast.work(50..100) - 3.0).abs() < 0.01);
        assert!(forecast.rows_for(0, 50, 15.0) * 2 < forecast.rows_for(50, 50, 15.0));
        assert!((forecast.work(0..100) - 100.0).abs() < 1e-6);
    }

    #[test]
    fn moving_costs_are_extrapolated() {
        let hill = |frame: u32, row: u32| {
            let from_centre = f64::from(row) - 150.0 - 10.0 * f64::from(frame);
            1.0 + 20.0 * (-0.5 * (from_centre / 46.0).powi(2)).exp()
        };
        let mut map = learned(768, 12, hill);
        for ahead in 1..=2 {
            let forecast = map.forecast(768, ahead, TILES);
            let most_expensive =
                (0..768).max_by(|&a, &b| forecast.work(a..a + 1).total_cmp(&forecast.work(b..b + 1)));
            let expected = 150 + 10 * (11 + ahead as u32);
            assert!(
                most_expensive.is_some_and(|row| row.abs_diff(expected) <= 3),
                "{most_expensive:?}, not {expected}"
            );
        }
    }

    #[test]
    fn a_new_height_keeps_the_shape() {
        let mut map = learned(2, 1, |_, row| if row == 0 { 5.0 } else { 1.0 });
        let ratio = |forecast: &Forecast, a: u32, b: u32| forecast.work(a..a + 1) / forecast.work(b..b + 1);
        let before = ratio(&map.forecast(2, 1, TILES), 0, 1);
        assert!((ratio(&map.forecast(8, 1, TILES), 3, 4) - before).abs() < 1e-9);
        assert_eq!(map.forecast(0, 1, TILES).work(0..4), 4.0);
    }
}
