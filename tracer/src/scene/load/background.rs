//! The background of a scene file with the pictures of its sky.

use std::path::Path;

use super::instances::named;
use super::textures::Textures;
use crate::scene::data::{Background, Sky, SkyPicture};
use crate::scene::toml::{Fault, PictureText, RadianceText, SkyPictureText};

/// The background, with its pictures added to the scene's textures.
///
/// # Errors
/// A picture that cannot be read, or that is no face of a cube map.
pub(super) fn background(
    folder: &Path,
    text: &RadianceText,
    textures: &mut Textures,
) -> Result<Background, Fault> {
    let sky = match text {
        RadianceText::Plain(background) => return Ok(*background),
        RadianceText::Sky(sky) => sky,
    };
    let picture = match &sky.picture {
        SkyPictureText::Panorama(picture) => SkyPicture::Panorama(add(folder, picture, textures)?),
        SkyPictureText::Cubemap(faces) => SkyPicture::Cubemap(cubemap(folder, faces, textures)?),
    };
    Ok(Background::Sky(Sky { picture, rotate: sky.rotate, strength: sky.strength }))
}

fn add(folder: &Path, picture: &PictureText, textures: &mut Textures) -> Result<u32, Fault> {
    textures.add_sky(&named(folder, &picture.file)).map_err(|reason| Fault {
        at: picture.at,
        message: format!("the picture of the background: {reason} (paths are relative to the scene file)"),
    })
}

/// The faces of a cube map: squares of the same size.
fn cubemap(folder: &Path, pictures: &[PictureText; 6], textures: &mut Textures) -> Result<[u32; 6], Fault> {
    let mut faces = [0; 6];
    let mut first = None;
    for (face, picture) in faces.iter_mut().zip(pictures) {
        *face = add(folder, picture, textures)?;
        let Some((width, height)) = textures.size(*face) else { continue };
        let side = *first.get_or_insert(width);
        if (width, height) != (side, side) {
            let expected =
                if width == height { format!("{side} x {side}, as the first one") } else { "square".into() };
            let message =
                format!("this face of the cube map has {width} x {height} pixels, but must be {expected}");
            return Err(Fault { at: picture.at, message });
        }
    }
    Ok(faces)
}
