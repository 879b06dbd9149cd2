//! The text of a material library (MTL). What is odd in it costs a warning, never the model, and what is left out of it
//! is reported once per kind.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::panic::catch_unwind;

use glam::Vec3;

use super::super::printed::excerpt;
use super::super::warnings::Warnings;
use super::super::{MAX_EXPONENT, Material};
use super::lines::{Line, lines};
use super::picture::Place;
use super::surface;
use crate::mesh::NamedMaterial;

/// Materials by their [`plain_name`].
pub(super) type Library = BTreeMap<String, NamedMaterial>;

/// Keywords as the format spells them; programs write them in other letters too.
const KEYWORDS: &[&str] = &[
    "newmtl",
    "Ka",
    "Kd",
    "Ks",
    "Ke",
    "Km",
    "Ns",
    "Ni",
    "Tf",
    "Tr",
    "d",
    "illum",
    "sharpness",
    "map_aat",
    "map_Ka",
    "map_Kd",
    "map_Ks",
    "map_Ke",
    "map_Ns",
    "map_Ni",
    "map_d",
    "map_Tr",
    "map_opacity",
    "map_bump",
    "bump",
    "norm",
    "map_Kn",
    "disp",
    "map_disp",
    "decal",
    "refl",
    "map_refl",
    "Pr",
    "Pm",
    "Ps",
    "Pc",
    "Pcr",
    "aniso",
    "anisor",
    "map_Pr",
    "map_Pm",
    "map_Ps",
    "map_RMA",
    "map_ORM",
];

/// Statements that are left out, and what that means for the picture.
const LEFT_OUT: &[(&[&str], &str)] = &[
    (&["bump", "map_bump", "norm", "map_Kn"], "relief from pictures is not drawn"),
    (&["disp", "map_disp"], "displacement by pictures is not drawn"),
    (&["refl", "map_refl"], "reflected pictures are not drawn"),
    (&["decal"], "decals are not drawn"),
    (&["map_Ks", "map_Ns"], "highlights are alike all over a material"),
    (&["map_Tr", "map_opacity"], "only `map_d` cuts out: drawn opaque"),
    (
        &[
            "Pr", "Pm", "Ps", "Pc", "Pcr", "aniso", "anisor", "map_Pr", "map_Pm", "map_Ps", "map_RMA",
            "map_ORM",
        ],
        "metal, roughness, sheen and coat are not drawn: `Kd`, `Ks` and `Ns` are",
    ),
];

/// Without mirrors and glass these say nothing.
const WITHOUT_EFFECT: &[&str] = &["Ni", "map_Ni", "Km", "sharpness", "map_aat"];

/// The name of a material as models and libraries agree on it: without quotes around it, and with single blanks.
pub(super) fn plain_name(name: &str) -> Cow<'_, str> {
    let mut name = name.trim_ascii();
    for quote in ['"', '\''] {
        name =
            name.strip_prefix(quote).and_then(|rest| rest.strip_suffix(quote)).unwrap_or(name).trim_ascii();
    }
    let is_plain = !name.contains(['\t', '\x0c']) && !name.contains("  ");
    if is_plain {
        Cow::Borrowed(name)
    } else {
        name.split_ascii_whitespace().collect::<Vec<_>>().join(" ").into()
    }
}

/// A `newmtl` line.
struct Head {
    line: usize,
    name: String,
    /// What the parser does not know.
    surface: NamedMaterial,
}

