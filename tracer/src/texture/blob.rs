//! Textures as blobs of bytes.
//!
//! Sixteen bytes of header (magic, version, width, height, little endian), then three sRGB bytes a texel, rows from bottom to
//! top, which is the direction of v. Version 2 appends a byte of alpha a texel; only pictures with transparent texels have it.

use std::fmt;
use std::sync::OnceLock;

use bytemuck::{Pod, Zeroable};

use super::pyramid::Pyramid;
use super::{MAX_TEXELS, TextureError, TextureId};
use crate::image::{MAX_SIDE, RgbImage};

/// First bytes of a texture.
pub const MAGIC: [u8; 6] = *b"RFTEXM";

/// Version of the layout of opaque textures.
pub const FORMAT_VERSION: u16 = 1;

/// Version of the layout of textures with alpha.
const WITH_ALPHA: u16 = 2;

/// The smallest visible alpha: texels below one half are cut out.
pub(crate) const LEAST_ALPHA: u8 = 128;

/// Fixed part of a texture's bytes.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Header {
    magic: [u8; 6],
    version: u16,
    width: u32,
    height: u32,
}

const HEADER_BYTES: usize = size_of::<Header>();

const _: () = assert!(HEADER_BYTES == 16);

impl Header {
    fn read(bytes: &[u8]) -> Result<Self, TextureError> {
        let format = |what: String| Err(TextureError::Format(what));
        if !bytes.starts_with(&MAGIC) {
            return format("it does not start with RFTEXM".into());
        }
        let Some(fixed) = bytes.get(..HEADER_BYTES) else {
            return format(format!("{} bytes are too few for a header", bytes.len()));
        };
        let header: Header = bytemuck::pod_read_unaligned(fixed);
        let bytes_a_texel = match header.version {
            FORMAT_VERSION => 3,
            WITH_ALPHA => 4,
            version => {
                let known = format!("this program reads {FORMAT_VERSION} and {WITH_ALPHA}");
                return format(format!("it has format version {version}, {known}"));
            }
        };
        check_size(header.width, header.height)?;
        let texels = u64::from(header.width) * u64::from(header.height);
        let needed = HEADER_BYTES as u64 + bytes_a_texel * texels;
        if bytes.len() as u64 != needed {
            return format(format!("its header announces {needed} bytes, there are {}", bytes.len()));
        }
        Ok(header)
    }
}

/// Refuses a size that is empty or beyond the limits.
pub(crate) fn check_size(width: u32, height: u32) -> Result<(), TextureError> {
    if width == 0 || height == 0 {
        return Err(TextureError::Empty { width, height });
    }
    let too_large =
        width > MAX_SIDE || height > MAX_SIDE || u64::from(width) * u64::from(height) > MAX_TEXELS;
    if too_large { Err(TextureError::TooLarge { width, height }) } else { Ok(()) }
}

/// A picture on surfaces.
pub struct Texture {
    bytes: Vec<u8>,
    width: u32,
    height: u32,
    /// Offset of the alpha in `bytes`, if there is any.
    alpha: Option<usize>,
    id: TextureId,
    /// Smaller pictures, made when they are first needed.
    pyramid: OnceLock<Pyramid>,
}

impl fmt::Debug for Texture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Texture({:?}, {} x {})", self.id, self.width, self.height)
    }
}

impl Texture {
    /// Makes a texture of a picture.
    ///
    /// # Errors
    /// A picture that is empty or too large.
    pub fn new(picture: &RgbImage) -> Result<Self, TextureError> {
        Self::laid_out(FORMAT_VERSION, picture, &[])
    }

    /// Makes a texture of a picture with a byte of alpha per pixel. Alpha that cuts nothing out is dropped.
    ///
    /// # Errors
    /// As [`Texture::new`].
    pub fn with_alpha(picture: &RgbImage, alpha: &[u8]) -> Result<Self, TextureError> {
        let complete = alpha.len() as u64 == u64::from(picture.width) * u64::from(picture.height);
        if !complete || alpha.iter().all(|&alpha| alpha >= LEAST_ALPHA) {
            return Self::new(picture);
        }
        check_size(picture.width, picture.height)?;
        Self::laid_out(WITH_ALPHA, &bleed(picture, alpha), alpha)
    }

