//! [`Encoding::Rgb565`](super::Encoding::Rgb565): two bytes per pixel, for pictures whose pixels have the 65,536 colours
//! of RGB 5-6-5.
//!
//! ```text
//! the low byte first, bits  15 .. 11 | 10 ..  5 |  4 ..  0
//!                             red       green      blue
//! ```
//!
//! A channel of five bits expands to a byte whose low bits repeat its upper bits: 0b11010 expands to 0b11010110. Only
//! pixels of such colours can be packed, so the encoding is lossless.

use bytes::{Buf, BufMut};

use super::PixelFormat;

/// Number of bytes of an unpacked pixel.
const UNPACKED: usize = PixelFormat::Rgb8.bytes_per_pixel();

/// Number of bytes of a packed pixel.
const PACKED: usize = 2;

/// Number of packed bytes for `rgb8_bytes` bytes of RGB8.
pub fn rgb565_bytes(rgb8_bytes: usize) -> usize {
    rgb8_bytes / UNPACKED * PACKED
}

/// Packs RGB8 pixels in place, to two bytes each at the front of `pixels`, and returns the number of packed bytes.
///
/// Returns `None` where the length is no whole number of pixels or a pixel has another colour than those of RGB 5-6-5.
/// The content of `pixels` is unspecified then.
pub fn to_rgb565(pixels: &mut [u8]) -> Option<usize> {
    if !pixels.len().is_multiple_of(UNPACKED) {
        return None;
    }
    let count = pixels.len() / UNPACKED;
    let mut all_fit = true;
    for index in 0..count {
        let at = index * UNPACKED;
        let [r, g, b] = [pixels[at], pixels[at + 1], pixels[at + 2]];
        let color = u16::from(r >> 3) << 11 | u16::from(g >> 2) << 5 | u16::from(b >> 3);
        all_fit &= expand(color) == [r, g, b];
        pixels[index * PACKED..][..PACKED].copy_from_slice(&color.to_le_bytes());
    }
    all_fit.then_some(count * PACKED)
}

/// Unpacks RGB 5-6-5 into RGB8 pixels. Returns `false`, and writes nothing, where the two lengths do not match.
pub fn from_rgb565(mut packed: &[u8], pixels: &mut [u8]) -> bool {
    let fits = pixels.len().is_multiple_of(UNPACKED) && packed.len() == rgb565_bytes(pixels.len());
    if fits {
        for mut pixel in pixels.chunks_exact_mut(UNPACKED) {
            pixel.put_slice(&expand(packed.get_u16_le()));
        }
    }
    fits
}

fn expand(color: u16) -> [u8; UNPACKED] {
    let five = |bits: u16| (bits << 3 | bits >> 2) as u8;
    let green = color >> 5 & 0x3f;
    [five(color >> 11), (green << 2 | green >> 4) as u8, five(color & 0x1f)]
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn all_65536_colors_survive_a_round_trip() {
        let colors: Vec<u8> = (0..=u16::MAX).flat_map(u16::to_le_bytes).collect();
        let mut pixels = vec![7; colors.len() / 2 * 3];
        assert!(from_rgb565(&colors, &mut pixels));
        assert_eq!((&pixels[..3], &pixels[pixels.len() - 3..]), (&[0; 3][..], &[255; 3][..]));
        assert_eq!(to_rgb565(&mut pixels), Some(colors.len()));
        assert_eq!(pixels[..colors.len()], colors);
    }

    #[test]
    fn golden_bytes() {
        // Red 31 of 31, green 32 of 63, blue 1 of 31.
        let mut pixels = [0xff, 0x82, 0x08];
        assert_eq!(to_rgb565(&mut pixels), Some(2));
        assert_eq!(pixels[..2], [0b0000_0001, 0b1111_1100]);
    }

    #[test]
    fn other_colors_are_not_packed() {
        for pixel in [[1, 0, 0], [0, 1, 0], [0, 0, 254], [8, 8, 9]] {
            assert_eq!(to_rgb565(&mut [&[0; 3][..], &pixel, &[255; 3]].concat()), None, "{pixel:?}");
        }
        assert_eq!(to_rgb565(&mut [0; 4]), None);
        assert_eq!(to_rgb565(&mut []), Some(0));
    }

    proptest! {
        #[test]
        fn lengths_that_do_not_match_write_nothing(bytes in vec(any::<u8>(), 0..40), len in 0..60usize) {
            let mut pixels = vec![3; len];
            let fits = from_rgb565(&bytes, &mut pixels);
            prop_assert_eq!(fits, bytes.len() * 3 == len * 2);
            prop_assert!(fits || pixels == vec![3; len]);
        }
    }
}
