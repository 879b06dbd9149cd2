//! Whole pictures for terminals that show them: the protocols of kitty, of iTerm2 (JPEG), and sixel.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::encoder::place;
use super::sixel;

/// Most base64 characters in one part of a picture of kitty's protocol.
const KITTY_PART: usize = 4096;
/// Quality of JPEG for iTerm2.
const JPEG_QUALITY: u8 = 80;

/// Protocol for pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Protocol {
    /// kitty's, with raw pixels.
    Kitty,
    /// iTerm2's, with JPEG.
    Iterm,
    /// Sixel of DEC's terminals.
    Sixel,
}

/// A picture for an area of the terminal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed<'a> {
    /// Pixels per row.
    pub(super) width: usize,
    /// Rows of pixels.
    pub(super) height: usize,
    /// Three bytes per pixel.
    pub(super) rgb: &'a [u8],
    /// Columns and rows of the area, from the upper left corner of the terminal.
    pub(super) columns: usize,
    /// Rows of cells.
    pub(super) rows: usize,
}

/// Appends the bytes that show a picture.
///
/// # Errors
/// A picture that the encoder does not accept, in words.
pub(super) fn show(protocol: Protocol, picture: Placed<'_>, out: &mut Vec<u8>) -> Result<(), String> {
    place(out, 0, 0);
    match protocol {
        Protocol::Kitty => kitty(picture, out),
        Protocol::Iterm => return iterm(picture, out),
        Protocol::Sixel => sixel::encode(picture.width, picture.rgb, out),
    }
    Ok(())
}

/// Appends the bytes that remove the pictures of kitty's protocol; those of the others are overwritten by text.
pub(super) fn remove(protocol: Protocol, out: &mut Vec<u8>) {
    if protocol == Protocol::Kitty {
        out.extend_from_slice(b"\x1b_Ga=d,d=A,q=2\x1b\\");
    }
}

/// Picture 1 replaces its predecessor without flicker; the terminal sends no replies (q=2) and leaves the cursor (C=1).
fn kitty(picture: Placed<'_>, out: &mut Vec<u8>) {
    let Placed { width, height, rgb, columns, rows } = picture;
    let text = STANDARD.encode(rgb);
    let parts = text.as_bytes().chunks(KITTY_PART);
    let last = parts.len().saturating_sub(1);
    for (index, part) in parts.enumerate() {
        let more = u8::from(index < last);
        // Writing to memory does not fail.
        let _ = match index {
            0 => write!(
                out,
                "\x1b_Ga=T,f=24,s={width},v={height},i=1,p=1,q=2,C=1,c={columns},r={rows},m={more};"
            ),
            _ => write!(out, "\x1b_Gm={more},q=2;"),
        };
        out.extend_from_slice(part);
        out.extend_from_slice(b"\x1b\\");
    }
}

fn iterm(picture: Placed<'_>, out: &mut Vec<u8>) -> Result<(), String> {
    let Placed { columns, rows, .. } = picture;
    let jpeg = jpeg(picture)?;
    let text = STANDARD.encode(&jpeg);
    let size = jpeg.len();
    let _ = write!(
        out,
        "\x1b]1337;File=inline=1;size={size};width={columns};height={rows};preserveAspectRatio=0;doNotMoveCursor=1:{text}\x07"
    );
    Ok(())
}

fn jpeg(picture: Placed<'_>) -> Result<Vec<u8>, String> {
    let side =
        |pixels: usize| u16::try_from(pixels).map_err(|_| format!("{pixels} pixels are too many for JPEG"));
    let (width, height) = (side(picture.width)?, side(picture.height)?);
    let mut jpeg = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut jpeg, JPEG_QUALITY);
    let encoded = encoder.encode(picture.rgb, width, height, jpeg_encoder::ColorType::Rgb);
    encoded.map_err(|error| error.to_string())?;
    Ok(jpeg)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RGB: [u8; 5000 * 3] = [9; 5000 * 3];
    const PICTURE: Placed<'static> = Placed { width: 100, height: 50, rgb: &RGB, columns: 10, rows: 3 };

    fn shown(protocol: Protocol) -> String {
        let mut out = Vec::new();
        show(protocol, PICTURE, &mut out).unwrap();
        String::from_utf8(out).unwrap()
    }

    #[test]
    fn kitty_receives_all_pixels_in_parts() {
        let text = shown(Protocol::Kitty);
        let parts: Vec<&str> = text.split("\x1b\\").filter(|part| !part.is_empty()).collect();
        assert!(parts[0].contains("s=100,v=50") && parts[0].contains("c=10,r=3,m=1;"));
        assert!(parts.last().unwrap().contains("m=0"));
        let base64: String = parts.iter().map(|part| part.rsplit_once(';').unwrap().1).collect();
        assert_eq!(STANDARD.decode(base64).unwrap(), RGB);
    }

    #[test]
    fn iterm_receives_a_jpeg_of_the_announced_size() {
        let text = shown(Protocol::Iterm);
        let (head, tail) = text.split_once(':').unwrap();
        let jpeg = STANDARD.decode(tail.trim_end_matches('\x07')).unwrap();
        assert!(head.contains(&format!("size={};width=10;height=3;", jpeg.len())));
        assert_eq!(jpeg[..2], [0xFF, 0xD8]);
    }
}