    fn laid_out(version: u16, picture: &RgbImage, alpha: &[u8]) -> Result<Self, TextureError> {
        let RgbImage { width, height, ref pixels } = *picture;
        check_size(width, height)?;
        let header = Header { magic: MAGIC, version, width, height };
        let mut bytes = Vec::with_capacity(HEADER_BYTES + pixels.len() + alpha.len());
        bytes.extend_from_slice(bytemuck::bytes_of(&header));
        for row in
            pixels.chunks_exact(width as usize * 3).rev().chain(alpha.chunks_exact(width as usize).rev())
        {
            bytes.extend_from_slice(row);
        }
        Self::from_vec(bytes)
    }

    /// Copies and checks the bytes of a texture from a peer.
    ///
    /// # Errors
    /// Bytes that are no texture of this version, or one that is too large.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, TextureError> {
        // Before anything is copied: the header must fit the length.
        Header::read(bytes)?;
        Self::from_vec(bytes.to_vec())
    }

    fn from_vec(bytes: Vec<u8>) -> Result<Self, TextureError> {
        let Header { width, height, version, .. } = Header::read(&bytes)?;
        let id = TextureId(*blake3::Hasher::new().update_rayon(&bytes).finalize().as_bytes());
        let alpha = HEADER_BYTES + 3 * width as usize * height as usize;
        let alpha = (version == WITH_ALPHA).then_some(alpha);
        Ok(Self { bytes, width, height, alpha, id, pyramid: OnceLock::new() })
    }

    /// The bytes as they are sent.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// BLAKE3 of the bytes.
    pub fn id(&self) -> TextureId {
        self.id
    }

    /// Texels in a row.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The sRGB bytes of the texel in column `x`, from the left, of row `y`, from the bottom; black outside.
    #[inline(always)]
    pub(crate) fn texel(&self, x: u32, y: u32) -> [u8; 3] {
        let first = HEADER_BYTES + 3 * (y as usize * self.width as usize + x as usize);
        // Four bytes at once, from the preceding byte on: for the first texel that is the last of the header.
        match self.bytes.get(first - 1..first + 3) {
            Some(&[_, r, g, b]) => [r, g, b],
            _ => [0; 3],
        }
    }

    /// The picture in smaller sizes, made at the first call.
    pub(crate) fn pyramid(&self) -> &Pyramid {
        if let Some(pyramid) = self.pyramid.get() {
            return pyramid;
        }
        // Not inside of the lock: the threads that make it may take other work meanwhile, and come here again.
        let made = Pyramid::of(self);
        self.pyramid.get_or_init(|| made)
    }

    /// Whether its alpha cuts something out.
    pub fn has_alpha(&self) -> bool {
        self.alpha.is_some()
    }

    /// The alpha of the texel in column `x`, from the left, of row `y`, from the bottom; opaque outside, and where there is
    /// no alpha.
    pub(crate) fn alpha(&self, x: u32, y: u32) -> u8 {
        let at = |first| first + y as usize * self.width as usize + x as usize;
        self.alpha.and_then(|first| self.bytes.get(at(first))).copied().unwrap_or(u8::MAX)
    }
}

