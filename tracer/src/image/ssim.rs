//! Structural similarity (Wang et al. 2004): an 11 x 11 Gaussian window slides over the luma of both pictures, and
//! means, variances and the covariance under it are compared. At the borders the window is cut and its weights are
//! renormalised, so pictures of every size have a value. Only the rows under the window are in memory.

use std::collections::VecDeque;

use super::RgbImage;

const RADIUS: usize = 5;
const SIGMA: f64 = 1.5;
const C1: f64 = (0.01 * 255.0) * (0.01 * 255.0);
const C2: f64 = (0.03 * 255.0) * (0.03 * 255.0);

/// Weighted sums under the window at one pixel: a, b, a^2, b^2, ab.
type Moments = [f64; 5];

/// Mean similarity over all pixels; 1 for empty pictures. Both pictures have one size.
pub(super) fn mean(a: &RgbImage, b: &RgbImage) -> f64 {
    let (width, height) = (a.width as usize, a.height as usize);
    if width == 0 || height == 0 {
        return 1.0;
    }
    let kernel = kernel();
    let mut sum = 0.0;
    let mut window: VecDeque<(usize, Vec<Moments>)> = VecDeque::with_capacity(2 * RADIUS + 1);
    let mut rows = a.pixels.chunks(3 * width).zip(b.pixels.chunks(3 * width)).enumerate();
    for y in 0..height {
        while window.back().is_none_or(|(last, _)| *last < y + RADIUS) {
            let Some((i, (row_a, row_b))) = rows.next() else { break };
            window.push_back((i, blur(&moments(row_a, row_b), &kernel)));
        }
        while window.front().is_some_and(|(first, _)| first + RADIUS < y) {
            window.pop_front();
        }
        for x in 0..width {
            let column = window.iter().filter_map(|(i, row)| Some((*i, *row.get(x)?)));
            sum += similarity(weighted_mean(column, y, &kernel));
        }
    }
    sum / (width * height) as f64
}

fn kernel() -> [f64; RADIUS + 1] {
    std::array::from_fn(|i| (-((i * i) as f64) / (2.0 * SIGMA * SIGMA)).exp())
}

fn moments(row_a: &[u8], row_b: &[u8]) -> Vec<Moments> {
    let pair = |(a, b)| {
        let (a, b) = (luma(a), luma(b));
        [a, b, a * a, b * b, a * b]
    };
    row_a.chunks(3).zip(row_b.chunks(3)).map(pair).collect()
}

/// Rec. 601 luma of the encoded values, as is usual for this measure.
fn luma(rgb: &[u8]) -> f64 {
    [0.299, 0.587, 0.114].iter().zip(rgb).map(|(weight, byte)| weight * f64::from(*byte)).sum()
}

fn blur(row: &[Moments], kernel: &[f64; RADIUS + 1]) -> Vec<Moments> {
    (0..row.len())
        .map(|x| {
            let first = x.saturating_sub(RADIUS);
            let near = row.iter().enumerate().skip(first).take(x + RADIUS + 1 - first);
            weighted_mean(near.map(|(i, m)| (i, *m)), x, kernel)
        })
        .collect()
}

fn weighted_mean(
    samples: impl Iterator<Item = (usize, Moments)>,
    centre: usize,
    kernel: &[f64; RADIUS + 1],
) -> Moments {
    let mut sum = [0.0; 5];
    let mut weights = 0.0;
    for (i, sample) in samples {
        let weight = kernel.get(i.abs_diff(centre)).copied().unwrap_or(0.0);
        weights += weight;
        for (sum, value) in sum.iter_mut().zip(sample) {
            *sum += weight * value;
        }
    }
    sum.map(|s| s / weights)
}

fn similarity([a, b, aa, bb, ab]: Moments) -> f64 {
    let (variance_a, variance_b, covariance) = (aa - a * a, bb - b * b, ab - a * b);
    ((2.0 * a * b + C1) * (2.0 * covariance + C2)) / ((a * a + b * b + C1) * (variance_a + variance_b + C2))
}
