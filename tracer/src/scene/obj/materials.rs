//! Material libraries (MTL). They are looked for inside the model's folder only: a model from elsewhere must not make
//! the program read other files. What is missing or odd in a library costs a warning, never the model.

use std::collections::BTreeMap;
use std::panic::catch_unwind;
use std::path::{Component, Path, PathBuf};

use glam::Vec3;

use super::super::read::{MAX_LIBRARY_BYTES, bytes};
use super::super::warnings::Warnings;
use super::super::{MAX_EXPONENT, Material};
use super::lines::{Line, lines};
use super::picture::{Place, picture};
use crate::mesh::NamedMaterial;

/// Materials by the name that `usemtl` gives.
pub(super) type Library = BTreeMap<String, NamedMaterial>;

/// Adds the materials of the libraries that an `mtllib` line names. Whether all of them could be read, and warnings
/// about what stands in them.
pub(super) fn load(
    model: &Path,
    names: &str,
    line: usize,
    library: &mut Library,
    warnings: &mut Warnings,
) -> (bool, Vec<String>) {
    let folder = model.parent().unwrap_or(Path::new(""));
    let mut messages = Vec::new();
    let mut complete = true;
    for name in split_names(folder, names) {
        match read(folder, name) {
            Ok((path, text)) => {
                let mut about = Warnings::about(&path);
                let inner = path.strip_prefix(folder).ok().and_then(Path::parent).unwrap_or(Path::new(""));
                library.extend(parse(&text, &Place { folder, inner }, &mut about));
                messages.extend(about.into_messages());
            }
            Err(reason) => {
                warnings.at_line(line, format!("{reason}; its materials are drawn with the neutral one"));
                complete = false;
            }
        }
    }
    (complete, messages)
}

/// One name with spaces in it, if there is such a file; else several names.
fn split_names<'n>(folder: &Path, names: &'n str) -> Vec<&'n str> {
    let whole = inside(names).is_some_and(|name| folder.join(name).is_file());
    if whole { vec![names] } else { names.split_ascii_whitespace().collect() }
}

fn read(folder: &Path, name: &str) -> Result<(PathBuf, String), String> {
    let outside = || format!("the material library `{name}` lies outside the model's folder and is not read");
    let path = folder.join(inside(name).ok_or_else(outside)?);
    let content = bytes(&path, MAX_LIBRARY_BYTES).map_err(|e| format!("material library: {e}"))?;
    // A link inside the folder may still lead out of it.
    let anchor = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    match (path.canonicalize(), anchor.canonicalize()) {
        (Ok(real), Ok(folder)) if real.starts_with(&folder) => {}
        _ => return Err(outside()),
    }
    Ok((path, String::from_utf8_lossy(&content).into_owned()))
}

/// The relative path of a name that stays inside its folder, with the separators of either family of systems.
fn inside(name: &str) -> Option<PathBuf> {
    let path = PathBuf::from(name.replace('\\', "/"));
    let stays = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    (stays && !name.is_empty() && !name.contains(':')).then_some(path)
}

/// The materials of a library's text.
fn parse(text: &str, place: &Place<'_>, warnings: &mut Warnings) -> Library {
    let mut clean = String::new();
    for line in lines(text) {
        match statement(&line, place, warnings) {
            Ok(statement) => clean.push_str(&statement),
            Err(message) => warnings.at_line(line.number, format!("{message}; the line is left out")),
        }
    }
    // The parser panics on what it does not expect. Nothing of that kind is left, but it is not ours to promise.
    let parsed = catch_unwind(|| tobj::load_mtl_buf(&mut clean.as_bytes()));
    let Ok(Ok((materials, _))) = parsed else {
        warnings.at_file("the material library cannot be read, and is left out");
        return Library::new();
    };
    materials.into_iter().map(|material| (material.name.clone(), convert(material))).collect()
}

/// The line as the parser is to see it; empty for what nobody draws.
fn statement(line: &Line<'_>, place: &Place<'_>, warnings: &mut Warnings) -> Result<String, String> {
    let keyword = line.keyword();
    match keyword {
        "newmtl" if line.rest().is_empty() => Err("`newmtl` without a name".into()),
        "newmtl" => Ok(format!("newmtl {}\n", line.rest())),
        "Kd" | "Ks" => {
            let [r, g, b] = color(line)?.map(|channel| bounded(channel, 1.0, line, warnings));
            Ok(format!("{keyword} {r} {g} {b}\n"))
        }
        "Ns" => {
            let exponent = bounded(number(line)?, f64::from(MAX_EXPONENT), line, warnings);
            Ok(format!("Ns {exponent}\n"))
        }
        "illum" => Ok(format!("illum {}\n", number(line)?.clamp(0.0, 255.0) as u8)),
        "d" | "Tr" => {
            let opaque = if keyword == "d" { 1.0 } else { 0.0 };
            if number(line).is_ok_and(|share| share != opaque) {
                warnings.at_line(line.number, "transparency is not supported yet: drawn opaque");
            }
            Ok(String::new())
        }
        "map_Kd" => Ok(format!("map_Kd {}\n", picture(line, place, warnings)?)),
        _ => Ok(String::new()),
    }
}

