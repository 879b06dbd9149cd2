//! The light of a face of a cube map: means of bilinear lookups over the cells of a grid, times their solid angles.

use super::{Distribution, Texture};

/// Least and most cells along each side of a face. Small pictures have more cells than texels: solid angles vary over a face.
const CELLS: [u32; 2] = [32, 512];

impl Texture {
    /// The distribution of the light of a face of a cube map over its picture, whose rows begin at the bottom: the mean of its
    /// weights is the integral of red, green and blue added over the solid angle of the face. Made at the first call; `None` if the face is
    /// black.
    pub(crate) fn face_light(&self) -> Option<&Distribution> {
        if let Some(light) = self.face_light.get() {
            return light.as_ref();
        }
        let side = self.width().max(self.height()).clamp(CELLS[0], CELLS[1]);
        let made = Distribution::new(&weights(self, side), side as usize);
        self.face_light.get_or_init(|| made).as_ref()
    }
}

/// Weights of side x side cells.
fn weights(texture: &Texture, side: u32) -> Vec<f32> {
    let columns: Vec<_> = (0..side).map(|cell| shares(cell, side, texture.width())).collect();
    let rows: Vec<_> = (0..side).map(|cell| shares(cell, side, texture.height())).collect();
    let cells = f64::from(side) * f64::from(side);
    let mut weights = Vec::with_capacity(columns.len() * rows.len());
    for (row, along) in (0..side).zip(&rows) {
        for (column, across) in (0..side).zip(&columns) {
            let mut mean = 0.0;
            for &(y, share_of_row) in along {
                for &(x, share) in across {
                    let [r, g, b] = texture.linear_texel(x, y);
                    mean += f64::from(r + g + b) * share * share_of_row;
                }
            }
            weights.push((mean * solid_angle([column, row], side) * cells) as f32);
        }
    }
    weights
}

/// The texels that linear interpolation uses in a cell, with their shares of its mean. Interpolation ends at the border.
fn shares(cell: u32, cells: u32, texels: u32) -> Vec<(u32, f64)> {
    let per_cell = f64::from(texels) / f64::from(cells);
    let (start, end) = (f64::from(cell) * per_cell, f64::from(cell + 1) * per_cell);
    let first = (start - 0.5).floor().max(0.0) as u32;
    let last = ((end - 0.5).floor() as u32 + 1).min(texels - 1);
    let share = |texel: u32| {
        let center = f64::from(texel) + 0.5;
        let within = tent(end - center) - tent(start - center);
        // Before the centre of the first texel, and after that of the last, lookups find nothing else.
        let before = if texel == 0 { beyond(0.5 - start) - beyond(0.5 - end) } else { 0.0 };
        let border = f64::from(texels) - 0.5;
        let after = if texel + 1 == texels { beyond(end - border) - beyond(start - border) } else { 0.0 };
        (within + before + after) / per_cell
    };
    (first..=last).map(|texel| (texel, share(texel))).collect()
}

/// Integral of max(0, 1 - |x|) up to x, but for a constant.
fn tent(x: f64) -> f64 {
    let x = x.clamp(-1.0, 1.0);
    x - x * x.abs() / 2.0
}

/// Integral of max(0, x) up to x: between the centre of a border texel and the border, that texel has the share of its missing neighbour
/// as well.
fn beyond(x: f64) -> f64 {
    let x = x.max(0.0);
    x * x / 2.0
}

/// Solid angle of a cell of a face.
fn solid_angle([column, row]: [u32; 2], side: u32) -> f64 {
    let place = |cell: u32| 2.0 * f64::from(cell) / f64::from(side) - 1.0;
    // Of the rectangle from the centre of the face to (x, y).
    let corner = |x: f64, y: f64| libm::atan2(x * y, (x * x + y * y + 1.0).sqrt());
    let (left, right) = (place(column), place(column + 1));
    let (bottom, top) = (place(row), place(row + 1));
    corner(right, top) - corner(left, top) - corner(right, bottom) + corner(left, bottom)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::image::LinearImage;

    fn face(side: u32, texel: impl Fn(u32, u32) -> f32) -> Texture {
        // Rows of pictures begin at the top.
        let rows = (0..side).rev();
        let pixels = rows.flat_map(|y| (0..side).map(move |x| (x, y))).flat_map(|(x, y)| [texel(x, y); 3]);
        Texture::linear(&LinearImage { width: side, height: side, pixels: pixels.collect() }).unwrap().0
    }

    #[test]
    fn a_white_face_has_a_sixth_of_the_sphere() {
        for side in [1, 2, 31, 40, 600] {
            let face = face(side, |_, _| 1.0);
            let total = face.face_light().unwrap().total() / 3.0;
            assert!((total / (2.0 * PI / 3.0) - 1.0).abs() < 1e-5, "{side}: {total}");
        }
    }

    #[test]
    fn shares_of_a_cell_add_up_to_one() {
        for (cells, texels) in [(32, 1), (32, 5), (40, 40), (512, 600), (32, 32)] {
            let mut of_texels = vec![0.0; texels as usize];
            for cell in 0..cells {
                let shares = shares(cell, cells, texels);
                assert!((shares.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-9, "{cell}");
                assert!(shares.iter().all(|(_, share)| *share > -1e-12));
                shares.iter().for_each(|(texel, share)| of_texels[*texel as usize] += share);
            }
            // Each texel has the same part of the picture.
            let each = f64::from(cells) / f64::from(texels);
            assert!(of_texels.iter().all(|share| (share - each).abs() < 1e-9), "{cells} {texels}");
        }
        let middle = shares(3, 32, 32);
        assert_eq!(middle.iter().map(|(texel, _)| *texel).collect::<Vec<_>>(), [2, 3, 4]);
        assert!((middle[0].1 - 0.125).abs() < 1e-12 && (middle[1].1 - 0.75).abs() < 1e-12);
    }

    #[test]
    fn solid_angles_are_smaller_towards_the_corners() {
        let all: f64 = (0..64).map(|i| solid_angle([i % 8, i / 8], 8)).sum();
        assert!((all - 2.0 * PI / 3.0).abs() < 1e-12);
        assert!(solid_angle([0, 0], 8) < 0.35 * solid_angle([3, 4], 8));
    }

    #[test]
    fn light_is_found_next_to_a_bright_texel_and_nowhere_else() {
        let face = face(64, |x, y| if (x, y) == (20, 40) { 5.0 } else { 0.0 });
        let light = face.face_light().unwrap();
        let at = |x: f32, y: f32| light.density([x / 64.0, y / 64.0]);
        assert!(at(20.5, 40.5) > at(19.5, 40.5) && at(19.5, 39.5) > 0.0);
        assert_eq!((at(18.5, 40.5), at(20.5, 44.5)), (0.0, 0.0));
        assert!(self::face(4, |_, _| 0.0).face_light().is_none());
    }
}
