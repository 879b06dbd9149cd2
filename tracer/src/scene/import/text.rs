//! Decoding of text files: from the encodings that programs write to UTF-8 and its lines.
//!
//! UTF-8 and UTF-16 are read with or without a byte order mark. A line that is not UTF-8 is read as Windows-1252,
//! which maps every byte to a distinct character: names that differ in a byte remain different, and a name is the
//! same in a model and in its material library, whatever the encoding of their other lines.

use std::borrow::Cow;
use std::ffi::OsStr;

/// Number of bytes that are examined to recognise UTF-16 without a byte order mark.
const SAMPLE: usize = 4096;

/// The byte order mark.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// The text of a file, without byte order mark and without trailing padding of old systems. UTF-8 is not copied.
pub(in crate::scene) fn decoded(content: &[u8]) -> Cow<'_, str> {
    match content {
        [0xff, 0xfe, text @ ..] => Cow::Owned(utf16(text, u16::from_le_bytes)),
        [0xfe, 0xff, text @ ..] => Cow::Owned(utf16(text, u16::from_be_bytes)),
        _ => match zeros_of_utf16(content) {
            Some(Zeros::High) => Cow::Owned(utf16(content, u16::from_le_bytes)),
            Some(Zeros::Low) => Cow::Owned(utf16(content, u16::from_be_bytes)),
            None => match std::str::from_utf8(content) {
                Ok(text) => Cow::Borrowed(without_frame(text)),
                Err(_) => Cow::Owned(without_frame(&mixed(content)).to_owned()),
            },
        },
    }
}

/// A file name, decoded like a name in a file by [`decoded`].
pub(in crate::scene) fn decoded_name(name: &OsStr) -> Cow<'_, str> {
    decoded(name.as_encoded_bytes())
}

/// The lines of a text, with any ending: `\n`, `\r\n`, `\r\r\n` or `\r`. Byte order marks at the beginning of lines
/// are removed: concatenated files have them.
pub(in crate::scene) fn physical_lines(text: &str) -> impl Iterator<Item = &str> {
    let lines = text.split('\n').flat_map(|line| line.trim_end_matches('\r').split('\r'));
    lines.map(|line| line.trim_start_matches(BYTE_ORDER_MARK))
}

/// The byte that is zero in most code units, for little endian.
#[derive(Clone, Copy)]
enum Zeros {
    High,
    Low,
}

/// Recognises UTF-16 of mostly ASCII characters, as in all formats here: every other byte is zero.
fn zeros_of_utf16(content: &[u8]) -> Option<Zeros> {
    let sample = content.get(..SAMPLE).unwrap_or(content);
    let (pairs, _) = sample.as_chunks::<2>();
    let first = pairs.iter().filter(|pair| pair[0] == 0).count();
    let second = pairs.iter().filter(|pair| pair[1] == 0).count();
    let most = |count: usize| count > 0 && 2 * count >= pairs.len();
    let few = |count: usize| 10 * count < pairs.len();
    if most(second) && few(first) {
        Some(Zeros::High)
    } else if most(first) && few(second) {
        Some(Zeros::Low)
    } else {
        None
    }
}

fn utf16(content: &[u8], unit: impl Fn([u8; 2]) -> u16) -> String {
    let (pairs, _) = content.as_chunks::<2>();
    let units = pairs.iter().map(|pair| unit(*pair));
    let text: String = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
    without_frame(&text).to_owned()
}

fn without_frame(text: &str) -> &str {
    text.trim_start_matches(BYTE_ORDER_MARK).trim_end_matches(['\0', '\u{1a}'])
}

/// Each line as UTF-8, or as Windows-1252 if it is not.
fn mixed(content: &[u8]) -> String {
    let mut text = String::with_capacity(content.len() + content.len() / 8);
    for line in content.split_inclusive(|byte| matches!(byte, b'\n' | b'\r')) {
        match std::str::from_utf8(line) {
            Ok(line) => text.push_str(line),
            Err(_) => text.extend(line.iter().map(|byte| windows_1252(*byte))),
        }
    }
    text
}

