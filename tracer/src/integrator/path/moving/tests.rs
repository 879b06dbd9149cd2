//! Objects that move: coverage and shadows by hand, the same bits on every level and in every cut, still objects as they were.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use super::super::tests::{ball, camera_at, diffuse, floor, furnished, light, mean, path_view, sums};
use crate::compile::CompiledScene;
use crate::frame::PreparedFrame;
use crate::integrator::render_rows;
use crate::intersect::{Primitive, RaySegment};
use crate::material::Material;
use crate::mesh::{CompiledMesh, Mesh, NamedMaterial};
use crate::scene::{
    Background, Camera, CameraKind, FrameView, Lens, LightKind, Model, Motion, NormalMode, PixelFormat, Scene,
};
use crate::simd;

/// Two triangles that cross.
fn blades() -> Arc<CompiledMesh> {
    let positions =
        [[-1., 0., -0.3], [1., 0.2, 0.1], [0., 0.5, 0.4], [0.1, -1., 0.], [0.2, 1., 0.3], [-0.3, 0.1, -0.6]];
    let mesh = Mesh {
        positions: positions.map(DVec3::from_array).to_vec(),
        triangles: vec![[0, 1, 2], [3, 4, 5]],
        triangle_materials: vec![0; 2],
        materials: vec![NamedMaterial::plain("m", Material::NEUTRAL)],
        ..Mesh::default()
    };
    Arc::new(CompiledMesh::compile(&mesh).unwrap().0)
}

/// The furnished box with a glass ball and a model that move.
fn moving() -> (Scene, Arc<CompiledMesh>) {
    let (mut scene, mesh) = (furnished(), blades());
    let blade = |translate| Model {
        mesh: mesh.id(),
        materials: vec![0],
        normals: NormalMode::Flat,
        translate,
        rotate: DVec3::new(0.0, 20.0, 0.0),
        scale: DVec3::splat(0.5),
        group: DMat3::IDENTITY,
    };
    scene.models = vec![blade(DVec3::new(0.3, 0.7, 0.5)), blade(DVec3::new(-0.9, 0.9, -0.5))];
    let (translate, rotate) = (DVec3::new(0.6, 0.4, 0.6), DVec3::new(30.0, 140.0, 0.0));
    scene.motions = vec![
        Motion::Sphere { sphere: 0, center: DVec3::new(-0.4, -0.3, 0.2) },
        Motion::Model { model: 0, translate, rotate },
    ];
    (scene, mesh)
}

fn compiled(scene: &Scene, mesh: &Arc<CompiledMesh>) -> Arc<CompiledScene> {
    Arc::new(CompiledScene::new(scene.clone(), [Arc::clone(mesh)], []).unwrap())
}

#[test]
fn all_levels_and_cuts_have_the_same_sums_of_objects_that_move() {
    let (scene, mesh) = moving();
    let mut view = FrameView { width: 18, height: 19, ..path_view(&scene, 1, 3, 5) };
    for (kind, aperture) in [
        (CameraKind::PINHOLE, 0.0),
        (CameraKind::PINHOLE, 0.1),
        (CameraKind::Orthographic { view_height: 3.0 }, 0.0),
        (CameraKind::Fisheye, 0.0),
    ] {
        view.camera.kind = kind;
        view.lens = Lens { aperture, focus_distance: None };
        let mut frame = PreparedFrame::new(compiled(&scene, &mesh), &view).unwrap();
        assert!(frame.motions.is_some());
        let expected = sums(&frame, 0..view.height);
        for level in simd::all() {
            frame.level = level;
            assert!(sums(&frame, 0..view.height) == expected, "{}, {kind:?}", simd::name(level));
        }
        frame.level = simd::best();
        for (top, bottom) in [(0, 1), (1, 16), (16, 19)] {
            let pixels = top as usize * 18..bottom as usize * 18;
            assert!(sums(&frame, top..bottom) == expected[pixels], "rows {top} to {bottom}, {kind:?}");
        }
    }
}

