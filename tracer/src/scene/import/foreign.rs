//! Recognition of files of the wrong type: archives, web pages, git-lfs pointers, pictures, models of other programs.
//! Their first bytes identify them, and a message names the type and a remedy.

use std::io::Read;
use std::path::Path;

use crate::files::open_regular;
use crate::image::READ_FORMATS;

/// Number of first bytes that identify a file.
pub(in crate::scene) const HEAD: usize = 1024;

/// Type of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::scene) struct Foreign {
    /// Name with its article: "a ZIP archive".
    what: &'static str,
    family: Family,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Family {
    Archive,
    Page,
    Pointer,
    Picture,
    /// A picture in a format that is not read.
    OtherPicture,
    Model,
    /// Another document, program or recording.
    Other,
}

/// Type of file that was expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::scene) enum Wanted {
    /// A model or a scene.
    Model,
    /// A material library.
    Library,
    /// A picture.
    Picture,
}

use Family::{Archive, Model, Other, OtherPicture, Page, Picture, Pointer};

/// Magic numbers at the beginning of files.
const MAGIC: &[(&[u8], &str, Family)] = &[
    (b"PK\x03\x04", "a ZIP archive", Archive),
    (b"PK\x05\x06", "a ZIP archive", Archive),
    (b"\x1f\x8b", "a gzip archive", Archive),
    (b"BZh", "a bzip2 archive", Archive),
    (b"\xfd7zXZ\0", "an xz archive", Archive),
    (b"\x28\xb5\x2f\xfd", "a Zstandard archive", Archive),
    (b"\x04\x22\x4d\x18", "an LZ4 archive", Archive),
    (b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive", Archive),
    (b"Rar!\x1a\x07", "a RAR archive", Archive),
    (b"\x1f\x9d", "a compress (.Z) archive", Archive),
    (b"MSCF\0\0\0\0", "a Windows cabinet archive", Archive),
    (b"version https://git-lfs.github.com/", "a pointer of git-lfs", Pointer),
    (b"\x89PNG\r\n\x1a\n", "a PNG picture", Picture),
    (b"\xff\xd8\xff", "a JPEG picture", Picture),
    (b"GIF87a", "a GIF picture", Picture),
    (b"GIF89a", "a GIF picture", Picture),
    (b"II*\0", "a TIFF picture", Picture),
    (b"MM\0*", "a TIFF picture", Picture),
    (b"8BPS", "a Photoshop picture (.psd)", OtherPicture),
    (b"DDS ", "a DDS picture", OtherPicture),
    (b"\x76\x2f\x31\x01", "an OpenEXR picture", OtherPicture),
    (b"#?RADIANCE", "a Radiance picture (.hdr)", OtherPicture),
    (b"#?RGBE", "a Radiance picture (.hdr)", OtherPicture),
    (b"\xabKTX ", "a KTX picture", OtherPicture),
    (b"\xff\x0a", "a JPEG XL picture", OtherPicture),
    (b"\0\0\0\x0cJXL ", "a JPEG XL picture", OtherPicture),
    (b"\0\0\0\x0cjP  ", "a JPEG 2000 picture", OtherPicture),
    (b"gimp xcf", "a GIMP picture (.xcf)", OtherPicture),
    (b"qoif", "a QOI picture", OtherPicture),
    (b"VTF\0", "a Valve texture (.vtf)", OtherPicture),
    (b"glTF", "a glTF model (.glb)", Model),
    (b"Kaydara FBX Binary", "an FBX model", Model),
    (b"; FBX", "an FBX model", Model),
    (b"BLENDER", "a Blender file", Model),
    (b"ply\n", "a PLY model", Model),
    (b"ply\r", "a PLY model", Model),
    (b"PXR-USDC", "a USD scene", Model),
    (b"#usda", "a USD scene", Model),
    (b"OFF\n", "an OFF model", Model),
    (b"OFF\r", "an OFF model", Model),
    (b"#VRML", "a VRML model", Model),
    (b"ISO-10303-21", "a STEP file", Model),
    (b"DRACO", "a Draco model", Model),
    (b"Ogawa", "an Alembic file", Model),
    (b"3D Geometry File Format", "a Rhino file (.3dm)", Model),
    (b"\xff\xfe\xff\x0eS\0k\0e\0t\0c\0h\0U\0p\0", "a SketchUp file", Model),
    (b"//Maya ASCII", "a Maya scene", Model),
    (b"FOR4", "a Maya scene", Model),
    (b"FOR8", "a Maya scene", Model),
    (b"AC10", "an AutoCAD drawing (.dwg)", Model),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "a document of Microsoft's or a scene of 3ds Max", Model),
    (b"%PDF-", "a PDF document", Other),
    (b"%!PS", "a PostScript document", Other),
    (b"{\\rtf", "an RTF document", Other),
    (b"SQLite format 3\0", "an SQLite database", Other),
    (b"\x7fELF", "a program", Other),
    (b"OggS", "an Ogg recording", Other),
    (b"ID3", "an MP3 recording", Other),
    (b"\x1aE\xdf\xa3", "a Matroska video", Other),
];

