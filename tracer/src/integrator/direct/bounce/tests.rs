//! Reflection and transmission by physics: pictures whose colours follow from the equations by hand.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::compile::CompiledScene;
use crate::frame::PreparedFrame;
use crate::integrator::render_rows;
use crate::rays::RayCounts;
use crate::scene::{
    Background, Camera, CameraKind, Disk, FrameView, Material, Plane, RenderSettings, Scene, Sphere,
};
use crate::simd;
use crate::srgb;

const SIDE: u32 = 32;

/// An empty, unlit scene under a white sky, with the camera at z = 4.
fn under_white_sky() -> Scene {
    Scene {
        ambient: Vec3::ZERO,
        render: RenderSettings { width: SIDE, height: SIDE, ..RenderSettings::default() },
        camera: Camera {
            position: DVec3::Z * 4.0,
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            fov: 40.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        },
        background: Background::Color(Vec3::ONE),
        background_visible: true,
        lights: vec![],
        materials: vec![],
        textures: vec![],
        models: vec![],
        spheres: vec![],
        disks: vec![],
        planes: vec![],
        triangles: vec![],
        ..Scene::default()
    }
}

/// A material without light of its own.
fn clear() -> Material {
    Material { diffuse: Vec3::ZERO, specular: Vec3::ZERO, ..Material::NEUTRAL }
}

fn ball(center: DVec3, radius: f64, material: u32) -> Sphere {
    Sphere { center, radius, material, inside_out: false, uv_rotate: DVec3::ZERO }
}

/// Renders on every level, and asserts that the bytes agree, whole and in cuts.
fn render(scene: &Scene) -> (Vec<[u8; 3]>, RayCounts) {
    let view = FrameView::of(scene);
    let compiled = Arc::new(CompiledScene::new(scene.clone(), [], []).unwrap());
    let mut frame = PreparedFrame::new(compiled, &view).unwrap();
    let mut first: Option<(Vec<u8>, RayCounts)> = None;
    for level in simd::all() {
        frame.level = level;
        let mut bytes = vec![0; (view.width * view.height * 3) as usize];
        let counts = render_rows(&frame, 0..view.height, &mut bytes, &|| false).unwrap();
        let (expected, _) = first.get_or_insert((bytes.clone(), counts));
        assert!(bytes == *expected, "{}", simd::name(level));
        let row = (view.width * 3) as usize;
        for (top, bottom) in [(0, 1), (1, 7), (7, 18), (18, SIDE)] {
            let mut rows = vec![0; (bottom - top) as usize * row];
            render_rows(&frame, top..bottom, &mut rows, &|| false).unwrap();
            assert!(rows == expected[top as usize * row..bottom as usize * row], "rows {top} to {bottom}");
        }
    }
    let (bytes, counts) = first.unwrap();
    (bytes.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect(), counts)
}

fn center(pixels: &[[u8; 3]]) -> [u8; 3] {
    pixels[(SIDE / 2 * SIDE + SIDE / 2) as usize]
}

fn assert_near(found: [u8; 3], expected: [f32; 3]) {
    let expected = srgb::encode(Vec3::from_array(expected));
    let near = found.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 1);
    assert!(near, "{found:?}, not {expected:?}");
}

#[test]
fn a_mirror_shows_its_share_of_the_sky() {
    let mut scene = under_white_sky();
    scene.materials = vec![Material { reflect: Vec3::new(0.5, 0.25, 0.9), ..clear() }];
    scene.planes = vec![Plane { point: DVec3::NEG_Z, normal: DVec3::Z, material: 0, size: 1.0 }];
    let (pixels, counts) = render(&scene);
    pixels.iter().for_each(|&pixel| assert_near(pixel, [0.5, 0.25, 0.9]));
    assert_eq!((counts.primary, counts.secondary), (1024, 1024));
}

#[test]
fn between_two_mirrors_each_bounce_takes_its_share() {
    let mut scene = under_white_sky();
    let glow = Material { emission: Vec3::splat(0.1), reflect: Vec3::splat(0.5), ..clear() };
    scene.materials = vec![glow];
    let mirror =
        |z: f64| Plane { point: DVec3::Z * z, normal: DVec3::Z * -z.signum(), material: 0, size: 1.0 };
    scene.planes = vec![mirror(-1.0), mirror(5.0)];
    for depth in [0_u8, 1, 2, 5, 30] {
        scene.render.quality.max_depth = depth;
        scene.render.quality.min_contribution = 0.0;
        let (pixels, counts) = render(&scene);
        let expected: f32 = (0..=depth).map(|bounce| 0.1 * 0.5_f32.powi(i32::from(bounce))).sum();
        assert_near(center(&pixels), [expected; 3]);
        assert_eq!(counts.secondary, u64::from(depth) * 1024);
    }
}

