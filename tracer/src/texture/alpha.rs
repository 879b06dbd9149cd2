//! Alpha of textures: what it cuts out, and the colours that it hides.

use crate::image::RgbImage;

/// The smallest visible alpha: texels below one half are cut out.
pub(crate) const LEAST_ALPHA: u8 = 128;

/// The picture with new colours for fully transparent pixels: the mean of their other neighbours. Programs write arbitrary
/// colours there, which a filter would mix into the visible border.
pub(super) fn bleed(picture: &RgbImage, alpha: &[u8]) -> RgbImage {
    let (width, height) = (picture.width as usize, picture.height as usize);
    let mut bled = picture.clone();
    for (index, pixel) in bled.pixels.chunks_exact_mut(3).enumerate().filter(|(index, _)| alpha[*index] == 0)
    {
        let (x, y) = (index % width, index / width);
        let (mut sum, mut count) = ([0_u32; 3], 0);
        for row in [y + height - 1, y, y + 1].map(|row| row % height) {
            for neighbour in [x + width - 1, x, x + 1].map(|column| row * width + column % width) {
                let Some(&[r, g, b]) = picture.pixels.get(3 * neighbour..3 * neighbour + 3) else { continue };
                if alpha[neighbour] > 0 {
                    count += 1;
                    for (sum, channel) in sum.iter_mut().zip([r, g, b]) {
                        *sum += u32::from(channel);
                    }
                }
            }
        }
        for (channel, sum) in pixel.iter_mut().zip(sum) {
            *channel = (sum + count / 2).checked_div(count).map_or(*channel, |mean| mean as u8);
        }
    }
    bled
}