/// Beginnings of texts in lower case, after white space and a byte order mark.
const TEXTS: &[(&str, &str, Family)] = &[
    ("<!doctype html", "a web page", Page),
    ("<html", "a web page", Page),
    ("<head", "a web page", Page),
    ("<body", "a web page", Page),
    ("<script", "a web page", Page),
    ("<svg", "an SVG picture", OtherPicture),
    ("<!doctype svg", "an SVG picture", OtherPicture),
    ("<collada", "a COLLADA model (.dae)", Model),
    ("<x3d", "an X3D model", Model),
    ("<?xml", "an XML file", Other),
    ("<error", "an XML file", Other),
];

/// Type of a file by its first bytes; `None` for expected and for unknown types.
pub(in crate::scene) fn recognised(content: &[u8]) -> Option<Foreign> {
    let head = content.get(..HEAD).unwrap_or(content);
    let by_magic = MAGIC.iter().find(|(magic, ..)| head.starts_with(magic));
    if let Some((_, what, family)) = by_magic {
        return Some(Foreign { what, family: *family });
    }
    by_structure(head).or_else(|| by_text(head))
}

/// Type of a file, as [`recognised`]; `None` as well if it cannot be read.
pub(in crate::scene) fn recognised_file(path: &Path) -> Option<Foreign> {
    recognised(&head(path).ok()?)
}

/// The first bytes of a file.
pub(in crate::scene) fn head(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut head = Vec::new();
    open_regular(path)?.take(HEAD as u64).read_to_end(&mut head)?;
    Ok(head)
}

/// Formats with a magic number elsewhere.
fn by_structure(head: &[u8]) -> Option<Foreign> {
    let at = |range: std::ops::Range<usize>| head.get(range).unwrap_or_default();
    let (what, family) = if at(257..262) == b"ustar" {
        ("a tar archive", Archive)
    } else if at(0..4) == b"RIFF" && at(8..12) == b"WEBP" {
        ("a WebP picture", Picture)
    } else if at(0..4) == b"RIFF" {
        ("a recording or video", Other)
    } else if at(4..8) == b"ftyp" {
        match at(8..12) {
            b"avif" | b"avis" | b"heic" | b"heix" | b"mif1" => ("an AVIF or HEIC picture", OtherPicture),
            _ => ("a video", Other),
        }
    } else if at(0..4) == b"FORM" && at(8..11) == b"LWO" {
        ("a LightWave model", Model)
    } else if at(0..2) == b"BM" && at(6..10) == [0; 4] {
        ("a BMP picture", Picture)
    } else if at(0..2) == b"MM" && matches!(at(6..8), [0x02, 0x00] | [0x3d, 0x3d] | [0x3e, 0x3d]) {
        // The chunk of the whole file, and in it its version, or the editor's data.
        ("a 3DS model", Model)
    } else if at(0..2) == b"MZ" && head.contains(&0) {
        ("a program", Other)
    } else {
        return None;
    };
    Some(Foreign { what, family })
}

fn by_text(head: &[u8]) -> Option<Foreign> {
    let text = super::text::decoded(head);
    let text = text.trim_start();
    let lower = text.to_ascii_lowercase();
    let (_, what, family) = TEXTS.iter().find(|(start, ..)| lower.starts_with(start))?;
    let what_in_xml = match *what {
        "an XML file" if lower.contains("<collada") => ("a COLLADA model (.dae)", Model),
        "an XML file" if lower.contains("<svg") => ("an SVG picture", OtherPicture),
        "an XML file" if lower.contains("<x3d") => ("an X3D model", Model),
        "an XML file" if lower.contains("<html") => ("a web page", Page),
        what => (what, *family),
    };
    Some(Foreign { what: what_in_xml.0, family: what_in_xml.1 })
}

impl Foreign {
    /// Whether it is a picture in a format that is read.
    pub(in crate::scene) fn is_picture(self) -> bool {
        self.family == Picture
    }

