//! No shadow acne and no light leaks: pixels darker or brighter than the oracle's are counted under grazing light,
//! near and far, at all scales and far from the origin.

use std::path::Path;
use std::sync::Arc;

use crate::common::{ball, empty, light, point, render, torus};
use glam::{DMat3, DVec3, Vec3};
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::mesh::{CompileOptions, CompiledMesh};
use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{
    Attenuation, FrameView, LightKind, Model, NormalMode, Plane, Scene, Sphere, compile_model,
};

/// Largest extent of a scene, and its distance from the origin in extents.
const PLACES: [(f64, f64); 4] = [(1.0, 0.0), (1e-3, 0.0), (1e3, 0.0), (1.0, 1e4)];

fn model(mesh: &CompiledMesh, normals: NormalMode) -> Model {
    Model {
        mesh: mesh.id(),
        materials: vec![1; mesh.material_count()],
        normals,
        translate: DVec3::ZERO,
        rotate: DVec3::new(0.0, 25.0, 0.0),
        scale: DVec3::ONE,
        group: DMat3::IDENTITY,
    }
}

/// The scene scaled by `scale`, and moved.
fn placed(scene: &Scene, scale: f64, offset: f64) -> Scene {
    let place = |p: DVec3| (p + DVec3::new(offset, -offset, offset * 0.5)) * scale;
    let mut scene = scene.clone();
    scene.camera.position = place(scene.camera.position);
    scene.camera.look_at = place(scene.camera.look_at);
    for light in &mut scene.lights {
        if let LightKind::Point { position } = &mut light.kind {
            *position = place(*position);
        }
    }
    for model in &mut scene.models {
        (model.translate, model.scale) = (place(model.translate), model.scale * scale);
    }
    for sphere in &mut scene.spheres {
        (sphere.center, sphere.radius) = (place(sphere.center), sphere.radius * scale);
    }
    scene.planes.iter_mut().for_each(|plane| plane.point = place(plane.point));
    scene
}

/// Lights at this elevation in degrees: from infinitely far, far and near.
fn grazing(elevation: f64) -> [LightKind; 3] {
    let (s, c) = libm::sincos(elevation.to_radians());
    let to_light = DVec3::new(0.6 * c, s, 0.8 * c);
    let at = |distance: f64| LightKind::Point { position: to_light * distance };
    [LightKind::Directional { direction: -to_light }, at(1e4), at(3.0)]
}

/// Number of compared pixels, and of those that are darker and brighter than the oracle's by more than two steps.
fn wrong(scene: &Scene, meshes: &[Arc<CompiledMesh>], step: usize) -> (usize, usize) {
    let view = FrameView::of(scene);
    let (image, _) = render(scene, meshes, &view);
    let oracle = Oracle::new(scene, meshes, &[], &view);
    let (mut darker, mut brighter) = (0, 0);
    for i in (0..view.width * view.height).step_by(step) {
        let (x, y) = (i % view.width, i / view.width);
        let (found, expected) = (image.pixel(x, y).unwrap(), oracle.encoded_pixel(x, y));
        let pairs = || found.into_iter().zip(expected);
        darker += usize::from(pairs().any(|(found, expected)| found + 2 < expected));
        brighter += usize::from(pairs().any(|(found, expected)| found > expected.saturating_add(2)));
    }
    (darker, brighter)
}

/// All counts that are not zero, under all grazing lights and in all places.
fn wrong_anywhere(scene: &mut Scene, meshes: &[Arc<CompiledMesh>], step: usize) -> Vec<String> {
    let mut found = Vec::new();
    for elevation in [0.1, 1.0, 5.0] {
        for (kind, name) in grazing(elevation).into_iter().zip(["sun", "far", "near"]) {
            scene.lights = vec![light(kind, 1.0, Attenuation::None)];
            for (scale, offset) in PLACES {
                let counts = wrong(&placed(scene, scale, offset), meshes, step);
                if counts != (0, 0) {
                    found.push(format!(
                        "{name} {elevation} degrees, scale {scale}, offset {offset}: {counts:?}"
                    ));
                }
            }
        }
    }
    found
}

