//! Ways through volumes: their depths, free paths along them, and closed meshes against boxes.

use std::sync::Arc;

use glam::{DMat3, Vec3};
use proptest::prelude::*;

use super::*;
use crate::compile::CompiledScene;
use crate::mesh::{CompiledMesh, Mesh, NamedMaterial};
use crate::scene::{
    Camera, FrameView, Integrator, Material, Model, NormalMode, PathSettings, Scene, Volume, VolumeBoundary,
};

const LOWER: DVec3 = DVec3::new(-1.0, -0.5, -2.0);
const UPPER: DVec3 = DVec3::new(0.5, 1.0, 2.0);

fn boxed(lower: DVec3, upper: DVec3, density: f64, color: Vec3) -> Volume {
    Volume { boundary: VolumeBoundary::Box { lower, upper }, density, color }
}

/// A frame with some volumes, seen from the origin of the world.
fn frame_of(volumes: Vec<Volume>, meshes: Vec<Arc<CompiledMesh>>) -> PreparedFrame {
    let scene = Scene {
        camera: Camera { position: DVec3::ZERO, look_at: DVec3::NEG_Z, up: DVec3::Y, ..Camera::default() },
        volumes,
        ..Scene::default()
    };
    scene.validate().unwrap();
    let view = FrameView {
        width: 16,
        height: 16,
        samples: 1,
        integrator: Integrator::Path(PathSettings::default()),
        ..FrameView::of(&scene)
    };
    PreparedFrame::new(Arc::new(CompiledScene::new(scene, meshes, []).unwrap()), &view).unwrap()
}

/// A ray of world space.
fn ray(frame: &PreparedFrame, origin: DVec3, direction: DVec3) -> Ray {
    Ray { origin: origin * frame.per_unit, direction: direction * frame.per_unit }
}

fn depth(frame: &PreparedFrame, origin: DVec3, direction: DVec3, t_max: f64) -> f64 {
    frame.optical_depth(&ray(frame, origin, direction), t_max, &mut VolumeSections::default())
}

#[test]
fn depths_of_overlapping_volumes_add() {
    let cube = |from: f64, to: f64, density| {
        boxed(DVec3::new(from, -1.0, -1.0), DVec3::new(to, 1.0, 1.0), density, Vec3::ONE)
    };
    let frame = frame_of(vec![cube(1.0, 3.0, 0.5), cube(2.0, 4.0, 3.0)], Vec::new());
    let along = |origin: f64, t_max: f64| depth(&frame, DVec3::X * origin, DVec3::X, t_max);
    for (origin, t_max, expected) in [
        (0.0, f64::INFINITY, 0.5 * 2.0 + 3.0 * 2.0),
        (0.0, 1.5, 0.25),
        (0.0, 2.5, 0.75 + 1.5),
        (2.5, f64::INFINITY, 0.25 + 4.5),
        (2.5, 1.0, 0.25 + 3.0),
        (5.0, f64::INFINITY, 0.0),
        (0.0, 1.0, 0.0),
    ] {
        assert!(
            (along(origin, t_max) - expected).abs() < 1e-12,
            "{origin}, {t_max}: {}",
            along(origin, t_max)
        );
    }
    // Distances are in lengths of the direction, depths in the world's units.
    assert!((depth(&frame, DVec3::ZERO, DVec3::X * 0.25, f64::INFINITY) - 7.0).abs() < 1e-12);
    assert_eq!(depth(&frame, DVec3::Y * 2.0, DVec3::X, f64::INFINITY), 0.0);
}

#[test]
fn free_paths_have_the_mean_of_beers_law_and_the_albedo_of_their_place() {
    let wide = DVec3::splat(1e4);
    let (red, blue) = (Vec3::X, Vec3::new(0.0, 0.0, 0.5));
    let frame = frame_of(vec![boxed(-wide, wide, 0.5, red), boxed(-wide, wide, 1.5, blue)], Vec::new());
    let ray = ray(&frame, DVec3::ZERO, DVec3::new(0.0, 0.6, 0.8));
    let count = 10_000;
    let mut sum = 0.0;
    for i in 0..count {
        let depth = -libm::log(1.0 - (f64::from(i) + 0.5) / f64::from(count));
        let found = frame.scattered_at(&ray, f64::INFINITY, depth, &mut VolumeSections::default()).unwrap();
        assert!((found.color - DVec3::new(0.25, 0.0, 0.375)).length() < 1e-12);
        sum += found.t;
    }
    assert!((sum / f64::from(count) - 0.5).abs() < 1e-3, "{sum}");
    assert_eq!(frame.scattered_at(&ray, 1.0, 2.0, &mut VolumeSections::default()), None);
}

