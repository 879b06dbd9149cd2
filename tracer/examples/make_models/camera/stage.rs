//! What the camera stands on, and the room round it.

use super::{BRASS, STUDIO, TURNTABLE};
use crate::generator::angle::unit;
use crate::generator::shape::Model;
use crate::generator::shapes::{Path, lathe, spline, tube};

/// A stone disc with a brass line, its top at Y = 0.
pub(super) fn turntable() -> Model {
    let mut model = Model::default();
    let profile = spline(
        &[
            (0.0, -1.6),
            (10.6, -1.6),
            (10.6, -1.6),
            (10.7, -1.0),
            (11.3, -0.95),
            (11.3, -0.95),
            (11.4, -0.85),
            (11.4, -0.15),
            (11.4, -0.15),
            (11.25, 0.0),
            (11.25, 0.0),
            (0.0, 0.0),
        ],
        3,
    );
    model.add(&TURNTABLE, lathe(&profile, 144));
    model.add(&BRASS, tube(&Path::circle(11.4, -0.5, 144), 8, |_| 0.07));
    model
}

/// A floor that curves up into a wall all round: no horizon, and the same from every side.
pub(super) fn studio() -> Model {
    let mut model = Model::default();
    let mut profile = vec![(110.0, 120.0), (110.0, 60.0), (110.0, 60.0)];
    profile.extend(
        (0..=8).map(|step| unit(-11.25 * f64::from(step))).map(|p| (60.0 + 50.0 * p.x, 48.4 + 50.0 * p.y)),
    );
    profile.extend([(60.0, -1.6), (60.0, -1.6), (0.0, -1.6)]);
    model.add(&STUDIO, lathe(&spline(&profile, 3), 96));
    model
}
