//! The size of pixels on the wire, and the time to encode and decode them:
//!
//! ```text
//! cargo bench -p rayfarm-protocol --bench pixels -- FRAME.ppm ...
//! ```
//!
//! Each picture is a binary PPM, as `rayfarm-master render -o FRAME.ppm` writes it, and is cut into bands of 16 rows as
//! render threads do. The table has the bytes, their share of the raw bytes, and the milliseconds of one thread to encode
//! and decode the whole picture: the least of 15 repeats. The wire carries plain LZ4. LZ4 after differences to the left
//! neighbour and to the row above is measured for comparison: see `protocol/src/pixels/blocks.rs`.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a benchmark fails by panicking")]

use std::time::{Duration, Instant};

use rayfarm_protocol::pixels::{Packer, PixelFormat, unpack};

const BAND_ROWS: usize = 16;
const REPEATS: usize = 15;

/// Number of bytes of a pixel of the pictures.
const PIXEL_BYTES: usize = PixelFormat::Rgb8.bytes_per_pixel();

/// A picture as RGB8 rows.
struct Picture {
    name: String,
    row_bytes: usize,
    pixels: Vec<u8>,
}

/// A filter in front of LZ4.
#[derive(Clone, Copy)]
enum Filter {
    None,
    Left,
    Up,
}

fn main() {
    // `cargo bench` adds `--bench`.
    let paths: Vec<String> = std::env::args().skip(1).filter(|arg| !arg.starts_with("--")).collect();
    if paths.is_empty() {
        println!("name some pictures: cargo bench -p rayfarm-protocol --bench pixels -- FRAME.ppm ...");
    }
    println!(
        "{:24} {:>8} {:>10} {:>7} {:>10} {:>10}",
        "picture", "filter", "bytes", "share", "encode ms", "decode ms"
    );
    for picture in paths.iter().map(|path| read(path)) {
        for (name, filter) in [("none", Filter::None), ("left", Filter::Left), ("up", Filter::Up)] {
            let (bytes, encode, decode) = measure(&picture, filter);
            let share = bytes as f64 / picture.pixels.len() as f64;
            let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
            println!(
                "{:24} {name:>8} {bytes:>10} {share:>7.3} {:>10.2} {:>10.2}",
                picture.name,
                milliseconds(encode),
                milliseconds(decode)
            );
        }
    }
}

/// Number of bytes of all blocks, and the least times to encode and decode them.
fn measure(picture: &Picture, filter: Filter) -> (usize, Duration, Duration) {
    let Picture { row_bytes, pixels, .. } = picture;
    let mut packer = Packer::new();
    let mut back = vec![0; pixels.len()];
    let (mut bytes, mut encode, mut decode) = (0, Duration::MAX, Duration::MAX);
    for _ in 0..REPEATS {
        let begun = Instant::now();
        let bands = pixels.chunks(row_bytes * BAND_ROWS);
        let blocks: Vec<Vec<u8>> = bands
            .map(|band| match filter {
                Filter::None => packer.block(band).unwrap(),
                Filter::Left | Filter::Up => packer.block(&differences(band, *row_bytes, filter)).unwrap(),
            })
            .collect();
        encode = encode.min(begun.elapsed());
        bytes = blocks.iter().map(Vec::len).sum();
        let begun = Instant::now();
        for (block, band) in blocks.iter().zip(back.chunks_mut(row_bytes * BAND_ROWS)) {
            unpack(block, band).unwrap();
            undo(band, *row_bytes, filter);
        }
        decode = decode.min(begun.elapsed());
    }
    assert!(back == *pixels, "{} differs after decoding", picture.name);
    (bytes, encode, decode)
}

/// Distance in bytes to the byte that is subtracted.
fn distance(row_bytes: usize, filter: Filter) -> usize {
    match filter {
        Filter::None => 0,
        Filter::Left => PIXEL_BYTES,
        Filter::Up => row_bytes,
    }
}

fn differences(band: &[u8], row_bytes: usize, filter: Filter) -> Vec<u8> {
    let distance = distance(row_bytes, filter).min(band.len());
    let mut out = band.to_vec();
    for ((out, byte), before) in out[distance..].iter_mut().zip(&band[distance..]).zip(band) {
        *out = byte.wrapping_sub(*before);
    }
    out
}

fn undo(band: &mut [u8], row_bytes: usize, filter: Filter) {
    match filter {
        Filter::None => {}
        Filter::Left => {
            let mut sum = [0u8; PIXEL_BYTES];
            for pixel in band.chunks_exact_mut(PIXEL_BYTES) {
                for (sum, channel) in sum.iter_mut().zip(pixel) {
                    *sum = sum.wrapping_add(*channel);
                    *channel = *sum;
                }
            }
        }
        Filter::Up => {
            let mut rest = band;
            while let Some((row, below)) = rest.split_at_mut_checked(row_bytes) {
                below.iter_mut().zip(row).for_each(|(byte, above)| *byte = byte.wrapping_add(*above));
                rest = below;
            }
        }
    }
}

/// Reads a binary PPM of 8 bits per channel.
fn read(path: &str) -> Picture {
    let file = std::fs::read(path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let mut fields = file.splitn(4, |byte| byte.is_ascii_whitespace());
    let mut number = |what: &str| {
        let text = fields.next().and_then(|field| std::str::from_utf8(field).ok());
        text.unwrap_or_else(|| panic!("{path}: no {what}")).to_owned()
    };
    assert_eq!(number("magic"), "P6", "{path} is no binary PPM");
    let width: usize = number("width").parse().unwrap();
    let height: usize = number("height").parse().unwrap();
    let row_bytes = width * PIXEL_BYTES;
    let start = file.len().checked_sub(row_bytes * height).unwrap_or_else(|| panic!("{path} is too short"));
    let name = std::path::Path::new(path).file_stem().unwrap().to_string_lossy().into_owned();
    Picture { name, row_bytes, pixels: file[start..].to_vec() }
}
