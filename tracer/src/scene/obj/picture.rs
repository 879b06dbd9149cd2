//! The picture that `map_Kd` names: options put aside, and only inside of the model's folder, as with the libraries
//! themselves.

use std::path::{Component, Path};

use super::super::warnings::Warnings;
use super::lines::Line;
use crate::mesh::MAX_TEXTURE_NAME;

/// Where a material library lies.
pub(super) struct Place<'p> {
    /// The model's folder.
    pub(super) folder: &'p Path,
    /// The library's folder inside of it.
    pub(super) inner: &'p Path,
}

/// Options of texture statements, and how many words follow each at most.
const OPTIONS: &[(&str, usize)] = &[
    ("-blendu", 1),
    ("-blendv", 1),
    ("-bm", 1),
    ("-boost", 1),
    ("-cc", 1),
    ("-clamp", 1),
    ("-colorspace", 1),
    ("-imfchan", 1),
    ("-mm", 2),
    ("-o", 3),
    ("-s", 3),
    ("-t", 3),
    ("-texres", 1),
    ("-type", 1),
];

/// The picture's file, relative to the model's folder, with `/` between its parts. The error says why it is not used.
pub(super) fn picture(line: &Line<'_>, place: &Place<'_>, warnings: &mut Warnings) -> Result<String, String> {
    let (name, options) = split_options(line.rest());
    if name.is_empty() {
        return Err(format!("`{}` names no picture", line.keyword()));
    }
    let short: String = name.chars().take(200).collect();
    let outside = || {
        format!(
            "the picture `{short}` lies outside the model's folder and is not read; \
             put it there, or give the model a material of the scene file"
        )
    };
    let inside = inside(place.inner, name).ok_or_else(outside)?;
    if inside.len() > MAX_TEXTURE_NAME {
        return Err(format!(
            "the picture's name has {} bytes, at most {MAX_TEXTURE_NAME} are taken",
            inside.len()
        ));
    }
    // A link inside the folder may still lead out of it. A picture that is not there is told when it is wanted.
    let anchor = if place.folder.as_os_str().is_empty() { Path::new(".") } else { place.folder };
    if let (Ok(real), Ok(anchor)) = (place.folder.join(&inside).canonicalize(), anchor.canonicalize())
        && !real.starts_with(anchor)
    {
        return Err(outside());
    }
    if !options.is_empty() {
        let options = options.join(", ");
        warnings.at_line(
            line.number,
            format!("{options}: options of textures are left out; the picture repeats once a unit"),
        );
    }
    Ok(inside)
}

/// The file name, which may hold spaces, and the options before it.
fn split_options(rest: &str) -> (&str, Vec<&'static str>) {
    let mut rest = rest.trim();
    let mut given = Vec::new();
    while let Some((option, most)) = OPTIONS.iter().find(|(option, _)| first_word(rest) == *option) {
        given.push(*option);
        rest = after_word(rest);
        for index in 0..*most {
            // The second and third number of a vector may be left out.
            let number = first_word(rest).parse::<f64>().is_ok();
            if !number && (*most == 3 || index > 0) {
                break;
            }
            rest = after_word(rest);
        }
    }
    (rest, given)
}

fn first_word(text: &str) -> &str {
    text.split_ascii_whitespace().next().unwrap_or_default()
}

fn after_word(text: &str) -> &str {
    text.split_once(|c: char| c.is_ascii_whitespace()).map_or("", |(_, rest)| rest.trim_start())
}

/// `inner` and `name` together, without `.` and `..`; `None` when that leads out of the folder.
fn inside(inner: &Path, name: &str) -> Option<String> {
    let name = name.replace('\\', "/");
    if name.contains(':') {
        return None;
    }
    let mut parts = Vec::new();
    for component in inner.components().chain(Path::new(&name).components()) {
        match component {
            Component::Normal(part) => parts.push(part.to_string_lossy().into_owned()),
            Component::CurDir => {}
            Component::ParentDir => drop(parts.pop()?),
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(parts.join("/")).filter(|path| !path.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_put_aside_and_names_may_hold_spaces() {
        for (text, name, options) in [
            ("wood.png", "wood.png", &[][..]),
            ("  two words.png ", "two words.png", &[]),
            ("-s 2 2 1 -o 0.5 wood.png", "wood.png", &["-s", "-o"]),
            ("-clamp on -blendu off -mm 0 1 a b.png", "a b.png", &["-clamp", "-blendu", "-mm"]),
            ("-s 1 2.png", "2.png", &["-s"]),
            ("-x wood.png", "-x wood.png", &[]),
            ("-clamp on", "", &["-clamp"]),
        ] {
            assert_eq!(split_options(text), (name, options.to_vec()), "{text}");
        }
    }

    #[test]
    fn names_stay_inside_the_folder() {
        for (inner, name, expected) in [
            ("", "wood.png", Some("wood.png")),
            ("lib", "maps\\wood.png", Some("lib/maps/wood.png")),
            ("lib", "../wood.png", Some("wood.png")),
            ("lib", "./a/../b.png", Some("lib/b.png")),
            ("lib", "../../wood.png", None),
            ("", "/etc/a.png", None),
            ("", "C:\\a.png", None),
            ("", "..", None),
            ("", ".", None),
        ] {
            assert_eq!(inside(Path::new(inner), name).as_deref(), expected, "{inner} {name}");
        }
    }
}
