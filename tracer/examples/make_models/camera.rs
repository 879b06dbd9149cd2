//! A rangefinder camera on a turntable, in a round studio. Everything stands on Y = 0 round the origin, so it may
//! spin. Units are centimetres; the scene works in them too.

use glam::{DVec2, DVec3};

use super::angle::unit;
use super::obj::Digits::{Coarse, Finest};
use super::obj::Shading::Smooth;
use super::random::between;
use super::shape::{Material, Model, Shape};
use super::shapes::{
    Ends, Path, Softness, beveled_box, disc, grid, lathe, lathe_every, plain_box, rectangle_moulding,
    rounded_box, spline, sweep, tube,
};
use super::{Folder, Part};

static CHROME: Material = Material::metal("chrome", [0.300, 0.297, 0.288], [0.60, 0.59, 0.57], 48.0);
static BLACK: Material = Material::glossy("black", [0.022, 0.022, 0.024], 0.40, 70.0);
static LEATHER: Material = Material::glossy("leather", [0.150, 0.050, 0.024], 0.16, 22.0);
static STRAP: Material = Material::glossy("strap", [0.105, 0.036, 0.018], 0.14, 20.0);
static GLASS: Material = Material::glossy("lens_glass", [0.035, 0.030, 0.075], 0.95, 350.0);
static WINDOW: Material = Material::glossy("window_glass", [0.030, 0.045, 0.055], 0.80, 200.0);
static ENGRAVING: Material = Material::matt("engraving", [0.700, 0.680, 0.620]);
static RED: Material = Material::glossy("red_dot", [0.500, 0.020, 0.015], 0.30, 60.0);
static TURNTABLE: Material = Material::glossy("turntable", [0.270, 0.245, 0.215], 0.16, 40.0);
static BRASS: Material = Material::metal("brass_edge", [0.360, 0.235, 0.080], [0.70, 0.52, 0.25], 60.0);
static STUDIO: Material = Material::matt("studio", [0.205, 0.245, 0.255]);

/// The body: width, height, depth, and the height of its lower edge above the turntable.
const BODY: DVec3 = DVec3::new(13.8, 6.2, 3.3);
const STANDS_AT: f64 = 0.38;
/// Top of the leather, where the chrome plate begins.
const WAIST: f64 = 4.6;
/// Height of the top plate above the turntable.
const ROOF: f64 = STANDS_AT + BODY.y + 1.15;
/// The lens: middle on the body's front.
const LENS: DVec2 = DVec2::new(0.6, STANDS_AT + 3.0);

/// Everything in `models/camera/`.
pub(crate) fn folder() -> Folder {
    let parts = vec![
        Part::new("camera", Smooth, Coarse, camera()),
        Part::new("turntable", Smooth, Finest, turntable()),
        Part::new("studio", Smooth, Finest, studio()),
    ];
    Folder { name: "camera", parts }
}

/// The camera with its strap, looking towards +Z.
fn camera() -> Model {
    let mut model = Model::default();
    add_body(&mut model);
    add_top(&mut model);
    add_lens(&mut model);
    add_strap(&mut model);
    model
}

/// A box with half-round ends, upright: the outline of the body from `low` to `high`, `grow` larger all round.
fn capsule(low: f64, high: f64, grow: f64, edge: f64) -> Shape {
    let (steps, radius) = (20, BODY.z / 2.0);
    let reach = BODY.x / 2.0 - radius;
    let section = [(-edge, low), (0.0, low + edge), (0.0, high - edge), (-edge, high)];
    let points = 2 * (steps + 1);
    grid((points, Ends::Joined), (section.len() + 2, Ends::Open), |column, row| {
        let end = if column <= steps { 1.0 } else { -1.0 };
        let step = if column <= steps { column } else { column - steps - 1 };
        let direction = unit(90.0 - 180.0 * step as f64 / steps as f64) * end;
        let (inset, y) = section[row.clamp(1, section.len()) - 1];
        let is_cap = row == 0 || row == section.len() + 1;
        let size = if is_cap { 0.0 } else { radius + grow + inset };
        DVec3::new(end * reach + direction.x * size, y, direction.y * size)
    })
}

