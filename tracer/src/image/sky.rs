//! Pictures of skies: those of other pictures, and formats of high dynamic range.

use std::path::Path;

use ::image::DynamicImage;

use super::load::{decoded, drop_fourth, split_alpha};
use super::{ImageError, LinearImage, RgbImage};

/// A picture of a sky.
#[derive(Clone, Debug, PartialEq)]
pub struct SkyImage {
    /// The picture without its alpha.
    pub pixels: SkyPixels,
    /// Whether a pixel of the file was not opaque.
    pub translucent: bool,
}

/// The pixels of a [`SkyImage`].
#[derive(Clone, Debug, PartialEq)]
pub enum SkyPixels {
    /// 8-bit sRGB, from files of integers.
    Srgb(RgbImage),
    /// Linear light, from files of floating-point numbers. They may be negative, infinite or NaN.
    Linear(LinearImage),
}

/// Reads a picture in one of the [`super::READ_FORMATS`] or [`super::HIGH_RANGE_FORMATS`], recognised by its content. The exposure and
/// the primaries in the header of a Radiance picture are not applied.
///
/// # Errors
/// A file that cannot be read, is no picture, is broken, or is larger than [`super::MAX_SIDE`] in either direction.
pub fn load_sky(path: &Path) -> Result<SkyImage, ImageError> {
    let picture = decoded(path)?;
    let (width, height) = (picture.width(), picture.height());
    let linear = |pixels| SkyPixels::Linear(LinearImage { width, height, pixels });
    Ok(match picture {
        DynamicImage::ImageRgb32F(pixels) => {
            SkyImage { pixels: linear(pixels.into_raw()), translucent: false }
        }
        DynamicImage::ImageRgba32F(pixels) => {
            let mut pixels = pixels.into_raw();
            let translucent = pixels.iter().skip(3).step_by(4).any(|&alpha| alpha < 1.0);
            drop_fourth(&mut pixels);
            SkyImage { pixels: linear(pixels), translucent }
        }
        picture => {
            let (pixels, alpha) = split_alpha(picture);
            let translucent = alpha.is_some_and(|alpha| alpha.iter().any(|&alpha| alpha < u8::MAX));
            SkyImage { pixels: SkyPixels::Srgb(pixels), translucent }
        }
    })
}

#[cfg(test)]
mod tests {
    use ::image::{ImageFormat, Rgb, Rgb32FImage, RgbImage as Rgb8Image, Rgba, Rgba32FImage, RgbaImage};

    use super::super::{has_high_range, load, load_with_alpha, size};
    use super::*;

    /// A column brighter than 1 next to darker ones, with powers of two that every format keeps.
    fn light() -> Rgb32FImage {
        Rgb32FImage::from_fn(16, 8, |x, y| Rgb([f32::from(x == 3) * 4096.0, 0.5, (1 << (y % 4)) as f32]))
    }