#[test]
fn bounces_that_cannot_contribute_enough_are_not_traced() {
    let mut scene = under_white_sky();
    scene.materials = vec![Material { reflect: Vec3::splat(0.1), ..clear() }];
    let mirror =
        |z: f64| Plane { point: DVec3::Z * z, normal: DVec3::Z * -z.signum(), material: 0, size: 1.0 };
    scene.planes = vec![mirror(-1.0), mirror(5.0)];
    scene.render.quality.min_contribution = 0.005;
    // Weights 0.1 and 0.01 are enough, 0.001 is not.
    assert_eq!(render(&scene).1.secondary, 2 * 1024);
}

#[test]
fn glass_without_refraction_is_invisible() {
    let mut scene = under_white_sky();
    scene.background = Background::Gradient { bottom: Vec3::new(0.1, 0.2, 0.3), top: Vec3::ONE };
    let (empty, _) = render(&scene);
    scene.materials = vec![Material { transmit: Vec3::ONE, ior: 1.0, ..clear() }];
    scene.spheres = vec![ball(DVec3::ZERO, 1.0, 0), ball(DVec3::new(0.2, 0.3, 0.1), 0.4, 0)];
    let (through, counts) = render(&scene);
    let off = empty.iter().zip(&through).filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 1));
    assert_eq!(off.count(), 0);
    assert!(counts.secondary > 0);
}

#[test]
fn a_ball_of_glass_in_a_white_sky_cannot_be_seen() {
    // Fresnel shares add up to one: the white furnace.
    let mut scene = under_white_sky();
    let glass = Material { reflect: Vec3::ONE, transmit: Vec3::ONE, fresnel: true, ior: 1.5, ..clear() };
    scene.materials = vec![glass, Material { ior: 1.33, ..glass }];
    scene.spheres = vec![ball(DVec3::ZERO, 1.0, 0)];
    scene.render.quality.max_depth = 20;
    scene.render.quality.min_contribution = 1e-5;
    let (pixels, _) = render(&scene);
    pixels.iter().for_each(|&pixel| assert_near(pixel, [1.0; 3]));
    // Glass around water: total reflection keeps some light inside for more than twenty bounces.
    scene.spheres.push(ball(DVec3::new(0.1, 0.0, 0.2), 0.5, 1));
    scene.render.quality.max_depth = 64;
    let (pixels, _) = render(&scene);
    pixels.iter().for_each(|&pixel| assert_near(pixel, [1.0; 3]));
}

#[test]
fn light_is_absorbed_along_its_way_inside() {
    let mut scene = under_white_sky();
    let glass = Material { transmit: Vec3::ONE, ior: 1.0, absorption: Vec3::new(0.5, 1.0, 0.8), ..clear() };
    scene.materials = vec![glass];
    scene.spheres = vec![ball(DVec3::ZERO, 1.0, 0)];
    // Two units of way through the middle.
    assert_near(center(&render(&scene).0), [0.25, 1.0, 0.64]);
    // The camera inside, 0.5 from the surface.
    scene.camera.position = DVec3::Z * 0.5;
    scene.camera.look_at = DVec3::Z * 4.0;
    assert_near(center(&render(&scene).0), [0.5_f32.sqrt(), 1.0, 0.8_f32.sqrt()]);
    // Without a bounce, the same way takes its share of the light of the surface.
    scene.ambient = Vec3::ONE;
    scene.materials[0].diffuse = Vec3::splat(0.5);
    scene.render.quality.max_depth = 0;
    let (pixels, counts) = render(&scene);
    assert_near(center(&pixels), [0.5 * 0.5_f32.sqrt(), 0.5, 0.5 * 0.8_f32.sqrt()]);
    assert_eq!(counts.secondary, 0);
}

