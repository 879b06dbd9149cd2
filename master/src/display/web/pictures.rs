//! Encoded pictures: JPEG while frames change, PNG with the exact bytes of a frame at rest. Each frame is encoded at most once per
//! format, on demand, and all clients share the result.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use axum::body::Bytes;
use tokio::sync::Mutex;

use crate::viewer::PresentedFrame;

/// Quality of JPEG: a fifth of the bytes of the best quality, without visible errors in motion.
const JPEG_QUALITY: u8 = 75;
/// Bytes in front of a picture in a message: kind (1 JPEG, 2 PNG), three zeros, number, width, height, the numbers with four bytes,
/// the lowest first.
pub(super) const HEADER_BYTES: usize = 16;

/// Format of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    /// For frames that are replaced soon.
    Jpeg,
    /// For a frame at rest: the exact bytes.
    Png,
}

impl Format {
    pub(super) const ALL: [Self; 2] = [Self::Jpeg, Self::Png];

    /// Name in metrics.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Jpeg => "jpeg",
            Self::Png => "png",
        }
    }
}

/// A picture as a message.
#[derive(Clone, Debug)]
pub(super) struct Encoded {
    /// Number by which a client acknowledges the picture.
    pub(super) number: u32,
    /// Header and picture.
    pub(super) message: Bytes,
}

/// Encoder with the newest picture of each format.
#[derive(Debug, Default)]
pub(super) struct Pictures {
    newest: [Mutex<Option<Kept>>; 2],
    numbers: AtomicU32,
    counts: [Counts; 2],
}

/// A picture and its frame, whose pixels it does not keep in memory.
#[derive(Debug)]
struct Kept {
    frame: Weak<PresentedFrame>,
    encoded: Encoded,
}

#[derive(Debug, Default)]
struct Counts {
    pictures: AtomicU64,
    nanoseconds: AtomicU64,
    bytes: AtomicU64,
}

/// Work of the encoder since its start.
#[derive(Clone, Copy, Debug)]
pub(super) struct EncoderWork {
    pub(super) format: Format,
    pub(super) pictures: u64,
    /// Time of the encoder, which uses one core.
    pub(super) time: Duration,
    /// Bytes of all pictures, each counted once however many clients received it.
    pub(super) bytes: u64,
}

impl Pictures {
    /// The picture of a frame.
    ///
    /// # Errors
    /// A frame that cannot be encoded, in words.
    pub(super) async fn of(&self, frame: &Arc<PresentedFrame>, format: Format) -> Result<Encoded, String> {
        // A further client of the same frame waits here for the picture.
        let mut newest = self.newest[format as usize].lock().await;
        let kept = newest.as_ref().filter(|kept| kept.frame.as_ptr() == Arc::as_ptr(frame));
        if let Some(kept) = kept {
            return Ok(kept.encoded.clone());
        }
        let number = self.numbers.fetch_add(1, Ordering::Relaxed);
        let shared = Arc::clone(frame);
        let encode = move || {
            let started = Instant::now();
            message(&shared, format, number).map(|message| (message, started.elapsed()))
        };
        let encoded = tokio::task::spawn_blocking(encode).await;
        let (message, time) = encoded.map_err(|error| error.to_string())??;
        let counts = &self.counts[format as usize];
        counts.pictures.fetch_add(1, Ordering::Relaxed);
        let nanoseconds = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        counts.nanoseconds.fetch_add(nanoseconds, Ordering::Relaxed);
        counts.bytes.fetch_add((message.len() - HEADER_BYTES) as u64, Ordering::Relaxed);
        let encoded = Encoded { number, message };
        *newest = Some(Kept { frame: Arc::downgrade(frame), encoded: encoded.clone() });
        Ok(encoded)
    }

    /// Work so far, for each format.
    pub(super) fn work(&self) -> [EncoderWork; 2] {
        Format::ALL.map(|format| {
            let counts = &self.counts[format as usize];
            EncoderWork {
                format,
                pictures: counts.pictures.load(Ordering::Relaxed),
                time: Duration::from_nanos(counts.nanoseconds.load(Ordering::Relaxed)),
                bytes: counts.bytes.load(Ordering::Relaxed),
            }
        })
    }
}

fn message(frame: &PresentedFrame, format: Format, number: u32) -> Result<Bytes, String> {
    let (width, height) = (frame.frame.view.width, frame.frame.view.height);
    let rgb: &[u8] = &frame.frame.pixels;
    let mut message = Vec::with_capacity(HEADER_BYTES + rgb.len() / 8);
    message.extend_from_slice(&[format as u8 + 1, 0, 0, 0]);
    for value in [number, width, height] {
        message.extend_from_slice(&value.to_le_bytes());
    }
    match format {
        Format::Jpeg => jpeg(rgb, width, height, &mut message)?,
        Format::Png => png(rgb, width, height, &mut message).map_err(|error| error.to_string())?,
    }
    Ok(message.into())
}

fn jpeg(rgb: &[u8], width: u32, height: u32, out: &mut Vec<u8>) -> Result<(), String> {
    let side =
        |pixels: u32| u16::try_from(pixels).map_err(|_| format!("{pixels} pixels are too many for JPEG"));
    let (width, height) = (side(width)?, side(height)?);
    let encoder = jpeg_encoder::Encoder::new(out, JPEG_QUALITY);
    encoder.encode(rgb, width, height, jpeg_encoder::ColorType::Rgb).map_err(|error| error.to_string())
}

fn png(rgb: &[u8], width: u32, height: u32, out: &mut Vec<u8>) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    writer.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32) -> Vec<u8> {
        let mut random = 1_u32;
        let mut byte = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 24) as u8
        };
        (0..width * height * 3).map(|_| byte()).collect()
    }

    #[test]
    fn png_has_the_exact_bytes() {
        for (width, height) in [(1, 1), (7, 5), (64, 48)] {
            let (rgb, mut out) = (picture(width, height), Vec::new());
            png(&rgb, width, height, &mut out).unwrap();
            let mut reader = png::Decoder::new(std::io::Cursor::new(out)).read_info().unwrap();
            let mut read = vec![0; reader.output_buffer_size().unwrap()];
            let info = reader.next_frame(&mut read).unwrap();
            assert_eq!((info.width, info.height, info.color_type), (width, height, png::ColorType::Rgb));
            // Gamma or a colour space would change the pixels in a browser.
            assert!(reader.info().gama_chunk.is_none() && reader.info().srgb.is_none());
            assert_eq!(read, rgb);
        }
    }

    #[test]
    fn jpeg_has_the_size_and_refuses_huge_sides() {
        let mut out = Vec::new();
        jpeg(&picture(20, 10), 20, 10, &mut out).unwrap();
        assert_eq!(out[..2], [0xff, 0xd8]);
        let sizes = out.windows(9).find(|bytes| bytes[..2] == [0xff, 0xc0]).unwrap();
        assert_eq!(sizes[5..9], [0, 10, 0, 20]);
        assert!(jpeg(&[], 70_000, 1, &mut out).unwrap_err().contains("70000"));
    }
}
