//! Textures in ever smaller sizes, for the trilinear filter (Williams, "Pyramidal Parametrics", 1983).

use glam::DVec3;

use super::texture::linear_texel;
use crate::texture::Texture;

/// A picture in linear RGB, rows from bottom to top.
pub(super) struct Level {
    pub width: u32,
    pub height: u32,
    texels: Vec<DVec3>,
}

impl Level {
    pub(super) fn texel(&self, i: u32, j: u32) -> DVec3 {
        self.texels[j as usize * self.width as usize + i as usize]
    }

    /// The picture with half the texels along both sides, rounded down, but at least one: each is the mean of the area that it
    /// covers.
    fn halved(&self) -> Self {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let mean = |i: u32, j: u32| {
            let columns = covered(i, width, self.width);
            let mut sum = DVec3::ZERO;
            for (y, of_row) in covered(j, height, self.height) {
                sum += columns
                    .iter()
                    .map(|&(x, of_column)| self.texel(x, y) * (of_row * of_column))
                    .sum::<DVec3>();
            }
            sum
        };
        let texels = (0..height).flat_map(|j| (0..width).map(move |i| (i, j))).map(|(i, j)| mean(i, j));
        Self { width, height, texels: texels.collect() }
    }
}

/// The texels along a side of `below` texels that texel `i` of `size` covers, with their shares of it.
fn covered(i: u32, size: u32, below: u32) -> Vec<(u32, f64)> {
    let length = f64::from(below) / f64::from(size);
    let (start, end) = (f64::from(i) * length, f64::from(i + 1) * length);
    let share = |x: u32| (end.min(f64::from(x + 1)) - start.max(f64::from(x))) / length;
    (0..below)
        .map(|x| (x, share(x)))
        .skip(start as usize)
        .take_while(|(x, _)| f64::from(*x) < end)
        .filter(|(_, share)| *share > 0.0)
        .collect()
}

/// All levels of a texture, from the picture itself to a single texel.
pub(super) fn levels(texture: &Texture) -> Vec<Level> {
    let (width, height) = (texture.width(), texture.height());
    let places = (0..height).flat_map(|j| (0..width).map(move |i| (i, j)));
    let texels = places.map(|(i, j)| linear_texel(texture, i, j)).collect();
    let mut levels = vec![Level { width, height, texels }];
    while let Some(last) = levels.last().filter(|last| last.width > 1 || last.height > 1) {
        let smaller = last.halved();
        levels.push(smaller);
    }
    levels
}
