//! Models as people write them, models that are broken, and models made by chance.

mod normals;

use std::fmt::Write;

use glam::{DVec3, Vec3};
use proptest::prelude::*;

use super::*;
use crate::scene::Material;

fn load_files(files: &[(&str, &[u8])]) -> Result<(Mesh, Vec<String>), String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }
    let place = format!("{}{}", folder.path().display(), std::path::MAIN_SEPARATOR);
    let without_folder = |message: String| message.replace(&place, "");
    match load(&folder.path().join("a.obj"), Uvs::Textured, LoadOptions::default()) {
        Ok((mesh, warnings)) => Ok((mesh, warnings.into_iter().map(without_folder).collect())),
        Err(error) => Err(without_folder(error.to_string())),
    }
}

fn read(text: &str) -> (Mesh, Vec<String>) {
    load_files(&[("a.obj", text.as_bytes())]).unwrap()
}

fn refusal(text: &str) -> String {
    load_files(&[("a.obj", text.as_bytes())]).unwrap_err()
}

/// The corners of all triangles as points, whatever their indices.
fn corners(mesh: &Mesh) -> Vec<[DVec3; 3]> {
    mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize])).collect()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn square_corners() -> Vec<[DVec3; 3]> {
    let [a, b, c, d] =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]].map(DVec3::from_array);
    vec![[a, b, c], [a, c, d]]
}

#[test]
fn faces_are_read_in_every_way_of_writing_them() {
    for face in [
        "f 1 2 3 4",
        "f 1 2 3\nf 1 3 4",
        "f -4 -3 -2 -1",
        "f 1 2 3 4 # a quad",
        "f 1 2 \\\n 3 4",
        "f 1/1 2/2 3/3 4/4\nvt 0 0",
        "f 1//1 2//1 3//1 4//1\nvn 0 0 1",
        "f 1/9/1 2/9/1 3/9/1 4/9/1\nvn 0 0 1",
        "g one\nf 1 2 3\ng two\no three\ns off\nf 1 3 4",
        "vn 0 0 1\nf 1/-1/-1 2/1/-1 3/1/1 4/1/1",
    ] {
        for text in [format!("{SQUARE}{face}\n"), format!("\u{feff}# x\n{SQUARE}{face}")] {
            for text in [text.clone(), text.replace('\n', "\r\n"), text.replace(' ', " \t ")] {
                let (mesh, warnings) = read(&text);
                assert_eq!(corners(&mesh), square_corners(), "{text:?}");
                assert_eq!(warnings, [""; 0], "{text:?}");
                assert_eq!(mesh.triangle_materials, [0, 0]);
                assert_eq!(mesh.materials.len(), 1);
                assert_eq!(mesh.positions.len(), 4, "vertices are shared");
            }
        }
    }
}

#[test]
fn polygons_are_fanned_and_faces_may_come_before_their_vertices() {
    let (mesh, _) = read("f 1 2 3 4 5\nv 0 0 0\nv 2 0 0\nv 3 1 0\nv 2 2 0\nv 0 2 0\n");
    let [a, b, c, d, e] =
        [(0., 0.), (2., 0.), (3., 1.), (2., 2.), (0., 2.)].map(|(x, y)| DVec3::new(x, y, 0.0));
    assert_eq!(corners(&mesh), [[a, b, c], [a, c, d], [a, d, e]]);
}

#[test]
fn weights_colours_and_short_texture_coordinates_do_no_harm() {
    let text =
        "v 0 0 0 1.0\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0 1 0 0 1\nv 0 1 0\nvt 0.5\nvt 0 0 0\nf 1/1 2/2 3/1 4/2\n";
    let (mesh, warnings) = read(text);
    assert_eq!((corners(&mesh), warnings), (square_corners(), vec![]));
}

#[test]
fn digits_far_from_the_origin_survive() {
    let (mesh, _) = read("v 10000000.001 0 0\nv 10000000.002 0 0 1.0\nv 1e7 1 0 0.5 0.5 0.5\nf 1 2 3");
    assert_eq!(mesh.positions[0].x, 10_000_000.001);
    assert_eq!(mesh.positions[1].x, 10_000_000.002);
}

