//! Models in all common notations, broken models, and arbitrary models.

mod libraries;
mod normals;
mod styles;
mod texture_coordinates;

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

/// A square whose first triangle has a variable position in the picture.
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
fn polygons_are_triangulated_and_faces_may_precede_their_vertices() {
    let (mesh, _) = read("f 1 2 3 4 5\nv 0 0 0\nv 2 0 0\nv 3 1 0\nv 2 2 0\nv 0 2 0\n");
    let [a, b, c, d, e] =
        [(0., 0.), (2., 0.), (3., 1.), (2., 2.), (0., 2.)].map(|(x, y)| DVec3::new(x, y, 0.0));
    assert_eq!(corners(&mesh), [[a, b, c], [a, c, d], [a, d, e]]);
}

#[test]
fn weights_colours_and_short_texture_coordinates_are_accepted() {
    let text =
        "v 0 0 0 1.0\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0 1 0 0 1\nv 0 1 0\nvt 0.5\nvt 0 0 0\nf 1/1 2/2 3/1 4/2\n";
    let (mesh, warnings) = read(text);
    assert_eq!((corners(&mesh), warnings), (square_corners(), vec![]));
}

#[test]
fn digits_far_from_the_origin_are_kept() {
    let (mesh, _) = read("v 10000000.001 0 0\nv 10000000.002 0 0 1.0\nv 1e7 1 0 0.5 0.5 0.5\nf 1 2 3");
    assert_eq!(mesh.positions[0].x, 10_000_000.001);
    assert_eq!(mesh.positions[1].x, 10_000_000.002);
}

#[test]
fn normals_of_the_file_are_normalised() {
    let (mesh, warnings) = read(&format!("{SQUARE}vn 0 0 5\nvn 3 0 4\nf 1//1 2//2 3//1\nf 1//2 3//1 4//1"));
    assert_eq!(warnings, [""; 0]);
    // Corner 1 has two normals, so it becomes two vertices.
    assert_eq!((mesh.positions.len(), mesh.normals.len()), (5, 5));
    assert_eq!(mesh.normals[mesh.triangles[0][0] as usize], Vec3::Z);
    assert!((mesh.normals[mesh.triangles[1][0] as usize] - Vec3::new(0.6, 0.0, 0.8)).length() < 1e-6);
}

#[test]
fn concave_polygons_and_their_texture_coordinates_are_triangulated_alike() {
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
fn ignored_statements_are_reported_with_their_lines() {
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
