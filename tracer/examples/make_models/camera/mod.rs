//! A rangefinder camera on a turntable, in a round studio. Everything stands on Y = 0 round the origin, so it may
//! spin. Units are centimetres; the scene works in them too.

mod body;
mod lens;
mod stage;
mod strap;
mod top;

use glam::{DVec2, DVec3};

use super::angle::unit;
use super::obj::Digits::{Coarse, Finest};
use super::obj::Shading::Smooth;
use super::shape::{Material, Model, Shape};
use super::{Folder, Part};

/// Satin metal.
static CHROME: Material = Material::metal("chrome", [0.235, 0.232, 0.225], [0.72, 0.71, 0.68], 24.0);
static BLACK: Material = Material::glossy("black", [0.022, 0.022, 0.024], 0.40, 70.0);
static LEATHER: Material = Material::glossy("leather", [0.185, 0.062, 0.028], 0.20, 26.0);
static STRAP: Material = Material::glossy("strap", [0.150, 0.050, 0.024], 0.14, 20.0);
static GLASS: Material = Material::glossy("lens_glass", [0.030, 0.026, 0.070], 0.95, 140.0);
static WINDOW: Material = Material::glossy("window_glass", [0.030, 0.045, 0.055], 0.80, 200.0);
/// Scales and marks.
static ENGRAVING: Material = Material::matt("engraving", [0.700, 0.680, 0.620]);
static RED: Material = Material::glossy("red_dot", [0.500, 0.020, 0.015], 0.30, 60.0);
static TURNTABLE: Material = Material::glossy("turntable", [0.078, 0.076, 0.078], 0.22, 60.0);
static BRASS: Material = Material::metal("brass_edge", [0.360, 0.235, 0.080], [0.70, 0.52, 0.25], 60.0);
static STUDIO: Material = Material::matt("studio", [0.120, 0.185, 0.190]);

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
        Part::new("turntable", Smooth, Finest, stage::turntable()),
        Part::new("studio", Smooth, Finest, stage::studio()),
    ];
    Folder { name: "camera", parts }
}

/// The camera with its strap, looking towards +Z.
fn camera() -> Model {
    let mut model = body::body();
    model.include(top::top());
    model.include(lens::lens());
    model.include(strap::strap());
    model
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
