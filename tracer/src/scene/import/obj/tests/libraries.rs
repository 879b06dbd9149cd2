//! Material libraries: where they are found, and which materials triangles get.

use super::*;

const TWO_MATERIALS: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
    usemtl red\nf 1 2 3\nusemtl never\nusemtl blue\nf 1 2 3 4\nusemtl red\nf 1 3 4\n";
const LIBRARY: &str = "newmtl blue\nKd 0 0 1\nnewmtl red\nKd 1 0 0\nKs 0.5\nNs 9\n";

#[test]
fn triangles_get_the_materials_of_the_library() {
    let files: &[(&str, &[u8])] = &[("a.obj", TWO_MATERIALS.as_bytes()), ("a.mtl", LIBRARY.as_bytes())];
    let (mesh, warnings) = load_files(files).unwrap();
    assert_eq!(mesh.triangle_materials, [0, 1, 1, 0]);
    let names: Vec<&str> = mesh.materials.iter().map(|slot| slot.name.as_str()).collect();
    assert_eq!(names, ["red", "blue"]);
    assert_eq!((mesh.materials[0].material.diffuse, mesh.materials[0].material.exponent), (Vec3::X, 9.0));
    assert_eq!(mesh.materials[1].material.diffuse, Vec3::Z);
    assert_eq!(mesh.positions.len(), 4, "materials do not split vertices");
    assert_eq!(warnings, ["a.obj:8: no material library defines `never`: drawn with the neutral material"]);
}

#[test]
fn libraries_are_found_in_the_folder_of_the_model_only() {
    let red = |mtllib: &str, file: &str| {
        let text = TWO_MATERIALS.replace("a.mtl", mtllib);
        let (mesh, warnings) = load_files(&[("a.obj", text.as_bytes()), (file, LIBRARY.as_bytes())]).unwrap();
        (mesh.materials[0].material.diffuse == Vec3::X, warnings)
    };
    assert!(red("./a.mtl", "a.mtl").0);
    assert!(red("sub\\a.mtl", "sub/a.mtl").0);
    assert!(red("two words.mtl", "two words.mtl").0);
    let (found, warnings) = red("other.mtl b.mtl", "b.mtl");
    assert!(found, "{warnings:?}");
    assert!(
        warnings[0].starts_with("a.obj:1: the material library `other.mtl` is not in the model's folder"),
        "{warnings:?}"
    );
    // A path to another folder is found in the model's folder, with a warning.
    for other in ["../b.mtl", "/etc/b.mtl", "C:\\b.mtl", "B.MTL", "x/b.mtl"] {
        let (found, warnings) = red(other, "b.mtl");
        assert!(found, "{other}: {warnings:?}");
        let note = format!("a.obj:1: the material library `{other}` is not there: `b.mtl` is taken");
        assert_eq!(warnings[0], note);
    }
    for outside in ["../b.mtl", "/etc/b.mtl", "C:\\b.mtl"] {
        let (found, warnings) = red(outside, "sub/b.mtl");
        assert!(!found && warnings.len() == 1, "{warnings:?}");
        assert!(warnings[0].starts_with("a.obj:1: ") && warnings[0].contains("outside"), "{warnings:?}");
    }
}

#[test]
fn names_of_libraries_may_have_blanks_quotes_escapes_and_comments() {
    let red = b"\xef\xbb\xbfnewmtl red\nKd 1 0 0\n";
    let blue = b"\xef\xbb\xbfnewmtl blue\nKd 0 0 1\n";
    for names in [
        "my mats.mtl other.mtl",
        "other.mtl my mats.mtl # materials",
        "my\\ mats.mtl other.mtl",
        "\"my mats.mtl\" \"other.mtl\"",
        "\"my mats.mtl\"\nmtllib other.mtl # x.mtl",
        "my mats.mtl\nmtllib other.mtl\nmtllib my mats.mtl",
    ] {
        let text = TWO_MATERIALS.replace("usemtl never\n", "").replace("a.mtl", names);
        let files = [("a.obj", text.as_bytes()), ("my mats.mtl", &red[..]), ("other.mtl", &blue[..])];
        let (mesh, warnings) = load_files(&files).unwrap();
        assert_eq!(warnings, [""; 0], "{names}");
        let colors: Vec<_> = mesh.materials.iter().map(|slot| slot.material.diffuse).collect();
        assert_eq!(colors, [Vec3::X, Vec3::Z], "{names}");
    }
}