#[test]
fn seams_of_texture_coordinates_do_not_split_vertices() {
    let (mesh, _) = read(&format!("{SQUARE}vt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 1/2 3/2 4/2"));
    assert_eq!(mesh.positions.len(), 4);
    assert_eq!(mesh.triangles[0][0], mesh.triangles[1][0]);
}

/// A square whose first triangle may lie on another part of the picture than the second.
const WOODEN: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl wood\n";
const WOOD: (&str, &[u8]) = ("a.mtl", b"newmtl wood\nmap_Kd wood.png\nnewmtl red\nKd 1 0 0\n");

fn wooden(faces: &str) -> (Mesh, Vec<String>) {
    load_files(&[("a.obj", format!("{WOODEN}{faces}").as_bytes()), WOOD]).unwrap()
}

fn uvs(numbers: [f32; 6]) -> [Vec2; 3] {
    let [a, b, c, d, e, f] = numbers;
    [Vec2::new(a, b), Vec2::new(c, d), Vec2::new(e, f)]
}

#[test]
fn texture_coordinates_stay_with_the_corners() {
    for faces in [
        "vt 0 0\nvt 1 0 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n",
        "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf -4/-4 -3/-3 -2/-2 -1/-1\n",
        "f 1/1/1 2/2/1 3/3/1 4/4/1\nvn 0 0 1\nvt 0\nvt 1 0\nvt 1 1\nvt 0 1\n",
        "vt -5 7\nvt -4 7\nvt -4 8\nvt -5 8\nf 1 2\nf 1/1 2/2 3/3 4/4 # all\n",
    ] {
        let (mesh, _) = wooden(faces);
        assert_eq!(mesh.uvs, [uvs([0., 0., 1., 0., 1., 1.]), uvs([0., 0., 1., 1., 0., 1.])], "{faces}");
        assert_eq!(mesh.positions.len(), 4);
        assert_eq!(mesh.materials[0].texture.as_ref().map(|texture| texture.file.as_str()), Some("wood.png"));
        assert_eq!(mesh.materials[0].material.diffuse, Vec3::ONE);
    }
    let (seam, _) = wooden("vt 0 0\nvt 0.5 0.25\nf 1/1 2/1 3/1\nf 1/2 3/2 4/2\n");
    assert_eq!(seam.uvs, [uvs([0.0; 6]), uvs([0.5, 0.25, 0.5, 0.25, 0.5, 0.25])]);
    assert_eq!(seam.positions.len(), 4, "a seam splits no vertex");
}

#[test]
fn texture_coordinates_are_read_only_where_they_are_wanted() {
    let text = format!("{WOODEN}usemtl red\nvt 0 0\nf 1/1 2/1 3/1\n");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, &text).unwrap();
    std::fs::write(folder.path().join(WOOD.0), WOOD.1).unwrap();
    for (wanted, count) in [(Uvs::Never, 0), (Uvs::Textured, 0), (Uvs::Always, 1)] {
        assert_eq!(load(&path, wanted, LoadOptions::default()).unwrap().0.uvs.len(), count, "{wanted:?}");
    }
    std::fs::write(&path, text.replace("usemtl red", "usemtl wood")).unwrap();
    for (wanted, count) in [(Uvs::Never, 0), (Uvs::Textured, 1), (Uvs::Always, 1)] {
        assert_eq!(load(&path, wanted, LoadOptions::default()).unwrap().0.uvs.len(), count, "{wanted:?}");
    }
}

#[test]
fn triangles_without_usable_texture_coordinates_are_drawn_without_the_texture() {
    for odd in ["", "/", "/7", "/0", "/-9", "/2", "/3", "/4"] {
        let faces = format!("vt 0.5 0.5\nvt nan 0\nvt 2e6 0\nvt\nf 1/1 2/1 3/1\nf 1/1 3/1 4{odd}\n");
        let (mesh, warnings) = wooden(&faces);
        assert_eq!(mesh.triangle_materials, [0, 1], "{odd}");
        let names: Vec<_> = mesh.materials.iter().map(|m| (m.name.as_str(), m.texture.is_some())).collect();
        assert_eq!(names, [("wood", true), ("wood", false)], "{odd}");
        assert_eq!(mesh.uvs[1], [Vec2::ZERO; 3]);
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        let expected = "a.obj: triangles without texture coordinates that are finite and at most 1e6: 1; ";
        assert!(warnings[0].starts_with(expected), "{warnings:?}");
    }
    let (mesh, warnings) = wooden("f 1 2 3\nf 1 3 4\n");
    assert!(mesh.uvs.is_empty() && mesh.materials.len() == 1 && mesh.materials[0].texture.is_none());
    assert!(warnings[0].contains("no face has texture coordinates"), "{warnings:?}");
}

