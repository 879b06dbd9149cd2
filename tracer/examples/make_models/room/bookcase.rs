//! The bookcase and what fills it. It stands against the north wall, in that wall's frame.

use glam::{DVec2, DVec3};

use super::palette::{BRASS, COVERS, GLAZE, PAPER, TEAL, TERRACOTTA, WALNUT};
use crate::generator::angle::unit;
use crate::generator::random::{between, pick, uniform};
use crate::generator::shape::{Material, Model, Shape};
use crate::generator::shapes::{
    Ends, Path, beveled_box, grid, lathe, plain_box, spline, straight_moulding, tube,
};

/// Outer measures of the case.
const WIDTH: f64 = 2.9;
const HEIGHT: f64 = 2.36;
const DEPTH: f64 = 0.34;
/// Thickness of its boards.
const BOARD: f64 = 0.028;
/// Height of the plinth.
const PLINTH: f64 = 0.12;
/// Compartments across and up.
const COLUMNS: usize = 3;
const ROWS: usize = 6;
/// Compartments with a lying pile of books.
const PILES: [usize; 4] = [1, 8, 9, 17];
/// Width that a pile or an ornament needs.
const RESERVED: f64 = 0.28;

/// A box between two corners, with its edges just broken.
fn board(low: DVec3, high: DVec3) -> Shape {
    let middle = (low + high) / 2.0;
    beveled_box(high - low, 0.003).at(middle.x, middle.y, middle.z)
}

/// The case without its contents: flat-sided.
pub(crate) fn case() -> Model {
    let mut model = Model::default();
    let half = WIDTH / 2.0;
    let back = 0.03;
    for divider in 0..=COLUMNS {
        let x = upright(divider);
        model.add(
            &WALNUT,
            board(DVec3::new(x - BOARD / 2.0, 0.0, back), DVec3::new(x + BOARD / 2.0, HEIGHT, back + DEPTH)),
        );
    }
    for row in 0..=ROWS {
        let y = shelf(row);
        model.add(
            &WALNUT,
            board(DVec3::new(-half, y - BOARD, back + 0.002), DVec3::new(half, y, back + DEPTH - 0.004)),
        );
    }
    model.add(&WALNUT, board(DVec3::new(-half, 0.0, 0.015), DVec3::new(half, HEIGHT, back + 0.008)));
    model.add(
        &WALNUT,
        board(DVec3::new(-half, 0.0, back), DVec3::new(half, PLINTH - BOARD, back + DEPTH - 0.03)),
    );
    let crown = [
        (0.0, 0.0),
        (0.008, 0.012),
        (0.03, 0.016),
        (0.045, 0.035),
        (0.06, 0.04),
        (0.07, 0.055),
        (0.085, 0.055),
        (0.085, -DEPTH),
    ];
    model.add(
        &WALNUT,
        straight_moulding(-half - 0.05, half + 0.05, &crown).at(0.0, HEIGHT - 0.002, back + DEPTH),
    );
    let end = board(DVec3::new(-0.03, 0.0, -DEPTH), DVec3::new(0.0, 0.085, 0.05)).at(
        0.0,
        HEIGHT - 0.002,
        back + DEPTH,
    );
    model.add(&WALNUT, end.clone().at(-half - 0.02, 0.0, 0.0));
    model.add(&WALNUT, end.at(half + 0.05, 0.0, 0.0));
    model
}

/// X of the middle of an upright.
fn upright(divider: usize) -> f64 {
    (WIDTH - BOARD) * (divider as f64 / COLUMNS as f64 - 0.5)
}

/// Y of a shelf's upper face; the lower compartments are the taller ones.
fn shelf(row: usize) -> f64 {
    let part = row as f64 / ROWS as f64;
    PLINTH + (HEIGHT - PLINTH) * (part + 0.09 * part * (1.0 - part))
}

/// The books.
pub(crate) fn contents() -> Model {
    let mut model = Model::default();
    for (number, room) in compartments().enumerate() {
        model.include(fill(&room, number));
    }
    model
}

