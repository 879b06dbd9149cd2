//! Textures of skies, and warnings about what a texture cannot hold of a picture.

use std::collections::BTreeSet;
use std::path::Path;

use crate::image::{SkyImage, SkyPixels};
use crate::scene::import::shown;
use crate::texture::{MAX_CHANNEL, Replaced, Texture, TextureError};

/// Makes a texture of the picture of a sky, and adds warnings to `notes`.
pub(super) fn texture(
    picture: &Path,
    sky: &SkyImage,
    notes: &mut BTreeSet<String>,
) -> Result<Texture, TextureError> {
    let mut note = |message: &str| notes.insert(format!("{}: {message}", shown(picture)));
    if sky.translucent {
        note("the alpha of the picture has no effect on a sky");
    }
    let (texture, Replaced { unusable, too_bright }) = match &sky.pixels {
        SkyPixels::Srgb(pixels) => (Texture::new(pixels)?, Replaced::default()),
        SkyPixels::Linear(pixels) => Texture::linear(pixels)?,
    };
    if unusable > 0 {
        note(&format!(
            "channels that are negative, infinite or no number, in {unusable} {}: they count as 0 or, if infinite, as {MAX_CHANNEL}",
            pixels(unusable)
        ));
    }
    if too_bright > 0 {
        note(&format!(
            "channels above {MAX_CHANNEL}, in {too_bright} {}: they count as that",
            pixels(too_bright)
        ));
    }
    Ok(texture)
}

fn pixels(count: u64) -> &'static str {
    if count == 1 { "pixel" } else { "pixels" }
}
