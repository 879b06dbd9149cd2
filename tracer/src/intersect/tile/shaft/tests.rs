//! A shaft that is empty for certain, against rays.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use super::super::tests::Random;
use super::Shaft;
use crate::compile::CompiledScene;
use crate::frame::PreparedFrame;
use crate::light::SHADOW_T_MAX;
use crate::mesh::{CompiledMesh, Mesh, NamedMaterial};
use crate::rays::{BLOCKS, Ray};
use crate::scene::{
    Background, Camera, CameraKind, Disk, FrameView, Material, Model, NormalMode, Plane, RenderSettings,
    Scene, Sphere, Triangle,
};
use crate::simd::{self, LANES, Lanes, dispatch};

/// A scene of few random items around the origin.
fn frame(random: &mut Random) -> PreparedFrame {
    let mut place = || random.vector() * 2.0;
    let triangle = |place: &mut dyn FnMut() -> DVec3| {
        let a = place();
        [a, a + place() * 0.4, a + place() * 0.4]
    };
    let triangles: Vec<[DVec3; 3]> = (0..6).map(|_| triangle(&mut place)).collect();
    let corners: Vec<DVec3> = (0..20).flat_map(|_| triangle(&mut place)).collect();
    let mesh = Mesh {
        triangles: (0..20).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        triangle_materials: vec![0; 20],
        positions: corners,
        materials: vec![NamedMaterial::plain("a", Material::NEUTRAL)],
        ..Mesh::default()
    };
    let (mesh, _) = CompiledMesh::compile(&mesh).unwrap();
    let model = Model {
        mesh: mesh.id(),
        materials: vec![0],
        normals: NormalMode::Flat,
        translate: place() * 0.3,
        rotate: place() * 50.0,
        scale: DVec3::new(1.0, 0.5, 1.3),
        group: DMat3::IDENTITY,
    };
    let scene = Scene {
        ambient: Vec3::ZERO,
        render: RenderSettings::default(),
        camera: Camera {
            position: DVec3::Z * 5.0,
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            fov: 40.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        },
        background: Background::Color(Vec3::ZERO),
        lights: Vec::new(),
        materials: vec![Material::NEUTRAL],
        textures: Vec::new(),
        models: vec![model],
        spheres: (0..3)
            .map(|_| Sphere {
                center: place(),
                radius: 0.2 + 0.05 * place().x.abs(),
                material: 0,
                inside_out: false,
                uv_rotate: DVec3::ZERO,
            })
            .collect(),
        planes: vec![Plane {
            point: DVec3::Y * -3.0,
            normal: DVec3::Y + place() * 0.1,
            material: 0,
            size: 1.0,
        }],
        triangles: triangles
            .into_iter()
            .map(|vertices| Triangle { vertices, uvs: None, material: 0 })
            .collect(),
        disks: (0..2)
            .map(|_| Disk { center: place(), normal: place().normalize(), radius: 0.3, material: 0 })
            .collect(),
        background_visible: true,
        ..Scene::default()
    };
    let compiled = CompiledScene::new(scene.clone(), [Arc::new(mesh)], []).unwrap();
    PreparedFrame::new(Arc::new(compiled), &FrameView::of(&scene)).unwrap()
}

/// Points around a place, `spread` apart.
fn points_around(random: &mut Random, place: DVec3, spread: f64) -> [[Lanes; 3]; BLOCKS] {
    let mut points = [[Lanes::ZERO; 3]; BLOCKS];
    for block in &mut points {
        for lane in 0..LANES {
            let point = place + random.vector() * spread;
            (0..3).for_each(|axis| block[axis].0[lane] = point[axis] as f32);
        }
    }
    points
}

#[test]
fn no_ray_is_occluded_in_an_empty_shaft() {
    let random = &mut Random(7);
    let (mut empty, mut free) = (0, 0);
    for round in 0..300 {
        let frame = frame(random);
        let at = |place: DVec3| (place - DVec3::Z * 5.0) * frame.per_unit;
        let spread = [0.02, 0.2, 1.0][round % 3] * frame.per_unit;
        let place = at(random.vector() * 2.5);
        let points = points_around(random, place, spread);
        let (center, radius) = (at(random.vector() * 2.5), 0.1 * frame.per_unit);
        let lanes = [0xffff; BLOCKS];
        let shaft = Shaft::new(&frame, &points, &lanes, center, radius).unwrap();
        let results: Vec<bool> =
            simd::all().into_iter().map(|level| dispatch!(level, simd => shaft.is_empty(simd))).collect();
        let mut occluded = false;
        for block in &points {
            for lane in 0..LANES {
                let origin = DVec3::from_array([0, 1, 2].map(|axis| f64::from(block[axis].0[lane])));
                let target = center + random.vector().normalize() * radius;
                let ray = Ray { origin, direction: target - origin };
                occluded |= frame.occluded(&ray, SHADOW_T_MAX, None);
            }
        }
        assert!(!(occluded && results.contains(&true)), "round {round}: {results:?}");
        free += usize::from(!occluded);
        empty += usize::from(results[0]);
    }
    assert!(empty * 5 > free && free > 30 && free < 270, "{empty} of {free}");
}

#[test]
fn the_surface_that_points_are_on_does_not_count() {
    let random = &mut Random(3);
    let mut frame = frame(random);
    frame.nodes = vec![bytemuck::Zeroable::zeroed()];
    let plane = frame.planes[0];
    let (mut points, center) = (points_around(random, DVec3::ZERO, 0.3), plane.normal * (plane.offset + 0.5));
    for block in &mut points {
        for lane in 0..LANES {
            let point = DVec3::from_array([0, 1, 2].map(|axis| f64::from(block[axis].0[lane])));
            let above = point - plane.normal * (plane.normal.dot(point) - plane.offset - 1e-6);
            (0..3).for_each(|axis| block[axis].0[lane] = above[axis] as f32);
        }
    }
    let lanes = [0xffff; BLOCKS];
    let is_empty = |radius: f64| {
        let shaft = Shaft::new(&frame, &points, &lanes, center, radius).unwrap();
        dispatch!(frame.level, simd => shaft.is_empty(simd))
    };
    assert!(is_empty(0.4));
    assert!(!is_empty(0.6), "the ball reaches through the plane");
}
