//! Errors of pictures and their files.

#[cfg(feature = "pictures")]
use std::path::PathBuf;

#[cfg(feature = "pictures")]
use super::{HIGH_RANGE_FORMATS, MAX_SIDE};

/// Fault of a picture or its file.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The extension of a file name is no known format.
    #[cfg(feature = "pictures")]
    #[error("cannot write {}: its extension is none of {known}; end the file name in one of them", path.display())]
    UnknownExtension {
        /// The file.
        path: PathBuf,
        /// The extensions that are known.
        known: &'static str,
    },
    /// The layers of a file are not those that its format or the reader can have.
    #[cfg(feature = "pictures")]
    #[error(
        "{}: its layers do not fit; OpenEXR has one or more, all of one size, and other formats have one",
        path.display()
    )]
    Layers {
        /// The file.
        path: PathBuf,
    },
    /// The buffer of a picture does not match its size.
    #[error("a picture of {width} x {height} pixels needs {expected} bytes or numbers, but has {actual}")]
    WrongBuffer {
        /// Pixels per row.
        width: u32,
        /// Rows.
        height: u32,
        /// Bytes or numbers that the size needs.
        expected: usize,
        /// Bytes or numbers of the buffer.
        actual: usize,
    },
    /// Two pictures of different sizes cannot be compared.
    #[error("pictures of different sizes cannot be compared: {} x {} and {} x {}", a.0, a.1, b.0, b.1)]
    SizesDiffer {
        /// Width and height of the first.
        a: (u32, u32),
        /// Width and height of the second.
        b: (u32, u32),
    },
    /// The viewing distance is out of range.
    #[error("pictures are compared as seen at 1 to 1000 pixels per degree, not {given}")]
    PixelsPerDegree {
        /// Pixels per degree.
        given: f64,
    },
    /// The file cannot be written; nothing is left behind.
    #[cfg(feature = "pictures")]
    #[error("cannot write {}: {source}; check that its folder exists and may be written to", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file cannot be opened or read.
    #[cfg(feature = "pictures")]
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is no picture, a broken one, or one beyond the limits.
    #[cfg(feature = "pictures")]
    #[error("cannot decode {} as {formats} of at most {MAX_SIDE} x {MAX_SIDE} pixels: {source}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// The formats that were tried.
        formats: &'static str,
        /// Error of the decoder.
        source: ::image::ImageError,
    },
    /// The file has linear light beyond 1, where 8-bit sRGB is needed.
    #[cfg(feature = "pictures")]
    #[error(
        "{} is a picture of high dynamic range ({HIGH_RANGE_FORMATS}), which is for skies only ([background]); convert it to PNG",
        path.display()
    )]
    HighDynamicRange {
        /// The file.
        path: PathBuf,
    },
    /// The encoder refuses the picture; nothing is left behind.
    #[cfg(feature = "pictures")]
    #[error("cannot encode {}: {source}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// Error of the encoder.
        source: ::image::ImageError,
    },
}