/// The materials of a library's text.
pub(super) fn parse(text: &str, place: &Place<'_>, warnings: &mut Warnings) -> Library {
    let mut clean = String::new();
    let mut heads: Vec<Head> = Vec::new();
    for line in lines(text) {
        let keyword = spelled(line.keyword());
        if keyword == "newmtl" {
            if line.rest().is_empty() {
                warnings.at_line(line.number, "`newmtl` without a name; its material is left out");
            }
            // The parser is given numbers for names: it would change some.
            let _ = writeln!(clean, "newmtl {}", heads.len());
            let surface = NamedMaterial::plain("", Material::NEUTRAL);
            heads.push(Head { line: line.number, name: plain_name(line.rest()).into_owned(), surface });
        } else if let Some(head) = heads.last_mut() {
            let read = surface::read(&line, place, &mut head.surface, warnings);
            match read.and_then(|()| statement(keyword, &line, warnings)) {
                Ok(statement) => clean.push_str(&statement),
                Err(message) => warnings.at_line(line.number, format!("{message}; the line is left out")),
            }
        } else {
            warnings.once("before newmtl", line.number, "statements before the first `newmtl` are left out");
        }
    }
    // The parser panics on what it does not expect. Nothing of that kind is left, but it is not ours to promise.
    let parsed = catch_unwind(|| tobj::load_mtl_buf(&mut clean.as_bytes()));
    let Ok(Ok((materials, _))) = parsed else {
        warnings.at_file("the material library cannot be read, and is left out");
        return Library::new();
    };
    let mut library = Library::new();
    for material in materials {
        let head = material.name.parse().ok().and_then(|index: usize| heads.get(index));
        if let Some(head) = head.filter(|head| !head.name.is_empty()) {
            define(&mut library, head, material, warnings);
        }
    }
    let named_before_comment = |(name, material): (&String, &NamedMaterial)| {
        let (bare, _) = name.split_once(" #")?;
        Some((plain_name(bare).into_owned(), material.clone())).filter(|(bare, _)| !bare.is_empty())
    };
    let bare: Vec<_> = library.iter().filter_map(named_before_comment).collect();
    for (name, material) in bare {
        library.entry(name).or_insert(material);
    }
    library
}

/// Adds a material. The last definition of a name counts.
fn define(library: &mut Library, head: &Head, material: tobj::Material, warnings: &mut Warnings) {
    if has_ambient_color(&material) {
        let message = "`Ka`: ambient light takes the colour of `Kd`, and `Ka` is left out";
        warnings.once("Ka", head.line, message);
    }
    if material.ambient_texture.is_some() && head.surface.texture.is_none() {
        warnings.once("map_Ka", head.line, "`map_Ka` without `map_Kd` is left out: ambient light takes `Kd`");
    }
    let named = convert(material, head);
    let name = excerpt(&head.name, MAX_SHOWN);
    if library.insert(head.name.clone(), named.clone()).is_some_and(|before| before != named) {
        warnings.at_line(
            head.line,
            format!("`{name}` is defined again, in another way: the last definition counts"),
        );
    }
}

/// Whether ambient light was to show another colour than other light. A grey `Ka` is what programs write by habit.
fn has_ambient_color(material: &tobj::Material) -> bool {
    let Some(ambient) = material.ambient else { return false };
    ambient.iter().any(|channel| *channel != ambient[0]) && material.diffuse != Some(ambient)
}

/// The keyword as the format spells it.
fn spelled(keyword: &str) -> &str {
    KEYWORDS.iter().find(|known| keyword.eq_ignore_ascii_case(known)).copied().unwrap_or(keyword)
}