#[test]
fn total_reflection_ends_at_the_depth() {
    // From the middle of a ball of little index, no ray leaves at more than the critical angle: the camera next to the surface
    // sees rings of it without end.
    let mut scene = under_white_sky();
    scene.materials =
        vec![Material { transmit: Vec3::ONE, ior: 2.0, emission: Vec3::splat(0.001), ..clear() }];
    scene.spheres = vec![ball(DVec3::ZERO, 1.0, 0)];
    scene.camera.position = DVec3::new(0.0, 0.95, 0.0);
    scene.camera.look_at = DVec3::new(1.0, 0.95, 0.0);
    scene.camera.up = DVec3::Y;
    scene.render.quality.max_depth = 64;
    scene.render.quality.min_contribution = 0.0;
    let (_, counts) = render(&scene);
    assert!(counts.secondary > 30 * 1024 && counts.secondary <= 64 * 1024, "{}", counts.secondary);
}

#[test]
fn a_tree_of_rays_is_bounded() {
    // Each surface of nested shells splits every ray: without a bound 2^64 of them.
    let mut scene = under_white_sky();
    scene.render.width = 4;
    scene.render.height = SIDE;
    scene.materials = vec![Material { reflect: Vec3::ONE, transmit: Vec3::ONE, ior: 1.1, ..clear() }];
    scene.spheres = (1..=8).map(|i| ball(DVec3::ZERO, 0.12 * f64::from(i), 0)).collect();
    scene.render.quality.max_depth = 64;
    scene.render.quality.min_contribution = 0.0;
    let (_, counts) = render(&scene);
    assert!(counts.secondary <= 1024 * counts.primary);
    assert!(counts.secondary > 100 * counts.primary / 4, "{}", counts.secondary);
}

#[test]
fn a_sheet_of_thin_glass_bends_nothing() {
    let mut scene = under_white_sky();
    scene.background = Background::Gradient { bottom: Vec3::ZERO, top: Vec3::ONE };
    let (empty, _) = render(&scene);
    scene.materials =
        vec![Material { transmit: Vec3::ONE, ior: 1.5, thin: true, absorption: Vec3::splat(0.1), ..clear() }];
    let normal = DVec3::new(0.3, 0.2, 1.0).normalize();
    scene.disks = vec![Disk { center: DVec3::ZERO, normal, radius: 1.0, material: 0 }];
    let (through, _) = render(&scene);
    assert!(empty.iter().zip(&through).all(|(a, b)| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) <= 1)));
}

#[test]
fn a_plane_of_glass_shifts_what_is_behind_as_snell_says() {
    // A slab of glass, one unit thick, before a wall with an edge at x = 0.4, seen along a slant of 45 degrees.
    let mut scene = under_white_sky();
    scene.materials = vec![
        Material { transmit: Vec3::ONE, ior: 1.5, ..clear() },
        Material { emission: Vec3::new(1.0, 0.0, 0.0), ..clear() },
        Material { emission: Vec3::new(0.0, 1.0, 0.0), ..clear() },
    ];
    let glass = |z: f64| Plane { point: DVec3::Z * z, normal: DVec3::Z * z.signum(), material: 0, size: 1.0 };
    scene.planes = vec![glass(0.5), glass(-0.5)];
    let wall = |x: [f64; 2], material| {
        let corner = |x, y| DVec3::new(x, y, -1.0);
        let [a, b, c, d] = [corner(x[0], -9.0), corner(x[1], -9.0), corner(x[1], 9.0), corner(x[0], 9.0)];
        [[a, b, c], [a, c, d]].map(|vertices| crate::scene::Triangle { vertices, uvs: None, material })
    };
    // A ray of 45 degrees to the right, from x = -2 at z = 1.5: 1 in air, then the slab, then 0.5 in air.
    let sine = libm::sqrt(0.5) / 1.5;
    let in_glass = sine / (1.0 - sine * sine).sqrt();
    let lands = -2.0 + 1.0 + in_glass + 0.5;
    for (shift, expected) in [(1e-3, [1.0, 0.0, 0.0]), (-1e-3, [0.0, 1.0, 0.0])] {
        let edge = lands + shift;
        scene.triangles = wall([-9.0, edge], 1).into_iter().chain(wall([edge, 9.0], 2)).collect();
        scene.camera.position = DVec3::new(-2.0, 0.0, 1.5);
        scene.camera.look_at = DVec3::new(-1.0, 0.0, 0.5);
        scene.camera.fov = 1e-3;
        assert_near(center(&render(&scene).0), expected);
    }
}
