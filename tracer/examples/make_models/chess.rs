//! A chess set: turned pieces, a knight with a carved head, and the board. Units are squares; a scene scales them.

use glam::{DVec2, DVec3};

use super::angle::{heading, unit};
use super::obj::Digits::Coarse;
use super::obj::Shading::{Flat, Smooth};
use super::random::pick;
use super::shape::{Material, Model, Shape};
use super::shapes::{
    Ends, Path, beveled_box, lathe, lathe_every, plain_box, rectangle_moulding, spline, sweep,
};
use super::{Folder, Part};

/// The pieces' own material; a scene overrides it for either side.
static PIECE: Material = Material::glossy("piece", [0.62, 0.47, 0.28], 0.30, 60.0);
/// Light squares, three tones.
static LIGHT: [Material; 3] = [
    Material::glossy("maple_a", [0.560, 0.400, 0.220], 0.14, 50.0),
    Material::glossy("maple_b", [0.600, 0.440, 0.250], 0.14, 50.0),
    Material::glossy("maple_c", [0.525, 0.370, 0.195], 0.14, 50.0),
];
/// Dark squares, three tones.
static DARK: [Material; 3] = [
    Material::glossy("walnut_a", [0.120, 0.052, 0.024], 0.16, 50.0),
    Material::glossy("walnut_b", [0.140, 0.064, 0.030], 0.16, 50.0),
    Material::glossy("walnut_c", [0.102, 0.045, 0.021], 0.16, 50.0),
];
/// The border.
static ROSEWOOD: Material = Material::glossy("rosewood", [0.105, 0.030, 0.016], 0.20, 60.0);
/// The line between border and squares.
static INLAY: Material = Material::metal("inlay", [0.380, 0.250, 0.090], [0.60, 0.45, 0.20], 60.0);

/// Pieces round a turned shape.
const SEGMENTS: usize = 32;

/// Everything in `models/chess/`.
pub(crate) fn folder() -> Folder {
    let piece = |name, shape| {
        let mut model = Model::default();
        model.add(&PIECE, shape);
        Part::new(name, Smooth, Coarse, model)
    };
    let parts = vec![
        Part::new("board", Flat, Coarse, board()),
        piece("pawn", pawn()),
        piece("rook", rook()),
        piece("knight", knight()),
        piece("bishop", bishop()),
        piece("queen", queen()),
        piece("king", king()),
    ];
    Folder { name: "chess", parts }
}

/// 8 x 8 squares round the origin, their upper faces at Y = 0, with a moulded border.
fn board() -> Model {
    let mut model = Model::default();
    for square in 0..64u64 {
        let (file, rank) = (square % 8, square / 8);
        let wood = if (file + rank) % 2 == 0 { &DARK } else { &LIGHT };
        let tile = beveled_box(DVec3::new(0.995, 0.1, 0.995), 0.008);
        model.add(pick(70, square, &wood.each_ref()), tile.at(file as f64 - 3.5, -0.05, 3.5 - rank as f64));
    }
    let flat = |shape: Shape| shape.turned_x(-90.0);
    let line = [(0.0, 0.0), (0.0, 0.004), (0.06, 0.004), (0.06, 0.0)];
    model.add(&INLAY, flat(rectangle_moulding(DVec2::splat(8.12), &line)));
    let border = [
        (0.0, -0.36),
        (0.0, -0.30),
        (0.03, -0.27),
        (0.03, -0.22),
        (0.0, -0.18),
        (0.0, -0.06),
        (0.03, 0.0),
        (0.08, 0.02),
        (0.70, 0.02),
        (0.73, 0.01),
        (0.73, -0.05),
    ];
    model.add(&ROSEWOOD, flat(rectangle_moulding(DVec2::splat(9.56), &border)));
    model.add(&ROSEWOOD, plain_box(DVec3::new(-4.7, -0.35, -4.7), DVec3::new(4.7, -0.1, 4.7)));
    model
}

/// Foot and stem common to all pieces: a moulded foot of `radius`, drawn in to `neck` at `height`.
fn foot(radius: f64, neck: f64, height: f64) -> Vec<(f64, f64)> {
    vec![
        (0.0, 0.0),
        (radius, 0.0),
        (radius, 0.0),
        (radius, 0.04),
        (radius * 0.98, 0.07),
        (radius * 0.86, 0.10),
        (radius * 0.84, 0.13),
        (radius * 0.84, 0.13),
        (radius * 0.90, 0.15),
        (radius * 0.88, 0.19),
        (radius * 0.70, 0.23),
        (radius * 0.66, 0.25),
        (radius * 0.66, 0.25),
        (radius * 0.52, 0.32),
        ((radius * 0.52 + neck) / 2.2, (0.32 + height) / 2.0),
        (neck, height),
        (neck, height),
    ]
}