    /// A message with the type and a remedy.
    pub(in crate::scene) fn refusal(self, wanted: Wanted) -> String {
        let expected = match wanted {
            Wanted::Model => "a model (.obj) or a scene (.toml)",
            Wanted::Library => "a material library (.mtl)",
            Wanted::Picture => &format!("a {READ_FORMATS} picture"),
        };
        format!("this is {}, and {expected} was expected; {}", self.what, self.advice(wanted))
    }

    fn advice(self, wanted: Wanted) -> &'static str {
        match (self.family, wanted) {
            (Archive, Wanted::Model) => "unpack it, and give the model (.obj) that is in it",
            (Archive, _) => "unpack it",
            (Page, _) => {
                "the download went wrong: the server sent a page in place of the file; get the file itself again"
            }
            (Pointer, _) => "the file itself has not been fetched: run `git lfs pull` in its repository",
            (Picture, Wanted::Model) => {
                "give the model that it belongs to; pictures are named in its material library"
            }
            (_, Wanted::Picture) => "convert it to PNG",
            (Model, Wanted::Model) => "convert it to .obj, for example with Blender",
            (_, Wanted::Model) => "give one of those",
            (_, Wanted::Library) => "export the model again together with its materials (.mtl)",
        }
    }
}

/// Description of a text without a statement of OBJ, as a clause.
pub(in crate::scene) fn describe_other_text(content: &[u8], text: &str) -> String {
    if content.is_empty() {
        return "the file is empty".into();
    }
    if is_binary(content, text) {
        return "these are binary data, not the text of an OBJ file".into();
    }
    let first = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'));
    let Some(first) = first else { return "the file has nothing but comments and blank lines".into() };
    let what = if is_toml(first) {
        "this is TOML, not an OBJ file: give a scene a name that ends in .toml"
    } else if first.starts_with("solid") {
        "this is an STL model, not an OBJ file: convert it to .obj, for example with Blender"
    } else if text.contains("\"asset\"") && first.starts_with('{') {
        "this is a glTF model, not an OBJ file: convert it to .obj, for example with Blender"
    } else if first.starts_with(['{', '[']) {
        "this is JSON, not an OBJ file"
    } else if first.get(..7).is_some_and(|word| word.eq_ignore_ascii_case("newmtl ")) {
        "this is a material library: give the model (.obj) that it belongs to"
    } else if first == "0" && text.contains("SECTION") {
        "this is a DXF drawing, not an OBJ file: convert it to .obj"
    } else {
        let first = super::printed::excerpt(first, 60);
        return format!("no line of this file is a statement of an OBJ file (the first is `{first}`)");
    };
    what.into()
}

/// Whether the bytes are no text, by the share of control characters after decoding.
pub(in crate::scene) fn is_binary(content: &[u8], text: &str) -> bool {
    let sample: String = text.chars().take(4 * HEAD).collect();
    let odd = sample.chars().filter(|c| c.is_control() && !c.is_ascii_whitespace()).count();
    let bare = text.is_empty() && !content.is_empty() && content.iter().all(|byte| *byte == 0);
    bare || 20 * odd > sample.chars().count()
}