#[test]
fn objects_that_end_where_they_start_are_still() {
    let (scene, mesh) = moving();
    let still = Scene { motions: Vec::new(), ..scene.clone() };
    let ends = vec![
        Motion::Sphere { sphere: 0, center: scene.spheres[0].center },
        Motion::Model { model: 0, translate: scene.models[0].translate, rotate: scene.models[0].rotate },
    ];
    let resting = Scene { motions: ends, ..scene.clone() };
    let view = path_view(&scene, 20, 2, 5);
    let of = |scene: &Scene| sums(&PreparedFrame::new(compiled(scene, &mesh), &view).unwrap(), 0..20);
    assert!(of(&resting) == of(&still));
    assert!(of(&scene) != of(&still));
}

#[test]
fn the_direct_integrator_shows_objects_when_the_shutter_opens() {
    let (scene, mesh) = moving();
    let still = Scene { motions: Vec::new(), ..scene.clone() };
    let view = FrameView { width: 40, height: 30, format: PixelFormat::Rgb8, ..FrameView::of(&scene) };
    let of = |scene: &Scene| {
        let frame = PreparedFrame::new(compiled(scene, &mesh), &view).unwrap();
        let mut bytes = vec![0; 30 * frame.row_bytes()];
        render_rows(&frame, 0..30, &mut bytes, &|| false).unwrap();
        bytes
    };
    assert!(of(&scene) == of(&still));
}

#[test]
fn rays_of_the_world_hit_objects_where_they_are_when_the_shutter_opens() {
    let (scene, mesh) = moving();
    let still = Scene { motions: Vec::new(), ..scene.clone() };
    let view = path_view(&scene, 8, 1, 2);
    let [moving, still] =
        [&scene, &still].map(|scene| PreparedFrame::new(compiled(scene, &mesh), &view).unwrap());
    let origin = scene.camera.position;
    let mut of_moving = 0;
    for (i, j) in (0..40).flat_map(|i| (0..40).map(move |j| (i, j))) {
        let target = DVec3::new(f64::from(i) * 0.1 - 2.0, f64::from(j) * 0.08 - 1.2, 0.3);
        let direction = target - origin;
        let [found, expected] =
            [&moving, &still].map(|frame| frame.closest_hit(origin, direction, f64::INFINITY));
        assert_eq!(found.map(|hit| hit.primitive), expected.map(|hit| hit.primitive), "{target}");
        if let (Some(found), Some(expected)) = (found, expected) {
            assert!((found.t / expected.t - 1.0).abs() < 1e-12);
        }
        assert_eq!(moving.any_hit(origin, direction, 0.9), still.any_hit(origin, direction, 0.9));
        let ray = RaySegment { origin, direction, t_max: f64::INFINITY, starts_on: None };
        assert_eq!(moving.closest_hits(&[ray])[0], found);
        assert_eq!(moving.any_hits(&[ray]), u32::from(expected.is_some()));
        let on_model = found.is_some_and(|hit| matches!(hit.primitive, Primitive::Model { model: 0, .. }));
        of_moving += u32::from(on_model);
    }
    assert!(of_moving > 10, "{of_moving}");
}

/// Share of the times in [0, 1] at which a disc around `center`, which moves by `way` along x, covers a point.
fn share_covered([x, y]: [f64; 2], center: f64, way: f64, radius: f64) -> f64 {
    let Some(half) = Some(radius * radius - y * y).filter(|square| *square > 0.0).map(f64::sqrt) else {
        return 0.0;
    };
    let [enters, leaves] = [-half, half].map(|half| ((x - center + half) / way).clamp(0.0, 1.0));
    leaves - enters
}

