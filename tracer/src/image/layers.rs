//! Files of linear light: Radiance HDR with one picture, OpenEXR with any number of layers.

use std::io::{self, BufReader, BufWriter};
use std::path::Path;

use ::image::codecs::hdr::HdrEncoder;
use ::image::error::{DecodingError, EncodingError, ImageFormatHint};
use ::image::{ImageFormat, Rgb};
use exr::prelude as open_exr;
use exr::prelude::{ReadChannels, ReadLayers, WritableImage};

use super::{HIGH_RANGE_FORMATS, ImageError, LinearImage};
use crate::files::{Temporary, open_regular};

/// Extensions that [`save_layers`] supports, for messages.
pub const LINEAR_EXTENSIONS: &str = ".hdr, .exr";

/// Largest number of layers that [`layer_names`] reads.
const MAX_LAYERS: usize = 64;

/// A layer of a picture file.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Name, unlike those of the other layers of the file.
    pub name: &'static str,
    /// Meaning of the numbers.
    pub channels: Channels,
    /// The numbers.
    pub picture: LinearImage,
}

/// Channels of a layer, as OpenEXR names them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// Colours: R, G, B.
    Color,
    /// Vectors: X, Y, Z.
    Vector,
    /// The first of three numbers, by this name.
    Single(&'static str),
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Hdr,
    Exr,
}

impl Format {
    fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_string_lossy().to_ascii_lowercase();
        match extension.as_str() {
            "hdr" => Some(Self::Hdr),
            "exr" => Some(Self::Exr),
            _ => None,
        }
    }
}

/// Whether files of this name have linear light, by the extension.
pub fn is_linear(path: &Path) -> bool {
    Format::of(path).is_some()
}

/// Whether files of this name may have several layers, by the extension.
pub fn has_layers(path: &Path) -> bool {
    Format::of(path) == Some(Format::Exr)
}

/// Writes layers of one size as OpenEXR, or one layer of colours as Radiance HDR, by the extension of `path`, replacing an existing
/// file. Readers of one picture find the first layer. Radiance HDR has no negative numbers, and 8 bits of the largest channel.
///
/// # Errors
/// An unknown extension, several layers in a format of one, layers of different sizes or without pixels, a folder without write
/// permission, a full disk. An existing file is then unchanged, and no partial file is left.
pub fn save_layers(path: &Path, layers: &[Layer]) -> Result<(), ImageError> {
    let unknown = || ImageError::UnknownExtension { path: path.to_owned(), known: LINEAR_EXTENSIONS };
    let format = Format::of(path).ok_or_else(unknown)?;
    let Some(first) = layers.first() else { return Err(ImageError::Layers { path: path.to_owned() }) };
    let one_is_too_many = format == Format::Hdr && layers.len() > 1;
    if one_is_too_many || layers.iter().any(|layer| !layer.fits(&first.picture)) {
        return Err(ImageError::Layers { path: path.to_owned() });
    }
    let failed = |source| ImageError::Write { path: path.to_owned(), source };
    let (temporary, file) = Temporary::create_next_to(path).map_err(failed)?;
    let mut out = BufWriter::new(file);
    match format {
        Format::Hdr => write_hdr(&mut out, &first.picture),
        Format::Exr => write_exr(&mut out, layers),
    }
    .map_err(|source| ImageError::Encode { path: path.to_owned(), source })?;
    // Closed before renaming: Windows does not rename open files.
    drop(out.into_inner().map_err(|error| failed(error.into_error()))?);
    temporary.rename_to(path).map_err(failed)
}

impl Layer {
    /// Whether the layer has the size of another picture, and its pixels.
    fn fits(&self, other: &LinearImage) -> bool {
        let LinearImage { width, height, pixels } = &self.picture;
        let numbers = (*width as usize).saturating_mul(*height as usize).saturating_mul(3);
        (*width, *height) == (other.width, other.height) && pixels.len() == numbers && numbers > 0
    }

