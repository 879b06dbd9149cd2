//! [`Encoding::Narrow`](super::Encoding::Narrow): two bytes a pixel, for pictures whose pixels have the 65,536 colours of RGB 5-6-5.
//!
//! ```text
//! the low byte first, bits  15 .. 11 | 10 ..  5 |  4 ..  0
//!                             red       green      blue
//! ```
//!
//! A channel of five bits stands for the byte that repeats its upper bits below: 0b11010 for 0b11010110. Only pixels that are such
//! colours can be written, so nothing is lost on the way.

use bytes::{Buf, BufMut};

/// Bytes of a pixel that is not narrow.
const WIDE: usize = 3;

/// Bytes of a pixel that is.
const NARROW: usize = 2;

/// Bytes that take the place of `wide` bytes of RGB8.
pub fn narrow_bytes(wide: usize) -> usize {
    wide / WIDE * NARROW
}

/// Writes RGB8 pixels at two bytes each into the front of their own room. Returns how many bytes there are now; `None` where a
/// pixel is none of the colours, or not whole: then the pixels are lost.
pub fn narrow(pixels: &mut [u8]) -> Option<usize> {
    if !pixels.len().is_multiple_of(WIDE) {
        return None;
    }
    let count = pixels.len() / WIDE;
    let mut all_fit = true;
    for index in 0..count {
        let at = index * WIDE;
        let [r, g, b] = [pixels[at], pixels[at + 1], pixels[at + 2]];
        let color = u16::from(r >> 3) << 11 | u16::from(g >> 2) << 5 | u16::from(b >> 3);
        all_fit &= widened(color) == [r, g, b];
        pixels[index * NARROW..][..NARROW].copy_from_slice(&color.to_le_bytes());
    }
    all_fit.then_some(count * NARROW)
}

/// The RGB8 pixels of narrow ones. `false` where the lengths do not fit each other: then nothing is written.
pub fn widen(mut narrow: &[u8], pixels: &mut [u8]) -> bool {
    let fits = pixels.len().is_multiple_of(WIDE) && narrow.len() == narrow_bytes(pixels.len());
    if fits {
        for mut pixel in pixels.chunks_exact_mut(WIDE) {
            pixel.put_slice(&widened(narrow.get_u16_le()));
        }
    }
    fits
}

fn widened(color: u16) -> [u8; WIDE] {
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
    fn every_color_survives() {
        let colors: Vec<u8> = (0..=u16::MAX).flat_map(u16::to_le_bytes).collect();
        let mut pixels = vec![7; colors.len() / 2 * 3];
        assert!(widen(&colors, &mut pixels));
        assert_eq!((&pixels[..3], &pixels[pixels.len() - 3..]), (&[0; 3][..], &[255; 3][..]));
        assert_eq!(narrow(&mut pixels), Some(colors.len()));
        assert_eq!(pixels[..colors.len()], colors);
    }

    #[test]
    fn the_bytes_are_these() {
        // Full red, middle green, the darkest blue but one.
        let mut pixels = [0xff, 0x82, 0x08];
        assert_eq!(narrow(&mut pixels), Some(2));
        assert_eq!(pixels[..2], [0b0000_0001, 0b1111_1100]);
    }

    #[test]
    fn what_is_no_such_color_is_not_narrowed() {
        for pixel in [[1, 0, 0], [0, 1, 0], [0, 0, 254], [8, 8, 9]] {
            assert_eq!(narrow(&mut [&[0; 3][..], &pixel, &[255; 3]].concat()), None, "{pixel:?}");
        }
        assert_eq!(narrow(&mut [0; 4]), None);
        assert_eq!(narrow(&mut []), Some(0));
    }

    proptest! {
        #[test]
        fn lengths_that_do_not_fit_write_nothing(bytes in vec(any::<u8>(), 0..40), len in 0..60usize) {
            let mut pixels = vec![3; len];
            let fits = widen(&bytes, &mut pixels);
            prop_assert_eq!(fits, bytes.len() * 3 == len * 2);
            prop_assert!(fits || pixels == vec![3; len]);
        }
    }
}
