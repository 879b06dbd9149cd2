//! Writing of picture files. A file appears whole or not at all: the bytes go to a temporary name in the same folder,
//! which is renamed when complete and removed on failure.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use ::image::codecs::png::PngEncoder;
use ::image::{ExtendedColorType, ImageEncoder};

use super::{ImageError, RgbImage};
use crate::files::Temporary;

/// Extensions that [`save`] supports, for messages.
pub const KNOWN_EXTENSIONS: &str = ".png, .ppm";

#[derive(Clone, Copy)]
enum Format {
    Png,
    Ppm,
}

impl Format {
    fn of(path: &Path) -> Result<Self, ImageError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("ppm") => Ok(Self::Ppm),
            _ => Err(ImageError::UnknownExtension { path: path.to_owned(), known: KNOWN_EXTENSIONS }),
        }
    }
}

/// Writes a picture as PNG or PPM, by the extension of `path`, replacing an existing file.
///
/// # Errors
/// An unknown extension, a buffer that does not match the size, a folder without write permission, a full disk. An
/// existing file is then unchanged, and no partial file is left.
pub fn save(path: &Path, image: &RgbImage) -> Result<(), ImageError> {
    let format = Format::of(path)?;
    image.check()?;
    let failed = |source| ImageError::Write { path: path.to_owned(), source };
    let (temporary, file) = Temporary::create_next_to(path).map_err(failed)?;
    let mut out = BufWriter::new(file);
    match format {
        Format::Png => write_png(&mut out, image)
            .map_err(|source| ImageError::Encode { path: path.to_owned(), source })?,
        Format::Ppm => write_ppm(&mut out, image).map_err(failed)?,
    }
    // Closed before renaming: Windows does not rename open files.
    drop(out.into_inner().map_err(|e| failed(e.into_error()))?);
    temporary.rename_to(path).map_err(failed)
}

fn write_png(out: &mut impl Write, image: &RgbImage) -> Result<(), ::image::ImageError> {
    PngEncoder::new(out).write_image(&image.pixels, image.width, image.height, ExtendedColorType::Rgb8)
}

fn write_ppm(out: &mut impl Write, image: &RgbImage) -> io::Result<()> {
    write!(out, "P6\n{} {}\n255\n", image.width, image.height)?;
    out.write_all(&image.pixels)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::load;
    use super::*;

    fn gradient() -> RgbImage {
        let mut image = RgbImage::new(7, 5);
        for (i, byte) in image.pixels.iter_mut().enumerate() {
            *byte = (i * 37 % 256) as u8;
        }
        image
    }

    fn names_in(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn pictures_round_trip_and_no_other_file_is_left() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.png", "b.ppm", "c.PNG"] {
            let path = folder.path().join(name);
            save(&path, &gradient()).unwrap();
            save(&path, &gradient()).unwrap();
            assert_eq!(load(&path).unwrap(), gradient());
        }
        assert_eq!(names_in(folder.path()), ["a.png", "b.ppm", "c.PNG"]);
    }

    #[test]
    fn an_unknown_extension_is_refused_with_the_known_ones() {
        for name in ["picture.gif", "picture"] {
            let message = save(Path::new(name), &gradient()).unwrap_err().to_string();
            assert!(message.contains(name) && message.contains(".png, .ppm"), "{message}");
        }
    }

    #[test]
    fn a_failure_leaves_the_old_file_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("nowhere/a.png");
        let message = save(&missing, &gradient()).unwrap_err().to_string();
        assert!(message.contains("nowhere"), "{message}");

        // A folder has the target's name, so the last step, the renaming, fails.
        let taken = folder.path().join("taken.ppm");
        fs::create_dir(&taken).unwrap();
        fs::write(taken.join("inside"), "x").unwrap();
        assert!(save(&taken, &gradient()).is_err());
        assert_eq!(names_in(folder.path()), ["taken.ppm"]);

        let good = folder.path().join("good.png");
        save(&good, &gradient()).unwrap();
        let empty = RgbImage::new(0, 0);
        assert!(save(&good, &empty).is_err(), "PNG has no empty pictures");
        assert_eq!(load(&good).unwrap(), gradient());
        assert_eq!(names_in(folder.path()), ["good.png", "taken.ppm"]);
    }

    #[test]
    fn files_of_a_killed_process_are_skipped() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ppm");
        // Other tests of this process may advance the counter, so all names that may come next are taken.
        let left: Vec<String> =
            (0..500).map(|serial| format!(".a.ppm.{}-{serial}.partial", std::process::id())).collect();
        left.iter().for_each(|name| fs::write(folder.path().join(name), "half").unwrap());
        save(&path, &gradient()).unwrap();
        assert_eq!(load(&path).unwrap(), gradient());
        assert_eq!(names_in(folder.path()).len(), left.len() + 1);
    }

    #[test]
    fn a_buffer_of_another_size_is_refused() {
        let mut image = gradient();
        image.pixels.pop();
        let message = save(Path::new("x.png"), &image).unwrap_err().to_string();
        assert!(message.contains("105 bytes") && message.contains("104"), "{message}");
    }
}