/// Whether a line is `[table]`, `[[table]]` or `key = value` of TOML.
fn is_toml(line: &str) -> bool {
    let bare = |name: &str| {
        !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-' | b'.'))
    };
    let table = line.strip_prefix('[').and_then(|rest| rest.split(']').next());
    table.is_some_and(|name| bare(name.trim_start_matches('[').trim()))
        || line.split_once('=').is_some_and(|(key, _)| bare(key.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn what(content: &[u8]) -> Option<&'static str> {
        recognised(content).map(|foreign| foreign.what)
    }

    #[test]
    fn files_are_recognised_by_their_beginning() {
        let mut tar = vec![b'a'; 257];
        tar.extend_from_slice(b"ustar\x0000");
        for (content, name) in [
            (&b"PK\x03\x04\x14\0"[..], "a ZIP archive"),
            (b"\x1f\x8b\x08\0", "a gzip archive"),
            (b"BZh91AY", "a bzip2 archive"),
            (b"\xfd7zXZ\0\0", "an xz archive"),
            (b"\x28\xb5\x2f\xfd\x04", "a Zstandard archive"),
            (b"7z\xbc\xaf\x27\x1c\0", "a 7-Zip archive"),
            (b"Rar!\x1a\x07\x01", "a RAR archive"),
            (&tar, "a tar archive"),
            (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "a pointer of git-lfs"),
            (b"\xef\xbb\xbf\n <!DOCTYPE html><html>", "a web page"),
            (b"<HTML>", "a web page"),
            (b"<?xml version=\"1.0\"?>\n<!-- x --><html xmlns=\"\">", "a web page"),
            (b"<?xml version=\"1.0\"?><COLLADA>", "a COLLADA model (.dae)"),
            (b"<?xml version=\"1.0\"?><svg>", "an SVG picture"),
            (b"<?xml version=\"1.0\"?><Error><Code>AccessDenied", "an XML file"),
            (b"%PDF-1.7", "a PDF document"),
            (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
            (b"\xff\xd8\xff\xe0\0\x10JFIF", "a JPEG picture"),
            (b"BM\x36\0\0\0\0\0\0\0\x36\0\0\0", "a BMP picture"),
            (b"RIFF\x10\0\0\0WEBPVP8 ", "a WebP picture"),
            (b"\0\0\0\x20ftypavif", "an AVIF or HEIC picture"),
            (b"MM\0*\0\0\0\x08", "a TIFF picture"),
            (b"DDS \x7c\0\0\0", "a DDS picture"),
            (b"glTF\x02\0\0\0", "a glTF model (.glb)"),
            (b"Kaydara FBX Binary  \0", "an FBX model"),
            (b"BLENDER-v279", "a Blender file"),
            (b"ply\nformat ascii 1.0\n", "a PLY model"),
            (b"MM\xf0\x1c\0\0\x02\0\x0a\0\0\0", "a 3DS model"),
            (b"PXR-USDC\0", "a USD scene"),
            (b"#usda 1.0\n", "a USD scene"),
        ] {
            assert_eq!(what(content), Some(name), "{}", content.escape_ascii());
        }
    }

    #[test]
    fn models_libraries_and_scenes_are_not_foreign() {
        for content in [
            &b""[..],
            b"# made by hand\nv 0 0 0\n",
            b"\xef\xbb\xbfmtllib a.mtl\n",
            b"\xff\xfev\0 \x001\0",
            b"MMx 1 2 3\n",
            b"BMx\nv 1 2 3",
            b"newmtl a\n",
            b"[camera]\n",
            b"RFMESH..",
        ] {
            assert_eq!(what(content), None, "{}", content.escape_ascii());
        }
    }

    #[test]
    fn messages_say_what_to_do() {
        for (content, wanted, words) in [
            (
                &b"\x1f\x8b\x08"[..],
                Wanted::Model,
                "this is a gzip archive, and a model (.obj) or a scene (.toml) was expected; unpack it, and give",
            ),
            (b"version https://git-lfs.github.com/spec", Wanted::Picture, "run `git lfs pull`"),
            (
                b"<html>",
                Wanted::Library,
                "a web page, and a material library (.mtl) was expected; the download went wrong",
            ),
            (b"8BPS", Wanted::Picture, "convert it to PNG"),
            (
                b"ply\n",
                Wanted::Model,
                "a PLY model, and a model (.obj) or a scene (.toml) was expected; convert it to .obj",
            ),
            (b"\x89PNG\r\n\x1a\n", Wanted::Model, "give the model that it belongs to"),
            (b"%PDF-", Wanted::Library, "export the model again"),
        ] {
            let message = recognised(content).unwrap().refusal(wanted);
            assert!(message.contains(words), "{message}");
        }
    }

    #[test]
    fn texts_that_are_no_model_are_described() {
        for (content, words) in [
            (&b""[..], "the file is empty"),
            (b"\0\0\0\0", "binary data"),
            (b"\x01\x02\x00\x07 binary \x00\x00\x00", "binary data"),
            (b"# x\n\n", "nothing but comments"),
            (b"# scene\n[[model]]\nfile = \"a.obj\"\n", "this is TOML"),
            (b"ambient = [0, 0, 0]\n", "this is TOML"),
            (b"solid cube\nfacet normal 0 0 1\n", "an STL model"),
            (b"{\"asset\":{\"version\":\"2.0\"}}", "a glTF model"),
            (b"[1, 2]", "this is JSON"),
            (b"NEWMTL red\nKd 1 0 0\n", "a material library"),
            (
                b"404: Not Found",
                "no line of this file is a statement of an OBJ file (the first is `404: Not Found`)",
            ),
        ] {
            let message = describe_other_text(content, &super::super::text::decoded(content));
            assert!(message.contains(words), "{message}");
        }
    }
}
