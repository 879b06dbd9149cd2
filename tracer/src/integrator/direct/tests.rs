//! Extremes of shading: blocks full of materials, lights too bright and points too far for single precision. Every level gives
//! the same bytes, and those of the oracle.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::compile::CompiledScene;
use crate::frame::PreparedFrame;
use crate::integrator::render_rows;
use crate::reference::Oracle;
use crate::scene::{
    Attenuation, Background, Camera, CameraKind, ExponentPrecision, FrameView, Light, LightKind, Material,
    Plane, Quality, RenderSettings, Scene, Shading, Sphere, Triangle,
};
use crate::simd;

const SIDE: u32 = 48;

/// An empty scene with the camera at z = 4.
fn empty() -> Scene {
    Scene {
        ambient: Vec3::splat(0.02),
        render: RenderSettings { width: SIDE, height: SIDE, ..RenderSettings::default() },
        camera: Camera {
            position: DVec3::Z * 4.0,
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            fov: 40.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        },
        background: Background::Color(Vec3::splat(0.3)),
        lights: vec![],
        materials: vec![],
        textures: vec![],
        models: vec![],
        spheres: vec![],
        planes: vec![],
        triangles: vec![],
        background_visible: true,
        disks: Vec::new(),
        ..Scene::default()
    }
}

fn material(diffuse: Vec3, specular: f32, exponent: f32) -> Material {
    Material { diffuse, specular: Vec3::splat(specular), exponent, ..Material::NEUTRAL }
}

fn light(position: DVec3, color: f32, attenuation: Attenuation) -> Light {
    Light {
        kind: LightKind::Point { position },
        color: Vec3::splat(color),
        attenuation,
        shadows: true,
        radius: 0.0,
        shadow_samples: None,
    }
}

/// A wall at z = 0 of 40 x 40 squares with alternating materials: the rays of a block hit different ones.
fn patchwork(scene: &mut Scene) {
    let corner = |i: u32, j: u32| DVec3::new(f64::from(i) * 0.075 - 1.5, f64::from(j) * 0.075 - 1.5, 0.0);
    for (i, j) in (0..40).flat_map(|i| (0..40).map(move |j| (i, j))) {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        let material = (i * 7 + j * 3) % scene.materials.len() as u32;
        scene.triangles.push(Triangle { vertices: [a, b, c], uvs: None, material });
        scene.triangles.push(Triangle { vertices: [a, c, d], uvs: None, material });
    }
}

/// Renders on all levels, and asserts that they agree. Returns the pixels that differ from the oracle by more than a step: index,
/// value, expected value.
fn off_from_oracle(scene: &Scene, what: &str) -> Vec<(usize, [u8; 3], [u8; 3])> {
    off_from_oracle_by(1, &FrameView::of(scene), scene, what)
}

/// [`off_from_oracle`] with a number of steps.
fn off_from_oracle_by(
    steps: u8,
    view: &FrameView,
    scene: &Scene,
    what: &str,
) -> Vec<(usize, [u8; 3], [u8; 3])> {
    let compiled = Arc::new(CompiledScene::new(scene.clone(), [], []).unwrap());
    let mut frame = PreparedFrame::new(compiled, view).unwrap();
    let mut bytes_at = |level| {
        frame.level = level;
        let mut bytes = vec![0; (view.width * view.height * 3) as usize];
        render_rows(&frame, 0..view.height, &mut bytes, &|| false).unwrap();
        bytes
    };
    let first = bytes_at(simd::best());
    for level in simd::all() {
        assert!(bytes_at(level) == first, "{what} with {}", simd::name(level));
    }
    let expected = Oracle::new(scene, &[], &[], view).render();
    let pixels = |bytes: &[u8]| bytes.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect::<Vec<_>>();
    let pairs = pixels(&first).into_iter().zip(pixels(&expected.pixels)).enumerate();
    let pairs = pairs.map(|(index, (found, expected))| (index, found, expected));
    pairs.filter(|(_, a, b)| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > steps)).collect()
}

#[test]
fn exponents_and_colors_mixed_in_every_block() {
    let mut scene = empty();
    let exponents = [
        40.0, 0.0, 0.5, 1.0, 2.0, 3.7, 7.0, 16.0, 100.5, 255.0, 256.0, 257.0, 1000.0, 1999.5, 2001.0, 1e4,
        1e6, 1e-3,
    ];
    for (i, exponent) in exponents.into_iter().enumerate() {
        let diffuse = Vec3::new(0.1 * (i % 8) as f32, 0.3, 0.05 * (i % 5) as f32);
        scene.materials.push(material(diffuse, 0.2 * (i % 4) as f32, exponent));
    }
    patchwork(&mut scene);
    scene.lights = vec![
        light(DVec3::new(0.5, 0.6, 3.0), 0.6, Attenuation::None),
        light(DVec3::new(-1.0, 0.3, 0.5), 0.4, Attenuation::InverseSquare),
    ];
    assert_eq!(off_from_oracle(&scene, "patchwork"), []);
    // All knobs that the kernels know, on every level; 0.002 of 0.36 is up to three steps where it is darkest.
    let fast = Quality { exponent: ExponentPrecision::Fast, ..Quality::default() };
    for quality in [fast, Quality { shadows: false, ..fast }, Quality { shading: Shading::Diffuse, ..fast }] {
        let view = FrameView { quality, ..FrameView::of(&scene) };
        assert_eq!(off_from_oracle_by(3, &view, &scene, "patchwork"), [], "{quality:?}");
    }
}

