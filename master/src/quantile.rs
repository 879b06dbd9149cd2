//! Quantiles and rounding of times.

use std::time::Duration;

/// The quantile `share` (0..=1) of sorted values, interpolated between neighbours; zero for an empty slice.
pub(crate) fn percentile(sorted: &[Duration], share: f64) -> Duration {
    let Some(last) = sorted.len().checked_sub(1) else { return Duration::ZERO };
    let place = share.clamp(0.0, 1.0) * last as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (sorted[above] - sorted[below]).mul_f64(place - below as f64)
}

/// Time in milliseconds, rounded to microseconds.
pub(crate) fn round_to_us(time: Duration) -> f64 {
    (time.as_secs_f64() * 1e6).round() / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(values: &[u64]) -> Vec<Duration> {
        values.iter().copied().map(Duration::from_millis).collect()
    }

    #[test]
    fn percentiles_interpolate() {
        let sorted = ms(&[10, 20, 30, 40]);
        assert_eq!(percentile(&sorted, 0.0), Duration::from_millis(10));
        assert_eq!(percentile(&sorted, 0.5), Duration::from_millis(25));
        assert_eq!(percentile(&sorted, 1.0), Duration::from_millis(40));
        assert_eq!(percentile(&sorted, 7.0), Duration::from_millis(40));
        assert_eq!(percentile(&[], 0.5), Duration::ZERO);
        assert_eq!(percentile(&ms(&[3]), 0.95), Duration::from_millis(3));
    }
}
