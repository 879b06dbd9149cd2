//! One model in many styles of notation, and arbitrary statements.

use super::*;

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

/// A style of notation.
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

/// Statements of OBJ and MTL, valid and invalid.
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
