//! Exposure and tone curves: from linear light to linear colours of a display, 0 is black, 1 the brightest.
//!
//! ```text
//!   srgb      the light itself; the encoder clips above 1
//!   agx       AgX (Troy Sobotka): a matrix, log2 from -12.47393 to 4.026069, a curve, the inverse matrix, a power of 2.2. The curve
//!             is the polynomial of sixth degree of Benjamin Wrensch, "Minimal AgX Implementation", 2023; off by 0.002 (RMS)
//!   aces      x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14): Krzysztof Narkowicz, "ACES Filmic Tone Mapping Curve", 2016
//!   neutral   "Khronos PBR Neutral Tone Mapper", 2024: colours below 0.8 keep hue and saturation, brighter ones approach white
//! ```
//!
//! Plain operations in a fixed order: the same bits on every level.

use crate::scene::{ToneCurve, ToneMapping};
use crate::simd::math::{exp2, log2};
use crate::simd::vector::Vec3x16;
use crate::simd::{Simd, SimdBase, f32x16, select, splat, three};

/// Light beyond this counts as this: all curves have reached their upper end.
const BRIGHTEST: f32 = 65_536.0;

/// Light below this counts as this where logarithms are taken: far below the lower end of AgX.
const DARKEST: f32 = 1e-10;

/// A tone mapping with its factor.
#[derive(Clone, Copy)]
pub(super) struct Tone {
    /// 2 to the power of the exposure.
    scale: f32,
    curve: ToneCurve,
}

impl Tone {
    pub(super) fn new(mapping: ToneMapping) -> Self {
        let scale = libm::exp2(f64::from(mapping.exposure)) as f32;
        // A scale that is not finite would make NaN of black.
        Self { scale: scale.min(f32::MAX), curve: mapping.curve }
    }

    /// Linear colours of the display for linear light. Negative light and NaN become 0.
    #[inline(always)]
    pub(super) fn apply<S: Simd>(self, simd: S, light: Vec3x16<S>) -> Vec3x16<S> {
        let (zero, brightest, scale) = (splat(simd, 0.0), splat(simd, BRIGHTEST), splat(simd, self.scale));
        let exposed = three!(channel => {
            let exposed = light.0[channel] * scale;
            // False for NaN.
            select(exposed.simd_gt(zero), exposed, zero).min(brightest)
        });
        match self.curve {
            ToneCurve::Srgb => Vec3x16(exposed),
            ToneCurve::Agx => Vec3x16(agx(simd, exposed)),
            ToneCurve::Aces => Vec3x16(three!(channel => aces(simd, exposed[channel]))),
            ToneCurve::Neutral => Vec3x16(neutral(simd, exposed)),
        }
    }
}

/// Narkowicz' curve.
#[inline(always)]
fn aces<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    let upper = x * (x * splat(simd, 2.51) + splat(simd, 0.03));
    let lower = x * (x * splat(simd, 2.43) + splat(simd, 0.59)) + splat(simd, 0.14);
    upper / lower
}

/// Khronos' neutral mapper. Below F90 = 0.04 of reflected white, the smallest channel x loses x - 6.25 x^2, above it 0.04; what then
/// exceeds 0.76 is compressed, and mixed with white.
#[inline(always)]
fn neutral<S: Simd>(simd: S, color: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
    const START: f32 = 0.8 - 0.04;
    const REST: f32 = 1.0 - START;
    const DESATURATION: f32 = 0.15;
    let (one, start) = (splat(simd, 1.0), splat(simd, START));
    let least = color[0].min(color[1]).min(color[2]);
    let dark = least - splat(simd, 6.25) * least * least;
    let offset = select(least.simd_lt(splat(simd, 0.08)), dark, splat(simd, 0.04));
    let color = three!(channel => color[channel] - offset);
    let peak = color[0].max(color[1]).max(color[2]);
    let is_bright = peak.simd_ge(start);
    // Unused where the peak is lower; the bound avoids a division by zero there.
    let peak = peak.max(start);
    let compressed = one - splat(simd, REST * REST) / (peak + splat(simd, REST) - start);
    let shrink = compressed / peak;
    let whiteness = one - one / (splat(simd, DESATURATION) * (peak - compressed) + one);
    three!(channel => {
        let shrunk = color[channel] * shrink;
        let mixed = shrunk + (compressed - shrunk) * whiteness;
        select(is_bright, mixed, color[channel])
    })
}

