//! Fewer colours: RGB 5-6-5, in the bytes of RGB8.
//!
//! Channels are rounded to the nearest: at most 4 steps of 255 (green 2), and on three pictures 1.9 to 2.1 in the root mean square. Ordered
//! dithering was tried on them: at most 8 steps, 2.7 to 2.9 in the root mean square, and a quarter to three quarters more bytes when
//! compressed; only the mean over 4 x 4 pixels is nearer (0.4 for 1.6).

use crate::simd::{Level, Simd, dispatch};

/// Rounds each pixel to the nearest colour whose channels have five, six and five bits. A channel of so many bits is shown as the byte
/// that repeats its upper bits below, so that both ends of the range stay where they are.
pub(crate) fn reduce_colors(level: Level, pixels: &mut [u8]) {
    dispatch!(level, simd => reduce(simd, pixels));
}

/// Sixteen pixels at a time, so that the compiler sees vectors: whole numbers, the same on every level.
#[inline(always)]
fn reduce<S: Simd>(_: S, pixels: &mut [u8]) {
    let (many, rest) = pixels.as_chunks_mut::<48>();
    for chunk in many {
        for index in 0..48 {
            chunk[index] = rounded(index % 3, chunk[index]);
        }
    }
    for (index, value) in rest.iter_mut().enumerate() {
        *value = rounded(index % 3, *value);
    }
}

/// A channel's byte, rounded to its number of bits and shown as a byte again.
#[inline(always)]
fn rounded(channel: usize, value: u8) -> u8 {
    // Value times 31 / 255 or 63 / 255, to the nearest, in 2048ths.
    const FACTOR: [u32; 3] = [249, 506, 249];
    const HALF: [u32; 3] = [1014, 1010, 1014];
    // Sixteen times what repeats the upper bits: 8 + 1/4, 4 + 1/16.
    const SHOWN: [u32; 3] = [132, 65, 132];
    let number = (u32::from(value) * FACTOR[channel] + HALF[channel]) >> 11;
    ((number * SHOWN[channel]) >> 4) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::simd::{all, best};

    #[test]
    fn every_level_rounds_alike_whatever_the_length() {
        let pixels: Vec<u8> = (0..3 * 1000_u32).map(|i| (i.wrapping_mul(0x9e37_79b1) >> 24) as u8).collect();
        let one_by_one: Vec<u8> =
            pixels.iter().enumerate().map(|(i, value)| rounded(i % 3, *value)).collect();
        for level in all() {
            for end in [0, 3, 45, 48, 51, 144, 3000] {
                let mut reduced = pixels[..end].to_vec();
                reduce_colors(level, &mut reduced);
                assert_eq!(reduced, one_by_one[..end]);
            }
        }
    }

    #[test]
    fn every_byte_goes_to_the_nearest_and_stays_there() {
        for value in 0..=255_u8 {
            let mut pixel = [value; 3];
            reduce_colors(best(), &mut pixel);
            let [r, g, b] = pixel;
            assert_eq!((r, r >> 5), (b, r & 7), "the upper bits again below: {r:08b}");
            assert_eq!(g >> 6, g & 3, "the upper bits again below: {g:08b}");
            let nearest = |bits: u32| {
                let shown = (0..1_u32 << bits).map(|n| (n << (8 - bits) | n >> (2 * bits - 8)) as u8);
                shown.map(|shown| shown.abs_diff(value)).min()
            };
            assert_eq!(
                (Some(r.abs_diff(value)), Some(g.abs_diff(value))),
                (nearest(5), nearest(6)),
                "{value}"
            );
            let again = pixel;
            reduce_colors(best(), &mut pixel);
            assert_eq!(pixel, again);
        }
        let mut ends = [0, 0, 0, 255, 255, 255];
        reduce_colors(best(), &mut ends);
        assert_eq!(ends, [0, 0, 0, 255, 255, 255]);
    }
}
