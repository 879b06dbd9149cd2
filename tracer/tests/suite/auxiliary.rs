//! Pictures without light: all kinds against the oracle, the shading normals of meshes, and diffuse colours with textures.

use std::path::Path;
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};
use rayfarm_tracer::Basis;
use rayfarm_tracer::image::compare;
use rayfarm_tracer::mesh::CompiledMesh;
use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{
    Attenuation, FrameView, LoadedScene, Material, Model, NormalMode, Quality, Scene, Shading, load,
};
use rayfarm_tracer::srgb::decode;

use crate::common::{analytic, ball, empty, instanced, light, point, render, render_textured};

const SIDE: u32 = 64;

fn shown(scene: &Scene, shading: Shading) -> FrameView {
    FrameView { quality: Quality { shading, ..Quality::default() }, ..FrameView::of(scene) }
}

/// A ball of 528 triangles with a radius of 1, with the normals of the sphere.
fn mesh_ball(normals: NormalMode) -> (Scene, Arc<CompiledMesh>) {
    let mut mesh = ball(12, 24);
    mesh.normals = mesh.positions.iter().map(|position| position.as_vec3()).collect();
    let (mesh, _) = CompiledMesh::compile(&mesh).unwrap();
    let mut scene = empty(SIDE, SIDE);
    scene.models = vec![Model {
        mesh: mesh.id(),
        materials: vec![0, 1],
        normals,
        translate: DVec3::ZERO,
        rotate: DVec3::ZERO,
        scale: DVec3::ONE,
        group: DMat3::IDENTITY,
    }];
    scene.lights = vec![light(point(2.0, 4.0, 3.0), 0.9, Attenuation::None)];
    (scene, Arc::new(mesh))
}

/// Largest difference of a channel of the normals, as linear colours, from those of a sphere with a radius of 1, at the pixels in the
/// middle of the ball.
fn off_from_sphere(normals: NormalMode) -> f64 {
    let (scene, mesh) = mesh_ball(normals);
    let (picture, counts) = render(&scene, &[mesh], &shown(&scene, Shading::Normals));
    assert_eq!((counts.shadow, counts.secondary), (0, 0));
    let Basis { forward, right, up } = Basis::of(&scene.camera);
    let half = libm::tan(scene.camera.fov.to_radians() / 2.0);
    let position = scene.camera.position;
    let mut most: f64 = 0.0;
    let mut compared = 0;
    for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
        let place = |index: u32| ((f64::from(index) + 0.5) / f64::from(SIDE) * 2.0 - 1.0) * half;
        let ray = (forward + right * place(x) - up * place(y)).normalize();
        let along = position.dot(ray);
        let squared_distance = position.length_squared() - along * along;
        if squared_distance > 0.36 {
            continue;
        }
        compared += 1;
        let normal = position + ray * (-along - (1.0 - squared_distance).sqrt());
        let found = picture.pixel(x, y).unwrap().map(decode);
        for (found, expected) in found.into_iter().zip(((normal + 1.0) / 2.0).to_array()) {
            most = most.max((found - expected).abs());
        }
    }
    assert!(compared > 100, "{compared} pixels");
    most
}

#[test]
fn interpolated_normals_of_a_mesh_are_those_of_the_smooth_surface() {
    let (smooth, flat) = (off_from_sphere(NormalMode::Smooth), off_from_sphere(NormalMode::Flat));
    assert!(smooth < 0.02, "{smooth}");
    assert!(flat > 0.04, "{flat}");
}

/// Under white ambient light alone, a picture with light is the diffuse colours, except for the background.
#[test]
fn diffuse_colours_are_those_of_white_ambient_light() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/textured.toml");
    let LoadedScene { mut scene, meshes, textures, .. } = load(&path).unwrap();
    scene.ambient = Vec3::ONE;
    scene.lights.clear();
    scene.lights.push(light(point(0.0, 1.0, 0.0), 0.0, Attenuation::None));
    for material in &mut scene.materials {
        *material = Material { emission: Vec3::ZERO, unlit: false, ..*material };
    }
    scene.background = rayfarm_tracer::scene::Background::Color(Vec3::ZERO);
    (scene.render.width, scene.render.height) = (96, 72);
    let picture = |shading| render_textured(&scene, &meshes, &textures, &shown(&scene, shading)).0;
    let albedo = picture(Shading::Albedo);
    assert!(albedo == picture(Shading::Full), "the same bytes");
    let colors: std::collections::BTreeSet<&[u8]> = albedo.pixels.chunks_exact(3).collect();
    assert!(colors.len() > 100, "textures have more than {} colours", colors.len());
}

/// All pixels within a step, on spheres, planes, triangles and instances of meshes with flat and smooth normals.
#[test]
fn pictures_without_light_are_those_of_the_oracle() {
    let (instances, mesh) = instanced(96, 72);
    let mesh = std::slice::from_ref(&mesh);
    for (scene, meshes) in [(analytic(96, 72), &[][..]), (instances, mesh)] {
        for shading in [Shading::Normals, Shading::Depth, Shading::Item, Shading::Albedo] {
            let view = shown(&scene, shading);
            let (picture, _) = render(&scene, meshes, &view);
            let expected = Oracle::new(&scene, meshes, &[], &view).render();
            let difference = compare(&picture, &expected).unwrap();
            assert!(difference.max <= 1, "{shading:?}: {difference:?}");
        }
    }
}
