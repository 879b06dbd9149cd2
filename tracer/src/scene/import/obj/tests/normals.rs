//! Normals at the corners of compiled meshes, where the file has all, some or none of them.

use glam::Vec3;

use super::*;
use crate::mesh::CompiledMesh;

const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n";
const SIDES: [&str; 6] =
    ["f 5 6 7 8\n", "f 2 1 4 3\n", "f 6 2 3 7\n", "f 1 5 8 4\n", "f 8 7 3 4\n", "f 1 2 6 5\n"];

fn compiled(text: &str) -> (CompiledMesh, Vec<String>) {
    let (mesh, warnings) = read(text);
    let (compiled, _) = CompiledMesh::compile(&mesh).unwrap();
    (compiled, warnings)
}

/// The geometric normal of every triangle, and the normals at its corners with the corners.
fn corners_of(mesh: &CompiledMesh) -> Vec<(Vec3, [(Vec3, Vec3); 3])> {
    let of = |triangle: u32| {
        let [a, b, c] = mesh.corners(triangle);
        let [na, nb, nc] = mesh.corner_normals(triangle).unwrap();
        ((b - a).cross(c - a).normalize(), [(a, na), (b, nb), (c, nc)])
    };
    mesh.triangles().map(of).collect()
}

fn assert_flat(text: &str) -> Vec<String> {
    let (mesh, warnings) = compiled(text);
    assert_eq!(mesh.triangle_count(), 12, "{text}");
    if mesh.has_normals() {
        for (face, corners) in corners_of(&mesh) {
            assert!(
                corners.iter().all(|(_, normal)| normal.dot(face) > 0.999_999),
                "{text}: {face} {corners:?}"
            );
        }
    }
    warnings
}

#[test]
fn a_cube_is_flat_without_smoothing_with_a_group_a_side_and_by_its_creases() {
    let groups: String = (1..).zip(SIDES).map(|(group, side)| format!("s {group}\n{side}")).collect();
    for faces in [
        format!("s off\n{}", SIDES.concat()),
        format!("s 0\n{}", SIDES.concat()),
        groups,
        SIDES.concat(),
        format!("{}s off\n{}", SIDES[0], SIDES[1..].concat()),
    ] {
        let text = format!("{CUBE}{faces}");
        assert_eq!(assert_flat(&text), [""; 0], "{text}");
    }
    let (flat, _) = compiled(&format!("{CUBE}s off\n{}", SIDES.concat()));
    assert!(!flat.has_normals(), "a mesh that is flat everywhere pays for no normals");
}

#[test]
fn a_group_is_smooth_over_any_angle() {
    let (mesh, _) = compiled(&format!("{CUBE}s 1\n{}", SIDES.concat()));
    for (face, corners) in corners_of(&mesh) {
        for (place, normal) in corners {
            // The average of the three sides at that corner, and not the normal of one of them.
            assert!(normal.dot(place.normalize()) > 0.9 && normal.dot(face) < 0.9, "{place} {normal}");
        }
    }
    let odd = compiled(&format!("{CUBE}s x\n{}", SIDES.concat())).1;
    assert!(odd.len() == 1 && odd[0].starts_with("a.obj:9: a smoothing group"), "{odd:?}");
}

/// A prism around the y axis with two caps.
fn prism(sides: usize, [side, cap]: [&str; 2]) -> String {
    let ring = |y: f64| {
        (0..sides).map(move |i| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / sides as f64).sin_cos();
            format!("v {cos} {y} {sin}\n")
        })
    };
    let vertices: String = ring(-1.0).chain(ring(1.0)).collect();
    let wall = |i: usize| {
        let next = (i + 1) % sides;
        format!("f {} {} {} {}\n", i + 1, i + 1 + sides, next + 1 + sides, next + 1)
    };
    let walls: String = (0..sides).map(wall).collect();
    let top: String = (0..sides).rev().map(|i| format!(" {}", i + 1 + sides)).collect();
    let bottom: String = (0..sides).map(|i| format!(" {}", i + 1)).collect();
    format!("{vertices}{side}{walls}{cap}f{top}\nf{bottom}\n")
}