fn add_body(model: &mut Model) {
    let (low, waist, high) = (STANDS_AT, STANDS_AT + WAIST, STANDS_AT + BODY.y);
    model.add(&CHROME, capsule(low, low + 0.65, 0.0, 0.12));
    model.add(&CHROME, capsule(waist, high, 0.0, 0.12));
    model.add(&LEATHER, grained(capsule_wall(low + 0.62, waist + 0.03)));
    // The frame round the lens stands a little proud of the leather.
    let plate =
        rounded_box(DVec3::new(7.4, 4.2, 0.5), Softness { radius: 0.24, corner_steps: 4, flat_steps: 2 });
    model.add(&CHROME, plate.at(LENS.x, STANDS_AT + 2.62, BODY.z / 2.0 + 0.02));
    let foot = spline(&[(0.0, 0.0), (0.95, 0.0), (1.0, 0.06), (1.0, STANDS_AT + 0.05)], 3);
    model.add(&BLACK, lathe(&foot, 48).mapped(|p| DVec3::new(p.x * 2.2, p.y, p.z)));
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

/// The raised top: housing, windows, dials, release, winder, accessory shoe.
fn add_top(model: &mut Model) {
    let base = STANDS_AT + BODY.y;
    let housing = DVec3::new(8.6, ROOF - base + 0.1, 2.5);
    let soft = Softness { radius: 0.16, corner_steps: 3, flat_steps: 2 };
    model.add(&CHROME, rounded_box(housing, soft).at(-0.6, base + housing.y / 2.0 - 0.1, 0.0));
    let front = housing.z / 2.0;
    let middle = base + 0.56;
    for (x, width, height) in [(2.75, 1.25, 0.78), (0.2, 1.0, 0.62), (-3.6, 1.45, 0.85)] {
        add_window(model, DVec3::new(x, middle, front), DVec2::new(width, height));
    }
    for (x, radius, height, ridges) in [(4.75, 0.88, 0.62, 48), (-5.75, 0.80, 0.95, 40)] {
        model.add(&CHROME, dial(radius, height, ridges).at(x, base - 0.02, -0.15));
    }
    model.add(&CHROME, dial(0.72, 0.42, 36).at(2.55, ROOF - 0.02, -0.2));
    model.add(
        &BLACK,
        lathe(&spline(&[(0.5, 0.0), (0.5, 0.012), (0.0, 0.012)], 1), 32).at(2.55, ROOF + 0.40, -0.2),
    );
    for mark in 0..10 {
        let tick = beveled_box(DVec3::new(0.03, 0.012, 0.14), 0.003).at(0.0, ROOF + 0.414, 0.40);
        model.add(&ENGRAVING, tick.turned_y(36.0 * f64::from(mark)).at(2.55, 0.0, -0.2));
    }
    let release = spline(
        &[
            (0.36, 0.0),
            (0.36, 0.14),
            (0.30, 0.2),
            (0.22, 0.2),
            (0.22, 0.2),
            (0.21, 0.34),
            (0.16, 0.37),
            (0.06, 0.34),
            (0.0, 0.33),
        ],
        4,
    );
    model.add(&CHROME, lathe(&release, 32).at(6.15, base - 0.01, 0.35));
    let lever = Path::new(
        (0..=12)
            .map(|i| unit(60.0 - 14.0 * f64::from(i)))
            .map(|p| DVec3::new(4.75 + 1.05 * p.x, base + 0.68, -0.15 - 1.05 * p.y))
            .collect(),
        DVec3::Y,
        Ends::Open,
    );
    model.add(&CHROME, sweep(&lever, 16, |t, corner| disc(corner, 16) * DVec2::new(0.22 - 0.08 * t, 0.07)));
    model.add(&CHROME, beveled_box(DVec3::new(2.0, 0.1, 2.0), 0.03).at(-1.1, ROOF + 0.03, -0.05));
    for side in [-1.0, 1.0] {
        model.add(
            &CHROME,
            beveled_box(DVec3::new(0.32, 0.1, 1.9), 0.025).at(-1.1 + side * 0.82, ROOF + 0.24, -0.05),
        );
        model.add(
            &CHROME,
            beveled_box(DVec3::new(0.12, 0.2, 1.9), 0.025).at(-1.1 + side * 0.93, ROOF + 0.15, -0.05),
        );
    }
}

/// A framed pane that faces +Z.
fn add_window(model: &mut Model, middle: DVec3, size: DVec2) {
    let frame = [(0.0, -0.05), (0.0, 0.05), (0.03, 0.08), (0.09, 0.08), (0.12, 0.05), (0.13, -0.02)];
    model.add(&BLACK, rectangle_moulding(size, &frame).at(middle.x, middle.y, middle.z));
    let pane = beveled_box(DVec3::new(size.x - 0.2, size.y - 0.2, 0.06), 0.02);
    model.add(&WINDOW, pane.at(middle.x, middle.y, middle.z + 0.01));
}

/// A round dial with a knurled side, standing on the origin.
fn dial(radius: f64, height: f64, ridges: usize) -> Shape {
    let profile = [
        (0.86, 0.0),
        (0.86, 0.12),
        (1.0, 0.18),
        (1.0, 0.88),
        (0.91, 0.97),
        (0.80, 1.0),
        (0.78, 0.97),
        (0.0, 0.97),
    ];
    let profile: Vec<DVec2> = profile.iter().map(|&(r, y)| DVec2::new(r * radius, y * height)).collect();
    knurled(lathe_every(&profile, 4 * ridges), radius * 0.93, ridges, 0.035 * radius)
}

/// Presses ridges into everything beyond `from` the axis.
fn knurled(shape: Shape, from: f64, ridges: usize, depth: f64) -> Shape {
    shape.mapped(|p| {
        let radius = DVec2::new(p.x, p.z).length();
        if radius < from {
            return p;
        }
        let wave = unit(libm::atan2(p.x, p.z).to_degrees() * ridges as f64).x;
        let scale = 1.0 - depth / radius * (0.5 - 0.5 * wave.signum() * wave.abs().sqrt());
        DVec3::new(p.x * scale, p.y, p.z * scale)
    })
}

/// Mount, barrel with two knurled rings, scales, glass.
fn add_lens(model: &mut Model) {
    let on_front = |shape: Shape| shape.turned_x(90.0).at(LENS.x, LENS.y, BODY.z / 2.0 + 0.2);
    let turned = |points: &[(f64, f64)], segments: usize| lathe(&spline(points, 3), segments);
    model.add(
        &CHROME,
        on_front(turned(
            &[(2.45, 0.0), (2.45, 0.25), (2.45, 0.25), (2.36, 0.34), (2.05, 0.36), (2.05, 0.36), (2.05, 0.5)],
            80,
        )),
    );
    model.add(
        &BLACK,
        on_front(turned(&[(2.12, 0.4), (2.12, 0.9), (2.12, 0.9), (2.06, 0.96), (1.9, 0.98)], 80)),
    );
    let focus = turned(
        &[
            (1.9, 0.95),
            (2.2, 1.02),
            (2.24, 1.08),
            (2.24, 1.08),
            (2.24, 1.75),
            (2.24, 1.75),
            (2.2, 1.82),
            (1.85, 1.86),
        ],
        256,
    );
    model.add(&CHROME, on_front(knurled(focus, 2.21, 64, 0.09)));
    model.add(
        &BLACK,
        on_front(turned(&[(1.88, 1.82), (1.88, 2.35), (1.88, 2.35), (1.84, 2.40), (1.7, 2.40)], 80)),
    );
    let aperture = turned(
        &[
            (1.7, 2.36),
            (1.92, 2.42),
            (1.94, 2.46),
            (1.94, 2.46),
            (1.94, 2.75),
            (1.94, 2.75),
            (1.9, 2.8),
            (1.72, 2.82),
        ],
        160,
    );
    model.add(&CHROME, on_front(knurled(aperture, 1.91, 40, 0.08)));
    let rim = [
        (1.74, 2.8),
        (1.76, 3.25),
        (1.72, 3.32),
        (1.64, 3.32),
        (1.62, 3.28),
        (1.62, 3.28),
        (1.56, 3.12),
        (1.36, 2.98),
        (1.36, 2.98),
        (1.34, 2.90),
        (1.16, 2.84),
        (1.16, 2.84),
        (1.14, 2.7),
    ];
    model.add(&BLACK, on_front(turned(&rim, 72)));
    model.add(&CHROME, on_front(tube(&Path::circle(1.68, 3.31, 72), 6, |_| 0.03)));
    model.add(
        &GLASS,
        on_front(turned(&[(1.18, 2.70), (1.0, 2.80), (0.7, 2.90), (0.35, 2.96), (0.0, 2.98)], 64)),
    );
    add_scale(model, &on_front);
    model.add(
        &RED,
        on_front(lathe(&spline(&[(0.0, -0.1), (0.13, -0.02), (0.0, 0.06)], 4), 20).at(0.0, 0.33, -2.22)),
    );
}

/// Engraved ticks round the barrel: long ones every fifth.
fn add_scale(model: &mut Model, on_front: &impl Fn(Shape) -> Shape) {
    for (radius, along, count, length) in [(2.125, 0.66, 60, 0.3), (1.885, 2.1, 48, 0.26)] {
        for tick in 0..count {
            let length = if tick % 5 == 0 { length } else { 0.5 * length };
            let half = DVec3::new(0.018, length / 2.0, 0.01);
            let mark = plain_box(-half, half).at(0.0, along + length / 2.0 - 0.13, radius);
            model.add(&ENGRAVING, on_front(mark.turned_y(360.0 * f64::from(tick) / f64::from(count))));
        }
    }
}

/// Lugs, rings, and a strap that lies round the camera's back on the turntable.
fn add_strap(model: &mut Model) {
    for side in [-1.0, 1.0] {
        let lug = DVec3::new(side * (BODY.x / 2.0 + 0.12), STANDS_AT + 5.3, 0.0);
        model.add(
            &CHROME,
            lathe(&spline(&[(0.26, -0.2), (0.24, 0.05), (0.16, 0.2), (0.0, 0.22)], 3), 20)
                .turned_z(-90.0 * side)
                .at(lug.x - 0.05 * side, lug.y, lug.z),
        );
        model.add(
            &CHROME,
            tube(&Path::circle(0.42, 0.0, 28), 8, |_| 0.055).turned_x(90.0).at(
                lug.x + side * 0.28,
                lug.y - 0.3,
                0.0,
            ),
        );
    }
    let half = [
        DVec3::new(7.35, 5.13, 0.0),
        DVec3::new(7.72, 3.9, -0.15),
        DVec3::new(8.2, 2.0, -0.7),
        DVec3::new(8.9, 0.75, -2.0),
        DVec3::new(9.0, 0.2, -4.0),
        DVec3::new(7.6, 0.12, -6.4),
        DVec3::new(4.4, 0.12, -7.7),
        DVec3::new(0.0, 0.12, -7.2),
    ];
    let mirrored = half.iter().rev().skip(1).map(|p| DVec3::new(-p.x, p.y, p.z));
    let knots: Vec<DVec3> = half.iter().copied().chain(mirrored).collect();
    let path = curve(&knots, 6);
    // Across the strap: towards the lens where it hangs, along the ground where it lies.
    let ups =
        path.iter().map(|p| if p.y > 1.4 { DVec3::new(p.x.signum(), 0.25, 0.0) } else { DVec3::Y }).collect();
    let section = |_: f64, corner: usize| {
        let edge = [(-0.5, -0.08), (0.5, -0.08), (0.55, 0.0), (0.5, 0.08), (-0.5, 0.08), (-0.55, 0.0)];
        DVec2::from(edge[corner])
    };
    model.add(&STRAP, sweep(&Path::with_ups(path, smoothed(ups), Ends::Open), 6, section));
}

/// A curve in space through `knots`.
fn curve(knots: &[DVec3], steps: usize) -> Vec<DVec3> {
    let flat = |a: fn(&DVec3) -> f64, b: fn(&DVec3) -> f64| {
        spline(&knots.iter().map(|p| (a(p), b(p))).collect::<Vec<_>>(), steps)
    };
    let (xy, zy) = (flat(|p| p.x, |p| p.y), flat(|p| p.z, |p| p.y));
    xy.iter().zip(&zy).map(|(xy, zy)| DVec3::new(xy.x, xy.y, zy.x)).collect()
}

/// Each direction averaged with its neighbours, several times over.
fn smoothed(mut directions: Vec<DVec3>) -> Vec<DVec3> {
    for _ in 0..12 {
        let last = directions.len() - 1;
        let mean = |i: usize| {
            (directions[i.saturating_sub(1)] + directions[i] * 2.0 + directions[(i + 1).min(last)])
                .normalize_or(DVec3::Y)
        };
        directions = (0..=last).map(mean).collect();
    }
    directions
}

/// A stone disc with a brass line, its top at Y = 0.
fn turntable() -> Model {
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
fn studio() -> Model {
    let mut model = Model::default();
    let mut profile = vec![(110.0, 120.0), (110.0, 60.0), (110.0, 60.0)];
    profile.extend(
        (0..=8).map(|step| unit(-11.25 * f64::from(step))).map(|p| (60.0 + 50.0 * p.x, 48.4 + 50.0 * p.y)),
    );
    profile.extend([(60.0, -1.6), (60.0, -1.6), (0.0, -1.6)]);
    model.add(&STUDIO, lathe(&spline(&profile, 3), 96));
    model
}
