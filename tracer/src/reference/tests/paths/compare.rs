//! Single samples of the integrator compared with those of the oracle.

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;

use super::scenes::Furnished;
use crate::reference::Oracle;
use crate::scene::{FrameView, Integrator, PathSettings, Quality};
use crate::{CompiledScene, PixelFormat, PixelSums, PreparedFrame, render_rows};

/// Pixels along each side of the pictures.
const SIDE: u32 = 24;

/// Step of the radiance of samples.
const STEP: f64 = 1.0 / (1 << 20) as f64;

/// Relative difference up to which two samples are the same path: the integrator computes in `f32`.
const SAME: f64 = 1e-3;

/// Samples of both.
pub(super) struct Compared {
    /// Pixel, number, radiance by the integrator and by the oracle.
    pub samples: Vec<([u32; 2], u32, DVec3, DVec3)>,
}

/// The view of a scene with the path integrator.
pub(super) fn path_view(furnished: &Furnished, settings: PathSettings, max_depth: u8) -> FrameView {
    FrameView {
        width: SIDE,
        height: SIDE,
        samples: 1,
        integrator: Integrator::Path(settings),
        quality: Quality { max_depth, ..Quality::default() },
        format: PixelFormat::Sums,
        ..FrameView::of(&furnished.scene)
    }
}

/// Computes the samples with some numbers of all pixels.
pub(super) fn compare(furnished: &Furnished, view: &FrameView, numbers: Range<u32>) -> Compared {
    let Furnished { scene, meshes, textures } = furnished;
    let compiled = Arc::new(CompiledScene::new(scene.clone(), meshes.clone(), textures.clone()).unwrap());
    let oracle = Oracle::new(scene, meshes, textures, view);
    let paths = oracle.paths().unwrap();
    let mut samples = Vec::new();
    for number in numbers {
        let pass = FrameView { first_sample: number, ..*view };
        let frame = PreparedFrame::new(Arc::clone(&compiled), &pass).unwrap();
        let mut bytes = vec![0; view.height as usize * frame.row_bytes()];
        render_rows(&frame, 0..view.height, &mut bytes, &|| false).unwrap();
        let (pixels, _) = bytes.as_chunks();
        for (place, pixel) in (0..).zip(pixels) {
            let (x, y) = (place % view.width, place / view.width);
            let found = PixelSums::from_bytes(pixel).rgb.map(|sum| sum as f64 * STEP);
            let expected = if scene.motions.is_empty() {
                paths.radiance(x, y, number)
            } else {
                let time = paths.time(x, y, number);
                let oracle = Oracle::at_time(scene, meshes, textures, view, time);
                oracle.paths().unwrap().radiance(x, y, number)
            };
            let expected = PixelSums::steps(expected.map(|value| value as f32));
            let expected = expected.map(|steps| f64::from(steps) * STEP);
            samples.push(([x, y], number, DVec3::from(found), DVec3::from(expected)));
        }
    }
    Compared { samples }
}

impl Compared {
    /// The samples that differ by more than rounding.
    pub(super) fn different(&self) -> impl Iterator<Item = &([u32; 2], u32, DVec3, DVec3)> {
        self.samples.iter().filter(|(_, _, found, expected)| {
            let allowed = SAME * expected.max_element() + 2.0 * STEP;
            (*found - *expected).abs().max_element() > allowed
        })
    }

    /// Share of the samples that differ.
    pub(super) fn share(&self) -> f64 {
        self.different().count() as f64 / self.samples.len() as f64
    }

    /// The means by the integrator and by the oracle.
    pub(super) fn means(&self) -> [DVec3; 2] {
        let count = self.samples.len() as f64;
        let found: DVec3 = self.samples.iter().map(|(_, _, found, _)| *found).sum();
        let expected: DVec3 = self.samples.iter().map(|(_, _, _, expected)| *expected).sum();
        [found / count, expected / count]
    }

    /// The mean of the differences of the samples that differ, in units of its standard deviation, largest channel: rounding that sends paths
    /// elsewhere brightens as many as it darkens.
    pub(super) fn bias(&self) -> f64 {
        let differences = || self.different().map(|(_, _, found, expected)| *found - *expected);
        let sum: DVec3 = differences().sum();
        let squares: DVec3 = differences().map(|difference| difference * difference).sum();
        let deviation = DVec3::from_array(squares.to_array().map(f64::sqrt)).max(DVec3::splat(STEP));
        (sum.abs() / deviation).max_element()
    }
}
