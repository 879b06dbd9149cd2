//! What fills the openings: windows with muntins, the door, curtains.

use glam::{DVec2, DVec3};

use super::palette::{BRASS, IRON, LINEN, WOODWORK};
use super::plan::{Opening, THICKNESS, Wall};
use super::walls::CASING;
use crate::generator::angle::sin;
use crate::generator::shape::{Model, Shape};
use crate::generator::shapes::{
    Ends, Path, beveled_box, grid, lathe, plain_box, rectangle_moulding, spline, tube,
};

/// From the casing's outer edge to the face that it turns to the opening: a little inside the masonry, not in one plane with it.
const JAMB: f64 = CASING + 0.003;
/// Panes across and up.
const PANES: (usize, usize) = (3, 5);
/// Width of the bars between panes.
const MUNTIN: f64 = 0.026;
/// Width of the window's own frame.
const SASH: f64 = 0.055;
/// The rod's height and distance from the wall.
const ROD: (f64, f64) = (2.70, 0.11);

/// Windows, door, casings: flat-sided woodwork, in the room's frame.
pub(crate) fn joinery() -> Model {
    let mut model = Model::default();
    for wall in Wall::ALL {
        for opening in wall.openings() {
            let filling = if opening.sill > 0.0 { window(opening) } else { door(opening) };
            let filling = Shape::union([casing(opening), filling]);
            model.add(&WOODWORK, wall.place(filling));
        }
    }
    model
}

/// The profiled strip round an opening, on the wall; a door's runs on under the floor.
fn casing(opening: &Opening) -> Shape {
    let section = [
        (0.0, 0.0),
        (0.0, 0.02),
        (0.008, 0.034),
        (0.022, 0.036),
        (0.03, 0.026),
        (0.075, 0.02),
        (JAMB, 0.014),
        (JAMB, -0.1),
    ];
    let low = if opening.sill > 0.0 { opening.sill } else { -0.3 };
    let size = DVec2::new(opening.width + 2.0 * CASING, opening.head - low + 2.0 * CASING);
    rectangle_moulding(size, &section).at(opening.middle, (opening.head + low) / 2.0, 0.0)
}

fn window(opening: &Opening) -> Shape {
    let height = opening.head - opening.sill;
    let glass = DVec2::new(opening.width - 2.0 * SASH, height - 2.0 * SASH);
    let sash = [(0.0, -0.03), (0.0, 0.03), (SASH - 0.012, 0.03), (SASH, 0.012), (SASH, -0.03)];
    let mut shape = rectangle_moulding(DVec2::new(opening.width, height), &sash);
    for i in 1..PANES.0 {
        let x = glass.x * (i as f64 / PANES.0 as f64 - 0.5);
        shape.add(beveled_box(DVec3::new(MUNTIN, glass.y, 0.036), 0.007).at(x, 0.0, 0.0));
    }
    for i in 1..PANES.1 {
        let y = glass.y * (i as f64 / PANES.1 as f64 - 0.5);
        shape.add(beveled_box(DVec3::new(glass.x, MUNTIN, 0.034), 0.007).at(0.0, y, 0.0));
    }
    let mut shape = shape.at(0.0, height / 2.0, -0.6 * THICKNESS);
    shape.add(beveled_box(DVec3::new(opening.width + 0.26, 0.035, 0.26), 0.008).at(0.0, -0.012, -0.03));
    shape.at(opening.middle, opening.sill, 0.0)
}

/// A closed door of six panels.
fn door(opening: &Opening) -> Shape {
    let raised = [(0.0, 0.0), (0.008, -0.014), (0.02, -0.016), (0.03, -0.012), (0.06, 0.002), (0.07, 0.002)];
    let leaf = DVec3::new(opening.width - 0.008, opening.head - 0.008, 0.045);
    let front = -0.05;
    let (column, margin) = ((leaf.x - 0.36) / 2.0, 0.12);
    let mut shape = plain_box(
        DVec3::new(-leaf.x / 2.0, 0.004, front - leaf.z),
        DVec3::new(leaf.x / 2.0, opening.head - 0.004, front),
    );
    for (low, high) in [(0.22, 0.82), (0.96, 1.56), (1.70, 1.98)] {
        for side in [-1.0, 1.0] {
            let size = DVec2::new(column, high - low);
            let x = side * (column + margin) / 2.0;
            shape.add(rectangle_moulding(size, &raised).at(x, (low + high) / 2.0, front + 0.016));
        }
    }
    shape.at(opening.middle, 0.0, 0.0)
}