/// The picture with new colours for fully transparent pixels: the mean of their other neighbours. Programs write arbitrary
/// colours there, which a filter would mix into the visible border.
fn bleed(picture: &RgbImage, alpha: &[u8]) -> RgbImage {
    let (width, height) = (picture.width as usize, picture.height as usize);
    let mut bled = picture.clone();
    for (index, pixel) in bled.pixels.chunks_exact_mut(3).enumerate().filter(|(index, _)| alpha[*index] == 0)
    {
        let (x, y) = (index % width, index / width);
        let (mut sum, mut count) = ([0_u32; 3], 0);
        for row in [y + height - 1, y, y + 1].map(|row| row % height) {
            for neighbour in [x + width - 1, x, x + 1].map(|column| row * width + column % width) {
                let Some(&[r, g, b]) = picture.pixels.get(3 * neighbour..3 * neighbour + 3) else { continue };
                if alpha[neighbour] > 0 {
                    count += 1;
                    for (sum, channel) in sum.iter_mut().zip([r, g, b]) {
                        *sum += u32::from(channel);
                    }
                }
            }
        }
        for (channel, sum) in pixel.iter_mut().zip(sum) {
            *channel = (sum + count / 2).checked_div(count).map_or(*channel, |mean| mean as u8);
        }
    }
    bled
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn picture(width: u32, height: u32) -> RgbImage {
        let pixels = (0..width * height * 3).map(|i| (i * 7 % 256) as u8).collect();
        RgbImage { width, height, pixels }
    }

    #[test]
    fn rows_are_stored_from_the_bottom() {
        let picture = picture(5, 3);
        let texture = Texture::new(&picture).unwrap();
        for (x, y) in (0..3).flat_map(|y| (0..5).map(move |x| (x, y))) {
            assert_eq!(Some(texture.texel(x, 2 - y)), picture.pixel(x, y));
        }
        assert_eq!(texture.texel(0, 3), [0; 3]);
        let again = Texture::from_bytes(texture.bytes()).unwrap();
        assert_eq!((again.id(), again.width(), again.height()), (texture.id(), 5, 3));
    }

    #[test]
    fn alpha_is_kept_where_it_cuts_and_colours_bleed() {
        let picture = picture(4, 3);
        let mut alpha = vec![255; 12];
        alpha[5] = LEAST_ALPHA;
        let opaque = Texture::with_alpha(&picture, &alpha).unwrap();
        assert!(!opaque.has_alpha() && opaque.id() == Texture::new(&picture).unwrap().id());
        assert_eq!(opaque.alpha(1, 1), 255);
        alpha[5] = LEAST_ALPHA - 1;
        alpha[0] = 0;
        let cut = Texture::from_bytes(Texture::with_alpha(&picture, &alpha).unwrap().bytes()).unwrap();
        assert!(cut.has_alpha() && cut.bytes().len() == 16 + 4 * 12);
        for (x, y) in (0..3).flat_map(|y| (0..4).map(move |x| (x, y))) {
            assert_eq!(cut.alpha(x, 2 - y), alpha[(4 * y + x) as usize]);
            let own = picture.pixel(x, y).unwrap();
            assert_eq!(cut.texel(x, 2 - y) == own, (x, y) != (0, 0), "{x} {y}");
        }
        // The mean of the eight around it, across the picture's border.
        let around = [(3, 2), (0, 2), (1, 2), (3, 0), (1, 0), (3, 1), (0, 1), (1, 1)];
        let red: u32 = around.iter().map(|&(x, y)| u32::from(picture.pixel(x, y).unwrap()[0])).sum();
        assert_eq!(u32::from(cut.texel(0, 2)[0]), (red + 4) / 8);
        assert_eq!(cut.alpha(0, 3), 255);
        assert!(Texture::from_bytes(&cut.bytes()[..60]).is_err());
    }

    #[test]
    fn sizes_are_checked_before_memory_is_allocated() {
        let announced = |width: u32, height: u32| {
            let header = Header { magic: MAGIC, version: FORMAT_VERSION, width, height };
            Texture::from_bytes(bytemuck::bytes_of(&header)).unwrap_err()
        };
        for (width, height) in [(u32::MAX, u32::MAX), (16384, 8192), (16385, 1)] {
            assert_eq!(announced(width, height), TextureError::TooLarge { width, height });
        }
        assert_eq!(announced(0, 7), TextureError::Empty { width: 0, height: 7 });
        assert!(announced(8192, 8192).to_string().contains("announces 201326608 bytes, there are 16"));
        assert!(Texture::new(&picture(0, 0)).unwrap_err().to_string().contains("needs at least one"));
    }

    #[test]
    fn other_bytes_are_refused() {
        for (bytes, words) in [
            (&b"RFMESH"[..], "does not start with RFTEXM"),
            (b"RFTEXM", "6 bytes are too few"),
            (b"RFTEXM\x09\x00\x01\x00\x00\x00\x01\x00\x00\x00abc", "format version 9"),
        ] {
            let message = Texture::from_bytes(bytes).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }

    proptest! {
        #[test]
        fn changed_bytes_are_refused_or_a_valid_texture(
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..5),
            cut in 0_usize..4,
        ) {
            let mut bytes = Texture::new(&picture(4, 3)).unwrap().bytes().to_vec();
            bytes.truncate(bytes.len() - cut);
            for (index, value) in changes {
                let at = index.index(bytes.len());
                bytes[at] = value;
            }
            if let Ok(texture) = Texture::from_bytes(&bytes) {
                prop_assert_eq!(u64::from(texture.width()) * u64::from(texture.height()), 12);
                texture.texel(texture.width() - 1, texture.height() - 1);
            }
        }
    }
}