#[test]
fn a_ball_that_moves_along_a_row_covers_it_as_the_box_filter_of_its_disc() {
    let (width, view_height, radius) = (48_u32, 0.1, 0.5);
    let (start, way) = (-1.0, 2.0);
    let camera = Camera {
        kind: CameraKind::Orthographic { view_height },
        up: DVec3::Y,
        ..camera_at(DVec3::new(0.0, 0.0, 4.0))
    };
    let still = Scene {
        camera,
        background: Background::Color(Vec3::ONE),
        materials: vec![diffuse(Vec3::ZERO)],
        spheres: vec![ball(DVec3::new(start, 0.0, 0.0), radius, 0)],
        ..Scene::default()
    };
    let motion = Motion::Sphere { sphere: 0, center: DVec3::new(start + way, 0.0, 0.0) };
    let moving = Scene { motions: vec![motion], ..still.clone() };
    let samples = 4096;
    let covered = |scene: &Scene| -> Vec<f64> {
        let view = FrameView { width, height: 1, ..path_view(scene, 1, samples, 2) };
        let frame = PreparedFrame::new(super::super::tests::compiled(scene), &view).unwrap();
        sums(&frame, 0..1).iter().map(|pixel| 1.0 - f64::from(pixel.mean(samples)[0])).collect()
    };
    let (found, still) = (covered(&moving), covered(&still));
    let (across, along) = (16, 8);
    for (column, found) in found.iter().enumerate() {
        let points = (0..across * along).map(|index| {
            let at = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
            let x = column as f64 + at(index % across, across) - f64::from(width) / 2.0;
            [x * view_height, (at(index / across, along) - 0.5) * view_height]
        });
        let sum: f64 = points.map(|point| share_covered(point, start, way, radius)).sum();
        let expected = sum / f64::from(across * along);
        // Four standard deviations of independent samples.
        assert!((found - expected).abs() < 0.03, "column {column}: {found}, not {expected}");
    }
    let [found, still] = [found, still].map(|covered| covered.iter().sum::<f64>());
    assert!((found / still - 1.0).abs() < 0.01, "{found}, not {still}");
    assert!((still * view_height / (2.0 * radius) - 1.0).abs() < 0.01, "{still}");
}

#[test]
fn a_ball_that_passes_a_light_shades_its_share_of_the_time() {
    // The ball crosses the way from the origin to the light, whose middle it is at half of the time: 0.5 of 2 units.
    let center = |z: f64| DVec3::new(-1.0, 1.0, z);
    let kinds = [
        (LightKind::Directional { direction: DVec3::new(1.0, -1.0, 0.0).normalize() }, 0.0),
        (LightKind::Point { position: DVec3::new(-3.0, 3.0, 0.0) }, 0.0),
        (LightKind::Point { position: DVec3::new(-3.0, 3.0, 0.0) }, 0.01),
    ];
    for (kind, radius) in kinds {
        let mut lit = floor();
        lit.camera.fov = 0.2;
        let mut lamp = light(kind);
        lamp.radius = radius;
        lit.lights = vec![lamp];
        let shaded = Scene {
            spheres: vec![ball(center(-1.0), 0.25, 0)],
            motions: vec![Motion::Sphere { sphere: 0, center: center(1.0) }],
            ..lit.clone()
        };
        let [shaded, lit] = [&shaded, &lit].map(|scene| mean(scene, &path_view(scene, 2, 1024, 1))[0]);
        assert!((shaded / lit - 0.75).abs() < 0.01, "{kind:?}: {shaded} of {lit}");
    }
}

#[test]
fn a_white_ball_that_moves_in_a_white_sky_is_invisible() {
    let scene = Scene {
        camera: Camera { up: DVec3::Y, fov: 40.0, ..camera_at(DVec3::new(0.0, 0.5, 4.0)) },
        background: Background::Color(Vec3::ONE),
        materials: vec![diffuse(Vec3::ONE)],
        spheres: vec![ball(DVec3::new(-0.3, 0.0, 0.0), 0.5, 0), ball(DVec3::new(1.0, 0.0, 0.0), 0.3, 0)],
        motions: vec![
            Motion::Sphere { sphere: 0, center: DVec3::new(0.15, 0.2, 0.0) },
            Motion::Sphere { sphere: 1, center: DVec3::new(1.2, -0.5, 0.3) },
        ],
        ..Scene::default()
    };
    let view = path_view(&scene, 24, 16, 64);
    let frame = PreparedFrame::new(super::super::tests::compiled(&scene), &view).unwrap();
    for pixel in sums(&frame, 0..24) {
        assert!(pixel.mean(16).iter().all(|&value| (0.98..=1.000_001).contains(&value)), "{pixel:?}");
    }
}
