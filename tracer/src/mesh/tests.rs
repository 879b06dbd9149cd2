//! Cleaning, the round trip through bytes, and invalid bytes.

use glam::{DVec2, DVec3, Vec2, Vec3};
use proptest::prelude::*;

use super::*;
use crate::texture::{Wrap, without_repeats};

fn mesh(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    let triangle_materials = vec![0; triangles.len()];
    let materials = vec![NamedMaterial::plain("clay", Material::NEUTRAL)];
    Mesh { positions, triangles, triangle_materials, materials, ..Mesh::default() }
}

/// A bumpy sheet of n x n squares.
fn sheet(n: u32) -> Mesh {
    let at = |x: u32, y: u32| y * (n + 1) + x;
    let height = |x: u32, y: u32| f64::from((x * 7 + y * 13) % 5) * 0.1;
    let positions = (0..=n)
        .flat_map(|y| (0..=n).map(move |x| DVec3::new(f64::from(x), height(x, y), f64::from(y))))
        .collect();
    let squares = (0..n).flat_map(|y| (0..n).map(move |x| (x, y)));
    let triangles = squares
        .flat_map(|(x, y)| {
            [[at(x, y), at(x + 1, y), at(x + 1, y + 1)], [at(x, y), at(x + 1, y + 1), at(x, y + 1)]]
        })
        .collect();
    mesh(positions, triangles)
}

/// The sheet with texture coordinates, and a slot with a texture.
fn textured(n: u32) -> Mesh {
    let mut mesh = sheet(n);
    let uv = |v: u32| DVec2::new(mesh.positions[v as usize].x, mesh.positions[v as usize].z * 0.5);
    mesh.uvs = mesh.triangles.iter().map(|t| without_repeats(t.map(uv)).unwrap()).collect();
    mesh.materials[0].texture = Some(TextureFile::new("maps/clay.png"));
    mesh
}

/// All corners, in the order of the blocks.
fn corners(mesh: &CompiledMesh) -> Vec<[Vec3; 3]> {
    mesh.triangles().map(|i| mesh.corners(i)).collect()
}

#[test]
fn untraceable_triangles_are_dropped_and_counted() {
    let positions = vec![
        DVec3::ZERO,
        DVec3::X,
        DVec3::Y,
        DVec3::new(f64::NAN, 0.0, 0.0),
        DVec3::new(1e300, 0.0, 0.0),
        DVec3::X * 2.0,
    ];
    let triangles =
        vec![[0, 1, 2], [2, 0, 1], [0, 2, 1], [0, 1, 5], [1, 1, 2], [0, 1, 3], [0, 1, 4], [0, 5, 2]];
    let (compiled, report) = CompiledMesh::compile(&mesh(positions, triangles)).unwrap();
    assert_eq!(report, MeshReport { dropped_degenerate: 2, dropped_duplicate: 2, dropped_not_finite: 2 });
    assert_eq!(compiled.triangle_count(), 2);
    assert_eq!(compiled.bounds(), (DVec3::ZERO, DVec3::new(2.0, 1.0, 0.0)));
}

#[test]
fn a_mesh_with_nothing_left_is_refused() {
    let error = CompiledMesh::compile(&mesh(vec![DVec3::ZERO; 3], vec![[0, 1, 2]])).unwrap_err();
    assert!(error.to_string().contains("no triangle left"), "{error}");
}

#[test]
fn inconsistent_arrays_are_refused() {
    let error = CompiledMesh::compile(&mesh(vec![DVec3::ZERO], vec![[0, 1, 2]])).unwrap_err();
    assert!(error.to_string().contains("vertex 1"), "{error}");
    let mut short = sheet(2);
    short.triangle_materials.pop();
    assert!(CompiledMesh::compile(&short).unwrap_err().to_string().contains("material slots"));
}

#[test]
fn twenty_thousand_copies_of_one_triangle_become_one() {
    let (compiled, report) =
        CompiledMesh::compile(&mesh(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]; 20_000])).unwrap();
    assert_eq!((compiled.triangle_count(), report.dropped_duplicate), (1, 19_999));
}

#[test]
fn bytes_round_trip() {
    let (compiled, _) = CompiledMesh::compile(&sheet(20)).unwrap();
    let again = CompiledMesh::from_bytes(compiled.bytes()).unwrap();
    assert_eq!(again.id(), compiled.id());
    assert_eq!(again.bytes(), compiled.bytes());
    assert_eq!(again.materials(), compiled.materials());
    assert_eq!(again.triangle_count(), 800);
    assert!(again.corner_normals(0).is_some());
}

