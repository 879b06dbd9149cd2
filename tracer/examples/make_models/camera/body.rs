//! The body: chrome caps over a leather sheet, and the plate that carries the lens.

use glam::{DVec2, DVec3};

use super::{BLACK, BODY, CHROME, LEATHER, LENS, STANDS_AT, WAIST};
use crate::generator::angle::unit;
use crate::generator::random::between;
use crate::generator::shape::{Model, Shape};
use crate::generator::shapes::{Ends, Softness, grid, lathe, rounded_box, spline};

/// Everything below the raised top, without the lens.
pub(super) fn body() -> Model {
    let mut model = Model::default();
    let (low, waist, high) = (STANDS_AT, STANDS_AT + WAIST, STANDS_AT + BODY.y);
    model.add(&CHROME, capsule(low, low + 0.65));
    model.add(&CHROME, capsule(waist, high));
    model.add(&LEATHER, grained(capsule_wall(low + 0.62, waist + 0.03)));
    // The frame round the lens stands a little proud of the leather.
    let plate =
        rounded_box(DVec3::new(7.4, 4.2, 0.5), Softness { radius: 0.24, corner_steps: 4, flat_steps: 2 });
    model.add(&CHROME, plate.at(LENS.x, STANDS_AT + 2.62, BODY.z / 2.0 + 0.02));
    let foot = spline(&[(0.0, 0.0), (0.95, 0.0), (1.0, 0.06), (1.0, STANDS_AT + 0.05)], 3);
    model.add(&BLACK, lathe(&foot, 48).mapped(|p| DVec3::new(p.x * 2.2, p.y, p.z)));
    model
}

/// A box with half-round ends, upright: the outline of the body from `low` to `high`, with bevelled edges.
fn capsule(low: f64, high: f64) -> Shape {
    let (steps, radius, edge) = (20, BODY.z / 2.0, 0.12);
    let reach = BODY.x / 2.0 - radius;
    let section = [(-edge, low), (0.0, low + edge), (0.0, high - edge), (-edge, high)];
    let points = 2 * (steps + 1);
    grid((points, Ends::Joined), (section.len() + 2, Ends::Open), |column, row| {
        let end = if column <= steps { 1.0 } else { -1.0 };
        let step = if column <= steps { column } else { column - steps - 1 };
        let direction = unit(90.0 - 180.0 * step as f64 / steps as f64) * end;
        let (inset, y) = section[row.clamp(1, section.len()) - 1];
        let is_cap = row == 0 || row == section.len() + 1;
        let size = if is_cap { 0.0 } else { radius + inset };
        DVec3::new(end * reach + direction.x * size, y, direction.y * size)
    })
}

/// The leather's sheet round the body: a fine grid, so that it can carry a grain.
fn capsule_wall(low: f64, high: f64) -> Shape {
    let radius = BODY.z / 2.0 - 0.02;
    let reach = BODY.x / 2.0 - BODY.z / 2.0;
    let (straight, round) = (2.0 * reach, std::f64::consts::PI * radius);
    let length = 2.0 * (straight + round);
    let (columns, rows) = (168, 18);
    grid((columns, Ends::Joined), (rows + 1, Ends::Open), |column, row| {
        let y = low + (high - low) * row as f64 / rows as f64;
        let along = length * column as f64 / columns as f64;
        let (side, rest) = if along < length / 2.0 { (1.0, along) } else { (-1.0, along - length / 2.0) };
        let p = if rest < straight {
            DVec2::new(rest - reach, radius)
        } else {
            let direction = unit(90.0 - (rest - straight) / radius * (180.0 / std::f64::consts::PI));
            DVec2::new(reach, 0.0) + direction * radius
        };
        DVec3::new(side * p.x, y, side * p.y)
    })
}

/// Leather: each vertex a little in or out along the body's horizontal normal.
fn grained(sheet: Shape) -> Shape {
    let reach = BODY.x / 2.0 - BODY.z / 2.0;
    let mut grain = sheet;
    for (index, p) in grain.positions.iter_mut().enumerate() {
        let core = DVec3::new(p.x.clamp(-reach, reach), p.y, 0.0);
        *p += (*p - core).normalize_or_zero() * between(80, index as u64, -0.012, 0.022);
    }
    grain
}
