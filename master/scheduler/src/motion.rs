//! Vertical motion of row costs between frames: a tilting camera moves expensive rows.

/// Largest motion per frame that is searched, as a share of the picture's height.
const MAX_SHIFT: f64 = 1.0 / 8.0;
/// A motion is accepted where the remaining difference is at most this share of the difference without motion: noise
/// alone is not motion.
const MAX_RESIDUAL: f64 = 0.7;
/// Rows per sample of the coarse search.
const COARSE: usize = 4;

/// Number of rows by which `after` is `before` moved down; 0 if no motion explains the difference.
pub(super) fn motion(before: &[f64], after: &[f64]) -> isize {
    let rows = before.len();
    if rows != after.len() || rows < 2 * COARSE {
        return 0;
    }
    let max_shift = (rows as f64 * MAX_SHIFT) as isize;
    let coarse = |costs: &[f64]| -> Vec<f64> {
        costs.chunks(COARSE).map(|rows| rows.iter().sum::<f64>() / rows.len() as f64).collect()
    };
    let (small_before, small_after) = (coarse(before), coarse(after));
    let reach = max_shift / COARSE as isize;
    let near = best(&small_before, &small_after, -reach..=reach) * COARSE as isize;
    let found = best(before, after, near - COARSE as isize..=near + COARSE as isize);
    let is_motion = difference(before, after, found) <= MAX_RESIDUAL * difference(before, after, 0);
    if is_motion { found } else { 0 }
}

/// `costs` moved down by `by` rows; rows that enter the picture repeat the edge.
pub(super) fn moved(costs: &[f64], by: isize) -> Vec<f64> {
    let last = costs.len().saturating_sub(1) as isize;
    let from = |row: isize| costs.get((row - by).clamp(0, last) as usize).copied().unwrap_or(1.0);
    (0..costs.len() as isize).map(from).collect()
}

fn best(before: &[f64], after: &[f64], tried: std::ops::RangeInclusive<isize>) -> isize {
    let differences = tried.map(|by| (difference(before, after, by), by));
    let least = differences.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.abs().cmp(&b.1.abs())));
    least.map_or(0, |(_, by)| by)
}

/// Mean absolute difference of the rows that overlap after moving `before`.
fn difference(before: &[f64], after: &[f64], by: isize) -> f64 {
    let skip = by.unsigned_abs().min(before.len());
    let (before, after) = if by >= 0 {
        (&before[..before.len() - skip], &after[skip..])
    } else {
        (&before[skip..], &after[..after.len() - skip])
    };
    let sum: f64 = before.iter().zip(after).map(|(before, after)| (before - after).abs()).sum();
    sum / before.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn hill(rows: usize, centre: f64) -> Vec<f64> {
        let cost = |row: usize| 1.0 + 20.0 * (-0.5 * ((row as f64 - centre) / 46.0).powi(2)).exp();
        (0..rows).map(cost).collect()
    }

    proptest! {
        #[test]
        fn a_moving_hill_is_followed(centre in 150.0..600.0, by in -90..=90_i32) {
            let found = motion(&hill(768, centre), &hill(768, centre + f64::from(by)));
            prop_assert!((found - by as isize).abs() <= 1, "{found}");
        }

        #[test]
        fn noise_is_not_motion(noise in prop::collection::vec(0.9..1.1, 768), centre in 0.0..768.0) {
            let before = hill(768, centre);
            let after: Vec<f64> = before.iter().zip(noise).map(|(cost, noise)| cost * noise).collect();
            prop_assert_eq!(motion(&before, &after), 0);
        }

        #[test]
        fn any_costs_are_accepted(before in prop::collection::vec(0.0..9.0, 0..60), after in prop::collection::vec(0.0..9.0, 0..60)) {
            let by = motion(&before, &after);
            prop_assert_eq!(moved(&before, by).len(), before.len());
        }
    }

    #[test]
    fn rows_that_enter_repeat_the_edge() {
        assert_eq!(moved(&[1.0, 2.0, 3.0], 1), [1.0, 1.0, 2.0]);
        assert_eq!(moved(&[1.0, 2.0, 3.0], -2), [3.0, 3.0, 3.0]);
        assert!(moved(&[], 2).is_empty());
    }
}