/// The line as the parser is to see it; empty for what is not drawn.
fn statement(keyword: &str, line: &Line<'_>, warnings: &mut Warnings) -> Result<String, String> {
    match keyword {
        "Kd" | "Ks" => {
            let [r, g, b] = bounded_color(color(line)?, keyword, line, warnings);
            Ok(format!("{keyword} {r} {g} {b}\n"))
        }
        "Ka" => {
            let [r, g, b] = color(line)?;
            Ok(format!("Ka {r} {g} {b}\n"))
        }
        "Ns" => {
            let exponent = bounded(number(line)?, f64::from(MAX_EXPONENT), line, warnings);
            if exponent > 0.0 && exponent < SMALLEST_EXPONENT {
                let message = format!(
                    "`{}`: a highlight this wide would whiten all that is lit, and is not drawn",
                    shortened(line)
                );
                warnings.at_line(line.number, message);
            }
            Ok(format!("Ns {exponent}\n"))
        }
        "illum" => {
            let model = number(line)?;
            if model > 2.0 {
                let message =
                    format!("`{}`: mirrors and glass of `illum` 3 and above are not drawn", shortened(line));
                warnings.at_line(line.number, message);
            }
            Ok(format!("illum {}\n", model.clamp(0.0, 255.0) as u8))
        }
        "d" | "Tr" => {
            let opaque = if keyword == "d" { 1.0 } else { 0.0 };
            if number(line).is_ok_and(|share| share != opaque) {
                warnings.at_line(line.number, "transparency is not supported yet: drawn opaque");
            }
            Ok(String::new())
        }
        // Mostly the picture of `map_Kd` again: only whether there is one matters.
        "map_Ka" => Ok("map_Ka given\n".into()),
        "map_Kd" | "map_d" | "Ke" | "map_Ke" => Ok(String::new()),
        _ => {
            leave_out(keyword, line, warnings);
            Ok(String::new())
        }
    }
}

/// Reports a statement that is not drawn, where that makes a difference.
fn leave_out(keyword: &str, line: &Line<'_>, warnings: &mut Warnings) {
    if let Some((_, reason)) = LEFT_OUT.iter().find(|(keywords, _)| keywords.contains(&keyword)) {
        return warnings.once(keyword, line.number, format!("`{keyword}` is left out: {reason}"));
    }
    let values = |plain: f64| color(line).is_ok_and(|color| color != [plain; 3]);
    match keyword {
        "Tf" if values(1.0) => {
            warnings.once(keyword, line.number, "`Tf` is left out: materials let no light through");
        }
        "Tf" => {}
        _ if WITHOUT_EFFECT.contains(&keyword) => {}
        _ => {
            let name = excerpt(keyword, 20);
            warnings.once(&name, line.number, format!("unknown statement `{name}` is left out"));
        }
    }
}

/// `Kd r g b`, or `Kd r` for grey.
pub(super) fn color(line: &Line<'_>) -> Result<[f64; 3], String> {
    let words: Vec<&str> = line.rest().split_ascii_whitespace().take(4).collect();
    let numbers: Option<Vec<f64>> =
        words.iter().map(|word| word.parse().ok().filter(|n: &f64| n.is_finite())).collect();
    match (numbers.as_deref(), words.first()) {
        (Some([grey]), _) => Ok([*grey; 3]),
        (Some([r, g, b]), _) => Ok([*r, *g, *b]),
        (_, Some(kind)) if kind.eq_ignore_ascii_case("spectral") || kind.eq_ignore_ascii_case("xyz") => {
            Err(format!("`{}`: `{kind}` colours are not read, only red, green and blue", shortened(line)))
        }
        _ => Err(format!("`{}`: three numbers were expected{}", shortened(line), comma_hint(line))),
    }
}

pub(super) fn number(line: &Line<'_>) -> Result<f64, String> {
    // `d -halo 0.5` has a word in between.
    let word = line.rest().split_ascii_whitespace().last().unwrap_or_default();
    let number = word.parse().ok().filter(|n: &f64| n.is_finite());
    number.ok_or_else(|| format!("`{}`: a number was expected{}", shortened(line), comma_hint(line)))
}

