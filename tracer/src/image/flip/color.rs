//! Colours: from bytes to the opponent space of the filters, from there to L*a*b*, and their difference.

use glam::{DMat3, DVec2, DVec3, Mat3, Vec3, Vec3Swizzles};

use crate::srgb;

/// Chromaticities of sRGB's red, green and blue, and of its white, D65 (IEC 61966-2-1).
const PRIMARIES: [DVec2; 3] = [DVec2::new(0.64, 0.33), DVec2::new(0.30, 0.60), DVec2::new(0.15, 0.06)];
const WHITE: DVec2 = DVec2::new(0.3127, 0.3290);

/// q_c, the exponent that compresses large colour differences.
const EXPONENT: f32 = 0.7;
/// p_c and p_t: errors below p_c of the largest one take p_t of the range.
const LOW: f32 = 0.4;
const LOW_RANGE: f32 = 0.95;

/// The sRGB colour space.
pub(super) struct ColorSpace {
    /// From linear RGB to X, Y and Z, each as a share of white's.
    from_rgb: Mat3,
    to_rgb: Mat3,
}

impl ColorSpace {
    pub(super) fn new() -> Self {
        let xyz = |c: DVec2| DVec3::new(c.x / c.y, 1.0, (1.0 - c.x - c.y) / c.y);
        let [r, g, b] = PRIMARIES.map(xyz);
        let primaries = DMat3::from_cols(r, g, b);
        let white = xyz(WHITE);
        // The sum of the three primaries is white.
        let amounts = primaries.inverse() * white;
        let from_rgb = DMat3::from_diagonal(1.0 / white) * primaries * DMat3::from_diagonal(amounts);
        Self { from_rgb: from_rgb.as_mat3(), to_rgb: from_rgb.inverse().as_mat3() }
    }

    /// An encoded colour as Y, Cx and Cz: luminance, red against green, blue against yellow. Linear in light.
    pub(super) fn opponent(&self, rgb: [u8; 3]) -> Vec3 {
        let decoded = srgb::decoded();
        let xyz = self.from_rgb * Vec3::from_array(rgb.map(|code| decoded[usize::from(code)]));
        Vec3::new(116.0 * xyz.y - 16.0, 500.0 * (xyz.x - xyz.y), 200.0 * (xyz.y - xyz.z))
    }

    /// Y, Cx and Cz as L*, a* and b* with Hunt's adjustment: dark colours count less. Filtered colours outside of the
    /// gamut are clamped to it.
    pub(super) fn seen(&self, opponent: Vec3) -> Vec3 {
        let y = (opponent.x + 16.0) / 116.0;
        let xyz = Vec3::new(opponent.y / 500.0 + y, y, y - opponent.z / 200.0);
        self.adjusted((self.to_rgb * xyz).clamp(Vec3::ZERO, Vec3::ONE))
    }

    fn adjusted(&self, linear: Vec3) -> Vec3 {
        let [x, y, z] = (self.from_rgb * linear).to_array().map(lightness);
        let l = 116.0 * y - 16.0;
        Vec3::new(l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z))
    }
}

/// Cube root of CIE L*a*b*, linear near zero.
fn lightness(share: f32) -> f32 {
    const BEND: f32 = 6.0 / 29.0;
    if share > BEND * BEND * BEND { share.cbrt() } else { share / (3.0 * BEND * BEND) + 4.0 / 29.0 }
}

/// HyAB, a difference of distant colours (Abasi, Tehran, Fairchild 2020).
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let difference = a - b;
    difference.x.abs() + difference.yz().length()
}

/// Delta E_c, the colour error.
pub(super) struct ColorError {
    /// Error of green compared with blue, the largest one on a monitor.
    greatest: f32,
}

impl ColorError {
    pub(super) fn new(space: &ColorSpace) -> Self {
        Self { greatest: hyab(space.adjusted(Vec3::Y), space.adjusted(Vec3::Z)).powf(EXPONENT) }
    }

    /// The error, 0..1, of one Hunt-adjusted colour compared with another.
    pub(super) fn of(&self, a: Vec3, b: Vec3) -> f32 {
        let error = hyab(a, b).powf(EXPONENT);
        let low = LOW * self.greatest;
        if error < low {
            LOW_RANGE / low * error
        } else {
            LOW_RANGE + (error - low) / (self.greatest - low) * (1.0 - LOW_RANGE)
        }
    }
}