/// Curtains, their rods, and the door's knob: smooth things, in the room's frame.
pub(crate) fn drapery() -> Model {
    let mut model = Model::default();
    let wall = Wall::West;
    for (index, (middle, width)) in
        [(-2.2, 0.62), (-0.33, 0.5), (0.33, 0.5), (2.2, 0.62)].into_iter().enumerate()
    {
        model.add(&LINEN, wall.place(curtain(index as u64, width).at(middle, 0.0, ROD.1)));
        model.add(&BRASS, wall.place(rings(width).at(middle, ROD.0, ROD.1)));
    }
    model.add(&IRON, wall.place(rod()));
    for door in Wall::South.openings() {
        model.add(&BRASS, Wall::South.place(knob().at(door.right() - 0.07, 1.02, -0.05)));
    }
    model
}

/// A hanging of `width` with folds that differ a little, round the origin's X and Z, from the rod to the floor.
fn curtain(index: u64, width: f64) -> Shape {
    let (columns, rows) = (72, 8);
    let folds = (width / 0.085).round();
    grid((columns + 1, Ends::Open), (rows + 1, Ends::Open), |column, row| {
        let across = column as f64 / columns as f64;
        let down = 1.0 - row as f64 / rows as f64;
        let phase = 360.0 * folds * across + 70.0 * sin(200.0 * across + 90.0 * index as f64) * (0.4 + down);
        let depth = (0.028 + 0.014 * down) * sin(phase) + 0.012 * down * sin(phase * 0.37 + 50.0);
        let spread = 1.0 + 0.12 * (down - 0.4) * (down - 0.4);
        let height = 0.012 + (ROD.0 - 0.05) * (1.0 - down);
        DVec3::new((across - 0.5) * width * spread, height, depth)
    })
}

fn rings(width: f64) -> Shape {
    let count = (width / 0.085).round() as usize;
    Shape::union((0..count).map(|i| {
        let x = width * ((i as f64 + 0.5) / count as f64 - 0.5);
        tube(&Path::circle(0.024, 0.0, 12), 4, |_| 0.0032).turned_z(90.0).at(x, -0.01, 0.0)
    }))
}

fn rod() -> Shape {
    let half = 2.75;
    let bar = Path::line(DVec3::new(-half, ROD.0, ROD.1), DVec3::new(half, ROD.0, ROD.1), 1);
    let finial = spline(
        &[
            (0.0, 0.0),
            (0.018, 0.0),
            (0.018, 0.012),
            (0.01, 0.016),
            (0.028, 0.04),
            (0.016, 0.068),
            (0.0, 0.074),
        ],
        4,
    );
    let finials =
        [-1.0, 1.0].map(|side| lathe(&finial, 16).turned_z(-90.0 * side).at(side * half, ROD.0, ROD.1));
    let brackets = [-2.5, 0.0, 2.5].map(|x| {
        tube(&Path::line(DVec3::new(x, ROD.0, -0.01), DVec3::new(x, ROD.0, ROD.1), 1), 8, |_| 0.009)
    });
    Shape::union([tube(&bar, 12, |_| 0.013)].into_iter().chain(finials).chain(brackets))
}

fn knob() -> Shape {
    let profile = spline(
        &[
            (0.0, 0.0),
            (0.028, 0.0),
            (0.028, 0.0),
            (0.026, 0.006),
            (0.011, 0.012),
            (0.010, 0.03),
            (0.024, 0.042),
            (0.027, 0.055),
            (0.018, 0.066),
            (0.0, 0.068),
        ],
        4,
    );
    lathe(&profile, 24).turned_x(90.0)
}
