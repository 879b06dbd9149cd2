//! Pyramids of textures: the picture in ever smaller sizes, for surfaces so far away that a pixel covers many texels (Williams,
//! "Pyramidal Parametrics", 1983).
//!
//! Each level has half the texels of the one below along both sides, rounded down, to a single one. A texel is the mean, in linear
//! light, of the area that it covers. Sums are in `f32` in a fixed order, so every machine builds the same levels; they are neither
//! stored nor sent. All levels together take a third of the memory of the picture.

use glam::Vec3;
use rayon::prelude::*;

use super::Texture;
use crate::srgb;

/// The levels above the picture itself.
pub(crate) struct Pyramid {
    levels: Vec<Level>,
}

/// A smaller picture: three sRGB bytes a texel, rows from bottom to top.
struct Level {
    width: u32,
    height: u32,
    texels: Vec<[u8; 3]>,
}

/// A picture in linear light.
struct Linear {
    width: u32,
    height: u32,
    texels: Vec<[f32; 3]>,
}

impl Pyramid {
    /// The levels of a texture.
    pub(super) fn of(texture: &Texture) -> Self {
        let decoded = srgb::decoded();
        let [mut width, mut height] = [texture.width(), texture.height()];
        let mut levels = Vec::new();
        let mut below: Option<Linear> = None;
        while width > 1 || height > 1 {
            let smaller = match &below {
                None => {
                    halved([width, height], |x, y| texture.texel(x, y).map(|code| decoded[usize::from(code)]))
                }
                Some(below) => halved([width, height], |x, y| below.texel(x, y)),
            };
            [width, height] = [smaller.width, smaller.height];
            let texels = smaller.texels.par_iter().map(|&texel| srgb::encode(Vec3::from_array(texel)));
            levels.push(Level { width, height, texels: texels.collect() });
            below = Some(smaller);
        }
        Self { levels }
    }
}

impl Linear {
    fn texel(&self, x: u32, y: u32) -> [f32; 3] {
        self.texels[y as usize * self.width as usize + x as usize]
    }
}

impl Texture {
    /// Number of levels, with the picture itself.
    pub(crate) fn levels(&self) -> u32 {
        self.width().max(self.height()).ilog2() + 1
    }

    /// Width and height of a level; of the last one for a higher level.
    #[inline]
    pub(crate) fn size_of_level(&self, level: u32) -> [u32; 2] {
        match self.level(level) {
            None => [self.width(), self.height()],
            Some(level) => [level.width, level.height],
        }
    }

    /// The sRGB bytes of a texel of a level; black outside.
    #[inline]
    pub(crate) fn texel_of_level(&self, level: u32, x: u32, y: u32) -> [u8; 3] {
        match self.level(level) {
            None => self.texel(x, y),
            Some(level) => {
                let index = y as usize * level.width as usize + x as usize;
                level.texels.get(index).copied().unwrap_or_default()
            }
        }
    }

    /// A level above the picture itself.
    fn level(&self, level: u32) -> Option<&Level> {
        let above = level.checked_sub(1)?;
        let levels = &self.pyramid().levels;
        levels.get(above as usize).or(levels.last())
    }
}

/// A picture of half the size.
fn halved([width, height]: [u32; 2], texel: impl Fn(u32, u32) -> [f32; 3] + Sync) -> Linear {
    let (columns, rows) = (shares(width), shares(height));
    let mut texels = vec![[0.0; 3]; columns.len() * rows.len()];
    texels.par_chunks_mut(columns.len()).zip(&rows).for_each(|(row, (first_y, of_rows))| {
        for (mean, (first_x, of_columns)) in row.iter_mut().zip(&columns) {
            for (y, of_row) in (*first_y..).zip(of_rows) {
                for (x, of_column) in (*first_x..).zip(of_columns) {
                    if *of_row > 0.0 && *of_column > 0.0 {
                        let texel = texel(x, y);
                        for (mean, channel) in mean.iter_mut().zip(texel) {
                            *mean += channel * (of_row * of_column);
                        }
                    }
                }
            }
        }
    });
    Linear { width: columns.len() as u32, height: rows.len() as u32, texels }
}

/// For each texel along a side of half the size, the first of the texels that it covers, and the shares of three of them.
fn shares(size: u32) -> Vec<(u32, [f32; 3])> {
    let half = size / 2;
    if half == 0 {
        return vec![(0, [1.0, 0.0, 0.0])];
    }
    // Of an odd size 2 h + 1, texel i covers 2 i + i / h to 2 (i + 1) + (i + 1) / h.
    let covered = f64::from(size) / f64::from(half);
    let left_over = |i: u32| f64::from(size % 2) * f64::from(i) / f64::from(half);
    (0..half)
        .map(|i| {
            let shares = [1.0 - left_over(i), 1.0, left_over(i + 1)];
            (2 * i, shares.map(|share| (share / covered) as f32))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::image::RgbImage;

    fn texture(width: u32, height: u32, color: impl Fn(u32, u32) -> [u8; 3]) -> Texture {
        let color = &color;
        let pixels = (0..height).flat_map(|y| (0..width).flat_map(move |x| color(x, y))).collect();
        Texture::new(&RgbImage { width, height, pixels }).unwrap()
    }

    #[test]
    fn a_fine_board_of_black_and_white_is_grey_from_far_away() {
        let board = texture(64, 64, |x, y| [if (x + y).is_multiple_of(2) { 255 } else { 0 }; 3]);
        assert_eq!(board.levels(), 7);
        for level in 1..7 {
            let [width, height] = board.size_of_level(level);
            assert_eq!((width, height), (64 >> level, 64 >> level));
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                // Half of the light, to the nearest code: 188.
                assert_eq!(board.texel_of_level(level, x, y), srgb::encode(Vec3::splat(0.5)));
            }
        }
    }

    #[test]
    fn sizes_are_halved_to_a_single_texel() {
        let odd = texture(5, 3, |x, y| [(x * 40) as u8, (y * 90) as u8, 7]);
        let sizes: Vec<_> = (0..odd.levels()).map(|level| odd.size_of_level(level)).collect();
        assert_eq!(sizes, [[5, 3], [2, 1], [1, 1]]);
        assert_eq!(odd.size_of_level(9), [1, 1]);
        assert_eq!(odd.texel_of_level(2, 1, 0), [0; 3], "outside");
        let single = texture(1, 1, |_, _| [9; 3]);
        assert_eq!((single.levels(), single.texel_of_level(0, 0, 0)), (1, [9; 3]));
    }

    proptest! {
        /// Each texel is covered once: the single texel of the last level is the mean of the picture.
        #[test]
        fn the_last_level_is_the_mean(width in 1..40_u32, height in 1..40_u32, seed in 0..1000_u32) {
            let code = |x: u32, y: u32| ((x * 7919 + y * 104_729 + seed * 31) % 256) as u8;
            let picture = texture(width, height, |x, y| [code(x, y); 3]);
            let all = (0..height).flat_map(|y| (0..width).map(move |x| srgb::decode(code(x, y))));
            let mean = all.sum::<f64>() / f64::from(width * height);
            let last = srgb::decode(picture.texel_of_level(picture.levels() - 1, 0, 0)[0]);
            // Half a step of the encoding.
            prop_assert!((last - mean).abs() < 0.006, "{last}, not {mean}");
        }
    }
}