/// The light is right in front of the hit of a pixel. Nearer than 10^-6 its side of a point is not defined in single precision.
#[test]
fn lights_brighter_than_single_precision_on_colors_with_zeros() {
    for (distance, color) in [(1.0, 1e3), (1.0, 1e30), (1e-3, 1e3), (1e-3, 1e30), (1e-5, 1e30), (1e-6, 1e30)]
    {
        let mut scene = empty();
        scene.materials = vec![
            material(Vec3::X, 0.0, 1.0),
            material(Vec3::Y, 0.0, 1.0),
            material(Vec3::Z * 1e-3, 0.4, 300.0),
            material(Vec3::ZERO, 0.4, 30.0),
        ];
        patchwork(&mut scene);
        let pixel = 8.0 * libm::tan(20.0_f64.to_radians()) / f64::from(SIDE);
        let place = DVec3::new(0.5 * pixel, 0.5 * pixel, distance);
        scene.lights = vec![light(place, color, Attenuation::InverseSquare)];
        // Next to a wall the oracle's own points occlude each other.
        scene.lights[0].shadows = false;
        let off = off_from_oracle(&scene, &format!("{color} at {distance}"));
        assert_eq!(off, [], "{color} at {distance}");
    }
}

fn two_balls(scene: &mut Scene) {
    let ball = |x: f64, y: f64| Sphere {
        center: DVec3::new(x, y, 0.0),
        radius: 0.3,
        material: 0,
        inside_out: false,
        uv_rotate: DVec3::ZERO,
    };
    scene.materials = vec![material(Vec3::splat(0.6), 0.1, 9.0)];
    scene.spheres = vec![ball(-0.2, 0.3), ball(0.1, 0.9)];
    scene.lights = vec![light(DVec3::new(0.2, 5.0, 1.0), 0.7, Attenuation::None)];
}

const SUN: LightKind = LightKind::Directional { direction: DVec3::new(0.1, -1.0, 0.3) };

/// Shadows in tiles that contain the horizon of an infinite plane.
#[test]
fn shadows_next_to_a_horizon_are_those_of_the_oracle() {
    for (tilt, sun) in [(0.0, true), (1e-6, true), (1e-12, true), (0.0, false), (1e-12, false)] {
        let mut scene = empty();
        two_balls(&mut scene);
        scene.render.height = SIDE + 1;
        scene.camera.look_at = DVec3::new(0.0, -tilt, 3.0);
        scene.planes = vec![Plane { point: DVec3::Y * -0.2, normal: DVec3::Y, material: 0, size: 1.0 }];
        if sun {
            scene.lights[0].kind = SUN;
        }
        assert_eq!(off_from_oracle(&scene, "horizon"), [], "tilt {tilt}, sun {sun}");
    }
}

/// A small scene in front of a plane so far away that its points are infinite in single precision.
#[test]
fn a_plane_out_of_range_changes_no_shadows() {
    let mut scene = empty();
    two_balls(&mut scene);
    scene.lights[0].kind = SUN;
    let small = 1.0 / (1_u64 << 40) as f64;
    scene.camera.position *= small;
    for sphere in &mut scene.spheres {
        (sphere.center, sphere.radius) = (sphere.center * small, sphere.radius * small);
    }
    let rendered = |scene: &Scene| {
        let view = FrameView::of(scene);
        let frame =
            PreparedFrame::new(Arc::new(CompiledScene::new(scene.clone(), [], []).unwrap()), &view).unwrap();
        let mut bytes = vec![0; (view.width * view.height * 3) as usize];
        render_rows(&frame, 0..view.height, &mut bytes, &|| false).unwrap();
        bytes
    };
    let alone = rendered(&scene);
    scene.planes = vec![Plane { point: DVec3::Y * -1e30, normal: DVec3::Y, material: 0, size: 1.0 }];
    let before = rendered(&scene);
    let nothing = alone[..3].to_vec();
    let pairs = alone.chunks_exact(3).zip(before.chunks_exact(3));
    let balls: Vec<_> = pairs.filter(|(alone, _)| **alone != nothing).collect();
    assert!(balls.len() > 100 && balls.iter().all(|(alone, before)| alone == before));
}
