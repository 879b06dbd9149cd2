//! A level of the filter: a 5 x 5 kernel whose taps are some pixels apart.

use rayon::prelude::*;

use super::estimate::Estimate;
use super::guides::Guides;
use super::weights;

/// The cubic B-spline at whole places.
const KERNEL: [f32; 5] = [1.0 / 16.0, 1.0 / 4.0, 3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];

/// Places of the taps along an axis, in steps.
const TAPS: [isize; 5] = [-2, -1, 0, 1, 2];

/// The estimates after a level whose taps are `step` pixels apart: means with the weights w of the taps, of independent noise.
///
/// ```text
/// l = sum w l_q / sum w      v = sum w^2 v_q / (sum w)^2
/// ```
pub(super) fn filtered(estimates: &[Estimate], guides: &Guides, step: usize) -> Vec<Estimate> {
    each_pixel(guides, |index| {
        let own = &estimates[index];
        let (mut light, mut variance, mut total) = ([0.0; 3], 0.0, 0.0);
        for_taps(guides, index, step, |tap, of_kernel| {
            let other = &estimates[tap];
            let weight = of_kernel * weights::of_light(own, other);
            for channel in 0..3 {
                light[channel] += weight * other.light[channel];
            }
            variance += weight * weight * other.variance;
            total += weight;
        });
        // The pixel itself has a weight of at least 9/64.
        Estimate { light: light.map(|sum| sum / total), variance: variance / (total * total) }
    })
}

/// The estimates with means of the variances of the taps on the same surface.
pub(super) fn with_smooth_variance(estimates: &[Estimate], guides: &Guides) -> Vec<Estimate> {
    each_pixel(guides, |index| {
        let (mut variance, mut total) = (0.0, 0.0);
        for_taps(guides, index, 1, |tap, weight| {
            variance += weight * estimates[tap].variance;
            total += weight;
        });
        Estimate { variance: variance / total, ..estimates[index] }
    })
}

/// A number for each pixel, rows in parallel.
fn each_pixel(guides: &Guides, one: impl Fn(usize) -> Estimate + Sync + Send) -> Vec<Estimate> {
    let width = guides.width().max(1);
    (0..guides.pixels().len()).into_par_iter().with_min_len(width).map(one).collect()
}

/// Calls `add` with the index and the weight of each tap in the picture, by kernel and surface, in the order of rows and columns.
#[inline(always)]
fn for_taps(guides: &Guides, index: usize, step: usize, mut add: impl FnMut(usize, f32)) {
    let (pixels, width) = (guides.pixels(), guides.width());
    let (column, row) = (index % width, index / width);
    let own = &pixels[index];
    for (down, of_row) in TAPS.into_iter().zip(KERNEL) {
        let down = down * step as isize;
        let Some(y) = row.checked_add_signed(down) else { continue };
        for (right, of_column) in TAPS.into_iter().zip(KERNEL) {
            let right = right * step as isize;
            let Some(x) = column.checked_add_signed(right).filter(|x| *x < width) else { continue };
            let tap = y * width + x;
            let Some(guide) = pixels.get(tap) else { continue };
            let weight = of_row * of_column;
            if tap == index {
                add(tap, weight);
            } else {
                let of_surface = weights::of_surface(own, guide, [right as f32, down as f32]);
                if of_surface > 0.0 {
                    add(tap, weight * of_surface);
                }
            }
        }
    }
}