/// Row by row from the bottom, from the left.
fn compartments() -> impl Iterator<Item = Compartment> {
    (0..ROWS * COLUMNS).map(|number| {
        let (row, column) = (number / COLUMNS, number % COLUMNS);
        let (left, right) = (upright(column) + BOARD / 2.0, upright(column + 1) - BOARD / 2.0);
        Compartment { left, right, floor: shelf(row), height: shelf(row + 1) - BOARD - shelf(row) }
    })
}

struct Compartment {
    left: f64,
    right: f64,
    floor: f64,
    height: f64,
}

/// Books from the left, in some compartments a lying pile on the right, in some room for an ornament.
fn fill(room: &Compartment, number: usize) -> Model {
    let mut model = Model::default();
    row_of_books(&mut model, room, number as u64, room.right - reserved(number));
    if PILES.contains(&number) {
        model.include(lying_pile(number as u64).at(room.right - RESERVED / 2.0, room.floor, 0.21));
    }
    model
}

fn reserved(number: usize) -> f64 {
    if PILES.contains(&number) || ornament(number).is_some() { RESERVED } else { 0.0 }
}

/// The thing that stands in a compartment beside its books.
fn ornament(number: usize) -> Option<Model> {
    match number {
        4 => Some(globe()),
        6 => Some(jar(&TERRACOTTA)),
        11 => Some(jar(&GLAZE)),
        13 => Some(bowl()),
        15 => Some(jar(&TEAL)),
        _ => None,
    }
}

/// All ornaments, in the case's frame: turned things, so not with the flat books.
pub(crate) fn ornaments() -> Model {
    let mut model = Model::default();
    for (number, room) in compartments().enumerate() {
        if let Some(ornament) = ornament(number) {
            model.include(ornament.at(room.right - RESERVED / 2.0, room.floor, 0.21));
        }
    }
    model
}

/// Books side by side up to `limit`; the last one leans when it has room.
fn row_of_books(model: &mut Model, room: &Compartment, shelf: u64, limit: f64) {
    let mut x = room.left + 0.004;
    for place in 0..80 {
        let index = shelf * 100 + place;
        let thickness = between(30, index, 0.019, 0.048);
        if x + thickness > limit {
            break;
        }
        let series = shelf * 100 + place / 4;
        let height =
            (room.height * between(31, series, 0.66, 0.92)).min(0.31) - between(32, index, 0.0, 0.012);
        let size = DVec3::new(thickness, height, between(33, series, 0.16, 0.215));
        let gap = limit - x - thickness;
        let lean = if gap < 0.075 && gap > 0.03 {
            -libm::asin((gap * 0.8 / height).min(0.4)).to_degrees()
        } else {
            0.0
        };
        let front = between(34, index, -0.012, 0.0);
        let book = book(index, size).turned_z(-lean.abs());
        let shift = if lean == 0.0 { 0.0 } else { gap * 0.05 };
        model.include(book.at(x + shift, room.floor, 0.365 + front - size.z));
        x += thickness + 0.0008;
    }
}

/// A standing book: X its thickness from 0, Y up from 0, its back at +Z.
fn book(index: u64, size: DVec3) -> Model {
    let mut model = Model::default();
    let cover = pick(35, index / if uniform(36, index / 5) < 0.25 { 5 } else { 1 }, &COVERS.each_ref());
    let (hull, bands) = binding(index, size);
    model.add(cover, hull);
    if uniform(37, index / 3) < 0.4 {
        model.add(&BRASS, bands);
    }
    let (edge, inset) = (0.0025, 0.004);
    let pages =
        plain_box(DVec3::new(edge, inset, inset), DVec3::new(size.x - edge, size.y - inset, size.z - edge));
    model.add(&PAPER, pages);
    model
}