#[test]
fn normals_of_the_file_are_kept_and_brought_to_unit_length() {
    let (mesh, warnings) = read(&format!("{SQUARE}vn 0 0 5\nvn 3 0 4\nf 1//1 2//2 3//1\nf 1//2 3//1 4//1"));
    assert_eq!(warnings, [""; 0]);
    // Corner 1 has two normals, so it becomes two vertices.
    assert_eq!((mesh.positions.len(), mesh.normals.len()), (5, 5));
    assert_eq!(mesh.normals[mesh.triangles[0][0] as usize], Vec3::Z);
    assert!((mesh.normals[mesh.triangles[1][0] as usize] - Vec3::new(0.6, 0.0, 0.8)).length() < 1e-6);
}

#[test]
fn concave_polygons_and_their_texture_coordinates_are_cut_alike() {
    // An arrowhead whose notch is its last corner.
    let faces =
        "vt 0 0\nvt 0.1 0\nvt 0.2 0\nvt 0.3 0\nv 2 -1 0\nv 0 2 0\nv -2 -1 0\nv 0 0.4 0\nf 5/1 6/2 7/3 8/4\n";
    let (mesh, _) = wooden(faces);
    let u_of_x = |x: f64| {
        if x == 2.0 {
            0.0
        } else if x == -2.0 {
            0.2
        } else {
            0.1
        }
    };
    assert_eq!(mesh.triangles.len(), 2);
    for (corners, uvs) in corners(&mesh).into_iter().zip(&mesh.uvs) {
        assert!(corners.contains(&DVec3::new(0.0, 0.4, 0.0)), "cut through the notch: {corners:?}");
        for (corner, uv) in corners.into_iter().zip(uvs) {
            let expected = if corner.y == 0.4 { 0.3 } else { u_of_x(corner.x) };
            assert_eq!(uv.x, expected as f32, "{corner}");
        }
    }
    assert_eq!(mesh.triangle_materials, [0, 0]);
}

#[test]
fn a_wall_with_a_window_keeps_its_window() {
    let (mesh, warnings) = read(
        "v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nv 1 1 0\nv 1 2 0\nv 3 2 0\nv 3 1 0\nf 1 2 3 4 1 5 6 7 8 5\n",
    );
    let area: f64 = corners(&mesh).iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).length() / 2.0).sum();
    assert!((area - 10.0).abs() < 1e-12, "{area}");
    assert_eq!((mesh.triangles.len(), warnings), (8, vec![]));
}

#[test]
fn what_is_left_out_is_told_with_its_line() {
    let text = format!("{SQUARE}f\nf 1 2\nl 1 2\np 1\ncurv 1 2\nhello 3\nf 1 2 3 4\n");
    let (mesh, warnings) = read(&text);
    assert_eq!(corners(&mesh), square_corners());
    for (line, words) in [
        (5, "fewer than three corners are left out (2 in the file)"),
        (7, "points and lines are left out"),
        (9, "curves and surfaces are not supported"),
        (10, "unknown statement `hello`"),
    ] {
        let found = warnings.iter().any(|w| w.starts_with(&format!("a.obj:{line}: ")) && w.contains(words));
        assert!(found, "{line} {words}: {warnings:#?}");
    }
    assert_eq!(warnings.len(), 4);
}