#[test]
fn no_acne_on_a_plane_and_spheres_at_grazing_light() {
    let mut scene = empty(60, 45);
    scene.ambient = Vec3::ZERO;
    scene.planes = vec![Plane { point: DVec3::ZERO, normal: DVec3::Y, material: 1, size: 1.0 }];
    // One is on the ground, one is sunk into it, one is large and one is tiny.
    for (x, y, z, radius) in
        [(-0.6, 0.4, 0.0, 0.4), (0.5, 0.0, 0.3, 0.3), (3.0, 1.0, -9.0, 4.0), (0.1, 0.01, 1.0, 0.01)]
    {
        scene.spheres.push(Sphere {
            center: DVec3::new(x, y, z),
            radius,
            material: 1,
            inside_out: false,
            uv_rotate: DVec3::ZERO,
        });
    }
    let found = wrong_anywhere(&mut scene, &[], 1);
    assert!(found.is_empty(), "darker, brighter: {found:#?}");
}

#[test]
fn no_acne_on_meshes_at_grazing_light() {
    for normals in [NormalMode::Flat, NormalMode::Smooth] {
        for mesh in [torus(40, 24), ball(24, 36)] {
            let mesh = Arc::new(CompiledMesh::compile(&mesh).unwrap().0);
            let mut scene = empty(48, 36);
            scene.ambient = Vec3::ZERO;
            scene.models = vec![model(&mesh, normals)];
            let found = wrong_anywhere(&mut scene, &[mesh], 7);
            assert!(found.is_empty(), "{normals:?}, darker, brighter: {found:#?}");
        }
    }
}

/// At a distance of a thousand extents, points have no digits left for the last 10^-3 of the mesh: shadow rays start
/// that far off it, and the shadows of the smallest folds are lost. Those pixels may be brighter, never darker.
#[test]
fn no_acne_on_the_bunny_at_grazing_light_near_and_far() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/models/stanford-bunny.obj");
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
        return;
    }
    let (mesh, _) = compile_model(&path, Path::new(""), CompileOptions::default()).unwrap();
    let (lo, hi) = mesh.bounds();
    let size = (hi - lo).max_element();
    let mut found = Vec::new();
    for (normals, distance) in [(NormalMode::Flat, 2.0), (NormalMode::Smooth, 2.0), (NormalMode::Flat, 1e3)] {
        let mut scene = empty(64, 48);
        scene.ambient = Vec3::ZERO;
        scene.models = vec![model(&mesh, normals)];
        scene.models[0].scale = DVec3::splat(1.0 / size);
        scene.models[0].translate = -(lo + hi) * 0.5 / size;
        scene.camera.position = DVec3::new(0.2, 0.3, 1.0) * distance;
        scene.camera.look_at = DVec3::ZERO;
        scene.camera.zoom = distance / 1.5;
        for elevation in [0.1, 5.0] {
            for (kind, name) in grazing(elevation).into_iter().zip(["sun", "far", "near"]) {
                scene.lights = vec![light(kind, 1.0, Attenuation::None)];
                let counts = wrong(&scene, std::slice::from_ref(&mesh), 29);
                let (darker, brighter) = counts;
                let lost_folds = if distance > 100.0 { 2 } else { 0 };
                if darker > 0 || brighter > lost_folds {
                    found
                        .push(format!("{normals:?} from {distance}, {name} {elevation} degrees: {counts:?}"));
                }
            }
        }
    }
    assert!(found.is_empty(), "darker, brighter: {found:#?}");
}

fn lit(image: &RgbImage) -> usize {
    image.pixels.chunks_exact(3).filter(|pixel| pixel.iter().any(|&channel| channel > 0)).count()
}