    /// The channels by their names, in the order of the numbers.
    fn channels(&self) -> Vec<open_exr::AnyChannel<open_exr::FlatSamples>> {
        let names: &[&str] = match &self.channels {
            Channels::Color => &["R", "G", "B"],
            Channels::Vector => &["X", "Y", "Z"],
            Channels::Single(name) => &[*name],
        };
        let samples = |channel| self.picture.pixels.iter().skip(channel).step_by(3).copied().collect();
        let named = names.iter().enumerate().map(|(channel, name)| {
            open_exr::AnyChannel::new(*name, open_exr::FlatSamples::F32(samples(channel)))
        });
        named.collect()
    }
}

fn write_hdr(out: &mut impl io::Write, picture: &LinearImage) -> Result<(), ::image::ImageError> {
    let pixels: Vec<Rgb<f32>> = picture.pixels.as_chunks().0.iter().map(|pixel| Rgb(*pixel)).collect();
    HdrEncoder::new(out).encode(&pixels, picture.width as usize, picture.height as usize)
}

fn write_exr(out: &mut (impl io::Write + io::Seek), layers: &[Layer]) -> Result<(), ::image::ImageError> {
    let size = |picture: &LinearImage| (picture.width as usize, picture.height as usize);
    let written: Vec<_> = layers
        .iter()
        .map(|layer| {
            let attributes = open_exr::LayerAttributes::named(layer.name);
            let channels = open_exr::AnyChannels::sort(layer.channels().into());
            let encoding = open_exr::Encoding::SMALL_LOSSLESS;
            open_exr::Layer::new(size(&layer.picture), attributes, encoding, channels)
        })
        .collect();
    let bounds = layers.first().map_or((0, 0), |layer| size(&layer.picture));
    let attributes = open_exr::ImageAttributes::new(open_exr::IntegerBounds::from_dimensions(bounds));
    let image = open_exr::Image::from_layers(attributes, written);
    image.write().non_parallel().to_buffered(out).map_err(|error| match error {
        exr::error::Error::Io(error) => ::image::ImageError::IoError(error),
        error => {
            let format = ImageFormatHint::Exact(ImageFormat::OpenExr);
            ::image::ImageError::Encoding(EncodingError::new(format, error))
        }
    })
}

/// The names of the layers of an OpenEXR file, all of which are read. Layers without a name have an empty one.
///
/// # Errors
/// A file that cannot be read, is not OpenEXR, is cut off or damaged, or has more than 64 layers or layers of another size than
/// `width` x `height`.
pub fn layer_names(path: &Path, width: u32, height: u32) -> Result<Vec<String>, ImageError> {
    let unreadable = |source| ImageError::Read { path: path.to_owned(), source };
    let broken = |error: exr::error::Error| {
        let source = DecodingError::new(ImageFormatHint::Exact(ImageFormat::OpenExr), error);
        let source = ::image::ImageError::Decoding(source);
        ImageError::Decode { path: path.to_owned(), formats: HIGH_RANGE_FORMATS, source }
    };
    let open = || open_regular(path).map(BufReader::new).map_err(unreadable);
    // The sizes in the headers are checked before anything is allocated for pixels.
    let headers = exr::meta::MetaData::read_from_buffered(open()?, false).map_err(broken)?.headers;
    let size = open_exr::Vec2(width as usize, height as usize);
    if headers.len() > MAX_LAYERS || headers.iter().any(|header| header.layer_size != size || header.deep) {
        return Err(ImageError::Layers { path: path.to_owned() });
    }
    let read = open_exr::read().no_deep_data().largest_resolution_level().all_channels();
    let image = read.all_layers().all_attributes().non_parallel().from_buffered(open()?).map_err(broken)?;
    let names = image.layer_data.iter().map(|layer| layer.attributes.layer_name.as_ref());
    Ok(names.map(|name| name.map_or_else(String::new, ToString::to_string)).collect())
}

#[cfg(test)]
mod tests {
    use super::super::{SkyPixels, load_sky, size};
    use super::*;

    fn picture(width: u32, height: u32) -> LinearImage {
        let number = |index: u32| (index as f32 - 9.0) * 1.375;
        LinearImage { width, height, pixels: (0..3 * width * height).map(number).collect() }
    }