#[test]
fn normals_are_left_out_if_not_requested() {
    let (flat, _) = CompiledMesh::compile_with(
        &sheet(20),
        CompileOptions { normals: false, ..CompileOptions::default() },
    )
    .unwrap();
    let (smooth, _) = CompiledMesh::compile(&sheet(20)).unwrap();
    assert!(flat.bytes().len() < smooth.bytes().len());
    assert_eq!((flat.has_normals(), flat.corner_normals(0)), (false, None));
}

#[test]
fn the_parts_of_a_mesh_are_all_of_its_bytes() {
    let (plain, rich) = (sheet(20), textured(20));
    let flat = CompileOptions { normals: false, ..CompileOptions::default() };
    let (plain, _) = CompiledMesh::compile_with(&plain, flat).unwrap();
    let (rich, _) = CompiledMesh::compile(&rich).unwrap();
    for mesh in [&plain, &rich] {
        let memory = mesh.memory();
        assert_eq!(memory.total_bytes(), mesh.bytes().len());
        assert!(memory.lanes >= mesh.triangle_count() && memory.nodes > 0 && memory.rest_bytes >= 128);
    }
    assert_eq!((plain.memory().normal_bytes, plain.memory().uv_bytes), (0, 0));
    assert_eq!(rich.memory().uv_bytes, rich.memory().full_uv_bytes());
    assert!(rich.memory().normal_bytes > rich.memory().least_normal_bytes());
}

#[test]
fn texture_coordinates_and_names_round_trip() {
    let mut source = textured(9);
    // Cleaning drops one triangle with its coordinates.
    source.triangles[5] = [0; 3];
    let (compiled, report) = CompiledMesh::compile(&source).unwrap();
    assert_eq!(report.dropped_degenerate, 1);
    let again = CompiledMesh::from_bytes(compiled.bytes()).unwrap();
    assert!(again.has_uvs());
    for triangle in again.triangles() {
        assert_eq!(again.corner_uvs(triangle), Some(source.uvs[again.source(triangle) as usize]));
    }
    assert_eq!(again.materials()[0].texture, Some(TextureFile::new("maps/clay.png")));
    let (plain, _) = CompiledMesh::compile(&sheet(9)).unwrap();
    assert_eq!((plain.has_uvs(), plain.corner_uvs(0)), (false, None));
    assert!(plain.bytes().len() < compiled.bytes().len());
}

#[test]
fn new_material_slots_change_nothing_else() {
    let (compiled, _) = CompiledMesh::compile(&textured(5)).unwrap();
    let mut materials = compiled.materials();
    materials[0].texture = Some(TextureFile::new("../elsewhere/a much longer name than before.png"));
    let changed = compiled.with_materials(&materials).unwrap();
    assert_eq!(changed.materials(), materials);
    assert_eq!(corners(&changed), corners(&compiled));
    assert_eq!(changed.corner_uvs(3), compiled.corner_uvs(3));
    assert_eq!(changed.with_materials(&compiled.materials()).unwrap().id(), compiled.id());
}

/// A mesh with all attributes of slots and triangles.
fn rich(n: u32) -> Mesh {
    let mut mesh = textured(n);
    mesh.uv_repeats = (0..mesh.triangles.len()).map(|i| Vec2::new(i as f32 - 3.0, 7.0)).collect();
    mesh.colors =
        (0..mesh.triangles.len()).map(|i| [[i as u8, 1, 2], [3, i as u8, 5], [6, 7, i as u8]]).collect();
    let tiling = Tiling { wrap: Wrap::Mirror, scale: Vec2::new(3.0, -1.5), offset: Vec2::new(0.25, 0.0) };
    let slot = &mut mesh.materials[0];
    slot.cutout = Some(TextureFile { file: "maps/holes.png".into(), tiling });
    slot.emission_texture = Some(TextureFile::new("lamp.png"));
    slot.material = Material { emission: Vec3::new(9.0, 0.5, 0.0), unlit: true, ..slot.material };
    mesh
}

#[test]
fn mirrors_and_glass_of_slots_round_trip() {
    let (compiled, _) = CompiledMesh::compile(&textured(5)).unwrap();
    let mut materials = compiled.materials();
    let plain_length = compiled.bytes().len();
    for (reflect, transmit, thin, fresnel) in [
        (Vec3::new(0.5, 0.25, 1.0), Vec3::ZERO, false, false),
        (Vec3::ZERO, Vec3::new(0.0, 0.75, 0.0), true, false),
        (Vec3::ONE, Vec3::ONE, false, true),
    ] {
        let material = &mut materials[0].material;
        *material = Material { reflect, transmit, ior: 1.25, thin, fresnel, ..*material };
        let changed = compiled.with_materials(&materials).unwrap();
        assert_eq!(CompiledMesh::from_bytes(changed.bytes()).unwrap().materials(), materials);
        assert!(changed.bytes().len() >= plain_length + 28);
    }
    materials[0].material.reflect.x = 1.5;
    let changed = compiled.with_materials(&materials);
    let read = changed.and_then(|changed| CompiledMesh::from_bytes(changed.bytes()));
    assert!(read.is_err_and(|error| error.to_string().contains("more than all light")));
}

