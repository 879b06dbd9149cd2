//! Profiled strips: picture frames, panels, cornices, chair rails.

use glam::{DVec2, DVec3};

use super::grid::{Ends, grid};
use crate::generator::shape::Shape;

/// A frame of `size` outside, round the origin in the XY plane, mitred at the corners. The section lists points of
/// (distance inwards from the outline, height towards +Z).
pub(crate) fn rectangle_moulding(size: DVec2, section: &[(f64, f64)]) -> Shape {
    let half = size / 2.0;
    let corners = [DVec2::new(-1.0, -1.0), DVec2::new(1.0, -1.0), DVec2::ONE, DVec2::new(-1.0, 1.0)];
    grid((4, Ends::Joined), (section.len(), Ends::Open), |corner, row| {
        let (inwards, height) = section[row];
        (corners[corner] * (half - inwards)).extend(height)
    })
}

/// A strip along X from `from` to `to` whose section lists points of (height +Y, depth +Z) from the bottom up; its
/// ends are open.
pub(crate) fn straight_moulding(from: f64, to: f64, section: &[(f64, f64)]) -> Shape {
    grid((2, Ends::Open), (section.len(), Ends::Open), |end, row| {
        let (height, depth) = section[row];
        DVec3::new([from, to][end], height, depth)
    })
}
