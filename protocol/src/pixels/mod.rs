//! Pixels of a rendered segment: their format, their encodings and the head of the message that carries them.
//!
//! A worker renders rows in a [`PixelFormat`], optionally packs them as RGB 5-6-5 ([`to_rgb565`]), and optionally
//! compresses them in blocks ([`Packer`]), formats of numbers in planes ([`planes_block`]). [`PixelsHeader`] names the [`Encoding`], so that the master can undo it.

mod blocks;
mod format;
mod header;
mod planes;
mod rgb565;

pub use blocks::{BlockError, Packer, unpack};
pub use format::PixelFormat;
pub use header::{Encoding, PixelsHeader};
pub use planes::{planes_block, unpack_planes};
pub use rgb565::{from_rgb565, rgb565_bytes, to_rgb565};

pub(crate) use header::PIXELS_HEAD_BYTES;