#[test]
fn repeats_colours_and_slots_round_trip() {
    let mut source = rich(9);
    source.triangles[5] = [0; 3];
    let (compiled, _) = CompiledMesh::compile(&source).unwrap();
    let again = CompiledMesh::from_bytes(compiled.bytes()).unwrap();
    assert!(again.has_colors());
    for triangle in again.triangles() {
        let from = again.source(triangle) as usize;
        assert_eq!(again.whole_repeats(triangle), source.uv_repeats[from]);
        assert_eq!(again.corner_colors(triangle), Some(source.colors[from]));
    }
    assert_eq!(again.materials(), source.materials);
    assert_eq!(again.memory().color_bytes, again.memory().full_color_bytes());
    let (plain, _) = CompiledMesh::compile(&textured(9)).unwrap();
    assert_eq!(
        (plain.has_colors(), plain.corner_colors(0), plain.whole_repeats(0)),
        (false, None, Vec2::ZERO)
    );
    assert_eq!(plain.memory().color_bytes, 0);
    for (spoil, what) in [
        (&(|mesh: &mut Mesh| mesh.colors.truncate(7)) as &dyn Fn(&mut Mesh), "colours of vertices for 7"),
        (&|mesh| mesh.uv_repeats.truncate(7), "whole repeats of texture coordinates for 7"),
        (&|mesh| mesh.uv_repeats[1].x = f32::NAN, "a number of whole repeats is not finite"),
        (&|mesh| mesh.materials[0].cutout.as_mut().unwrap().tiling.scale.x = 1e7, "unknown wrap"),
        (&|mesh| mesh.materials[0].material.emission.x = -1.0, "not in 0..1e9"),
    ] {
        let mut mesh = rich(2);
        spoil(&mut mesh);
        let error = CompiledMesh::compile(&mesh).unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    }
}

#[test]
fn the_previous_version_is_read() {
    let (compiled, _) = CompiledMesh::compile(&textured(4)).unwrap();
    let start = compiled.bytes().len() - compiled.header().material_bytes as usize;
    let mut old = compiled.bytes()[..start].to_vec();
    for number in [0.25_f32, 0.5, 0.75, 0.0, 0.125, 1.0, 12.0] {
        old.extend_from_slice(&number.to_le_bytes());
    }
    old.extend_from_slice(b"\x04clay\x0d\x00maps/clay.png");
    let mut header = blob::Header { version: OLDEST_FORMAT_VERSION, ..*compiled.header() };
    header.material_bytes = (old.len() - start) as u32;
    // The reserved fields of that version are ignored.
    (header.repeat_count, header.color_count) = (7, 9);
    old[..size_of::<blob::Header>()].copy_from_slice(bytemuck::bytes_of(&header));
    let read = CompiledMesh::from_bytes(&old).unwrap();
    assert_eq!((corners(&read), read.corner_uvs(3)), (corners(&compiled), compiled.corner_uvs(3)));
    let slot = &read.materials()[0];
    assert_eq!((slot.name.as_str(), &slot.texture), ("clay", &Some(TextureFile::new("maps/clay.png"))));
    let material = Material {
        diffuse: Vec3::new(0.25, 0.5, 0.75),
        specular: Vec3::new(0.0, 0.125, 1.0),
        exponent: 12.0,
        ..Material::NEUTRAL
    };
    assert_eq!(slot.material, material);
    // New slots are written in the newest version.
    let changed = read.with_materials(&rich(1).materials).unwrap();
    assert_eq!(changed.materials(), rich(1).materials);
    assert!(!changed.has_colors());
}

#[test]
fn broken_texture_coordinates_are_refused() {
    let mut short = textured(2);
    short.uvs.pop();
    let error = CompiledMesh::compile(&short).unwrap_err().to_string();
    assert!(error.contains("8 triangles but texture coordinates for 7"), "{error}");
    for odd in [f32::NAN, f32::INFINITY, -1e8, 1e8] {
        let mut mesh = textured(2);
        mesh.uvs[3][1] = Vec2::new(0.5, odd);
        let error = CompiledMesh::compile(&mesh).unwrap_err().to_string();
        assert!(error.contains("texture coordinate"), "{odd}: {error}");
    }
}

