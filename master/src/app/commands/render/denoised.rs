//! Pictures of paths without most of their noise.

use rayfarm_farm::FinishedFrame;
use rayfarm_tracer::image::{ImageError, LinearImage, RgbImage};
use rayfarm_tracer::scene::{FrameView, Integrator};
use rayfarm_tracer::{Guides, PixelFormat, PixelSums, develop_denoised};

use crate::app::cli::Aov;
use crate::app::picture::{DENOISE_NEEDS_PATHS, DENOISED, Picture};

/// Auxiliary pictures that guide the denoiser: albedo, normals and depth, as [`Guides::new`] takes them.
const GUIDES: [Aov; 3] = [Aov::Albedo, Aov::Normal, Aov::Depth];

/// Conversion of frames of sums to denoised pictures.
#[derive(Clone, Copy, Debug)]
pub(super) struct Denoised {
    /// Format of the pictures.
    pub(super) format: PixelFormat,
    /// Number of auxiliary pictures that are layers of the file. Those after them are for the denoiser only.
    pub(super) layers: usize,
}

/// The requested auxiliary pictures, and after them the other ones that guide the denoiser.
pub(super) fn with_guides(requested: &[Aov]) -> Vec<Aov> {
    let others = GUIDES.into_iter().filter(|guide| !requested.contains(guide));
    requested.iter().copied().chain(others).collect()
}

/// The reason for which pictures of a view cannot be denoised, in words.
pub(super) fn refusal(view: &FrameView) -> Option<&'static str> {
    match view.integrator {
        Integrator::Direct => Some(DENOISE_NEEDS_PATHS),
        Integrator::Path(settings) if settings.max_noise > 0.0 => Some(
            "--denoise needs the same number of samples in all pixels: leave it or --max-noise (max_noise in the scene) out",
        ),
        Integrator::Path(_) => None,
    }
}

impl Denoised {
    /// The picture of a frame of sums, of which `auxiliary` has the guides.
    ///
    /// # Errors
    /// Pictures of different sizes.
    pub(super) fn picture(
        self,
        frame: &FinishedFrame,
        auxiliary: impl Iterator<Item = (Aov, FinishedFrame)>,
    ) -> Result<Picture, ImageError> {
        let auxiliary: Vec<(Aov, LinearImage)> =
            auxiliary.filter_map(|(aov, frame)| Some((aov, frame.linear()?))).collect();
        let missing = LinearImage { width: 0, height: 0, pixels: Vec::new() };
        let [albedo, normals, depth] = GUIDES.map(|guide| {
            auxiliary.iter().find(|(aov, _)| *aov == guide).map_or(&missing, |(_, picture)| picture)
        });
        let guides = Guides::new(albedo, normals, depth)?;
        let sums: Vec<PixelSums> = frame.sums().into_iter().flatten().collect();
        let view = FrameView { format: self.format, ..frame.view };
        let pixels = develop_denoised(&view, view.samples, &sums, &guides)?;
        let FrameView { width, height, .. } = view;
        if self.format != PixelFormat::Linear {
            return frame.request.delivered(RgbImage { width, height, pixels }).map(Picture::from);
        }
        let numbers = pixels.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
        let beauty = LinearImage { width, height, pixels: numbers.collect() };
        Ok(Picture::of_layers(DENOISED, beauty, auxiliary.into_iter().take(self.layers)))
    }
}