/// A collar of `radius` at `height`: two rings, a wide one between thin ones.
fn collar(radius: f64, height: f64) -> [(f64, f64); 7] {
    [
        (radius * 0.80, height),
        (radius * 0.86, height + 0.012),
        (radius * 0.80, height + 0.024),
        (radius * 0.80, height + 0.024),
        (radius, height + 0.045),
        (radius * 0.97, height + 0.06),
        (radius * 0.60, height + 0.085),
    ]
}

fn turned(parts: &[&[(f64, f64)]]) -> Shape {
    lathe(&spline(&parts.concat(), 4), SEGMENTS)
}

/// A ball of `radius` round `height`, from where it leaves a neck of `neck` to its top.
fn ball(radius: f64, neck: f64, height: f64) -> Vec<(f64, f64)> {
    let start = -libm::acos(neck / radius).to_degrees();
    let steps = 8;
    let point = |step: i32| unit(start + (90.0 - start) * f64::from(step) / f64::from(steps)) * radius;
    (0..=steps).map(|step| (point(step).x.max(0.0), height + point(step).y)).collect()
}

fn pawn() -> Shape {
    turned(&[&foot(0.32, 0.105, 0.60), &collar(0.20, 0.60), &ball(0.165, 0.09, 0.82)])
}

fn bishop() -> Shape {
    let mitre = [
        (0.10, 0.93),
        (0.10, 0.97),
        (0.155, 1.03),
        (0.165, 1.10),
        (0.13, 1.22),
        (0.07, 1.31),
        (0.045, 1.335),
    ];
    let cleft = |p: DVec3| {
        // The slit of the mitre: what lies in its plane is drawn towards the axis.
        let distance = (p.y - 1.17) - 0.9 * p.x;
        let depth = if p.x > 0.02 && p.y > 1.05 {
            0.45 * libm::exp(-(distance / 0.022) * (distance / 0.022))
        } else {
            0.0
        };
        DVec3::new(p.x * (1.0 - depth), p.y, p.z * (1.0 - 0.4 * depth))
    };
    let top = ball(0.048, 0.03, 1.375);
    let lower = turned(&[&foot(0.36, 0.11, 0.80), &collar(0.22, 0.80)]);
    let upper = lathe_every(&spline(&[&mitre[..], &top].concat(), 4), SEGMENTS);
    Shape::union([lower, upper.mapped(cleft)])
}

fn queen() -> Shape {
    let crown = [
        (0.12, 1.10),
        (0.13, 1.16),
        (0.17, 1.30),
        (0.21, 1.42),
        (0.21, 1.42),
        (0.205, 1.43),
        (0.17, 1.415),
        (0.15, 1.40),
        (0.15, 1.40),
        (0.12, 1.455),
        (0.05, 1.48),
    ];
    let top = ball(0.05, 0.03, 1.525);
    let points = |p: DVec3| {
        let is_rim = p.y > 1.36 && DVec2::new(p.x, p.z).length() > 0.165;
        let wave = unit(8.0 * libm::atan2(p.x, p.z).to_degrees()).x;
        DVec3::new(p.x, if is_rim { p.y + 0.035 * wave * (p.y - 1.36) / 0.06 } else { p.y }, p.z)
    };
    turned(&[&foot(0.40, 0.125, 0.96), &collar(0.25, 0.96), &crown, &top]).mapped(points)
}

fn king() -> Shape {
    let crown = [
        (0.13, 1.18),
        (0.14, 1.24),
        (0.175, 1.38),
        (0.21, 1.50),
        (0.21, 1.50),
        (0.205, 1.515),
        (0.15, 1.56),
        (0.06, 1.59),
        (0.05, 1.60),
        (0.05, 1.60),
        (0.055, 1.625),
        (0.03, 1.645),
        (0.0, 1.645),
    ];
    let body = turned(&[&foot(0.42, 0.13, 1.04), &collar(0.26, 1.04), &crown]);
    let upright = beveled_box(DVec3::new(0.065, 0.24, 0.05), 0.012).at(0.0, 1.75, 0.0);
    let bar = beveled_box(DVec3::new(0.18, 0.065, 0.05), 0.012).at(0.0, 1.77, 0.0);
    Shape::union([body, upright, bar])
}