/// Wrensch's approximation of AgX, back in linear light.
#[inline(always)]
fn agx<S: Simd>(simd: S, color: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
    const INSET: [[f32; 3]; 3] = [
        [0.842_479_06, 0.078_433_6, 0.079_223_745],
        [0.042_328_242, 0.878_468_64, 0.079_166_13],
        [0.042_375_655, 0.078_433_6, 0.879_143],
    ];
    const OUTSET: [[f32; 3]; 3] = [
        [1.196_879, -0.098_020_88, -0.099_029_74],
        [-0.052_896_85, 1.151_903_1, -0.098_961_18],
        [-0.052_971_635, -0.098_043_45, 1.151_073_7],
    ];
    let inset = product(simd, &INSET, color);
    let curved = three!(channel => contrast(simd, inset[channel]));
    let display = product(simd, &OUTSET, curved);
    let (darkest, power) = (splat(simd, DARKEST), splat(simd, 2.2));
    three!(channel => exp2(simd, power * log2(simd, display[channel].max(darkest))))
}

/// The curve of AgX over the logarithm of light.
#[inline(always)]
fn contrast<S: Simd>(simd: S, light: f32x16<S>) -> f32x16<S> {
    const LOWEST: f32 = -12.473_93;
    const HIGHEST: f32 = 4.026_069;
    const SERIES: [f32; 7] = [-0.002_32, 0.119_1, 0.429_8, -6.868, 31.96, -40.14, 15.5];
    let (lowest, highest) = (splat(simd, LOWEST), splat(simd, HIGHEST));
    let stops = log2(simd, light.max(splat(simd, DARKEST))).max(lowest).min(highest);
    let x = (stops - lowest) / splat(simd, HIGHEST - LOWEST);
    let mut sum = splat(simd, SERIES[6]);
    for i in 0..6 {
        sum = sum * x + splat(simd, SERIES[5 - i]);
    }
    sum
}

