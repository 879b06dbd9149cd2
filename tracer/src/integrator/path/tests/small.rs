//! Things that are smaller than a pixel, away from its centre: first rays are at random places.

use glam::{DMat3, DVec3, Vec3};

use super::*;
use crate::mesh::{CompiledMesh, Mesh, NamedMaterial};
use crate::scene::{Model, NormalMode};

/// Pixels along a side of the pictures; a pixel is one unit wide.
const SIDE: u32 = 16;

/// A place in each pixel, a quarter of a pixel from two of its sides.
fn places() -> impl Iterator<Item = DVec3> {
    let along = |i: u32| f64::from(i) - f64::from(SIDE) / 2.0 + 0.25;
    (0..SIDE * SIDE).map(move |i| DVec3::new(along(i % SIDE), along(i / SIDE), 0.0))
}

fn scene() -> Scene {
    Scene {
        camera: Camera { up: DVec3::Y, ..camera_at(DVec3::new(0.0, 0.0, 500.0)) },
        materials: vec![lamp(Vec3::ONE)],
        ..Scene::default()
    }
}

/// Mean light of the pixels, by both cameras whose first rays are tiles.
fn covered(scene: &Scene, meshes: &[Arc<CompiledMesh>]) -> [f64; 2] {
    let compiled = Arc::new(CompiledScene::new(scene.clone(), meshes.to_vec(), []).unwrap());
    let fov = 2.0 * libm::atan(f64::from(SIDE) / 2.0 / 500.0).to_degrees();
    let orthographic = CameraKind::Orthographic { view_height: f64::from(SIDE) };
    [CameraKind::PINHOLE, orthographic].map(|kind| {
        let mut view = path_view(scene, SIDE, 64, 0);
        (view.camera.kind, view.camera.fov) = (kind, fov);
        let frame = PreparedFrame::new(Arc::clone(&compiled), &view).unwrap();
        let light: f64 = sums(&frame, 0..SIDE).iter().map(|pixel| f64::from(pixel.mean(64)[0])).sum();
        light / f64::from(SIDE * SIDE)
    })
}

#[test]
fn balls_cover_their_part_of_each_pixel() {
    let mut scene = scene();
    scene.spheres = places().map(|place| ball(place, 0.15, 0)).collect();
    let expected = std::f64::consts::PI * 0.15 * 0.15;
    for found in covered(&scene, &[]) {
        assert!((found / expected - 1.0).abs() < 0.05, "{found}, not {expected}");
    }
}

#[test]
fn triangles_of_a_mesh_cover_their_part_of_each_pixel() {
    let corners = [[-0.2, -0.2], [0.2, -0.2], [0.0, 0.2]].map(|[x, y]| DVec3::new(x, y, 0.0));
    let positions = places().flat_map(|place| corners.map(|corner| place + corner)).collect();
    let triangles: Vec<[u32; 3]> = (0..SIDE * SIDE).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = Mesh {
        positions,
        triangle_materials: vec![0; triangles.len()],
        triangles,
        materials: vec![NamedMaterial::plain("m", Material::NEUTRAL)],
        ..Mesh::default()
    };
    let (mesh, _) = CompiledMesh::compile(&mesh).unwrap();
    let mut scene = scene();
    scene.models = vec![Model {
        mesh: mesh.id(),
        materials: vec![0],
        normals: NormalMode::Flat,
        translate: DVec3::ZERO,
        rotate: DVec3::ZERO,
        scale: DVec3::ONE,
        group: DMat3::IDENTITY,
    }];
    let expected = 0.5 * 0.4 * 0.4;
    for found in covered(&scene, &[Arc::new(mesh)]) {
        assert!((found / expected - 1.0).abs() < 0.05, "{found}, not {expected}");
    }
}
