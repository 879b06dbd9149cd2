//! Three linear channels in four bytes: mantissas of nine bits and one exponent of five (RGB9E5, the format of the OpenGL
//! extension EXT_texture_shared_exponent).
//!
//! ```text
//!   channel = m 2^(e - 24)       bits 0-8, 9-17, 18-26: m of R, G, B; bits 27-31: e
//! ```
//!
//! From 2^-16 on the largest channel of a colour has a mantissa of at least 256, so its relative error is at most 1/512. The error of
//! the other channels has the same bound, 1/512 of the largest channel; below 2^-16 the bound is 2^-25. Every four bytes are a valid
//! colour, and finite.

/// The largest channel: 511 * 2^7.
pub const MAX_CHANNEL: f32 = 65_408.0;

/// Largest mantissa plus one.
const MANTISSAS: u32 = 1 << 9;

/// Binary digits of the smallest step behind the point: m = 1, e = 0.
const FRACTION_BITS: i32 = 24;

/// The power of two 2^`exponent`, for exponents of normal numbers.
#[inline(always)]
fn power_of_two(exponent: i32) -> f32 {
    f32::from_bits(((exponent + 127) as u32) << 23)
}

/// The four bytes nearest to a colour. NaN and negative channels count as 0, larger ones than [`MAX_CHANNEL`] as that.
pub(super) fn pack(color: [f32; 3]) -> u32 {
    // The comparison is false for NaN.
    let color = color.map(|channel| if channel > 0.0 { channel.min(MAX_CHANNEL) } else { 0.0 });
    let largest = color[0].max(color[1]).max(color[2]);
    let floor_of_log2 = (largest.to_bits() >> 23) as i32 - 127;
    // The exponent for which the largest mantissa is in [256, 512).
    let exponent = (floor_of_log2 + 16).max(0);
    let rounded = |exponent: i32| {
        let per_step = power_of_two(FRACTION_BITS - exponent);
        color.map(|channel| (channel * per_step).round_ties_even() as u32)
    };
    let mantissas = rounded(exponent);
    if mantissas.iter().all(|&mantissa| mantissa < MANTISSAS) {
        word(mantissas, exponent)
    } else {
        word(rounded(exponent + 1), exponent + 1)
    }
}

fn word([r, g, b]: [u32; 3], exponent: i32) -> u32 {
    r | g << 9 | b << 18 | (exponent as u32) << 27
}

/// The colour of four bytes, exactly.
#[inline(always)]
pub(super) fn unpack(word: u32) -> [f32; 3] {
    let step = power_of_two((word >> 27) as i32 - FRACTION_BITS);
    let mantissa = |shift: u32| (word >> shift & (MANTISSAS - 1)) as f32;
    [mantissa(0) * step, mantissa(9) * step, mantissa(18) * step]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn known_colors_have_their_bits() {
        for (color, bits) in [
            ([0.0; 3], 0),
            ([1.0, 0.5, 0.25], 16 << 27 | 64 << 18 | 128 << 9 | 256),
            ([MAX_CHANNEL; 3], u32::MAX),
            ([1.0 / (1 << 24) as f32, 0.0, 0.0], 1),
            // Rounds up to a mantissa of 512, which takes the next exponent.
            ([1.999, 0.0, 0.0], 17 << 27 | 256),
        ] {
            assert_eq!(pack(color), bits, "{color:?}");
        }
        assert_eq!(unpack(u32::MAX), [MAX_CHANNEL; 3]);
    }

    #[test]
    fn numbers_out_of_range_are_replaced() {
        let odd = [f32::NAN, -1.0, f32::NEG_INFINITY, -0.0, f32::INFINITY, 1e30, 65_409.0, f32::MIN_POSITIVE];
        let expected = [0.0, 0.0, 0.0, 0.0, MAX_CHANNEL, MAX_CHANNEL, MAX_CHANNEL, 0.0];
        for (channel, expected) in odd.into_iter().zip(expected) {
            assert_eq!(unpack(pack([channel; 3])), [expected; 3], "{channel}");
        }
        // The others are kept.
        assert_eq!(unpack(pack([f32::NAN, 0.5, -3.0])), [0.0, 0.5, 0.0]);
    }

    proptest! {
        #[test]
        fn colors_are_kept_to_one_part_in_512_of_the_largest_channel(
            mantissas in prop::array::uniform3(0.0_f32..1.0), scale in -20_i32..=16,
        ) {
            let color = mantissas.map(|m| (m * power_of_two(scale)).min(MAX_CHANNEL));
            let largest = color.into_iter().fold(0.0, f32::max);
            let allowed = f64::from(largest) / 512.0 + 1.0 / f64::from(1 << 25);
            for (kept, channel) in unpack(pack(color)).into_iter().zip(color) {
                prop_assert!((f64::from(kept) - f64::from(channel)).abs() <= allowed, "{} of {:?}", kept, color);
            }
        }

        #[test]
        fn what_is_packed_again_keeps_its_value(word: u32) {
            let color = unpack(word);
            prop_assert!(color.iter().all(|channel| (0.0..=MAX_CHANNEL).contains(channel)));
            prop_assert_eq!(unpack(pack(color)), color);
        }
    }
}
