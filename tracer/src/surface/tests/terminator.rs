//! Shadows of smooth meshes on themselves.

use glam::DMat3;

use super::*;
use crate::mesh::{Mesh, NamedMaterial};
use crate::scene::{Model, NormalMode};

/// A unit sphere of triangles, with 32 around and 16 from pole to pole.
fn ball_of_triangles() -> Mesh {
    let (around, rows) = (32, 16);
    let place = |i: u32, j: u32| {
        let (across, down) = (f64::from(i) / f64::from(around), f64::from(j) / f64::from(rows));
        let (s, c) = libm::sincos(across * std::f64::consts::TAU);
        let (ring, height) = libm::sincos(down * std::f64::consts::PI);
        DVec3::new(ring * c, height, ring * s)
    };
    let positions: Vec<DVec3> = (0..=rows).flat_map(|j| (0..around).map(move |i| place(i, j))).collect();
    let at = |i: u32, j: u32| j * around + i % around;
    let quad = |(i, j): (u32, u32)| {
        [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    };
    let triangles: Vec<[u32; 3]> =
        (0..rows).flat_map(|j| (0..around).map(move |i| (i, j))).flat_map(quad).collect();
    Mesh {
        normals: positions.iter().map(|position| position.as_vec3()).collect(),
        positions,
        triangle_materials: vec![0; triangles.len()],
        triangles,
        materials: vec![NamedMaterial::plain("m", Material::NEUTRAL)],
        ..Mesh::default()
    }
}

fn scene(mesh: &CompiledMesh, normals: NormalMode, scale: DVec3) -> Scene {
    let model = Model {
        mesh: mesh.id(),
        materials: vec![0],
        normals,
        translate: DVec3::new(0.3, -0.2, 0.1),
        rotate: DVec3::new(10.0, 20.0, 30.0),
        scale,
        group: DMat3::IDENTITY,
    };
    let lights = vec![sun(DVec3::new(-1.0, -0.3, 0.1))];
    Scene { ambient: Vec3::splat(0.05), lights, models: vec![model], ..empty() }
}

/// Nothing shades a convex body but itself, and N.L does that: a picture without shadows is the right one.
#[test]
fn a_convex_mesh_alone_has_no_shadow_on_its_lit_side() {
    let mesh = Arc::new(CompiledMesh::compile(&ball_of_triangles()).unwrap().0);
    for scale in [DVec3::ONE, DVec3::new(1.0, 1.4, 0.7), DVec3::new(-1.0, 1.0, 1.2)] {
        let scene = scene(&mesh, NormalMode::Smooth, scale);
        let quality = Quality::default();
        let right = rendered(&scene, &[Arc::clone(&mesh)], &[], Quality { shadows: false, ..quality });
        let smooth = rendered(&scene, &[Arc::clone(&mesh)], &[], quality);
        assert_eq!(different(&smooth, &right, 0), 0, "scale {scale}");
        let sawtooth =
            rendered(&scene, &[Arc::clone(&mesh)], &[], Quality { smooth_terminator: false, ..quality });
        assert!(different(&sawtooth, &right, 0) > 20, "the remedy is needed, scale {scale}");
    }
}

#[test]
fn flat_normals_are_not_lifted() {
    let mesh = Arc::new(CompiledMesh::compile(&ball_of_triangles()).unwrap().0);
    let scene = scene(&mesh, NormalMode::Flat, DVec3::ONE);
    let quality = Quality::default();
    let off = rendered(&scene, &[Arc::clone(&mesh)], &[], Quality { smooth_terminator: false, ..quality });
    assert_eq!(different(&rendered(&scene, &[Arc::clone(&mesh)], &[], quality), &off, 0), 0);
}