/// `Kd r g b`, or `Kd r` for grey.
fn color(line: &Line<'_>) -> Result<[f64; 3], String> {
    let words: Vec<&str> = line.rest().split_ascii_whitespace().take(4).collect();
    let numbers: Option<Vec<f64>> =
        words.iter().map(|word| word.parse().ok().filter(|n: &f64| n.is_finite())).collect();
    match numbers.as_deref() {
        Some([grey]) => Ok([*grey; 3]),
        Some([r, g, b]) => Ok([*r, *g, *b]),
        _ => Err(format!("`{}`: three numbers were expected", shortened(line))),
    }
}

fn number(line: &Line<'_>) -> Result<f64, String> {
    // `d -halo 0.5` has a word in between.
    let word = line.rest().split_ascii_whitespace().last().unwrap_or_default();
    let number = word.parse().ok().filter(|n: &f64| n.is_finite());
    number.ok_or_else(|| format!("`{}`: a number was expected", shortened(line)))
}

fn bounded(value: f64, limit: f64, line: &Line<'_>, warnings: &mut Warnings) -> f64 {
    if !(0.0..=limit).contains(&value) {
        let message = format!("`{}`: taken to the nearest value from 0 to {limit}", shortened(line));
        warnings.at_line(line.number, message);
    }
    value.clamp(0.0, limit)
}

fn shortened(line: &Line<'_>) -> String {
    line.text.chars().take(60).collect()
}

fn convert(material: tobj::Material) -> NamedMaterial {
    let color = |[r, g, b]: [f64; 3]| Vec3::new(r as f32, g as f32, b as f32);
    // Illumination models 0 and 1 have no highlights.
    let matt = material.illumination_model.is_some_and(|model| model < 2);
    let diffuse = match (material.diffuse.map(color), &material.diffuse_texture) {
        // `Kd` is a factor of the texel. Some programs write 0 for "the map alone", which would be black.
        (None | Some(Vec3::ZERO), Some(_)) => Vec3::ONE,
        (diffuse, _) => diffuse.unwrap_or(Material::NEUTRAL.diffuse),
    };
    let converted = Material {
        diffuse,
        specular: material.specular.filter(|_| !matt).map_or(Vec3::ZERO, color),
        exponent: material.shininess.map_or(Material::NEUTRAL.exponent, |ns| ns as f32),
        texture: None,
    };
    NamedMaterial { name: material.name, material: converted, texture: material.diffuse_texture }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> (Library, Vec<String>) {
        let mut warnings = Warnings::about(Path::new("a.mtl"));
        let place = Place { folder: Path::new("no such folder"), inner: Path::new("") };
        let library = parse(text, &place, &mut warnings);
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
            "newmtl a\nKd red\nmap_Kd ../wood.png\nd 0.5\nKs 2 0 0\nNs 1e9\nKd 0.1 nan 0.3\nnewmtl\nKd 1 1";
        let (library, warnings) = parsed(text);
        let a = library["a"].material;
        assert_eq!(a.diffuse, Material::NEUTRAL.diffuse);
        assert_eq!((a.specular, a.exponent), (Vec3::X, 1e6));
        let expected = [
            "a.mtl:2: `Kd red`: three numbers",
            "a.mtl:3: the picture `../wood.png` lies outside",
            "a.mtl:4: transparency is not supported yet",
            "a.mtl:5: `Ks 2 0 0`: taken to the nearest value from 0 to 1",
            "a.mtl:6: `Ns 1e9`: taken",
            "a.mtl:7: `Kd 0.1 nan 0.3`: three numbers",
            "a.mtl:8: `newmtl` without a name",
            "a.mtl:9: `Kd 1 1`: three numbers",
        ];
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
        let found = |name: &str| (library[name].material.diffuse, library[name].texture.as_deref());
        assert_eq!(found("a"), (Vec3::new(0.5, 1.0, 1.0), Some("maps/wood one.png")));
        assert_eq!(found("b"), (Vec3::ONE, Some("b.png")));
        assert_eq!(found("c"), (Vec3::ONE, Some("c.png")));
        assert_eq!(found("d"), (Vec3::ZERO, None));
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        assert!(warnings[0].starts_with("a.mtl:3: -clamp: options of textures are left out"), "{warnings:?}");
        assert!(warnings[1].starts_with("a.mtl:12: `map_Kd` names no picture"), "{warnings:?}");
    }

    #[test]
    fn names_that_lead_out_of_the_folder_are_refused() {
        for name in
            ["../a.mtl", "/etc/passwd", "a/../../b.mtl", "C:\\a.mtl", "..\\a.mtl", "\\\\host\\a.mtl", ""]
        {
            assert_eq!(inside(name), None, "{name}");
        }
        assert_eq!(inside("mtl\\a.mtl"), Some(PathBuf::from("mtl/a.mtl")));
        assert_eq!(inside("./a b.mtl"), Some(PathBuf::from("./a b.mtl")));
    }
}
