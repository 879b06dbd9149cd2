//! Extrapolation to scales of a third and a quarter, where only larger ones were measured.
//!
//! The time of a frame falls with the same power of the scale as from the whole to a half. The error grows with the width of
//! a rendered pixel at the same slope as from three quarters to a half. That overstates it: in all tables of
//! `models/tradeoff` the slope decreases with the scale.

use rayfarm_tracer::scene::RenderScale;

/// Cost and loss at a scale, extrapolated from those at the whole, three quarters and a half.
pub(crate) fn continued(known: [(f64, f64); 3], scale: RenderScale) -> (f64, f64) {
    let [(full, _), (_, three_quarters_lost), (half, half_lost)] = known;
    let factor = scale.factor();
    let power = (half / full).ln() / RenderScale::Half.factor().ln();
    let width = |scale: RenderScale| 1.0 / scale.factor();
    let run = width(RenderScale::Half) - width(RenderScale::ThreeQuarters);
    let slope = (half_lost - three_quarters_lost).max(0.0) / run;
    let loss = half_lost + slope * (width(scale) - width(RenderScale::Half));
    (full * factor.powf(power), loss.min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_keep_their_power_and_errors_their_slope() {
        // Times are proportional to the pixels; errors grow by 0.02 per pixel width.
        let known = [(1.0, 0.0), (0.5625, 0.02 / 3.0), (0.25, 0.02)];
        for (scale, pixels, loss) in
            [(RenderScale::Third, 1.0 / 9.0, 0.04), (RenderScale::Quarter, 1.0 / 16.0, 0.06)]
        {
            let (cost, lost) = continued(known, scale);
            assert!((cost - pixels).abs() < 1e-12 && (lost - loss).abs() < 1e-12, "{cost} {lost}");
        }
    }

    #[test]
    fn an_error_never_falls_and_never_exceeds_one() {
        assert_eq!(continued([(1.0, 0.0), (0.6, 0.3), (0.4, 0.2)], RenderScale::Quarter).1, 0.2);
        assert_eq!(continued([(1.0, 0.0), (0.6, 0.1), (0.4, 0.9)], RenderScale::Quarter).1, 1.0);
    }
}