fn rook() -> Shape {
    let tower = [
        (0.19, 0.72),
        (0.19, 0.76),
        (0.235, 0.80),
        (0.24, 0.82),
        (0.24, 0.82),
        (0.24, 0.86),
        (0.24, 0.86),
        (0.16, 0.86),
        (0.16, 0.86),
        (0.16, 0.83),
        (0.16, 0.83),
        (0.0, 0.83),
    ];
    let body = turned(&[&foot(0.37, 0.185, 0.66), &collar(0.24, 0.63), &tower]);
    let merlons = (0..6).map(|i| merlon(60.0 * f64::from(i)));
    Shape::union([body].into_iter().chain(merlons))
}

/// One tooth of the battlement round a bearing.
fn merlon(bearing: f64) -> Shape {
    let arc = |step: usize| heading(bearing - 20.0 + 5.0 * step as f64);
    let path =
        Path::new((0..=8).map(|step| arc(step) * 0.2 + DVec3::Y * 0.89).collect(), DVec3::Y, Ends::Open);
    let section =
        [(-0.04, -0.04), (0.04, -0.04), (0.04, 0.035), (0.035, 0.04), (-0.035, 0.04), (-0.04, 0.035)];
    sweep(&path, section.len(), |_, corner| DVec2::from(section[corner]))
}

/// The knight looks towards +X.
fn knight() -> Shape {
    let base = turned(&[&foot(0.37, 0.24, 0.36)]);
    let plinth = lathe(&spline(&[(0.24, 0.33), (0.25, 0.37), (0.22, 0.40), (0.0, 0.42)], 3), SEGMENTS);
    let ears = [-1.0, 1.0].map(|side| {
        let cone = spline(&[(0.055, 0.0), (0.05, 0.05), (0.0, 0.12)], 3);
        lathe(&cone, 12)
            .mapped(|p| DVec3::new(p.x * 0.8, p.y, p.z * 0.6))
            .turned_x(12.0 * side)
            .turned_z(8.0)
            .at(-0.03, 1.13, 0.065 * side)
    });
    let eyes = [-1.0, 1.0].map(|side| {
        let eye = lathe(&spline(&[(0.0, -0.02), (0.022, 0.0), (0.0, 0.02)], 4), 12);
        eye.at(0.13, 1.065, 0.112 * side)
    });
    Shape::union([base, plinth, neck_and_head(), mane()].into_iter().chain(ears).chain(eyes))
}

/// Half sizes of the sections along the neck, over the poll, and down to the muzzle: (across the piece, in the
/// plane of the piece).
const HEAD_SECTIONS: [(f64, f64); 10] = [
    (0.21, 0.215),
    (0.175, 0.20),
    (0.150, 0.20),
    (0.135, 0.195),
    (0.128, 0.17),
    (0.125, 0.155),
    (0.115, 0.13),
    (0.098, 0.108),
    (0.092, 0.095),
    (0.084, 0.074),
];

fn neck_and_head() -> Shape {
    let spine = Path::in_xy(
        &[
            (-0.01, 0.39),
            (-0.045, 0.55),
            (-0.065, 0.72),
            (-0.05, 0.88),
            (-0.01, 1.0),
            (0.07, 1.055),
            (0.15, 1.035),
            (0.235, 0.965),
            (0.29, 0.90),
            (0.325, 0.855),
        ],
        4,
    );
    sweep(&spine, 24, |t, corner| {
        let place = t * (HEAD_SECTIONS.len() - 1) as f64;
        let i = (place as usize).min(HEAD_SECTIONS.len() - 2);
        let half = DVec2::from(HEAD_SECTIONS[i]).lerp(DVec2::from(HEAD_SECTIONS[i + 1]), place - i as f64);
        let direction = unit(15.0 * corner as f64);
        DVec2::new(direction.x * half.y, direction.y * half.x)
    })
}

/// A ridge with notches down the back of the neck.
fn mane() -> Shape {
    let crest = Path::in_xy(
        &[(0.0, 1.19), (-0.10, 1.14), (-0.19, 1.0), (-0.245, 0.84), (-0.25, 0.68), (-0.225, 0.52)],
        8,
    );
    sweep(&crest, 12, |t, corner| {
        let notch = 1.0 - 0.22 * unit(360.0 * 9.0 * t).x;
        let taper = (1.0 - (2.0 * t - 1.0) * (2.0 * t - 1.0)).max(0.0).sqrt();
        unit(30.0 * corner as f64) * DVec2::new(0.062 * notch, 0.045) * (0.25 + 0.75 * taper)
    })
}