/// Two boards and a rounded back, as one bent sheet; and gilt lines across the back.
fn binding(index: u64, size: DVec3) -> (Shape, Shape) {
    let outline = spine_outline(size.x, size.z, 0.0);
    let sheet = |points: &[DVec2], low: f64, high: f64| {
        grid((points.len(), Ends::Open), (2, Ends::Open), |column, row| {
            DVec3::new(points[column].x, [low, high][row], points[column].y)
        })
    };
    let mut hull = sheet(&outline, 0.0, size.y);
    // The boards' thickness shows at the head only.
    let inner = spine_outline(size.x, size.z, 0.0025);
    hull.add(grid((outline.len(), Ends::Open), (2, Ends::Open), |column, row| {
        let p = [outline[column], inner[column]][row];
        DVec3::new(p.x, size.y, p.y)
    }));
    let back = spine_outline(size.x, size.z, -0.0004);
    let back = &back[1..back.len() - 1];
    let mut bands = Shape::default();
    for (place, height) in [(0.12, 0.004), (0.80, 0.004), (0.86, 0.010)] {
        let low = size.y * (place + between(38, index / 4, -0.03, 0.03));
        bands.add(sheet(back, low, low + height));
    }
    (hull, bands)
}

/// From the left board's front edge round the back to the right one's, `inset` inside the outside.
fn spine_outline(thickness: f64, depth: f64, inset: f64) -> Vec<DVec2> {
    let (steps, bulge) = (5, 0.18 * thickness);
    let half = thickness / 2.0 - inset;
    let round = (0..=steps).map(|step| {
        let direction = unit(180.0 - 180.0 * step as f64 / steps as f64);
        DVec2::new(thickness / 2.0 + half * direction.x, depth - bulge - inset + bulge * direction.y)
    });
    let ends = [inset, thickness - inset].map(|x| DVec2::new(x, 0.0));
    [ends[0]].into_iter().chain(round).chain([ends[1]]).collect()
}

/// A few books lying on each other, backs to the front.
fn lying_pile(number: u64) -> Model {
    let mut model = Model::default();
    let mut y = 0.0;
    for place in 0..4 {
        let index = 5000 + number * 10 + place;
        let size = DVec3::new(between(40, index, 0.022, 0.042), between(41, index, 0.20, 0.255), 0.17);
        let lying = book(index, size).turned_z(90.0).at(size.y / 2.0, y, -size.z / 2.0);
        model.include(lying.turned_y(between(42, index, -7.0, 7.0)));
        y += size.x;
    }
    model
}

fn jar(material: &'static Material) -> Model {
    let mut model = Model::default();
    let profile = spline(
        &[
            (0.0, 0.0),
            (0.045, 0.0),
            (0.045, 0.0),
            (0.07, 0.06),
            (0.082, 0.12),
            (0.06, 0.175),
            (0.032, 0.2),
            (0.03, 0.215),
            (0.042, 0.232),
            (0.038, 0.231),
            (0.026, 0.213),
            (0.028, 0.19),
        ],
        5,
    );
    model.add(material, lathe(&profile, 40));
    model
}

fn bowl() -> Model {
    let mut model = Model::default();
    let profile = spline(
        &[
            (0.0, 0.004),
            (0.04, 0.004),
            (0.043, 0.0),
            (0.046, 0.006),
            (0.09, 0.04),
            (0.115, 0.085),
            (0.111, 0.084),
            (0.085, 0.044),
            (0.03, 0.016),
            (0.0, 0.014),
        ],
        5,
    );
    model.add(&TERRACOTTA, lathe(&profile, 48));
    model
}

/// A globe in a brass meridian on a turned foot.
fn globe() -> Model {
    let mut model = Model::default();
    let foot = spline(
        &[
            (0.0, 0.0),
            (0.06, 0.0),
            (0.06, 0.0),
            (0.06, 0.008),
            (0.02, 0.02),
            (0.012, 0.035),
            (0.016, 0.05),
            (0.008, 0.06),
            (0.0, 0.062),
        ],
        3,
    );
    model.add(&WALNUT, lathe(&foot, 32));
    let ball: Vec<DVec2> = (0..=20).map(|step| unit(-90.0 + 9.0 * f64::from(step)) * 0.095).collect();
    model.add(&TEAL, lathe(&ball, 32).turned_z(-23.0).at(0.0, 0.17, 0.0));
    let meridian = tube(&Path::circle(0.105, 0.0, 48), 6, |_| 0.0035).turned_x(90.0);
    model.add(&BRASS, meridian.at(0.0, 0.17, 0.0));
    model
}
