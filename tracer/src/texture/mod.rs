//! Textures: pictures on surfaces and of skies, and how they are looked up.
//!
//! A texture is one immutable blob of bytes, named by its BLAKE3 hash like a compiled mesh. The master makes it of a picture,
//! and every worker receives it as it is.
//!
//! ```text
//!   blob              its bytes
//!   alpha             what alpha cuts out and hides
//!   shared_exponent   linear RGB in four bytes, for high dynamic range
//!   bilinear          the four texels around each of sixteen places
//!   map               filter, wrap, scale and offset of a lookup
//!   lookup            single lookups in f64, of alpha and normals
//!   pyramid           smaller and smaller sizes, for surfaces far away
//!   distribution      random places in the picture of a sky, by its light
//!   face_light        those in faces of cube maps
//!   uv                texture coordinates with and without whole repeats
//! ```

mod alpha;
pub(crate) mod bilinear;
mod blob;
mod distribution;
mod face_light;
mod lookup;
mod map;
mod pyramid;
mod shared_exponent;
mod uv;

use std::fmt;

use serde::{Deserialize, Serialize};

pub use blob::{FORMAT_VERSION, MAGIC, Replaced, Texture};
pub use map::{Filter, MAX_TILING, TextureMap, Tiling, Wrap};
pub use shared_exponent::MAX_CHANNEL;
pub use uv::{MAX_UV, are_usable, split_repeats, without_repeats};

pub(crate) use alpha::LEAST_ALPHA;
#[cfg(feature = "import")]
pub(crate) use blob::check_size;
pub(crate) use distribution::Distribution;
pub(crate) use uv::is_usable;

/// Most texels of one texture: 8192 x 8192, 192 or 256 MiB.
pub const MAX_TEXELS: u64 = 1 << 26;

/// The name of a texture: BLAKE3 of its bytes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TextureId(pub [u8; 32]);

impl fmt::Display for TextureId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for TextureId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "TextureId({:02x}{:02x}{:02x}{:02x})", self.0[0], self.0[1], self.0[2], self.0[3])
    }
}

/// Why a picture cannot be a texture, or bytes are none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TextureError {
    /// More texels than a texture may have.
    #[error(
        "a texture of {width} x {height} texels; at most {MAX_TEXELS} (8192 x 8192) are allowed: make the picture smaller"
    )]
    TooLarge {
        /// Texels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// No texel at all.
    #[error("a texture of {width} x {height} texels; it needs at least one")]
    Empty {
        /// Texels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// The bytes are no texture of this version.
    #[error("not a texture that this version reads: {0}")]
    Format(String),
}
