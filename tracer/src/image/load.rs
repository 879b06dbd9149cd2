//! Reading pictures. What a file announces is checked against limits before memory is taken for it.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use ::image::{ImageReader, Limits};

use super::{ImageError, MAX_SIDE, RgbImage};

/// Memory that decoding one picture takes at most: one of the largest size with four 8-bit channels, and some room.
const MAX_DECODE_BYTES: u64 = 4 * (MAX_SIDE as u64) * (MAX_SIDE as u64) + (64 << 20);

/// Reads a PNG, JPEG or PPM picture, recognised by its content.
///
/// # Errors
/// A file that cannot be read, is no picture, is broken, or is larger than [`MAX_SIDE`] in either direction.
pub fn load(path: &Path) -> Result<RgbImage, ImageError> {
    let picture = open(path)?.decode().map_err(|source| broken(path, source))?.into_rgb8();
    let (width, height) = picture.dimensions();
    Ok(RgbImage { width, height, pixels: picture.into_raw() })
}

/// Pixels per row, and rows, that a picture announces, without decoding it.
///
/// # Errors
/// As [`load`]; a picture may still turn out to be broken.
pub fn size(path: &Path) -> Result<(u32, u32), ImageError> {
    open(path)?.into_dimensions().map_err(|source| broken(path, source))
}

fn broken(path: &Path, source: ::image::ImageError) -> ImageError {
    ImageError::Decode { path: path.to_owned(), source }
}

fn open(path: &Path) -> Result<ImageReader<BufReader<File>>, ImageError> {
    let unreadable = |source| ImageError::Read { path: path.to_owned(), source };
    let file = File::open(path).map_err(unreadable)?;
    let mut reader = ImageReader::new(BufReader::new(file)).with_guessed_format().map_err(unreadable)?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_DECODE_BYTES);
    reader.limits(limits);
    Ok(reader)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message_for(bytes: &[u8]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.ppm");
        std::fs::write(&path, bytes).unwrap();
        load(&path).unwrap_err().to_string()
    }

    #[test]
    fn a_missing_file_is_named() {
        let message = load(Path::new("no/such/picture.png")).unwrap_err().to_string();
        assert!(message.starts_with("cannot read no/such/picture.png: "), "{message}");
    }

    #[test]
    fn broken_files_are_refused() {
        for bytes in [&b"hello"[..], b"", b"P6\n4 4\n255\nabc", b"\x89PNG\r\n\x1a\n...."] {
            let message = message_for(bytes);
            assert!(message.contains("picture.ppm as PNG, JPEG or PPM"), "{message}");
        }
    }

    #[test]
    fn an_announced_size_beyond_the_limit_is_refused_before_memory_is_taken() {
        let message = message_for(b"P6\n20000 20000\n255\nabc");
        assert!(message.contains("16384"), "{message}");
    }
}
