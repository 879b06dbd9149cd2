//! Picture names and options of statements such as `map_Kd`.

use std::path::Path;

use super::super::lookup::{Found, Lookup, Missing, tidy};
use super::super::printed::excerpt;
use super::super::warnings::Warnings;
use super::lines::Line;
use super::tiling::{TextureOption, tiling, warn_of_others};
use crate::mesh::MAX_TEXTURE_NAME;
use crate::texture::Tiling;

/// Location of a material library.
pub(super) struct Place<'p> {
    /// Lookup of pictures in the model's folder.
    pub(super) pictures: &'p Lookup<'p>,
    /// Folder of the library, relative to the model's.
    pub(super) inner: &'p Path,
}

/// Characters of a name in a message.
const MAX_SHOWN: usize = 200;

/// Options of texture statements, with the largest number of words of each.
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

/// The picture's file, relative to the model's folder, with `/` between its parts, and its tiling. The error is the
/// reason why it is not used.
pub(super) fn picture(
    line: &Line<'_>,
    place: &Place<'_>,
    warnings: &mut Warnings,
) -> Result<(String, Tiling), String> {
    let (name, options) = split_options(line.rest());
    if tidy(name).is_empty() {
        return Err(format!("`{}` names no picture", line.keyword()));
    }
    let file = match place.pictures.find(place.inner, name) {
        Ok(found) => {
            note_other_place(line.number, name, &found, warnings);
            found.name
        }
        Err(missing) => way_to_missing(name, missing, place)?,
    };
    if file.len() > MAX_TEXTURE_NAME {
        return Err(format!(
            "the picture's name has {} bytes, at most {MAX_TEXTURE_NAME} are taken",
            file.len()
        ));
    }
    warn_of_others(&options, line, warnings);
    Ok((file, tiling(&options)))
}

fn note_other_place(line: usize, name: &str, found: &Found, warnings: &mut Warnings) {
    if !found.as_named {
        let (name, instead) = (excerpt(name, MAX_SHOWN), excerpt(&found.name, MAX_SHOWN));
        warnings.at_line(
            line,
            format!("the picture `{name}` is not there: `{instead}` in the model's folder is taken"),
        );
    }
}

/// The named path of a missing picture, to be reported when it is used; or the reason why it is not searched.
fn way_to_missing(name: &str, missing: Missing, place: &Place<'_>) -> Result<String, String> {
    let shown = excerpt(name, MAX_SHOWN);
    match missing {
        Missing::NotThere => {
            let way = place.pictures.way(place.inner, name);
            way.ok_or_else(|| format!("the picture `{shown}` is not in the model's folder; put it there"))
        }
        Missing::Absolute => Err(format!(
            "the picture `{shown}` is named by a path of another disk, and there is none of its name in the model's \
             folder; put it there"
        )),
        Missing::Above | Missing::Link => Err(format!(
            "the picture `{shown}` is outside the model's folder and is not read; put it there, \
             or allow it with --allow-parent-textures"
        )),
    }
}

/// The file name, which may contain blanks, and the options before it.
fn split_options(rest: &str) -> (&str, Vec<TextureOption<'_>>) {
    let mut rest = rest.trim();
    let mut given = Vec::new();
    while let Some((option, most)) = OPTIONS.iter().find(|(option, _)| first_word(rest) == *option) {
        let mut words = Vec::new();
        rest = after_word(rest);
        for index in 0..*most {
            // The second and third number of a vector are optional.
            let number = first_word(rest).parse::<f64>().is_ok();
            if !number && (*most == 3 || index > 0) {
                break;
            }
            words.push(first_word(rest));
            rest = after_word(rest);
        }
        given.push((*option, words));
    }
    (rest, given)
}

fn first_word(text: &str) -> &str {
    text.split_ascii_whitespace().next().unwrap_or_default()
}

fn after_word(text: &str) -> &str {
    text.split_once(|c: char| c.is_ascii_whitespace()).map_or("", |(_, rest)| rest.trim_start())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_read_and_names_may_contain_blanks() {
        for (text, name, options) in [
            ("wood.png", "wood.png", &[][..]),
            ("  two words.png ", "two words.png", &[]),
            ("-s 2 2 1 -o 0.5 wood.png", "wood.png", &["-s", "-o"]),
            ("-clamp on -blendu off -mm 0 1 a b.png", "a b.png", &["-clamp", "-blendu", "-mm"]),
            ("-s 1 2.png", "2.png", &["-s"]),
            ("-x wood.png", "-x wood.png", &[]),
            ("-clamp on", "", &["-clamp"]),
        ] {
            let (found, given) = split_options(text);
            let given: Vec<_> = given.into_iter().map(|(option, _)| option).collect();
            assert_eq!((found, given), (name, options.to_vec()), "{text}");
        }
    }
}
