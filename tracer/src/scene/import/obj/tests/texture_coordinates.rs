//! Texture coordinates of corners.

use super::*;

#[test]
fn seams_of_texture_coordinates_do_not_split_vertices() {
    let (mesh, _) = read(&format!("{SQUARE}vt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 1/2 3/2 4/2"));
    assert_eq!(mesh.positions.len(), 4);
    assert_eq!(mesh.triangles[0][0], mesh.triangles[1][0]);
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
fn texture_coordinates_are_read_only_where_they_are_requested() {
    let text = format!("{WOODEN}usemtl red\nvt 0 0\nf 1/1 2/1 3/1\n");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, &text).unwrap();
    std::fs::write(folder.path().join(WOOD.0), WOOD.1).unwrap();
    for (requested, count) in [(Uvs::Never, 0), (Uvs::Textured, 0), (Uvs::Always, 1)] {
        assert_eq!(
            load(&path, requested, LoadOptions::default()).unwrap().0.uvs.len(),
            count,
            "{requested:?}"
        );
    }
    std::fs::write(&path, text.replace("usemtl red", "usemtl wood")).unwrap();
    for (requested, count) in [(Uvs::Never, 0), (Uvs::Textured, 1), (Uvs::Always, 1)] {
        assert_eq!(
            load(&path, requested, LoadOptions::default()).unwrap().0.uvs.len(),
            count,
            "{requested:?}"
        );
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