#[test]
fn broken_lines_are_refused_with_their_number() {
    for (lines, place, words) in [
        ("f 1 2 5", "a.obj:5: ", "names vertex 5, but the file has 4"),
        ("f 1 2 3\nf 1 2 99999999999", "a.obj:6: ", "99999999999"),
        ("f 1 2 99999999999999999999", "a.obj:5: ", "whole numbers"),
        ("f 0 1 2", "a.obj:5: ", "counted from 1"),
        ("f -5 1 2", "a.obj:5: ", "counts 5 back, but only 4 vertex lines"),
        ("f 1 2 x", "a.obj:5: ", "`x` is no corner"),
        ("f 1 2 1.5", "a.obj:5: ", "`v/vt/vn` was expected"),
        ("f 1/1/1/1 2 3", "a.obj:5: ", "no corner"),
        ("f 1/x 2 3", "a.obj:5: ", "no corner"),
        ("f 1// 2 /3", "a.obj:5: ", "`/3` is no corner"),
        ("v 1 2\nf 1 2 3", "a.obj:5: ", "`v 1 2`: three numbers were expected"),
        ("v 1 2 three", "a.obj:5: ", "three numbers"),
        ("v 1,5 2 3", "a.obj:5: ", "three numbers"),
        ("v 0 0 1.#INF\nf 1 2 5", "a.obj:5: ", "not finite"),
        ("# c\n\nv nan 0 0\nf 1 2 5", "a.obj:7: ", "not finite"),
        ("v 0 inf 0\nf 1 2 -1", "a.obj:5: ", "not finite"),
        ("f 1 2 5\nv 0 0 1e39", "a.obj:6: ", "beyond 1e30"),
    ] {
        let message = refusal(&format!("{SQUARE}{lines}\n"));
        assert!(message.starts_with(place) && message.contains(words), "{lines:?}: {message}");
    }
}

#[test]
fn vertices_that_are_not_finite_and_not_used_are_counted() {
    let (mesh, warnings) = read(&format!("{SQUARE}v nan nan nan\nv 1e39 0 0\nf 1 2 3 4"));
    assert_eq!(corners(&mesh), square_corners());
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].starts_with("a.obj:5: 2 vertices that no face uses"), "{warnings:?}");
}