#[test]
fn a_ray_through_a_sphere_has_the_depth_of_its_chord() {
    let boundary = VolumeBoundary::Sphere { center: DVec3::new(0.0, 0.0, -3.0), radius: 1.0 };
    let frame = frame_of(vec![Volume { boundary, density: 2.0, color: Vec3::ONE }], Vec::new());
    for (x, chord) in [(0.0, 2.0), (0.6, 1.6), (0.8, 1.2), (1.5, 0.0)] {
        let found = depth(&frame, DVec3::X * x, DVec3::NEG_Z, f64::INFINITY);
        assert!((found - 2.0 * chord).abs() < 1e-12, "{x}: {found}");
    }
    let inside = depth(&frame, DVec3::new(0.0, 0.0, -3.0), DVec3::NEG_Z, f64::INFINITY);
    assert!((inside - 2.0).abs() < 1e-12, "{inside}");
}

/// The box from [`LOWER`] to [`UPPER`] as a mesh, and a bubble of a smaller box in it; `inwards` faces its fronts to the inside.
fn box_with_bubble(inwards: bool) -> Mesh {
    let middle = (LOWER + UPPER) / 2.0;
    let corner = |lower: DVec3, upper: DVec3, i: usize| {
        let side = |axis: usize| if i >> axis & 1 == 1 { upper[axis] } else { lower[axis] };
        DVec3::new(side(0), side(1), side(2))
    };
    let mut positions: Vec<DVec3> = (0..8).map(|i| corner(LOWER, UPPER, i)).collect();
    let small = (middle - (UPPER - LOWER) / 8.0, middle + (UPPER - LOWER) / 8.0);
    positions.extend((0..8).map(|i| corner(small.0, small.1, i)));
    let mut triangles = Vec::new();
    for first in [0_u32, 8] {
        for quad in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
            let [a, b, c, d] = quad.map(|i: u32| i + first);
            for [a, b, c] in [[a, b, c], [a, c, d]] {
                let at = |i: u32| positions[i as usize];
                let outwards = (at(b) - at(a)).cross(at(c) - at(a)).dot(at(a) - middle) > 0.0;
                let keeps = outwards != (first == 8) && !inwards || outwards == (first == 8) && inwards;
                triangles.push(if keeps { [a, b, c] } else { [a, c, b] });
            }
        }
    }
    let count = triangles.len();
    Mesh {
        positions,
        triangles,
        materials: vec![NamedMaterial::plain("any", Material::NEUTRAL)],
        triangle_materials: vec![0; count],
        ..Mesh::default()
    }
}

fn placed(mesh: &CompiledMesh, scale: DVec3) -> Volume {
    let model = Model {
        mesh: mesh.id(),
        materials: Vec::new(),
        normals: NormalMode::Flat,
        translate: DVec3::ZERO,
        rotate: DVec3::ZERO,
        scale,
        group: DMat3::IDENTITY,
    };
    Volume { boundary: VolumeBoundary::Model(model), density: 0.75, color: Vec3::ONE }
}

proptest! {
    #[test]
    fn a_closed_mesh_with_a_bubble_has_the_depth_of_its_boxes(
        origin in prop::array::uniform3(-3.0..3.0_f64), direction in prop::array::uniform3(-1.0..1.0_f64),
        inwards: bool, mirrored: bool,
    ) {
        let (origin, direction) = (DVec3::from_array(origin), DVec3::from_array(direction));
        prop_assume!(direction.length() > 0.1);
        let (mesh, _) = CompiledMesh::compile(&box_with_bubble(inwards)).unwrap();
        let scale = if mirrored { DVec3::new(1.0, -1.0, 1.0) } else { DVec3::ONE };
        let volume = placed(&mesh, scale);
        let solid = frame_of(vec![volume], vec![Arc::new(mesh)]);
        let middle = (LOWER + UPPER) / 2.0;
        let small = (UPPER - LOWER) / 8.0;
        let depth_of = |lower, upper| {
            let frame = frame_of(vec![boxed(lower, upper, 0.75, Vec3::ONE)], Vec::new());
            depth(&frame, origin, direction, f64::INFINITY)
        };
        let expected = depth_of(LOWER, UPPER) - depth_of(middle - small, middle + small);
        let found = depth(&solid, origin * scale, direction * scale, f64::INFINITY);
        // Corners of meshes are rounded to `f32`.
        prop_assert!((found - expected).abs() < 1e-5, "{found}, not {expected}");
    }
}

#[test]
fn a_mesh_that_is_missing_is_named() {
    let (mesh, _) = CompiledMesh::compile(&box_with_bubble(false)).unwrap();
    let scene = Scene { volumes: vec![placed(&mesh, DVec3::ONE)], ..Scene::default() };
    assert!(scene.mesh_ids().contains(&mesh.id()));
    let refusal = CompiledScene::new(scene, [], []).unwrap_err().to_string();
    assert!(refusal.starts_with("volume 0 names mesh"), "{refusal}");
}