/// Some programs write numbers as their country does.
fn comma_hint(line: &Line<'_>) -> &'static str {
    let has_comma = |word: &str| word.contains(',') && word.replace(',', ".").parse::<f64>().is_ok();
    if line.rest().split_ascii_whitespace().any(has_comma) {
        " (decimal points, not commas: export the model again with the settings of an English system)"
    } else {
        ""
    }
}

fn bounded(value: f64, limit: f64, line: &Line<'_>, warnings: &mut Warnings) -> f64 {
    if !(0.0..=limit).contains(&value) {
        let message = format!("`{}`: taken to the nearest value from 0 to {limit}", shortened(line));
        warnings.at_line(line.number, message);
    }
    value.clamp(0.0, limit)
}

/// A colour with channels from 0 to 1, and one warning where it had others.
fn bounded_color(color: [f64; 3], keyword: &str, line: &Line<'_>, warnings: &mut Warnings) -> [f64; 3] {
    // More than 1 by rounding is 1.
    const ROUNDING: f64 = 1e-5;
    let largest = color.into_iter().fold(0.0, f64::max);
    if color.iter().any(|channel| !(-ROUNDING..=1.0 + ROUNDING).contains(channel)) {
        let hint = if largest > 2.0 && largest <= 255.0 {
            let [r, g, b] = color.map(|channel| (channel / 255.0 * 1000.0).round() / 1000.0);
            format!("; for colours from 0 to 255 divide by 255, as in `{keyword} {r} {g} {b}`")
        } else {
            String::new()
        };
        let message = format!(
            "`{}`: colours from 0 to 1 were expected, others are taken to the nearest one{hint}",
            shortened(line)
        );
        warnings.at_line(line.number, message);
    }
    color.map(|channel| channel.clamp(0.0, 1.0))
}

/// Characters of a name or line that a message shows.
const MAX_SHOWN: usize = 60;

fn shortened(line: &Line<'_>) -> String {
    excerpt(&line.text, MAX_SHOWN)
}

/// A highlight with a smaller exponent is nearly as strong at the edge of the light as in its middle. Programs write
/// `Ns 0` for none.
const SMALLEST_EXPONENT: f64 = 1.0;

fn convert(material: tobj::Material, head: &Head) -> NamedMaterial {
    let mut surface = head.surface.clone();
    surface::finish(&mut surface);
    let color = |[r, g, b]: [f64; 3]| Vec3::new(r as f32, g as f32, b as f32);
    // Illumination models 0 and 1 have no highlights.
    let matt = material.illumination_model.is_some_and(|model| model < 2)
        || material.shininess.is_some_and(|exponent| exponent < SMALLEST_EXPONENT);
    let diffuse = match (material.diffuse.map(color), &surface.texture) {
        // `Kd` is a factor of the texel. Some programs write 0 for "the map alone", which would be black.
        (None | Some(Vec3::ZERO), Some(_)) => Vec3::ONE,
        (diffuse, _) => diffuse.unwrap_or(Material::NEUTRAL.diffuse),
    };
    let converted = Material {
        diffuse,
        specular: material.specular.filter(|_| !matt).map_or(Vec3::ZERO, color),
        exponent: material.shininess.map_or(Material::NEUTRAL.exponent, |ns| ns as f32),
        ..surface.material
    };
    NamedMaterial { name: head.name.clone(), material: converted, ..surface }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use glam::Vec2;

    use super::super::super::lookup::Lookup;
    use super::*;
    use crate::mesh::TextureFile;
    use crate::scene::Wrap;

    fn parsed(text: &str) -> (Library, Vec<String>) {
        let mut warnings = Warnings::about(Path::new("a.mtl"));
        let pictures = Lookup::new(Path::new("no such folder"), false);
        let library = parse(text, &Place { pictures: &pictures, inner: Path::new("") }, &mut warnings);
        (library, warnings.into_messages())
    }

    #[test]
    fn materials_are_read() {
        let text = "# made by hand\r\nnewmtl dark red # 2\r\nKd 0.5 0 0 # red\r\nKs 0.25 0.25 0.25\r\nNs 12\r\n\
                    illum 2\nnewmtl grey\nKd 0.5\nnewmtl matt\nKs 1 1 1\nillum 1\nd 1.0\nTr 0\n";
        let (library, warnings) = parsed(text);
        assert_eq!(warnings, [""; 0]);
        let red = library["dark red # 2"].material;
        assert_eq!((red.diffuse, red.specular), (Vec3::new(0.5, 0.0, 0.0), Vec3::splat(0.25)));
        assert_eq!(red.exponent, 12.0);
        assert_eq!(library["grey"].material.diffuse, Vec3::splat(0.5));
        assert_eq!(library["matt"].material.specular, Vec3::ZERO);
    }

    #[test]
    fn what_cannot_be_drawn_is_told_with_its_line() {
        let text =
            "newmtl a\nKd red\nmap_Kd ../wood.png\nd 0.5\nKs 2 0 0\nNs 1e9\nKs 0.1 nan 0.3\nnewmtl\nKd 1 0 1";
        let (library, warnings) = parsed(text);
        let a = library["a"].material;
        assert_eq!(a.diffuse, Material::NEUTRAL.diffuse);
        assert_eq!((a.specular, a.exponent), (Vec3::X, 1e6));
        let expected = [
            "a.mtl:2: `Kd red`: three numbers were expected; the line is left out (2 lines of this kind)",
            "a.mtl:3: the picture `../wood.png` is outside the model's folder and is not read; put it there, or allow it \
             with --allow-parent-textures",
            "a.mtl:4: transparency is not supported yet",
            "a.mtl:5: `Ks 2 0 0`: colours from 0 to 1 were expected",
            "a.mtl:6: `Ns 1e9`: taken",
            "a.mtl:8: `newmtl` without a name",
        ];
        assert_eq!(library.len(), 1);
        assert_eq!(warnings.len(), expected.len(), "{warnings:#?}");
        for (warning, start) in warnings.iter().zip(expected) {
            assert!(warning.starts_with(start), "{warning} / {start}");
        }
    }

    #[test]
    fn kd_is_a_factor_of_the_texture_unless_it_hides_it() {
        let text = "newmtl a\nKd 0.5 1 1\nmap_Kd -clamp on maps\\wood one.png\nnewmtl b\nmap_Kd b.png\n\
                    newmtl c\nKd 0 0 0\nmap_Kd c.png\nnewmtl d\nKd 0 0 0\nnewmtl e\nmap_Kd -s 2\n";
        let (library, warnings) = parsed(text);
        let found = |name: &str| {
            (
                library[name].material.diffuse,
                library[name].texture.as_ref().map(|texture| texture.file.as_str()),
            )
        };
        assert_eq!(found("a"), (Vec3::new(0.5, 1.0, 1.0), Some("maps/wood one.png")));
        assert_eq!(found("b"), (Vec3::ONE, Some("b.png")));
        assert_eq!(found("c"), (Vec3::ONE, Some("c.png")));
        assert_eq!(found("d"), (Vec3::ZERO, None));
        assert_eq!(library["a"].texture.as_ref().map(|texture| texture.tiling.wrap), Some(Wrap::Clamp));
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].starts_with("a.mtl:12: `map_Kd` names no picture"), "{warnings:?}");
    }

    #[test]
    fn light_of_its_own_cut_outs_and_pictures_that_lie_elsewhere_are_read() {
        let text = "newmtl photo\nKd 0.5 0.5 0.5\nKs 1 1 1\nillum 0\nmap_Kd -s 3 2 1 -o 0.5 0 0 a.png\nmap_d -clamp on b.png\n\
                    newmtl lamp\nKd 0 0 0\nKe 2 0.5 -1\nd 0.5\nnewmtl screen\nmap_Ke -mm 0 0.5 c.png\nKe 0 0 0\nTr 0.5\n\
                    newmtl bumpy\nillum 2\nmap_bump -bm 0.2 d.png\nnewmtl lamp\nKe 1\n";
        let (library, warnings) = parsed(text);
        let photo = &library["photo"];
        assert!(photo.material.unlit && !photo.material.is_specular() && !library["bumpy"].material.unlit);
        let texture = photo.texture.as_ref().unwrap();
        assert_eq!((texture.file.as_str(), texture.tiling.scale), ("a.png", Vec2::new(3.0, 2.0)));
        assert_eq!(texture.tiling.offset, Vec2::new(0.5, 0.0));
        let cutout = photo.cutout.as_ref().unwrap();
        assert_eq!((cutout.file.as_str(), cutout.tiling.wrap), ("b.png", Wrap::Clamp));
        // Defined once more: the last one counts.
        assert_eq!(library["lamp"].material.emission, Vec3::ONE);
        assert_eq!(library["screen"].material.emission, Vec3::ONE);
        assert_eq!(library["screen"].emission_texture, Some(TextureFile::new("c.png")));
        let expected = [
            "a.mtl:10: transparency is not supported yet: drawn opaque (2 lines of this kind)",
            "a.mtl:12: the option `-mm` of textures is left out",
            "a.mtl:17: `map_bump` is left out: relief from pictures is not drawn",
            "a.mtl:18: `lamp` is defined again, in another way: the last definition counts",
        ];
        assert_eq!(warnings, expected);
        let (library, _) = parsed("newmtl lamp\nKe 2 0.5 -1\n");
        assert_eq!(library["lamp"].material.emission, Vec3::new(2.0, 0.5, 0.0));
    }

    #[test]
    fn exponents_that_mean_no_highlight_give_none() {
        let specular = |lines: &str| {
            let (library, warnings) = parsed(&format!("newmtl a\nKs 1 1 1\nillum 2\n{lines}\n"));
            (library["a"].material.specular, warnings.len())
        };
        for (lines, count) in [("Ns 0", 0), ("Ns 0.0", 0), ("Ns -0", 0), ("Ns -1", 1), ("Ns 0.25", 1)] {
            assert_eq!(specular(lines), (Vec3::ZERO, count), "{lines}");
        }
        for lines in ["", "Ns 1", "Ns 10.5", "Ns 1e3"] {
            assert_eq!(specular(lines), (Vec3::ONE, 0), "{lines}");
        }
    }

    #[test]
    fn keywords_are_read_in_any_letters() {
        let text = "NEWMTL red#1\nKD 1 0 0\nKS 0.5 0.5 0.5\nNS 9\nILLUM 2\nMAP_KD a#b.png\n\
                    NewMtl blue\n\tkd\t0 0 1e0 \t\nmap_kd  c.png  \nMap_Bump d.png\nni 1.5\nTR 0\n";
        let (library, warnings) = parsed(text);
        let red = &library["red#1"];
        assert_eq!(
            (red.material.diffuse, red.material.specular, red.material.exponent),
            (Vec3::X, Vec3::splat(0.5), 9.0)
        );
        assert_eq!(red.texture.as_ref().map(|texture| &*texture.file), Some("a#b.png"));
        assert_eq!(
            (
                library["blue"].material.diffuse,
                library["blue"].texture.as_ref().map(|texture| &*texture.file)
            ),
            (Vec3::Z, Some("c.png"))
        );
        assert_eq!(warnings, ["a.mtl:10: `map_bump` is left out: relief from pictures is not drawn"]);
    }

    #[test]
    fn colours_beyond_one_are_one_warning_with_a_hint() {
        let (library, warnings) = parsed("newmtl red\nKd 204 30 30\nnewmtl blue\nKd 0 0 255\n");
        assert_eq!(library["blue"].material.diffuse, Vec3::Z);
        let expected = "a.mtl:2: `Kd 204 30 30`: colours from 0 to 1 were expected, others are taken to the nearest one; \
                        for colours from 0 to 255 divide by 255, as in `Kd 0.8 0.118 0.118` (2 lines of this kind)";
        assert_eq!(warnings, [expected]);
        let (library, warnings) = parsed("newmtl a\nKd 1.000001 1 1\nnewmtl b\nKd 1.5 -0.5 0\n");
        assert_eq!((library["a"].material.diffuse, library["b"].material.diffuse), (Vec3::ONE, Vec3::X));
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(!warnings[0].contains("255"), "{warnings:?}");
    }

    #[test]
    fn numbers_that_are_no_numbers_here_get_a_hint() {
        for (line, words) in [
            ("Kd 0,8 0,1 0,1", "`Kd 0,8 0,1 0,1`: three numbers were expected (decimal points, not commas"),
            ("Ns 12,5", "a number was expected (decimal points, not commas"),
            ("Kd spectral red.rfl 1", "`spectral` colours are not read"),
            ("Kd xyz 0.3 0.3 0.3", "`xyz` colours are not read"),
            ("Kd 1 0", "three numbers were expected;"),
        ] {
            let (library, warnings) = parsed(&format!("newmtl a\n{line}\n"));
            assert_eq!(library["a"].material.diffuse, Material::NEUTRAL.diffuse);
            assert_eq!(warnings.len(), 1, "{warnings:?}");
            assert!(warnings[0].starts_with("a.mtl:2: ") && warnings[0].contains(words), "{warnings:?}");
        }
        assert_eq!(parsed("newmtl a\nKd 1e-1 +.5 5E-1\n").1, [""; 0]);
    }

    #[test]
    fn what_is_left_out_is_reported_once_a_kind_and_what_says_nothing_is_not() {
        let material = |name: usize| {
            format!(
                "newmtl m{name}\nKa 0.2 0.2 0.2\nKe 0 0 0\nNi 1.45\nTf 1 1 1\nd 1\nillum 2\nKd 0.8 0.8 0.8\n\
                 map_Ka a.png\nmap_Kd a.png\n"
            )
        };
        let text: String = (0..3).map(material).collect();
        assert_eq!(parsed(&text).1, [""; 0]);
        let odd = "bump a.png\nnorm a.png\nmap_Ks a.png\nPr 0.5\nmap_Tr a.png\nTf 1 0 0\nillum 3\nKa 1 0 0\nhello 1\n";
        let text: String = (0..3).map(|name| format!("{}{odd}", material(name))).collect();
        let warnings = parsed(&text).1;
        for words in [
            "a.mtl:11: `bump` is left out",
            "a.mtl:12: `norm` is left out",
            "a.mtl:13: `map_Ks` is left out",
            "a.mtl:14: `Pr` is left out",
            "a.mtl:15: `map_Tr` is left out",
            "a.mtl:16: `Tf` is left out",
            "a.mtl:17: `illum 3`: mirrors and glass",
            "a.mtl:19: unknown statement `hello`",
            "a.mtl:1: `Ka`: ambient light takes the colour of `Kd`",
        ] {
            let found = warnings.iter().find(|warning| warning.starts_with(words));
            assert!(
                found.is_some_and(|warning| warning.ends_with("(3 lines of this kind)")),
                "{words}: {warnings:#?}"
            );
        }
        assert_eq!(warnings.len(), 9, "{warnings:#?}");
        let warnings = parsed("Kd 1 0 0\nNs 2\nnewmtl a\nmap_Ka a.png\n").1;
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        assert!(warnings[0].starts_with("a.mtl:1: statements before the first `newmtl`"), "{warnings:?}");
        assert!(warnings[1].starts_with("a.mtl:3: `map_Ka` without `map_Kd`"), "{warnings:?}");
    }

    #[test]
    fn the_last_definition_of_a_name_counts() {
        let (library, warnings) = parsed("newmtl a\nKd 1 0 0\nnewmtl b\nnewmtl a\nKd 0 0 1\nnewmtl b\n");
        assert_eq!(library["a"].material.diffuse, Vec3::Z);
        assert_eq!(warnings, ["a.mtl:4: `a` is defined again, in another way: the last definition counts"]);
    }

    #[test]
    fn names_are_plain() {
        for (name, plain) in [
            ("red", "red"),
            ("\"dark red\"", "dark red"),
            ("'dark red' ", "dark red"),
            ("dark \t  red", "dark red"),
            ("\"", "\""),
            ("5\" pipe", "5\" pipe"),
            ("rouge\u{a0}", "rouge\u{a0}"),
        ] {
            assert_eq!(plain_name(name), plain, "{name}");
        }
        let (library, _) = parsed("newmtl \"dark red\" # oak\nnewmtl a\u{a0}\nnewmtl a\n");
        assert_eq!(library.keys().collect::<Vec<_>>(), ["\"dark red\" # oak", "a", "a\u{a0}", "dark red"]);
    }
}