#[test]
fn a_library_named_like_the_model_replaces_a_missing_one() {
    for (mtllib, note) in [
        (
            "mtllib model_v1.mtl",
            "a.obj:1: the material library `model_v1.mtl` is not there: `a.mtl`, named like the model, is taken",
        ),
        (
            "",
            "a.obj: no `mtllib` line names the library of its materials: `a.mtl`, named like the model, is taken",
        ),
    ] {
        let text = TWO_MATERIALS.replace("mtllib a.mtl", mtllib).replace("usemtl never\n", "");
        let load =
            |library: &str| load_files(&[("a.obj", text.as_bytes()), ("a.mtl", library.as_bytes())]).unwrap();
        let (mesh, warnings) = load(LIBRARY);
        assert_eq!((mesh.materials[0].material.diffuse, warnings), (Vec3::X, vec![note.to_owned()]));
        let (mesh, warnings) = load("newmtl unrelated\nKd 0 1 0\n");
        assert!(mesh.materials.iter().all(|slot| slot.material == Material::NEUTRAL));
        assert!(warnings.len() == 1 && !warnings[0].contains("is taken"), "{warnings:?}");
    }
}

#[test]
fn libraries_of_other_formats_are_named() {
    for (content, words) in [
        (&b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n"[..], "a pointer of git-lfs"),
        (b"<!DOCTYPE html><html></html>", "a web page"),
        (b"PK\x03\x04....", "a ZIP archive"),
    ] {
        let (mesh, warnings) =
            load_files(&[("a.obj", TWO_MATERIALS.as_bytes()), ("a.mtl", content)]).unwrap();
        assert_eq!(mesh.materials[0].material, Material::NEUTRAL);
        assert!(warnings[0].starts_with("a.obj:1: material library: a.mtl: this is "), "{warnings:?}");
        assert!(warnings[0].contains(words), "{warnings:?}");
    }
}

#[test]
fn many_unknown_materials_are_one_warning() {
    let runs: String = (0..20).map(|i| format!("usemtl m{i}\nf 1 2 3\n")).collect();
    let (_, warnings) = read(&format!("{SQUARE}{runs}"));
    let expected = "a.obj:5: no material library defines `m0`, `m1`, `m2`, `m3`, `m4` and 15 more: drawn with the neutral material";
    assert_eq!(warnings, [expected]);
}

#[test]
fn quoted_names_of_materials_are_the_names() {
    let text =
        format!("mtllib a.mtl\n{SQUARE}usemtl \"dark red\"\nf 1 2 3\nusemtl dark  red # again\nf 1 3 4\n");
    let (mesh, warnings) =
        load_files(&[("a.obj", text.as_bytes()), ("a.mtl", b"newmtl dark red\nKd 1 0 0\n")]).unwrap();
    assert_eq!(warnings, [""; 0]);
    assert!(mesh.materials.iter().all(|slot| slot.material.diffuse == Vec3::X), "{:?}", mesh.materials);
}

#[cfg(unix)]
#[test]
fn links_out_of_the_folder_are_not_followed() {
    let outside = tempfile::tempdir().unwrap();
    std::fs::write(outside.path().join("a.mtl"), LIBRARY).unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), TWO_MATERIALS).unwrap();
    std::os::unix::fs::symlink(outside.path().join("a.mtl"), folder.path().join("a.mtl")).unwrap();
    let (mesh, warnings) = load(&folder.path().join("a.obj"), Uvs::Textured, LoadOptions::default()).unwrap();
    assert_eq!(mesh.materials[0].material, Material::NEUTRAL);
    assert!(warnings[0].contains("outside"), "{warnings:?}");
}

#[test]
fn a_missing_library_is_one_warning_and_the_neutral_material() {
    let (mesh, warnings) = read(TWO_MATERIALS);
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    let expected = "a.obj:1: the material library `a.mtl` is not in the model's folder; its materials are drawn with the neutral one";
    assert_eq!(warnings, [expected]);
    assert!(mesh.materials.iter().all(|slot| slot.material == Material::NEUTRAL));
}

#[test]
fn names_are_one_in_every_encoding_of_model_and_library() {
    let model =
        "mtllib a.mtl\n# grüße\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl grün\nf 1 2 3\nusemtl gräu\nf 1 3 2\n";
    let library = "newmtl grün\nKd 0 1 0\nnewmtl gräu\nKd 0.5 0.5 0.5\n";
    let latin_1 = |text: &str| text.chars().map(|c| c as u8).collect::<Vec<u8>>();
    let wide = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
    let marked = |text: &str| format!("\u{feff}{text}").into_bytes();
    let old_mac = |text: &str| text.replace('\n', "\r").into_bytes();
    type Writing<'w> = &'w dyn Fn(&str) -> Vec<u8>;
    let writings: [Writing<'_>; 5] = [&|text| text.into(), &latin_1, &wide, &marked, &old_mac];
    for (i, write_model) in writings.iter().enumerate() {
        for (j, write_library) in writings.iter().enumerate() {
            let files = [("a.obj", write_model(model)), ("a.mtl", write_library(library))];
            let (mesh, warnings) =
                load_files(&files.each_ref().map(|(name, text)| (*name, &text[..]))).unwrap();
            let materials: Vec<_> = mesh.materials.iter().map(|m| (&*m.name, m.material.diffuse)).collect();
            assert_eq!(materials, [("grün", Vec3::Y), ("gräu", Vec3::splat(0.5))], "{i} {j}");
            assert_eq!(warnings, [""; 0]);
        }
    }
}