    fn written(name: &str, picture: impl Into<DynamicImage>) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        picture.into().save(&path).unwrap();
        (folder, path)
    }

    fn linear(path: &Path) -> LinearImage {
        match load_sky(path).unwrap().pixels {
            SkyPixels::Linear(picture) => picture,
            SkyPixels::Srgb(_) => panic!("{} is read as sRGB", path.display()),
        }
    }

    #[test]
    fn radiance_pictures_of_other_programs_are_read() {
        let (_folder, path) = written("a.hdr", light());
        let expected = linear(&path);
        let bytes = std::fs::read(&path).unwrap();
        let line = bytes.iter().position(|&byte| byte == b'\n').unwrap();
        for name in ["#?RGBE", "#?AUTOPANO_PRO 4.4"] {
            std::fs::write(&path, [name.as_bytes(), &bytes[line..]].concat()).unwrap();
            assert!(has_high_range(&path));
            assert_eq!(size(&path).unwrap(), (16, 8));
            assert_eq!(linear(&path), expected, "{name}");
        }
    }

    #[test]
    fn formats_of_high_range_are_linear_and_for_skies_only() {
        for name in ["a.hdr", "a.exr"] {
            let (_folder, path) = written(name, light());
            assert_eq!(size(&path).unwrap(), (16, 8), "{name}");
            let LinearImage { width, height, pixels } = linear(&path);
            assert_eq!((width, height), (16, 8), "{name}");
            for (index, (found, expected)) in pixels.iter().zip(light().as_raw()).enumerate() {
                // Radiance's exponent is shared: next to 4096 its step is 32.
                let step = if name == "a.hdr" && index / 3 % 16 == 3 { 32.0 } else { 0.0 };
                assert!((found - expected).abs() <= step, "{name}: {found} {expected}");
            }
            assert_eq!(pixels[9], 4096.0, "{name}");
            assert!(has_high_range(&path));
            for message in [load(&path).unwrap_err(), load_with_alpha(&path).unwrap_err()] {
                assert!(message.to_string().contains("for skies only"), "{message}");
            }
        }
    }

    #[test]
    fn other_formats_are_srgb() {
        let (_folder, path) = written("a.png", Rgb8Image::from_pixel(4, 2, Rgb([10, 200, 30])));
        let sky = load_sky(&path).unwrap();
        let expected = RgbImage { width: 4, height: 2, pixels: [10, 200, 30].repeat(8) };
        assert_eq!(sky, SkyImage { pixels: SkyPixels::Srgb(expected), translucent: false });
        assert!(!has_high_range(&path));
        let (_folder, path) = written("a.png", RgbaImage::from_pixel(4, 2, Rgba([10, 200, 30, 254])));
        assert!(load_sky(&path).unwrap().translucent);
    }

    #[test]
    fn alpha_of_linear_pictures_is_dropped() {
        for (alpha, translucent) in [(1.0, false), (0.25, true)] {
            let picture = Rgba32FImage::from_fn(3, 2, |x, y| Rgba([x as f32, y as f32, 7.0, alpha]));
            let (_folder, path) = written("a.exr", picture);
            assert_eq!(load_sky(&path).unwrap().translucent, translucent);
            let LinearImage { pixels, .. } = linear(&path);
            assert_eq!(pixels[12..], [0.0, 1.0, 7.0, 1.0, 1.0, 7.0, 2.0, 1.0, 7.0][3..]);
        }
    }

    #[test]
    fn truncated_pictures_of_high_range_are_refused() {
        for format in [ImageFormat::Hdr, ImageFormat::OpenExr] {
            let (_folder, path) =
                written(if format == ImageFormat::Hdr { "a.hdr" } else { "a.exr" }, light());
            let whole = std::fs::read(&path).unwrap();
            for parts in 1..8 {
                std::fs::write(&path, &whole[..whole.len() * parts / 8]).unwrap();
                let message = load_sky(&path).unwrap_err().to_string();
                assert!(message.contains("as Radiance HDR or OpenEXR"), "{parts}/8: {message}");
            }
        }
    }

    #[test]
    fn announced_sizes_beyond_the_limit_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hdr");
        std::fs::write(&path, b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 20000 +X 20000\n").unwrap();
        assert!(load_sky(&path).is_err() && size(&path).is_err());
    }

    proptest::proptest! {
        #[test]
        fn changed_pictures_are_refused_or_read(
            exr: bool,
            changes in proptest::collection::vec((proptest::prelude::any::<proptest::sample::Index>(), 0_u8..), 1..6),
        ) {
            let (_folder, path) = written(if exr { "a.exr" } else { "a.hdr" }, light());
            let mut bytes = std::fs::read(&path).unwrap();
            for (index, value) in changes {
                let at = index.index(bytes.len());
                bytes[at] = value;
            }
            std::fs::write(&path, bytes).unwrap();
            if size(&path).is_ok_and(|(width, height)| u64::from(width) * u64::from(height) < 1 << 20)
                && let Ok(SkyImage { pixels: SkyPixels::Linear(picture), .. }) = load_sky(&path)
            {
                let channels = 3 * picture.width as usize * picture.height as usize;
                proptest::prop_assert_eq!(picture.pixels.len(), channels);
            }
        }
    }
}