    fn layers() -> Vec<Layer> {
        let layer = |name, channels| Layer { name, channels, picture: picture(7, 5) };
        vec![
            layer("beauty", Channels::Color),
            layer("normal", Channels::Vector),
            layer("depth", Channels::Single("Z")),
        ]
    }

    fn loaded(path: &Path) -> LinearImage {
        match load_sky(path).unwrap().pixels {
            SkyPixels::Linear(picture) => picture,
            SkyPixels::Srgb(_) => panic!("{} is not linear", path.display()),
        }
    }

    #[test]
    fn one_layer_of_open_exr_has_every_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.EXR");
        let mut one = layers()[..1].to_vec();
        one[0].picture.pixels[4] = f32::INFINITY;
        one[0].picture.pixels[5] = 1.0e-40;
        save_layers(&path, &one).unwrap();
        save_layers(&path, &one).unwrap();
        assert_eq!((loaded(&path), size(&path).unwrap()), (one[0].picture.clone(), (7, 5)));
        assert_eq!(layer_names(&path, 7, 5).unwrap(), ["beauty"]);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn several_layers_keep_their_names_and_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        save_layers(&path, &layers()).unwrap();
        assert_eq!(loaded(&path), picture(7, 5), "the first layer is the picture for other programs");
        assert_eq!(layer_names(&path, 7, 5).unwrap(), ["beauty", "normal", "depth"]);
        let read = open_exr::read().no_deep_data().largest_resolution_level().all_channels();
        let image = read.all_layers().all_attributes().from_file(&path).unwrap();
        let named = |layer: usize| -> Vec<(String, Vec<f32>)> {
            let channels = image.layer_data[layer].channel_data.list.iter();
            let numbers = |channel: &open_exr::AnyChannel<open_exr::FlatSamples>| {
                (channel.name.to_string(), channel.sample_data.values_as_f32().collect())
            };
            channels.map(numbers).collect()
        };
        let expected = |channel: usize, name: &str| -> (String, Vec<f32>) {
            (name.to_owned(), picture(7, 5).pixels.into_iter().skip(channel).step_by(3).collect())
        };
        assert_eq!(named(1), [expected(0, "X"), expected(1, "Y"), expected(2, "Z")]);
        assert_eq!(named(2), [expected(0, "Z")]);
    }

    #[test]
    fn radiance_has_light_within_a_256th_of_the_largest_channel() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hdr");
        let mut one = layers()[..1].to_vec();
        one[0].picture.pixels.iter_mut().for_each(|value| *value = value.abs());
        save_layers(&path, &one).unwrap();
        let pixels = loaded(&path).pixels;
        for (found, expected) in
            pixels.as_chunks::<3>().0.iter().zip(one[0].picture.pixels.as_chunks::<3>().0)
        {
            let largest = expected.iter().copied().fold(0.0, f32::max);
            for channel in 0..3 {
                assert!(
                    (found[channel] - expected[channel]).abs() <= largest / 128.0,
                    "{found:?} {expected:?}"
                );
            }
        }
    }

    #[test]
    fn what_a_file_cannot_have_is_refused_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |name: &str, layers: &[Layer]| {
            save_layers(&folder.path().join(name), layers).unwrap_err().to_string()
        };
        assert!(refused("a.hdr", &layers()).contains("layers"));
        assert!(refused("a.exr", &[]).contains("layers"));
        let mut other = layers();
        other[1].picture = picture(5, 7);
        assert!(refused("a.exr", &other).contains("layers"));
        let message = refused("a.png", &layers());
        assert!(message.contains("a.png") && message.contains(".hdr, .exr"), "{message}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_file_that_is_cut_off_anywhere_is_not_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        save_layers(&path, &layers()).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for length in (0..whole.len()).step_by(37).chain([whole.len() - 1]) {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(layer_names(&path, 7, 5).is_err(), "{length} of {} bytes", whole.len());
        }
        std::fs::write(&path, &whole).unwrap();
        assert!(layer_names(&path, 8, 5).is_err(), "another size");
    }
}
