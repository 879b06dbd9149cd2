//! Turned shapes: a profile that goes round the Y axis.

use glam::{DVec2, DVec3};

use super::grid::{Ends, grid};
use crate::generator::angle::{cos, heading};
use crate::generator::shape::Shape;

/// Turns a profile of (radius, height) round +Y. A profile that runs from the middle of the bottom outwards, up, and
/// back to the middle of the top gives a closed solid with its outside outside.
/// Points between which the profile hardly turns are left out.
pub(crate) fn lathe(profile: &[DVec2], segments: usize) -> Shape {
    lathe_every(&thinned(profile, LEAST_TURN_DEGREES), segments)
}

/// As [`lathe`], with more points of the profile: for mirrors and glass, which show every corner.
pub(crate) fn lathe_fine(profile: &[DVec2], segments: usize) -> Shape {
    lathe_every(&thinned(profile, FINE_TURN_DEGREES), segments)
}

/// As [`lathe`], with every point of the profile: for shapes that are bent or carved afterwards.
pub(crate) fn lathe_every(profile: &[DVec2], segments: usize) -> Shape {
    let round: Vec<DVec3> = (0..segments).map(|i| heading(360.0 * i as f64 / segments as f64)).collect();
    grid((segments, Ends::Joined), (profile.len(), Ends::Open), |column, row| {
        round[column] * profile[row].x + DVec3::Y * profile[row].y
    })
}

/// Turn of the profile from one kept point to the next.
const LEAST_TURN_DEGREES: f64 = 18.0;
const FINE_TURN_DEGREES: f64 = 9.0;

/// The profile without the points at which it has turned by less than an angle since the last one kept.
fn thinned(profile: &[DVec2], degrees: f64) -> Vec<DVec2> {
    let least_cosine = cos(degrees);
    let mut kept: Vec<DVec2> = profile.first().copied().into_iter().collect();
    let mut arrived = profile.get(1).map_or(DVec2::X, |second| (second - profile[0]).normalize_or(DVec2::X));
    for window in profile.windows(3) {
        let leaving = (window[2] - window[1]).normalize_or(arrived);
        let has_turned = arrived.dot(leaving) < least_cosine;
        if has_turned {
            kept.push(window[1]);
            arrived = leaving;
        }
    }
    kept.extend(profile.last());
    kept
}

/// A curve through `points`, `steps` pieces from each to the next (Catmull and Rom, 1974). A point that is named
/// twice is a corner; between two corners lies a straight line.
pub(crate) fn spline(points: &[(f64, f64)], steps: usize) -> Vec<DVec2> {
    let points: Vec<DVec2> = points.iter().map(|&(x, y)| DVec2::new(x, y)).collect();
    let mut curve = Vec::new();
    for run in runs(&points) {
        curve.extend(smooth_run(run, steps));
    }
    curve.dedup();
    curve
}

/// Cuts the points between the two of each doubled pair.
fn runs(points: &[DVec2]) -> impl Iterator<Item = &[DVec2]> {
    points.chunk_by(|a, b| a != b)
}

fn smooth_run(run: &[DVec2], steps: usize) -> Vec<DVec2> {
    let Some(&last) = run.last() else { return Vec::new() };
    if run.len() <= 2 {
        return run.to_vec();
    }
    let mut curve = Vec::new();
    for i in 0..run.len() - 1 {
        let before = run[i.saturating_sub(1)];
        let after = run[(i + 2).min(run.len() - 1)];
        curve.extend(
            (0..steps)
                .map(|step| catmull_rom([before, run[i], run[i + 1], after], step as f64 / steps as f64)),
        );
    }
    curve.push(last);
    curve
}

fn catmull_rom([p0, p1, p2, p3]: [DVec2; 4], t: f64) -> DVec2 {
    let (t2, t3) = (t * t, t * t * t);
    0.5 * (2.0 * p1
        + (p2 - p0) * t
        + (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) * t2
        + (3.0 * p1 - p0 - 3.0 * p2 + p3) * t3)
}