#[test]
fn a_cylinder_is_smooth_around_and_has_a_sharp_rim() {
    for (sides, smoothing) in
        [(16, ["s 1\n", "s off\n"]), (16, ["s 1\n", "s 2\n"]), (16, ["", ""]), (9, ["", ""])]
    {
        let (mesh, _) = compiled(&prism(sides, smoothing));
        for (face, corners) in corners_of(&mesh) {
            for (place, normal) in corners {
                if face.y.abs() > 0.5 {
                    assert!(normal.dot(face) > 0.999_999, "a cap is flat: {normal} on {face}");
                    continue;
                }
                let out = Vec3::new(place.x, 0.0, place.z).normalize();
                assert!(normal.dot(out) > 0.98 && normal.y.abs() < 1e-6, "{sides}: {normal} at {place}");
                assert!(normal.dot(face) < 0.999, "{sides}: the side is smooth");
            }
        }
    }
    // Angles of 45 degrees are more than 40.
    let (mesh, _) = compiled(&prism(8, ["", ""]));
    assert!(
        corners_of(&mesh).iter().flat_map(|(face, c)| c.map(|(_, n)| n.dot(*face))).all(|cos| cos > 0.9999)
    );
}

#[test]
fn the_crease_angle_may_be_another() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, prism(8, ["", ""])).unwrap();
    let walls_are_smooth = |degrees: f64| {
        let options = LoadOptions { crease_angle: Some(degrees), ..LoadOptions::default() };
        let (mesh, _) = load(&path, Uvs::Textured, options).unwrap();
        let (mesh, _) = CompiledMesh::compile(&mesh).unwrap();
        let walls = corners_of(&mesh).into_iter().filter(|(face, _)| face.y.abs() < 0.5);
        let smooth = walls.map(|(face, corners)| corners.iter().any(|(_, normal)| normal.dot(face) < 0.999));
        smooth.collect::<Vec<_>>()
    };
    assert!(walls_are_smooth(50.0).into_iter().all(|smooth| smooth));
    assert!(!walls_are_smooth(30.0).into_iter().any(|smooth| smooth));
}

#[test]
fn two_sides_of_a_wall_do_not_cancel_out() {
    let house = "v -2 0 -2\nv 2 0 -2\nv 2 2.5 -2\nv -2 2.5 -2\nv -2 0 2\nv -2 2.5 2\n";
    for smoothing in ["", "s 1\n"] {
        let text = format!("{house}{smoothing}f 1 2 3 4\nf 4 3 2 1\nf 5 1 4 6\nf 6 4 1 5\n");
        let (mesh, _) = compiled(&text);
        // The other diagonal: no triangle is duplicated.
        assert_eq!(mesh.triangle_count(), 8);
        for (face, corners) in corners_of(&mesh) {
            for (place, normal) in corners {
                assert!((normal.length() - 1.0).abs() < 1e-6, "{normal} at {place}");
                // A group is smooth around the corner of the building, but each side has its own normals.
                let least = if smoothing.is_empty() { 0.999 } else { 0.4 };
                assert!(normal.dot(face) > least, "{smoothing:?}: {normal} on {face} at {place}");
            }
        }
    }
}

#[test]
fn a_face_with_its_corners_the_wrong_way_round_is_smooth_with_its_neighbours() {
    // A low ridge whose second half has the opposite winding.
    let ridge = "v 0 0 0\nv 1 0.1 0\nv 2 0 0\nv 0 0 1\nv 1 0.1 1\nv 2 0 1\n";
    let (mesh, _) = compiled(&format!("{ridge}f 1 4 5 2\nf 2 3 6 5\n"));
    for (face, corners) in corners_of(&mesh) {
        for (place, normal) in corners {
            assert!(normal.dot(face) > 0.99, "{normal} on {face}");
            // Vertical on the ridge, whichever side the face shows.
            if place.x.abs() < 0.1 {
                assert!(normal.y.abs() > 0.999, "{normal} at {place}");
            }
        }
    }
}

