//! Statements of material libraries, and the warnings about them.

mod optics;

use std::path::Path;

use glam::Vec2;

use super::super::super::lookup::Lookup;
use super::*;
use crate::mesh::TextureFile;
use crate::texture::Wrap;

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
fn unsupported_statements_are_reported_with_their_lines() {
    let text =
        "newmtl a\nKd red\nmap_Kd ../wood.png\nd 0.5\nKs 2 0 0\nNs 1e9\nKs 0.1 nan 0.3\nnewmtl\nKd 1 0 1";
    let (library, warnings) = parsed(text);
    let a = library["a"].material;
    assert_eq!(a.diffuse, Material::NEUTRAL.diffuse * 0.5);
    assert_eq!((a.transmit, a.thin), (Vec3::splat(0.5), true));
    assert_eq!((a.specular, a.exponent), (Vec3::X, 1e6));
    let expected = [
        "a.mtl:2: `Kd red`: three numbers were expected; the line is left out (2 lines of this kind)",
        "a.mtl:3: the picture `../wood.png` is outside the model's folder and is not read; put it there, or allow it \
         with --allow-parent-textures",
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
fn kd_is_a_factor_of_the_texture_unless_it_is_black() {
    let text = "newmtl a\nKd 0.5 1 1\nmap_Kd -clamp on maps\\wood one.png\nnewmtl b\nmap_Kd b.png\n\
                newmtl c\nKd 0 0 0\nmap_Kd c.png\nnewmtl d\nKd 0 0 0\nnewmtl e\nmap_Kd -s 2\n";
    let (library, warnings) = parsed(text);
    let found = |name: &str| {
        (library[name].material.diffuse, library[name].texture.as_ref().map(|texture| texture.file.as_str()))
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
fn emission_cut_outs_and_tiling_are_read() {
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
        "a.mtl:12: the option `-mm` of textures is left out",
        "a.mtl:17: `map_bump` is left out: relief from pictures is not drawn",
        "a.mtl:18: `lamp` is defined again, in another way: the last definition counts",
    ];
    assert_eq!(warnings, expected);
    let (library, _) = parsed("newmtl lamp\nKe 2 0.5 -1\n");
    assert_eq!(library["lamp"].material.emission, Vec3::new(2.0, 0.5, 0.0));
}

#[test]
fn tiny_exponents_give_no_highlight() {
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
fn keywords_are_read_in_upper_and_lower_case() {
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
        (library["blue"].material.diffuse, library["blue"].texture.as_ref().map(|texture| &*texture.file)),
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
fn malformed_numbers_get_a_hint() {
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
fn ignored_statements_are_reported_once_per_kind_if_they_matter() {
    let material = |name: usize| {
        format!(
            "newmtl m{name}\nKa 0.2 0.2 0.2\nKe 0 0 0\nNi 1.45\nTf 1 1 1\nd 1\nillum 2\nKd 0.8 0.8 0.8\n\
             map_Ka a.png\nmap_Kd a.png\n"
        )
    };
    let text: String = (0..3).map(material).collect();
    assert_eq!(parsed(&text).1, [""; 0]);
    let odd =
        "bump a.png\nnorm a.png\nmap_Ks a.png\nPr 0.5\nmap_Tr a.png\nTf 1 0 0\nillum 3\nKa 1 0 0\nhello 1\n";
    let text: String = (0..3).map(|name| format!("{}{odd}", material(name))).collect();
    let warnings = parsed(&text).1;
    for words in [
        "a.mtl:11: `bump` is left out",
        "a.mtl:12: `norm` is left out",
        "a.mtl:13: `map_Ks` is left out",
        "a.mtl:14: `Pr` is left out",
        "a.mtl:15: `map_Tr` is left out",
        "a.mtl:16: `Tf` is left out",
        "a.mtl:19: unknown statement `hello`",
        "a.mtl:1: `Ka`: ambient light takes the colour of `Kd`",
    ] {
        let found = warnings.iter().find(|warning| warning.starts_with(words));
        assert!(
            found.is_some_and(|warning| warning.ends_with("(3 lines of this kind)")),
            "{words}: {warnings:#?}"
        );
    }
    assert_eq!(warnings.len(), 8, "{warnings:#?}");
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
fn names_are_normalised() {
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