/// A light in a closed mesh lights nothing outside, and one outside nothing inside; also where it nearly touches.
#[test]
fn no_light_leaks_through_a_closed_mesh() {
    let mut found = Vec::new();
    for (rings, sectors) in [(12, 19), (40, 64)] {
        let mesh = Arc::new(CompiledMesh::compile(&ball(rings, sectors)).unwrap().0);
        let mut scene = empty(96, 72);
        scene.ambient = Vec3::ZERO;
        scene.background = rayfarm_tracer::scene::Background::Color(Vec3::ZERO);
        scene.models = vec![model(&mesh, NormalMode::Flat)];
        scene.planes = vec![Plane { point: DVec3::Y * -1.001, normal: DVec3::Y, material: 2, size: 1.0 }];
        // Towards an edge: facets are inside the unit ball.
        let deepest = libm::cos(std::f64::consts::PI / f64::from(sectors)) * 0.9;
        let inside = [DVec3::ZERO, DVec3::new(0.3, -0.2, 0.1), DVec3::Y * 0.999, DVec3::X * deepest];
        let outside = [DVec3::new(0.0, 1.001, 0.0), DVec3::X * 1.0001, DVec3::new(3.0, 4.0, 5.0)];
        let eyes = [DVec3::new(0.0, 0.5, 4.0), DVec3::new(0.05, 0.02, 0.1)];
        for (eye, lights, fov) in [(eyes[0], &inside[..], 45.0), (eyes[1], &outside[..], 140.0)] {
            for at in lights {
                (scene.camera.position, scene.camera.look_at, scene.camera.fov) = (eye, DVec3::ZERO, fov);
                scene.lights = vec![light(point(at.x, at.y, at.z), 1e3, Attenuation::None)];
                for (scale, offset) in PLACES {
                    let scene = placed(&scene, scale, offset);
                    let (image, _) = render(&scene, std::slice::from_ref(&mesh), &FrameView::of(&scene));
                    if lit(&image) > 0 {
                        found.push(format!("light at {at}, scale {scale}, offset {offset}: {}", lit(&image)));
                    }
                }
            }
        }
    }
    assert!(found.is_empty(), "pixels lit: {found:#?}");
}

/// Points whose segments to the light pass edges and vertices of a wall of many triangles, all but exactly.
#[test]
fn no_light_leaks_through_the_seams_of_a_wall() {
    let mut mesh = torus(3, 3);
    let n = 16;
    let at = |i: u32, j: u32| DVec3::new(f64::from(i) / 8.0 - 1.0, 0.5, f64::from(j) / 8.0 - 1.0);
    mesh.positions = (0..=n).flat_map(|i| (0..=n).map(move |j| at(i, j))).collect();
    let vertex = |i: u32, j: u32| i * (n + 1) + j;
    mesh.triangles = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    mesh.triangle_materials = vec![0; mesh.triangles.len()];
    let mesh = Arc::new(CompiledMesh::compile(&mesh).unwrap().0);
    let mut scene = empty(64, 64);
    scene.ambient = Vec3::ZERO;
    scene.background = rayfarm_tracer::scene::Background::Color(Vec3::ZERO);
    scene.models = vec![Model { rotate: DVec3::ZERO, ..model(&mesh, NormalMode::Flat) }];
    scene.planes = vec![Plane { point: DVec3::ZERO, normal: DVec3::Y, material: 2, size: 1.0 }];
    // Straight from above, between floor and wall: pixels are at multiples of 1/64.
    scene.camera.position = DVec3::new(1.0 / 128.0, 0.25, 1.0 / 128.0);
    scene.camera.look_at = scene.camera.position - DVec3::Y;
    scene.camera.up = DVec3::Z;
    scene.camera.fov = 2.0 * libm::atan(2.0).to_degrees();
    let straight = LightKind::Directional { direction: DVec3::NEG_Y };
    let slanted = LightKind::Directional { direction: DVec3::new(0.25, -1.0, 0.5) };
    for kind in [straight, slanted, point(0.0, 1.0, 0.0), point(0.0, 64.0, 0.0), point(0.125, 0.75, 0.25)] {
        scene.lights = vec![light(kind, 1.0, Attenuation::None)];
        let (image, _) = render(&scene, std::slice::from_ref(&mesh), &FrameView::of(&scene));
        assert_eq!(lit(&image), 0, "{kind:?}");
    }
}