/// A matrix, given by rows, times colours.
#[inline(always)]
fn product<S: Simd>(simd: S, matrix: &[[f32; 3]; 3], color: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
    three!(row => {
        let [r, g, b] = three!(column => splat(simd, matrix[row][column]) * color[column]);
        r + g + b
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{LANES, Lanes, all, dispatch};

    #[inline(always)]
    fn applied<S: Simd>(simd: S, tone: Tone, light: &[Lanes; 3]) -> [Lanes; 3] {
        let mut display = [Lanes::ZERO; 3];
        tone.apply(simd, Vec3x16::load(simd, light)).store(&mut display);
        display
    }

    /// Display colours of sixteen lights, the same bits on all levels.
    fn sixteen(exposure: f32, curve: ToneCurve, light: &[[f32; 3]; LANES]) -> [[f32; 3]; LANES] {
        let tone = Tone::new(ToneMapping { exposure, curve });
        let lanes = [0, 1, 2].map(|channel| Lanes(light.map(|light| light[channel])));
        let first = dispatch!(all()[0], simd => applied(simd, tone, &lanes));
        for level in all() {
            let here = dispatch!(level, simd => applied(simd, tone, &lanes));
            for channel in 0..3 {
                assert_eq!(
                    here[channel].0.map(f32::to_bits),
                    first[channel].0.map(f32::to_bits),
                    "{curve:?}"
                );
            }
        }
        std::array::from_fn(|lane| [0, 1, 2].map(|channel| first[channel].0[lane]))
    }

    fn one(curve: ToneCurve, light: [f32; 3]) -> [f32; 3] {
        sixteen(0.0, curve, &[light; LANES])[0]
    }

    fn assert_near(found: [f32; 3], expected: [f32; 3], what: &str) {
        for channel in 0..3 {
            let off = (found[channel] - expected[channel]).abs();
            assert!(off < 2e-5, "{what}: {found:?}, expected {expected:?}");
        }
    }

    /// Grey from 2^-16 to 2^12, then whatever a broken scene may have.
    fn greys() -> Vec<[[f32; 3]; LANES]> {
        let grey = |i: usize| libm::exp2(-16.0 + 28.0 * i as f64 / 4799.0) as f32;
        (0..300).map(|step| std::array::from_fn(|lane| [grey(16 * step + lane); 3])).collect()
    }

    #[test]
    fn a_ramp_of_grey_rises_to_white() {
        for (word, curve) in ToneCurve::WORDS {
            let mut last = 0.0;
            for light in greys() {
                for display in sixteen(0.0, curve, &light) {
                    let dark = display.into_iter().fold(f32::INFINITY, f32::min);
                    // Rounding may lower a value by some units in the last place.
                    assert!(dark >= last * (1.0 - 2e-6), "{word}: {display:?} after {last}");
                    last = dark;
                    let spread = display.into_iter().fold(0.0, f32::max) - dark;
                    assert!(spread <= 6e-4 * dark, "{word}: grey became {display:?}");
                }
            }
            assert!(last > 0.99, "{word} ends at {last}");
        }
    }

    #[test]
    fn black_and_what_is_no_light_are_black() {
        for (word, curve) in ToneCurve::WORDS {
            for light in [0.0, -0.0, -5.0, f32::NAN, f32::NEG_INFINITY] {
                for exposure in [-20.0, 0.0, 20.0, 1000.0] {
                    let [display, ..] = sixteen(exposure, curve, &[[light; 3]; LANES]);
                    assert!(display.iter().all(|value| (0.0..1e-9).contains(value)), "{word}: {display:?}");
                }
            }
            let [bright, ..] = sixteen(0.0, curve, &[[f32::INFINITY; 3]; LANES]);
            assert!(bright.iter().all(|value| *value > 0.99 && value.is_finite()), "{word}: {bright:?}");
        }
    }

    #[test]
    fn exposure_counts_in_stops() {
        let light = [0.01, 0.2, 0.4];
        for (_, curve) in ToneCurve::WORDS {
            let brighter = light.map(|value| value * 8.0);
            assert_eq!(sixteen(3.0, curve, &[light; LANES])[0], one(curve, brighter));
            let darker = light.map(|value| value / 4.0);
            assert_eq!(sixteen(-2.0, curve, &[light; LANES])[0], one(curve, darker));
        }
    }

    #[test]
    fn aces_has_the_values_of_its_formula() {
        // 2.54 / 3.16, and 0.086724 / 0.324932.
        assert_near(one(ToneCurve::Aces, [1.0, 0.18, 0.0]), [0.803_797_5, 0.266_899, 0.0], "aces");
    }

    #[test]
    fn neutral_has_the_values_of_its_formula() {
        // Below 0.08: 6.25 x^2. Up to 0.8: less 0.04. Above: 1 - 0.0576 / (0.96 - 0.52).
        let greys = [(0.04, 0.01), (0.5, 0.46), (0.8, 0.76), (1.0, 0.869_090_9)];
        for (light, display) in greys {
            assert_near(one(ToneCurve::Neutral, [light; 3]), [display; 3], "neutral");
        }
        // Red without blue: nothing is subtracted, the peak 2 becomes 1 - 0.0576 / 1.48 = 0.961081, the rest is mixed with white
        // by 1 - 1 / (0.15 (2 - 0.961081) + 1) = 0.134827.
        assert_near(one(ToneCurve::Neutral, [2.0, 1.0, 0.0]), [0.961_081, 0.545_329, 0.129_578], "red");
    }

    #[test]
    fn agx_has_the_values_of_its_formula() {
        // Computed in double precision from the published matrices and coefficients.
        assert_near(one(ToneCurve::Agx, [0.18; 3]), [0.214_467_4, 0.214_532_7, 0.214_536_7], "grey");
        assert_near(one(ToneCurve::Agx, [1.0, 0.0, 0.0]), [0.719_417_1, 0.039_487_6, 0.039_550_3], "red");
    }
}
