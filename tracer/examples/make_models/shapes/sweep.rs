//! A section carried along a path: tubes, handles, spouts, knots.

use glam::{DVec2, DVec3};

use super::grid::{Ends, grid};
use super::lathe::spline;
use crate::generator::angle::{heading, unit};
use crate::generator::shape::Shape;

/// A path through space with the direction that its section calls up at each point.
#[derive(Clone, Debug)]
pub(crate) struct Path {
    points: Vec<DVec3>,
    /// One per point; need not be perpendicular to the path, only never along it.
    up: Vec<DVec3>,
    ends: Ends,
}

impl Path {
    /// A path that keeps one up direction, such as the normal of the plane it lies in.
    pub(crate) fn new(points: Vec<DVec3>, up: DVec3, ends: Ends) -> Self {
        let up = vec![up; points.len()];
        Self { points, up, ends }
    }

    /// A path with an up direction for each point.
    pub(crate) fn with_ups(points: Vec<DVec3>, up: Vec<DVec3>, ends: Ends) -> Self {
        Self { points, up, ends }
    }

    /// A curve in the XY plane through `points`, `steps` pieces from each to the next.
    pub(crate) fn in_xy(points: &[(f64, f64)], steps: usize) -> Self {
        let curve = spline(points, steps).into_iter().map(|p| p.extend(0.0)).collect();
        Self::new(curve, DVec3::Z, Ends::Open)
    }

    /// A circle about +Y at `height`.
    pub(crate) fn circle(radius: f64, height: f64, steps: usize) -> Self {
        let points =
            (0..steps).map(|i| heading(360.0 * i as f64 / steps as f64) * radius + DVec3::Y * height);
        Self::new(points.collect(), DVec3::Y, Ends::Joined)
    }

    /// A straight line.
    pub(crate) fn line(from: DVec3, to: DVec3, steps: usize) -> Self {
        let up = if (to - from).normalize_or_zero().y.abs() > 0.9 { DVec3::X } else { DVec3::Y };
        Self::new((0..=steps).map(|i| from.lerp(to, i as f64 / steps as f64)).collect(), up, Ends::Open)
    }

    /// The last point.
    pub(crate) fn end(&self) -> DVec3 {
        self.points.last().copied().unwrap_or_default()
    }

    fn tangent(&self, i: usize) -> DVec3 {
        let n = self.points.len();
        let (before, after) = match self.ends {
            Ends::Joined => ((i + n - 1) % n, (i + 1) % n),
            Ends::Open => (i.saturating_sub(1), (i + 1).min(n - 1)),
        };
        (self.points[after] - self.points[before]).normalize_or(DVec3::Y)
    }

    /// Right and up of the section at a point.
    fn frame(&self, i: usize) -> (DVec3, DVec3) {
        let tangent = self.tangent(i);
        let right = self.up[i].cross(tangent).normalize_or(DVec3::X);
        (right, tangent.cross(right))
    }
}

/// Carries a section of `corners` points along the path: `section(t, corner)` with t from 0 to 1, counter-clockwise.
/// Open ends are closed by a cap.
pub(crate) fn sweep(path: &Path, corners: usize, section: impl Fn(f64, usize) -> DVec2) -> Shape {
    let count = path.points.len();
    let caps = if path.ends == Ends::Open { 1 } else { 0 };
    grid((corners, Ends::Joined), (count + 2 * caps, path.ends), |corner, row| {
        let i = row.saturating_sub(caps).min(count - 1);
        let is_cap = caps == 1 && (row == 0 || row == count + 1);
        let (right, up) = path.frame(i);
        let p = if is_cap { DVec2::ZERO } else { section(i as f64 / (count - 1) as f64, corner) };
        path.points[i] + right * p.x + up * p.y
    })
}

/// A round tube of `radius(t)`, t from 0 to 1 along the path.
pub(crate) fn tube(path: &Path, sides: usize, radius: impl Fn(f64) -> f64) -> Shape {
    sweep(path, sides, |t, corner| disc(corner, sides) * radius(t))
}

/// The corner of a regular polygon on the unit circle.
pub(crate) fn disc(corner: usize, corners: usize) -> DVec2 {
    unit(360.0 * corner as f64 / corners as f64)
}