#[test]
fn averaged_normals_of_a_flat_sheet_are_vertical() {
    let mut flat = sheet(4);
    flat.positions.iter_mut().for_each(|position| position.y = 0.0);
    let (compiled, _) = CompiledMesh::compile(&flat).unwrap();
    for normal in compiled.corner_normals(0).unwrap() {
        assert_eq!(normal.abs(), Vec3::Y);
    }
}

#[test]
fn scaling_by_a_power_of_two_changes_only_the_header() {
    let (small, _) = CompiledMesh::compile(&sheet(6)).unwrap();
    for exponent in [-40, -3, 17, 40] {
        let mut scaled = sheet(6);
        scaled.positions.iter_mut().for_each(|position| *position *= f64::from(exponent).exp2());
        let (large, _) = CompiledMesh::compile(&scaled).unwrap();
        assert_eq!(corners(&large), corners(&small));
        assert_eq!(large.exponent(), small.exponent() + exponent);
    }
}

#[test]
fn a_mesh_far_from_its_origin_keeps_its_digits() {
    let (near, _) = CompiledMesh::compile(&sheet(6)).unwrap();
    let mut moved = sheet(6);
    moved.positions.iter_mut().for_each(|position| *position += DVec3::splat(6e6));
    let (far, _) = CompiledMesh::compile(&moved).unwrap();
    for (a, b) in corners(&far).iter().flatten().zip(corners(&near).iter().flatten()) {
        assert!((*a - *b).abs().max_element() < 1e-6, "{a} {b}");
    }
}

#[test]
fn other_formats_and_versions_are_refused() {
    let text = CompiledMesh::from_bytes(b"v 0 0 0").unwrap_err().to_string();
    assert!(text.contains("RFMESH"), "{text}");
    let (compiled, _) = CompiledMesh::compile(&sheet(2)).unwrap();
    let mut newer = compiled.bytes().to_vec();
    newer[6] = 9;
    assert!(CompiledMesh::from_bytes(&newer).unwrap_err().to_string().contains("9"));
    let cut = CompiledMesh::from_bytes(&compiled.bytes()[..200]).unwrap_err().to_string();
    assert!(cut.contains("200"), "{cut}");
}

/// Offsets of the centre and the bounds in the header, and of numbers in the first block.
#[test]
fn inconsistent_bounds_and_corners_are_refused() {
    let (compiled, _) = CompiledMesh::compile(&sheet(4)).unwrap();
    let (center, lo, hi) = (16, 40, 64);
    for (at, number) in [(center, 1e90), (center, 5.0), (lo, -1e300), (lo, 9.0), (hi, 1e300), (hi, -9.0)] {
        let mut bytes = compiled.bytes().to_vec();
        bytes[at..at + 8].copy_from_slice(&f64::to_le_bytes(number));
        let error = CompiledMesh::from_bytes(&bytes).unwrap_err().to_string();
        assert!(error.contains("bounds do not fit"), "{number} at {at}: {error}");
    }
    let first_block = 128 + 512 * compiled.nodes().len();
    for axis in 0..3 {
        let mut bytes = compiled.bytes().to_vec();
        let at = first_block + axis * 64;
        bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
        let error = CompiledMesh::from_bytes(&bytes).unwrap_err().to_string();
        assert!(error.contains("outside [-1, 1]"), "axis {axis}: {error}");
    }
}

proptest! {
    #[test]
    fn changed_bytes_are_refused_or_a_valid_mesh(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let (compiled, _) = CompiledMesh::compile(&textured(4)).unwrap();
        let mut bytes = compiled.bytes().to_vec();
        for (index, value) in changes {
            let at = index.index(bytes.len());
            bytes[at] = value;
        }
        if let Ok(mesh) = CompiledMesh::from_bytes(&bytes) {
            for triangle in mesh.triangles() {
                prop_assert!((mesh.slot(triangle) as usize) < mesh.material_count());
                mesh.corner_normals(triangle);
                for uv in mesh.corner_uvs(triangle).into_iter().flatten() {
                    prop_assert!(uv.is_finite());
                }
            }
        }
    }

    #[test]
    fn arbitrary_bytes_are_refused(bytes in prop::collection::vec(any::<u8>(), 0..400), magic in any::<bool>()) {
        let mut all = if magic { [&MAGIC[..], &FORMAT_VERSION.to_le_bytes()].concat() } else { Vec::new() };
        all.extend(bytes);
        prop_assert!(CompiledMesh::from_bytes(&all).is_err());
    }
}
