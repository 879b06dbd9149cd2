//! Textures as blobs of bytes.
//!
//! Sixteen bytes of header (magic, version, width, height, little endian), then the texels, rows from bottom to top, which is the
//! direction of v:
//!
//! ```text
//!   version 1   three sRGB bytes a texel
//!   version 2   the same, then a byte of alpha a texel; only for pictures with transparent texels
//!   version 3   four bytes of linear RGB a texel, little endian: see `shared_exponent`; only for skies
//! ```

use std::fmt;
use std::sync::OnceLock;

use bytemuck::{Pod, Zeroable};

use super::alpha::{LEAST_ALPHA, bleed};
use super::distribution::Distribution;
use super::pyramid::Pyramid;
use super::shared_exponent::{MAX_CHANNEL, pack, unpack};
use super::{MAX_TEXELS, TextureError, TextureId};
use crate::image::{LinearImage, MAX_SIDE, RgbImage};
use crate::srgb;

/// First bytes of a texture.
pub const MAGIC: [u8; 6] = *b"RFTEXM";

/// Version of the layout of opaque textures.
pub const FORMAT_VERSION: u16 = 1;

/// Version of the layout of textures with alpha.
const WITH_ALPHA: u16 = 2;

/// Version of the layout of linear textures.
const LINEAR: u16 = 3;

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
            WITH_ALPHA | LINEAR => 4,
            version => {
                let known = format!("this program reads {FORMAT_VERSION} to {LINEAR}");
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

/// A picture on surfaces, or of a sky.
pub struct Texture {
    bytes: Vec<u8>,
    width: u32,
    height: u32,
    /// Offset of the alpha in `bytes`, if there is any.
    alpha: Option<usize>,
    linear: bool,
    id: TextureId,
    /// Smaller pictures, made when they are first needed.
    pyramid: OnceLock<Pyramid>,
    /// Where the light of a panorama comes from, found when it is first needed.
    pub(super) light: OnceLock<Option<Distribution>>,
    /// Where the light of a face of a cube map comes from, found when it is first needed.
    pub(super) face_light: OnceLock<Option<Distribution>>,
}

/// Numbers of texels that a linear texture cannot hold as they are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Replaced {
    /// Texels with a channel that is negative, infinite or no number.
    pub unusable: u64,
    /// Other texels with a channel above [`MAX_CHANNEL`].
    pub too_bright: u64,
}

impl Replaced {
    fn count(&mut self, color: [f32; 3]) {
        if color.iter().any(|channel| !(*channel >= 0.0) || channel.is_infinite()) {
            self.unusable += 1;
        } else if color.iter().any(|&channel| channel > MAX_CHANNEL) {
            self.too_bright += 1;
        }
    }
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

    /// Makes a texture of a picture in linear light, for skies. Channels that are negative or no number count as 0, larger ones than
    /// [`MAX_CHANNEL`] as that; the counts are returned.
    ///
    /// # Errors
    /// As [`Texture::new`], and a picture whose buffer does not match its size.
    pub fn linear(picture: &LinearImage) -> Result<(Self, Replaced), TextureError> {
        let LinearImage { width, height, ref pixels } = *picture;
        check_size(width, height)?;
        let texels = width as usize * height as usize;
        if pixels.len() != 3 * texels {
            let message = format!("{} channels for {width} x {height} texels", pixels.len());
            return Err(TextureError::Format(message));
        }
        let header = Header { magic: MAGIC, version: LINEAR, width, height };
        let mut bytes = Vec::with_capacity(HEADER_BYTES + 4 * texels);
        bytes.extend_from_slice(bytemuck::bytes_of(&header));
        let mut replaced = Replaced::default();
        for row in pixels.chunks_exact(width as usize * 3).rev() {
            for color in row.as_chunks().0 {
                replaced.count(*color);
                bytes.extend_from_slice(&pack(*color).to_le_bytes());
            }
        }
        Ok((Self::from_vec(bytes)?, replaced))
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
        let (alpha, linear) = ((version == WITH_ALPHA).then_some(alpha), version == LINEAR);
        let (light, face_light) = (OnceLock::new(), OnceLock::new());
        Ok(Self { bytes, width, height, alpha, linear, id, pyramid: OnceLock::new(), light, face_light })
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

    /// Whether its texels are linear: see [`Texture::linear`]. Others are sRGB.
    pub fn is_linear(&self) -> bool {
        self.linear
    }

    /// The linear RGB of the texel in column `x`, from the left, of row `y`, from the bottom, of both formats; outside, black or the
    /// colour of another texel.
    #[inline(always)]
    pub fn linear_texel(&self, x: u32, y: u32) -> [f32; 3] {
        if !self.linear {
            let decoded = srgb::decoded();
            return self.texel(x, y).map(|code| decoded[usize::from(code)]);
        }
        let first = HEADER_BYTES + 4 * (y as usize * self.width as usize + x as usize);
        match self.bytes.get(first..first + 4) {
            Some(&[a, b, c, d]) => unpack(u32::from_le_bytes([a, b, c, d])),
            _ => [0.0; 3],
        }
    }

    /// The sRGB bytes of the texel in column `x`, from the left, of row `y`, from the bottom; black outside. Not for linear textures.
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

#[cfg(test)]
mod tests;
