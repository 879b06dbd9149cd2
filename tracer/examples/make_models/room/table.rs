//! The round tea table, 0.52 m high, on four turned legs.

use glam::DVec3;

use super::palette::{BRASS, WALNUT};
use crate::generator::angle::heading;
use crate::generator::shape::Model;
use crate::generator::shapes::{Path, lathe, spline, tube};

/// Height of the table's surface.
pub(crate) const TOP: f64 = 0.52;
const RADIUS: f64 = 0.56;

/// The table round the origin.
pub(crate) fn table() -> Model {
    let mut model = Model::default();
    model.add(&WALNUT, lathe(&plate(RADIUS, TOP, 0.032), 80));
    model.add(&WALNUT, lathe(&apron(), 56));
    model.add(&WALNUT, lathe(&plate(0.36, 0.17, 0.02), 56));
    for leg in 0..4 {
        let foot = heading(45.0 + 90.0 * f64::from(leg)) * 0.36;
        model.add(&WALNUT, lathe(&leg_profile(), 20).at(foot.x, 0.0, foot.z));
    }
    // A brass line let into the edge of the top.
    model.add(&BRASS, tube(&Path::circle(RADIUS - 0.0035, TOP - 0.016, 80), 6, |_| 0.0045));
    model
}

/// A round board with a moulded edge.
fn plate(radius: f64, top: f64, thickness: f64) -> Vec<glam::DVec2> {
    let (low, edge) = (top - thickness, thickness / 4.0);
    spline(
        &[
            (0.0, low),
            (radius - 3.0 * edge, low),
            (radius - 3.0 * edge, low),
            (radius - edge, low + edge),
            (radius - 0.3 * edge, low + 2.0 * edge),
            (radius - 0.5 * edge, top - 0.6 * edge),
            (radius - 1.5 * edge, top),
            (radius - 1.5 * edge, top),
            (0.0, top),
        ],
        4,
    )
}

fn apron() -> Vec<glam::DVec2> {
    let low = TOP - 0.105;
    spline(
        &[
            (0.40, TOP - 0.03),
            (0.40, low),
            (0.40, low),
            (0.405, low - 0.004),
            (0.415, low - 0.004),
            (0.421, low + 0.004),
            (0.421, low + 0.008),
            (0.417, low + 0.014),
            (0.417, low + 0.014),
            (0.417, TOP - 0.03),
        ],
        3,
    )
}

fn leg_profile() -> Vec<glam::DVec2> {
    spline(
        &[
            (0.0, 0.0),
            (0.014, 0.0),
            (0.019, 0.012),
            (0.016, 0.026),
            (0.013, 0.034),
            (0.021, 0.10),
            (0.025, 0.13),
            (0.018, 0.145),
            (0.027, 0.152),
            (0.027, 0.180),
            (0.018, 0.187),
            (0.020, 0.20),
            (0.028, 0.27),
            (0.022, 0.325),
            (0.017, 0.34),
            (0.026, 0.35),
            (0.026, 0.358),
            (0.017, 0.366),
            (0.030, 0.385),
            (0.030, 0.42),
            (0.030, TOP - 0.02),
        ],
        4,
    )
}

/// A brass tray of `radius` with a rolled rim and two handles, its inside floor at 3 mm.
pub(crate) fn tray(radius: f64) -> Model {
    let mut model = Model::default();
    let profile = spline(
        &[
            (0.0, 0.0),
            (radius - 0.02, 0.0),
            (radius - 0.02, 0.0),
            (radius - 0.005, 0.008),
            (radius, 0.024),
            (radius + 0.004, 0.0265),
            (radius + 0.005, 0.024),
            (radius - 0.001, 0.012),
            (radius - 0.02, 0.003),
            (radius - 0.02, 0.003),
            (0.0, 0.003),
        ],
        4,
    );
    // The outside comes first going up, so the inside floor faces up.
    model.add(&BRASS, lathe(&profile, 80));
    for side in [-1.0, 1.0] {
        let bow = Path::in_xy(&[(-0.055, 0.0), (-0.05, 0.028), (0.0, 0.04), (0.05, 0.028), (0.055, 0.0)], 5);
        let handle = tube(&bow, 8, |_| 0.004)
            .mapped(|p| DVec3::new(side * (radius + 0.4 * p.y + p.z), 0.018 + 0.8 * p.y, p.x));
        model.add(&BRASS, handle);
    }
    model
}
