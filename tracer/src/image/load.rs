//! Decoding of picture files. Announced sizes are checked against limits before memory is allocated.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use ::image::error::{DecodingError, ImageFormatHint};
use ::image::{DynamicImage, ImageFormat, ImageReader, Limits};

use super::{HIGH_RANGE_FORMATS, ImageError, MAX_SIDE, READ_FORMATS, RgbImage};
use crate::files::open_regular;

/// Memory for everything but the pixels of a picture file: a colour profile of some kilobytes may unpack to
/// gigabytes.
const MAX_REST_BYTES: u64 = 64 << 20;

/// Largest size of a decoded pixel: four channels of 32 bits.
const MAX_PIXEL_BYTES: u64 = 16;

/// Largest memory for decoding one picture: one of the largest size with four 8-bit channels, and the rest.
const MAX_DECODE_BYTES: u64 = 4 * (MAX_SIDE as u64) * (MAX_SIDE as u64) + MAX_REST_BYTES;

/// Largest size of a file.
const MAX_FILE_BYTES: u64 = 1 << 30;

/// Reads a picture in one of the [`super::READ_FORMATS`], recognised by its content; of an animation, the first
/// frame.
///
/// # Errors
/// A file that cannot be read, is no picture, is broken, is larger than [`MAX_SIDE`] in either direction, or is in one of the
/// [`super::HIGH_RANGE_FORMATS`].
pub fn load(path: &Path) -> Result<RgbImage, ImageError> {
    let picture = decoded_srgb(path)?.into_rgb8();
    let (width, height) = picture.dimensions();
    Ok(RgbImage { width, height, pixels: picture.into_raw() })
}

/// Reads a picture like [`load`], with a byte of alpha per pixel if the picture has alpha.
///
/// # Errors
/// As [`load`].
pub fn load_with_alpha(path: &Path) -> Result<(RgbImage, Option<Vec<u8>>), ImageError> {
    decoded_srgb(path).map(split_alpha)
}

/// The pixels of a decoded picture in 8-bit sRGB, and its alpha if it has any.
pub(super) fn split_alpha(picture: DynamicImage) -> (RgbImage, Option<Vec<u8>>) {
    let (width, height) = (picture.width(), picture.height());
    if !picture.color().has_alpha() {
        return (RgbImage { width, height, pixels: picture.into_rgb8().into_raw() }, None);
    }
    let mut pixels = picture.into_rgba8().into_raw();
    let alpha = pixels.iter().skip(3).step_by(4).copied().collect();
    drop_fourth(&mut pixels);
    (RgbImage { width, height, pixels }, Some(alpha))
}

/// Removes every fourth number, in place: large pictures are not stored three times.
pub(super) fn drop_fourth<T: Copy>(pixels: &mut Vec<T>) {
    for pixel in 0..pixels.len() / 4 {
        pixels.copy_within(4 * pixel..4 * pixel + 3, 3 * pixel);
    }
    pixels.truncate(pixels.len() / 4 * 3);
}

/// Width and height in the header of a picture file, without decoding it.
///
/// # Errors
/// As [`load`]; the rest of the file is not checked.
pub fn size(path: &Path) -> Result<(u32, u32), ImageError> {
    let reader = open(path, MAX_REST_BYTES)?;
    catch_panic(path, || reader.into_dimensions())
}

/// Whether a file is in one of the [`super::HIGH_RANGE_FORMATS`], by its first bytes.
pub fn has_high_range(path: &Path) -> bool {
    let format = open(path, MAX_REST_BYTES).ok().and_then(|reader| reader.format());
    matches!(format, Some(ImageFormat::Hdr | ImageFormat::OpenExr))
}

/// A decoded picture in sRGB.
fn decoded_srgb(path: &Path) -> Result<DynamicImage, ImageError> {
    if has_high_range(path) {
        return Err(ImageError::HighDynamicRange { path: path.to_owned() });
    }
    decoded(path)
}