#[test]
fn files_without_faces_are_refused() {
    for (text, words) in [
        ("", "the file is empty"),
        (SQUARE, "a cloud of 4 points"),
        ("g empty\no group\n", "needs at least one `f` line"),
        ("\u{0}\u{1}\u{2}", "binary data"),
        ("v \u{0}\u{1}\u{2}\n", "binary data"),
        ("f\nf 1\n", "its 2 faces have fewer than three corners"),
        ("[[model]]\nfile = 'a.obj'\n", "this is TOML"),
    ] {
        let message = refusal(text);
        assert!(
            message.starts_with("a.obj: no faces in the file") && message.contains(words),
            "{text:?}: {message}"
        );
    }
    let message =
        load(Path::new("no/such.obj"), Uvs::Textured, LoadOptions::default()).unwrap_err().to_string();
    assert!(message.starts_with("cannot read no/such.obj: "), "{message}");
}

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
fn libraries_are_found_beside_the_model_only() {
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
    // What names another place is found in the model's folder, with a note.
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
fn a_library_named_like_the_model_is_taken_where_the_named_one_is_not_there() {
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
fn libraries_that_are_none_are_named_for_what_they_are() {
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

/// A mesh of polygons, each with its corners as indices counted from 0.
#[derive(Clone, Debug)]
struct Polygons {
    vertices: Vec<[f64; 3]>,
    faces: Vec<Vec<usize>>,
}

fn polygons() -> impl Strategy<Value = Polygons> {
    let coordinate = prop_oneof![-1e6..1e6f64, Just(0.0), -1e-9..1e-9f64, 1e20..1e25f64];
    prop::collection::vec(prop::array::uniform3(coordinate), 3..30).prop_flat_map(|vertices| {
        let face = prop::collection::vec(0..vertices.len(), 3..7);
        (Just(vertices), prop::collection::vec(face, 1..20))
            .prop_map(|(vertices, faces)| Polygons { vertices, faces })
    })
}

/// How a writer might write it down.
#[derive(Clone, Copy, Debug)]
struct Style {
    negative: bool,
    crlf: bool,
    comments: bool,
    continued: bool,
    groups: bool,
    texture: bool,
}

fn style() -> impl Strategy<Value = Style> {
    any::<[bool; 6]>().prop_map(|[negative, crlf, comments, continued, groups, texture]| Style {
        negative,
        crlf,
        comments,
        continued,
        groups,
        texture,
    })
}

fn write(polygons: &Polygons, style: Style) -> String {
    let comment = if style.comments { " # 1 2 3" } else { "" };
    let gap = if style.continued { " \\\n" } else { " " };
    let mut text = String::new();
    for [x, y, z] in &polygons.vertices {
        writeln!(text, "v {x:e}{gap}{y} {z:?}{comment}").unwrap();
    }
    for (i, face) in polygons.faces.iter().enumerate() {
        if style.groups && i % 3 == 0 {
            writeln!(text, "o part {i}\nusemtl m{}", i % 2).unwrap();
        }
        text.push('f');
        for vertex in face {
            let index = *vertex as i64;
            let index = if style.negative { index - polygons.vertices.len() as i64 } else { index + 1 };
            write!(text, "{gap}{index}").unwrap();
            if style.texture {
                text.push_str("/1");
            }
        }
        writeln!(text, "{comment}").unwrap();
    }
    if style.crlf { text.replace('\n', "\r\n") } else { text }
}

proptest! {
    #[test]
    fn what_is_written_is_read(polygons in polygons(), style in style()) {
        let (mesh, _) = read(&write(&polygons, style));
        let point = |vertex: usize| DVec3::from_array(polygons.vertices[vertex]);
        let expected: Vec<[DVec3; 3]> = polygons
            .faces
            .iter()
            .flat_map(|face| {
                let points: Vec<DVec3> = face.iter().map(|&vertex| point(vertex)).collect();
                let mut triangles = Vec::new();
                match points.len() {
                    3 => triangles.push([0, 1, 2]),
                    _ => polygon::cut(&points, &mut triangles),
                }
                triangles.into_iter().map(move |triangle| triangle.map(|corner: u32| points[corner as usize])).collect::<Vec<_>>()
            })
            .collect();
        prop_assert_eq!(corners(&mesh), expected);
        prop_assert_eq!(mesh.triangle_materials.len(), mesh.triangles.len());
    }

    #[test]
    fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = load_files(&[("a.obj", &bytes)]);
    }

    #[test]
    fn any_statements_are_read_or_refused(lines in prop::collection::vec(statement(), 0..30)) {
        let text = lines.concat();
        if let Ok((mesh, _)) = load_files(&[("a.obj", text.as_bytes()), ("a.mtl", text.as_bytes())]) {
            prop_assert!(!mesh.triangles.is_empty());
            prop_assert!(mesh.triangles.iter().flatten().all(|v| (*v as usize) < mesh.positions.len()));
            prop_assert!(mesh.positions.iter().all(|p| p.is_finite()));
            prop_assert!(mesh.normals.is_empty() || mesh.normals.len() == mesh.positions.len());
            prop_assert!(mesh.normals.iter().all(|n| n.is_finite()));
            prop_assert!(mesh.triangle_materials.iter().all(|s| (*s as usize) < mesh.materials.len()));
            prop_assert!(mesh.uvs.is_empty() || mesh.uvs.len() == mesh.triangles.len());
            prop_assert!(mesh.uvs.iter().flatten().all(|uv| uv.is_finite()));
        }
    }
}

/// Statements of both languages, sound and unsound.
fn statement() -> impl Strategy<Value = String> {
    let number =
        || prop_oneof!["-?[0-9]{1,3}", Just("nan".to_owned()), Just("1e39".to_owned()), Just("x".to_owned())];
    let index = || prop_oneof![5 => "[1-6]", 1 => "-[1-9]", 1 => "[1-6]//[1-3]", 1 => "[0-9]{0,3}/[0-9]{0,2}/[0-9]{0,2}"];
    prop_oneof![
        4 => prop::collection::vec("[0-9]", 3).prop_map(|n| format!("v {}\n", n.join(" "))),
        1 => prop::collection::vec(number(), 0..5).prop_map(|n| format!("v {}\n", n.join(" "))),
        1 => prop::collection::vec("[0-9]", 3).prop_map(|n| format!("vn {}\n", n.join(" "))),
        4 => prop::collection::vec(index(), 0..6).prop_map(|n| format!("f {}\n", n.join(" "))),
        1 => (prop::sample::select(vec!["Kd", "Ks", "Ns", "d", "illum", "map_Kd", "bump", "Tf"]),
              prop::collection::vec(number(), 0..5)).prop_map(|(k, n)| format!("{k} {}\n", n.join(" "))),
        1 => prop::sample::select(vec!["usemtl a\n", "usemtl\n", "newmtl a\n", "newmtl\n", "mtllib a.mtl\n",
                                       "mtllib a.obj ../b\n", "o\n", "g x y\n", "\\\n", "#\\\n", "\r\n"])
            .prop_map(str::to_owned),
    ]
}