#[test]
fn normals_that_are_not_there_or_no_directions_are_averaged_with_one_warning() {
    let named: String = (1..)
        .zip(SIDES)
        .map(|(normal, side)| {
            let corners = side.trim_start_matches("f ").split_whitespace();
            format!(
                "f {}\n",
                corners.map(|corner| format!("{corner}//{normal}")).collect::<Vec<_>>().join(" ")
            )
        })
        .collect();
    let front = "vn 0 0 1\n";
    let unusable = "vn 0 0 0\nvn -1.#IND 0 1.#QNAN\nvn nan(ind) 0 1\nvn 1,5 0 0\nvn 1\n";
    for (normals, parts) in [
        ("", &["24 name a normal that is not in the file"][..]),
        (front, &["20 name a normal that is not in the file"]),
        (&format!("{front}{unusable}"), &["20 name one that is zero or not finite"]),
        (
            &format!("{front}vn 0 0 0\n"),
            &["16 name a normal that is not in the file", "4 name one that is zero"],
        ),
    ] {
        let text = format!("{CUBE}{normals}{named}");
        let warnings = assert_flat(&text);
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].starts_with("a.obj: of 24 corners of faces, "), "{warnings:?}");
        assert!(parts.iter().all(|part| warnings[0].contains(part)), "{warnings:?}");
    }
    for odd in ["0", "-1", "99999999999"] {
        let warnings =
            assert_flat(&format!("{CUBE}{}f 1//{odd} 2//{odd} 6//{odd} 5//{odd}\n", SIDES[..5].concat()));
        assert!(warnings.len() == 1 && warnings[0].contains("20 have none"), "{warnings:?}");
    }
}

#[test]
fn normals_that_are_given_stay_where_others_are_missing() {
    let tilted = Vec3::new(0.6, 0.0, 0.8);
    let (mesh, warnings) =
        compiled(&format!("{CUBE}vn 0.6 0 0.8\nf 5//1 6//1 7//1 8//1\n{}", SIDES[1..].concat()));
    for (face, corners) in corners_of(&mesh) {
        let expected = if face.z > 0.5 { tilted } else { face };
        assert!(corners.iter().all(|(_, normal)| normal.dot(expected) > 0.999_999), "{face} {corners:?}");
    }
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].contains("24") && warnings[0].contains("20"), "{warnings:?}");
}

#[test]
fn seams_of_parts_are_smooth_unless_the_file_has_normals() {
    let parts = "v 0 0 0\nv 1 0.1 0\nv 1 0.1 1\nv 0 0 1\nv 1 0.1 -0.0\nv 2 0 0\nv 2 0 1\nv 1 0.1 1\n";
    let (mesh, _) = compiled(&format!("{parts}f 1 4 3 2\nf 5 8 7 6\n"));
    for (_, corners) in corners_of(&mesh) {
        for (place, normal) in corners.into_iter().filter(|(place, _)| place.x.abs() < 0.1) {
            assert!(normal.y > 0.999, "{normal} at {place}");
        }
    }
    let (mesh, _) = read(&format!("{parts}vn 0 0 1\nf 1//1 2//1 3//1\nf 5//1 6//1 8//1\n"));
    assert_eq!(mesh.positions.len(), 6);
}

#[test]
fn a_sphere_without_creases_is_averaged_over_all_faces() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/globe/ball.obj");
    let (mesh, _) = load(&path, Uvs::Always, LoadOptions::default()).unwrap();
    let everywhere = Mesh { smoothing: crate::mesh::Smoothing::Full, ..mesh.clone() };
    assert_ne!(mesh.smoothing, everywhere.smoothing);
    let id = |mesh: &Mesh| CompiledMesh::compile(mesh).unwrap().0.id();
    assert_eq!(id(&mesh), id(&everywhere));
}
