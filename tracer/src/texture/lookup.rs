//! Lookups one at a time in `f64`, of texels that are no colours: alpha and normals.

use glam::DVec2;

use super::{Filter, Texture, Wrap};

impl Texture {
    /// The mean of what `texel` gives for the texels around a place of the texture, both coordinates from 0 to 1; `texel` has the
    /// column and the row. Smaller pictures are not used: [`Filter::Trilinear`] is as [`Filter::Bilinear`].
    pub(crate) fn filtered<const N: usize>(
        &self,
        filter: Filter,
        wrap: Wrap,
        place: DVec2,
        texel: impl Fn(u32, u32) -> [f64; N],
    ) -> [f64; N] {
        let [width, height] = [self.width(), self.height()];
        let (x, y) = (place.x * f64::from(width), place.y * f64::from(height));
        match filter {
            // The conversion rounds down, and maps NaN to 0.
            Filter::Nearest => texel((x as u32).min(width - 1), (y as u32).min(height - 1)),
            Filter::Bilinear | Filter::Trilinear => {
                let (columns, right) = pair(x, width, wrap);
                let (rows, up) = pair(y, height, wrap);
                let row = |y: u32| mean(columns.map(|x| texel(x, y)), right);
                mean(rows.map(row), up)
            }
        }
    }
}

fn mean<const N: usize>([first, second]: [[f64; N]; 2], weight: f64) -> [f64; N] {
    std::array::from_fn(|i| first[i] * (1.0 - weight) + second[i] * weight)
}

/// The two texels around a position along one axis, and the weight of the second.
fn pair(position: f64, size: u32, wrap: Wrap) -> ([u32; 2], f64) {
    let from_center = position - 0.5;
    let first = from_center.floor();
    let texel = |index: f64| match wrap {
        Wrap::Repeat => index.rem_euclid(f64::from(size)) as u32,
        Wrap::Clamp | Wrap::Mirror => (index as u32).min(size - 1),
    };
    ([texel(first), texel(first + 1.0)], from_center - first)
}
