//! Options of the picture: size, light, quality and animation.

use clap::Args;

use super::values::{Size, degrees, size};
use super::{LightArgs, QualityArgs};

/// Size, light, quality and animation; all but the animation override the scene file.
#[derive(Clone, Debug, Args)]
pub(crate) struct PictureArgs {
    /// Picture size in pixels.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<Size>,
    #[command(flatten)]
    pub(crate) light: LightArgs,
    #[command(flatten)]
    pub(crate) quality: QualityArgs,
    /// Orbit the camera about its look-at point by this angle over all frames.
    #[arg(long, value_name = "DEGREES", default_value = "0", allow_hyphen_values = true, value_parser = degrees)]
    pub(crate) orbit: f64,
    /// Rotate the models about y by this angle per frame.
    #[arg(long, value_name = "DEGREES", default_value = "0", allow_hyphen_values = true, value_parser = degrees)]
    pub(crate) spin: f64,
}