/// A decoded picture in any format.
pub(super) fn decoded(path: &Path) -> Result<DynamicImage, ImageError> {
    let (width, height) = size(path)?;
    let pixels = u64::from(width) * u64::from(height);
    let reader = open(path, MAX_DECODE_BYTES.min(MAX_PIXEL_BYTES * pixels + MAX_REST_BYTES))?;
    catch_panic(path, || reader.decode())
}

/// Result of a decoder. A decoder that panics means a broken picture, and must not end the program.
fn catch_panic<T>(path: &Path, decode: impl FnOnce() -> ::image::ImageResult<T>) -> Result<T, ImageError> {
    let decoded = catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|_| {
        let reason = DecodingError::new(ImageFormatHint::Unknown, "the decoder panicked");
        Err(::image::ImageError::Decoding(reason))
    });
    decoded.map_err(|source| broken(path, source))
}

fn broken(path: &Path, source: ::image::ImageError) -> ImageError {
    let formats = if has_high_range(path) { HIGH_RANGE_FORMATS } else { READ_FORMATS };
    ImageError::Decode { path: path.to_owned(), formats, source }
}

/// A reader that allocates at most `memory` bytes.
fn open(path: &Path, memory: u64) -> Result<ImageReader<Box<dyn BufReadSeek>>, ImageError> {
    let unreadable = |source| ImageError::Read { path: path.to_owned(), source };
    let file = open_regular(path).map_err(unreadable)?;
    if file.metadata().map_err(unreadable)?.len() > MAX_FILE_BYTES {
        let reason = format!("the file is larger than {MAX_FILE_BYTES} bytes, the limit");
        return Err(unreadable(io::Error::new(io::ErrorKind::FileTooLarge, reason)));
    }
    let bytes = with_known_signature(file).map_err(unreadable)?;
    let mut reader = ImageReader::new(bytes).with_guessed_format().map_err(unreadable)?;
    if reader.format().is_none() && is_targa(path).map_err(unreadable)? {
        reader.set_format(ImageFormat::Tga);
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(memory);
    reader.limits(limits);
    Ok(reader)
}

/// A buffered file, or bytes in memory.
trait BufReadSeek: BufRead + Seek {}

impl<T: BufRead + Seek> BufReadSeek for T {}

/// The bytes of a file. Radiance pictures of many programs begin with `#?RGBE` or another name, and the decoder only knows
/// `#?RADIANCE`: those are read with that in place of their first line.
fn with_known_signature(mut file: File) -> io::Result<Box<dyn BufReadSeek>> {
    const KNOWN: &[u8] = b"#?RADIANCE";
    let mut start = Vec::new();
    file.by_ref().take(KNOWN.len() as u64).read_to_end(&mut start)?;
    file.rewind()?;
    if !start.starts_with(b"#?") || start == KNOWN {
        return Ok(Box::new(BufReader::new(file)));
    }
    let mut bytes = Vec::new();
    file.take(MAX_FILE_BYTES).read_to_end(&mut bytes)?;
    let line = bytes.iter().position(|&byte| byte == b'\n').unwrap_or(bytes.len());
    bytes.splice(..line, KNOWN.iter().copied());
    Ok(Box::new(Cursor::new(bytes)))
}

/// Whether a file is TGA. The format has no magic number: the extension decides, or the signature at the end of newer
/// files.
fn is_targa(path: &Path) -> io::Result<bool> {
    const SIGNATURE: &[u8] = b"TRUEVISION-XFILE.\0";
    let named = path.extension().is_some_and(|extension| {
        ["tga", "targa", "icb", "vda", "vst"].iter().any(|known| extension.eq_ignore_ascii_case(known))
    });
    let mut file = open_regular(path)?;
    let length = file.metadata()?.len();
    let Some(start) = length.checked_sub(SIGNATURE.len() as u64).filter(|_| !named) else { return Ok(named) };
    let mut end = Vec::new();
    file.seek(SeekFrom::Start(start))?;
    file.take(SIGNATURE.len() as u64).read_to_end(&mut end)?;
    Ok(end == SIGNATURE)
}

/// Whether a file is a JPEG picture without an end. The decoder fills up the missing part without an error.
pub fn ends_early(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = |start: &mut Vec<u8>| {
        let mut file = open_regular(path)?.take(MAX_FILE_BYTES);
        file.by_ref().take(3).read_to_end(start)?;
        if start.starts_with(b"\xff\xd8\xff") { file.read_to_end(start) } else { Ok(0) }
    };
    read(&mut start).is_ok_and(|rest| rest > 0) && !has_end(&start)
}

/// Whether the segments and scans of a JPEG picture reach its end marker.
fn has_end(jpeg: &[u8]) -> bool {
    const START_OF_SCAN: u8 = 0xda;
    const END: u8 = 0xd9;
    let mut at = 2;
    while let Some(marker) = next_marker(jpeg, &mut at) {
        match marker {
            END => return true,
            0x01 | 0xd0..=0xd8 => {}
            _ => {
                let Some(&[high, low]) = jpeg.get(at..at + 2) else { return false };
                at += usize::from(u16::from_be_bytes([high, low]));
                if marker == START_OF_SCAN {
                    skip_scan(jpeg, &mut at);
                }
            }
        }
    }
    false
}

/// The next marker from a position on, which moves behind it.
fn next_marker(jpeg: &[u8], at: &mut usize) -> Option<u8> {
    let rest = jpeg.get(*at..)?;
    let start = rest.windows(2).position(|pair| pair[0] == 0xff && !matches!(pair[1], 0 | 0xff))?;
    *at += start + 2;
    rest.get(start + 1).copied()
}

/// Moves a position behind the coded pixels, to the next marker outside of them.
fn skip_scan(jpeg: &[u8], at: &mut usize) {
    let rest = jpeg.get(*at..).unwrap_or_default();
    let is_end = |pair: &[u8]| pair[0] == 0xff && !matches!(pair[1], 0 | 0xff | 0xd0..=0xd7);
    *at += rest.windows(2).position(is_end).unwrap_or(rest.len());
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
            assert!(message.contains("picture.ppm"), "{message}");
        }
    }

    #[test]
    fn an_announced_size_beyond_the_limit_is_refused() {
        let message = message_for(b"P6\n20000 20000\n255\nabc");
        assert!(message.contains("16384"), "{message}");
    }

    /// Four quarters of different colours, as wide as high.
    fn quarters() -> ::image::RgbImage {
        let color = |x: u32, y: u32| match (x < 8, y < 8) {
            (true, true) => [200, 30, 30],
            (false, true) => [30, 200, 30],
            (true, false) => [30, 30, 200],
            (false, false) => [200, 200, 30],
        };
        ::image::RgbImage::from_fn(16, 16, |x, y| ::image::Rgb(color(x, y)))
    }

    fn encoded(format: ImageFormat) -> Vec<u8> {
        let mut bytes = io::Cursor::new(Vec::new());
        quarters().write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    const FORMATS: [(&str, ImageFormat); 8] = [
        ("a.tga", ImageFormat::Tga),
        ("a.bmp", ImageFormat::Bmp),
        ("a.gif", ImageFormat::Gif),
        ("a.tif", ImageFormat::Tiff),
        ("a.webp", ImageFormat::WebP),
        ("a.png", ImageFormat::Png),
        ("a.jpg", ImageFormat::Jpeg),
        ("a.ppm", ImageFormat::Pnm),
    ];

    #[test]
    fn every_format_is_read() {
        let folder = tempfile::tempdir().unwrap();
        for (name, format) in FORMATS {
            let path = folder.path().join(name);
            std::fs::write(&path, encoded(format)).unwrap();
            assert_eq!(size(&path).unwrap(), (16, 16), "{name}");
            let picture = load(&path).unwrap();
            for (x, y) in [(2, 2), (13, 2), (2, 13), (13, 13)] {
                let (found, expected) = (picture.pixel(x, y).unwrap(), quarters().get_pixel(x, y).0);
                let difference = found.iter().zip(expected).map(|(a, b)| a.abs_diff(b)).max().unwrap();
                assert!(difference <= if name == "a.jpg" { 12 } else { 0 }, "{name}: {found:?} {expected:?}");
            }
            assert!(!ends_early(&path), "{name}");
        }
    }

    #[test]
    fn targa_is_recognised_by_its_name_or_its_end() {
        let folder = tempfile::tempdir().unwrap();
        let mut bytes = encoded(ImageFormat::Tga);
        let path = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            path
        };
        assert!(load(&path("a.TGA", &bytes)).is_ok());
        assert!(load(&path("a.bin", &bytes)).is_err());
        bytes.extend_from_slice(&[0; 8]);
        bytes.extend_from_slice(b"TRUEVISION-XFILE.\0");
        assert!(load(&path("a.bin", &bytes)).is_ok());
    }

    #[test]
    fn truncated_pictures_are_refused_or_end_early() {
        let folder = tempfile::tempdir().unwrap();
        for (name, format) in FORMATS {
            let path = folder.path().join(name);
            let whole = encoded(format);
            for parts in 1..8 {
                std::fs::write(&path, &whole[..whole.len() * parts / 8]).unwrap();
                assert!(load(&path).is_err() || ends_early(&path), "{parts}/8 of {name}");
            }
        }
    }

    #[test]
    fn the_end_of_a_jpeg_is_behind_its_scans() {
        let whole = encoded(ImageFormat::Jpeg);
        assert!(has_end(&whole));
        // Bytes behind the end are ignored, and so are end markers inside of a segment.
        assert!(has_end(&[&whole[..], b"trailing"].concat()));
        let thumbnail = b"\xff\xe1\x00\x08\xff\xd8\xff\xd9\x00\x00";
        let cut = [&whole[..2], thumbnail, &whole[2..whole.len() - 2]].concat();
        assert!(!has_end(&cut));
        assert!(has_end(&[&cut[..], b"\xff\xd9"].concat()));
        for length in 0..whole.len() - 1 {
            assert!(!has_end(&whole[..length]), "{length}");
        }
    }

    #[test]
    fn sizes_beyond_the_limit_are_refused_in_every_format() {
        let folder = tempfile::tempdir().unwrap();
        let huge = |width: u16, height: u16| {
            let mut targa = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0];
            targa.extend_from_slice(&width.to_le_bytes());
            targa.extend_from_slice(&height.to_le_bytes());
            targa.extend_from_slice(&[24, 0]);
            targa
        };
        let mut bmp = encoded(ImageFormat::Bmp);
        bmp[18..26].copy_from_slice(&[0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff, 0x7f]);
        let mut gif = encoded(ImageFormat::Gif);
        gif[6..10].fill(0xff);
        for (name, bytes) in [("a.tga", huge(65535, 65535)), ("a.bmp", bmp), ("a.gif", gif)] {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            assert!(load(&path).is_err(), "{name}");
            assert!(size(&path).is_err(), "{name}");
        }
    }

    proptest::proptest! {
        #[test]
        fn changed_pictures_are_refused_or_read(
            which in 0..FORMATS.len(),
            changes in proptest::collection::vec((proptest::prelude::any::<proptest::sample::Index>(), 0_u8..), 1..6),
        ) {
            let (name, format) = FORMATS[which];
            let mut bytes = encoded(format);
            for (index, value) in changes {
                let at = index.index(bytes.len().min(200));
                bytes[at] = value;
            }
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            if size(&path).is_ok_and(|(width, height)| u64::from(width) * u64::from(height) < 1 << 20)
                && let Ok(picture) = load(&path)
            {
                proptest::prop_assert!(picture.check().is_ok());
            }
        }
    }
}