/// The character of a byte. The five undefined bytes of Windows-1252 are the control characters of Latin-1.
fn windows_1252(byte: u8) -> char {
    const FROM_0X80: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}',
        '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
    ];
    let index = usize::from(byte).checked_sub(0x80);
    index.and_then(|index| FROM_0X80.get(index)).copied().unwrap_or(char::from(byte))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    const TEXT: &str = "newmtl grün\nKd 1 0 0\n";

    fn in_utf16(text: &str, bytes: impl Fn(u16) -> [u8; 2]) -> Vec<u8> {
        text.encode_utf16().flat_map(bytes).collect()
    }

    #[test]
    fn one_text_is_read_from_every_encoding() {
        let marked = format!("{BYTE_ORDER_MARK}{TEXT}");
        let encodings = [
            TEXT.as_bytes().to_vec(),
            marked.as_bytes().to_vec(),
            in_utf16(TEXT, u16::to_le_bytes),
            in_utf16(TEXT, u16::to_be_bytes),
            in_utf16(&marked, u16::to_le_bytes),
            in_utf16(&marked, u16::to_be_bytes),
            b"newmtl gr\xfcn\nKd 1 0 0\n".to_vec(),
            format!("{TEXT}\u{1a}").into_bytes(),
            format!("{TEXT}\0\0\0").into_bytes(),
        ];
        for content in encodings {
            assert_eq!(decoded(&content), TEXT, "{content:?}");
        }
        assert!(matches!(decoded(TEXT.as_bytes()), Cow::Borrowed(_)), "nothing is copied");
        assert_eq!(decoded(b""), "");
        assert_eq!(decoded(b"\xff\xfe"), "");
    }

    #[test]
    fn every_byte_maps_to_a_distinct_character() {
        let characters: BTreeSet<char> = (0..=255).map(windows_1252).collect();
        assert_eq!(characters.len(), 256);
        assert_eq!([0x41, 0x80, 0x9f, 0xa0, 0xff].map(windows_1252), ['A', '€', 'Ÿ', '\u{a0}', 'ÿ']);
        let names: BTreeSet<String> =
            (0x80..=0xff).map(|byte: u8| decoded(&[b'a', byte, b'\n']).into_owned()).collect();
        assert_eq!(names.len(), 128);
    }

    #[test]
    fn lines_of_both_encodings_may_be_in_one_file() {
        assert_eq!(decoded(b"# gr\xfcn\r\nusemtl gr\xc3\xbcn\r# \xff"), "# grün\r\nusemtl grün\r# ÿ");
    }

    #[test]
    fn every_line_ending_is_read() {
        let lines = |text: &str| physical_lines(text).map(str::to_owned).collect::<Vec<_>>();
        for end in ["\n", "\r\n", "\r\r\n", "\r"] {
            let text = ["a", "", "b"].join(end);

            assert_eq!(lines(&text), ["a", "", "b"], "{end:?}");
        }
        assert_eq!(lines("a\r\nb\rc\nd\r"), ["a", "b", "c", "d"]);
        assert_eq!(lines("a\n\u{feff}b"), ["a", "b"]);
        assert_eq!(lines(""), [""]);
    }

    #[test]
    fn other_bytes_are_not_mistaken_for_utf16() {
        for content in [&b"v 1 2 3\n"[..], b"\0\0\0\0\0\0", b"ab\0\0cd\0\0ef", b"\x01\0\0\0\x02\0\0\0"] {
            assert!(zeros_of_utf16(content).is_none(), "{content:?}");
        }
    }

    #[test]
    fn file_names_are_decoded_like_names_in_files() {
        assert_eq!(decoded_name(OsStr::new("grün.png")), "grün.png");
        #[cfg(unix)]
        {
            use std::os::unix::ffi::OsStrExt;
            assert_eq!(decoded_name(OsStr::from_bytes(b"gr\xfcn.png")), "grün.png");
        }
    }
}
