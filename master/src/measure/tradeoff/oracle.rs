//! Checks some pixels of the reference against the tracer's oracle (`f64`, every ray against every primitive).

use std::sync::atomic::{AtomicUsize, Ordering};

use rayfarm_tracer::CompiledScene;
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::FrameView;
use serde::Serialize;

use crate::measure::ray_bounds::RayBounds;

/// Budget in tests of a ray against a primitive: about ten seconds of one core.
const MAX_TESTS: u64 = 2_000_000_000;
/// Least and greatest number of pixels, whatever they cost.
const PIXELS: std::ops::RangeInclusive<u64> = 4..=64;

/// Differences between the reference and the oracle in the checked pixels, with all samples of each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct ReferenceCheck {
    /// Checked pixels.
    pub(crate) pixels: usize,
    /// Largest difference of a channel, in steps of 1/255.
    pub(crate) max_error: u8,
    /// Pixels that differ by more than one step.
    pub(crate) above_one_step: usize,
}

/// Number of pixels of a view that the budget allows in this scene.
pub(crate) fn affordable_pixels(scene: &CompiledScene, view: &FrameView) -> usize {
    let data = scene.scene();
    let shapes = data.spheres.len() + data.disks.len() + data.planes.len();
    let primitives = scene.triangle_count() + shapes as u64;
    let RayBounds { shadow, secondary } = RayBounds::of(scene, &view.quality);
    let rays = u64::from(view.samples).saturating_mul(1 + shadow.saturating_add(secondary));
    let pixels = MAX_TESTS / primitives.max(1).saturating_mul(rays).max(1);
    pixels.clamp(*PIXELS.start(), *PIXELS.end()) as usize
}

/// Pixels of a picture, one at a random place in each of `count` equal parts of it, so that they form no pattern.
pub(crate) fn sample_pixels(width: u32, height: u32, count: usize) -> Vec<(u32, u32)> {
    let all = u64::from(width) * u64::from(height);
    let count = (count as u64).min(all);
    (0..count)
        .map(|i| {
            let (first, end) = (i * all / count, (i + 1) * all / count);
            let pixel = first + mix(i) % (end - first).max(1);
            ((pixel % u64::from(width)) as u32, (pixel / u64::from(width)) as u32)
        })
        .collect()
}

/// Finaliser of splitmix64 (Steele, Lea and Flood, 2014).
fn mix(seed: u64) -> u64 {
    let z = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Checks pixels with `threads` threads; `oracle` has the reference's view. `None` if it was cancelled.
pub(crate) fn check_pixels(
    oracle: &Oracle,
    reference: &RgbImage,
    pixels: &[(u32, u32)],
    threads: usize,
    cancelled: &(dyn Fn() -> bool + Sync),
    done: &(dyn Fn() + Sync),
) -> Option<ReferenceCheck> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut errors = Vec::new();
        while let Some((x, y)) = pixels.get(next.fetch_add(1, Ordering::Relaxed)) {
            if cancelled() {
                return None;
            }
            let found = reference.pixel(*x, *y).unwrap_or_default();
            let expected = oracle.encoded_pixel(*x, *y);
            errors.push(found.iter().zip(expected).map(|(a, b)| a.abs_diff(b)).max().unwrap_or(0));
            done();
        }
        Some(errors)
    };
    let errors: Option<Vec<Vec<u8>>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let joined = threads.into_iter().map(|thread| thread.join());
        joined.map(|errors| errors.unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    });
    let errors: Vec<u8> = errors?.concat();
    Some(ReferenceCheck {
        pixels: errors.len(),
        max_error: errors.iter().copied().max().unwrap_or(0),
        above_one_step: errors.iter().filter(|error| **error > 1).count(),
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use rayfarm_farm::testing::test_scene;

    #[test]
    fn sampled_pixels_are_inside_and_different() {
        for (width, height, count) in [(1, 1, 4), (640, 480, 64), (3, 2, 64), (16_384, 16_384, 64)] {
            let pixels: BTreeSet<(u32, u32)> = sample_pixels(width, height, count).into_iter().collect();
            assert_eq!(pixels.len(), count.min(width as usize * height as usize));
            assert!(pixels.iter().all(|(x, y)| *x < width && *y < height));
        }
    }

    #[test]
    fn differences_are_counted_in_steps() {
        let (scene, view) = (test_scene::scene(), test_scene::view());
        let oracle = Oracle::new(&scene, &[], &[], &view);
        let mut reference = RgbImage::new(view.width, view.height);
        reference.pixels.fill(255);
        let pixels = sample_pixels(view.width, view.height, 6);
        let checked =
            |picture: &RgbImage| check_pixels(&oracle, picture, &pixels, 2, &|| false, &|| ()).unwrap();
        assert_eq!(checked(&reference), ReferenceCheck { pixels: 6, max_error: 0, above_one_step: 0 });
        for (nth, step) in [(1, 1), (4, 9)] {
            let (x, y) = pixels[nth];
            reference.pixels[(y * view.width + x) as usize * 3 + 1] -= step;
        }
        assert_eq!(checked(&reference), ReferenceCheck { pixels: 6, max_error: 9, above_one_step: 1 });
        assert_eq!(check_pixels(&oracle, &reference, &pixels, 2, &|| true, &|| ()), None);
    }
}
