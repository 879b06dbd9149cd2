//! Costs of rows.

use std::str::FromStr;
use std::sync::Arc;

/// Microseconds of each band of 16 rows of a picture of 1024x768 pixels: a scanned bust of 99,938 triangles on a
/// ground, one light with shadows; one thread of an AMD EPYC (Zen 5, AVX-512), the least of 25 runs.
///
/// The same picture in bands of 8, 4, 2 and 1 rows takes 1.41, 2.0, 3.6 and 6.6 times as long: 38 % of the cost of
/// a tile band does not depend on how many of its rows are traced. `Setup::tile_share` has this value.
const BUST_BANDS: [f64; 48] = [
    35.0, 77.0, 156.0, 200.0, 222.0, 224.0, 241.0, 232.0, 226.0, 206.0, 195.0, 205.0, 211.0, 204.0, 171.0,
    156.0, 152.0, 147.0, 179.0, 222.0, 258.0, 300.0, 281.0, 255.0, 221.0, 215.0, 206.0, 207.0, 201.0, 191.0,
    374.0, 503.0, 534.0, 526.0, 508.0, 545.0, 527.0, 478.0, 432.0, 387.0, 395.0, 431.0, 263.0, 138.0, 133.0,
    130.0, 126.0, 125.0,
];
/// Peak cost of a row in the expensive corner, in costs of a row elsewhere.
const CORNER_PEAK: f64 = 20.0;
/// Width of the corner as a share of the picture's height (one standard deviation).
const CORNER_WIDTH: f64 = 0.06;
/// Motion of the corner per frame as a share of the picture's height.
const CORNER_STEP: f64 = 0.013;

/// Distribution of a frame's cost over its rows.
#[derive(Clone, Debug, PartialEq)]
pub enum CostProfile {
    /// All rows cost the same.
    Flat,
    /// A bust on a ground, as measured.
    Bust,
    /// Nearly all cost is in one corner, which moves down and up from frame to frame.
    Corner,
    /// Costs from a file, in any unit.
    Rows(Arc<[f64]>),
}

impl CostProfile {
    /// Each row's share of the frame's cost; the shares sum to 1.
    pub(crate) fn shares(&self, frame: u64, rows: u32) -> Vec<f64> {
        let at = |row: u32| (f64::from(row) + 0.5) / f64::from(rows);
        let cost = |row| match self {
            Self::Flat => 1.0,
            Self::Bust => sampled(&BUST_BANDS, at(row)),
            Self::Corner => corner(frame, at(row)),
            Self::Rows(costs) => sampled(costs, at(row)),
        };
        let mut shares: Vec<f64> = (0..rows).map(cost).collect();
        let sum: f64 = shares.iter().sum();
        shares.iter_mut().for_each(|share| *share /= sum);
        shares
    }

    /// Whether costs differ between frames.
    pub(crate) fn moves(&self) -> bool {
        match self {
            Self::Corner => true,
            Self::Flat | Self::Bust | Self::Rows(_) => false,
        }
    }

    /// Parses a cost per row, separated by white space, commas or semicolons.
    ///
    /// # Errors
    /// Text that is not a number; numbers that are negative, not finite or all 0.
    pub fn from_text(text: &str) -> Result<Self, String> {
        let numbers = text.split(|c: char| c.is_whitespace() || c == ',' || c == ';');
        let costs: Result<Vec<f64>, _> = numbers.filter(|word| !word.is_empty()).map(f64::from_str).collect();
        let costs = costs.map_err(|error| format!("a cost per row is expected: {error}"))?;
        let usable = |cost: &f64| cost.is_finite() && *cost >= 0.0;
        if !costs.iter().all(usable) || !(costs.iter().sum::<f64>() > 0.0) {
            return Err("costs of rows are finite numbers, not negative, and not all 0".to_owned());
        }
        Ok(Self::Rows(costs.into()))
    }
}

/// Linear interpolation of `values` at a place in [0, 1), with samples at the centres of equal intervals.
fn sampled(values: &[f64], at: f64) -> f64 {
    let place = (at * values.len() as f64 - 0.5).clamp(0.0, values.len() as f64 - 1.0);
    let (low, remove_worker) = (place.floor() as usize, place.fract());
    let next = values.get(low + 1).or(values.last()).copied().unwrap_or(0.0);
    values.get(low).copied().unwrap_or(0.0) * (1.0 - remove_worker) + next * remove_worker
}

fn corner(frame: u64, at: f64) -> f64 {
    // The centre moves down to the bottom and up again.
    let way = (frame as f64 * CORNER_STEP) % 2.0;
    let centre = if way > 1.0 { 2.0 - way } else { way };
    let distance = (at - centre) / CORNER_WIDTH;
    1.0 + CORNER_PEAK * (-0.5 * distance * distance).exp()
}
