//! Pictures of a run as they are written.

use std::path::Path;

use rayfarm_tracer::image::{self, Channels, ImageError, Layer, LinearImage, RgbImage};

use super::cli::Aov;
use super::video::VideoError;

/// Name of the layer of the frame itself.
pub(crate) const BEAUTY: &str = "beauty";
/// Name of the layer of the frame itself, where its noise is filtered.
pub(crate) const DENOISED: &str = "denoised";

/// The reason for which pictures of the direct integrator are not denoised, and the remedy.
pub(crate) const DENOISE_NEEDS_PATHS: &str = "--denoise filters the noise of paths, and the direct integrator has none: leave it out, or add --integrator path";

/// A picture for a file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Picture {
    /// Colours of a display, for PNG and PPM.
    Srgb(RgbImage),
    /// Layers of linear light, for OpenEXR and Radiance HDR.
    Linear(Vec<Layer>),
}

impl Picture {
    /// Layers of a frame in linear light, by this name, and its auxiliary pictures.
    pub(crate) fn of_layers(
        name: &'static str,
        beauty: LinearImage,
        auxiliary: impl IntoIterator<Item = (Aov, LinearImage)>,
    ) -> Self {
        let beauty = Layer { name, channels: Channels::Color, picture: beauty };
        let layer = |(aov, picture): (Aov, _)| Layer { name: aov.name(), channels: aov.channels(), picture };
        Self::Linear(std::iter::once(beauty).chain(auxiliary.into_iter().map(layer)).collect())
    }

    /// The colours of a display, as frames of videos have them.
    ///
    /// # Errors
    /// Linear light, which no video has.
    pub(crate) fn into_srgb(self) -> Result<RgbImage, VideoError> {
        match self {
            Self::Srgb(picture) => Ok(picture),
            Self::Linear(_) => Err(VideoError::new("a frame of linear light, where colours were expected")),
        }
    }

    /// Writes the picture in the format of the file's extension.
    ///
    /// # Errors
    /// As [`image::save`] and [`image::save_layers`].
    pub(crate) fn save(&self, path: &Path) -> Result<(), ImageError> {
        match self {
            Self::Srgb(picture) => image::save(path, picture),
            Self::Linear(layers) => image::save_layers(path, layers),
        }
    }
}

impl From<RgbImage> for Picture {
    fn from(picture: RgbImage) -> Self {
        Self::Srgb(picture)
    }
}
