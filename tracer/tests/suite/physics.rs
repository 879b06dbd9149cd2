//! Radiances with known values, and pictures that must not change.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use crate::common::{analytic, ball, empty, instanced, light, point, render};
use glam::{DMat3, DVec3, Vec3};
use proptest::prelude::*;
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::mesh::CompiledMesh;
use rayfarm_tracer::scene::{
    Attenuation, Background, FrameView, LightKind, Material, Model, NormalMode, Plane, Quality, Scene,
    Sphere, Triangle,
};
use rayfarm_tracer::{Cancelled, CompileError, CompiledScene, IsCancelled, PreparedFrame, render_rows, srgb};

/// One pixel in the middle of the picture.
fn middle(scene: &Scene) -> [u8; 3] {
    let (image, _) = render(scene, &[], &FrameView { width: 1, height: 1, ..FrameView::of(scene) });
    image.pixel(0, 0).unwrap()
}

fn code(linear: f32) -> u8 {
    srgb::encode(Vec3::splat(linear))[0]
}

/// A unit ball seen from z = 4, lit from the camera: N = L = V = H in the middle.
fn lit_sphere(material: Material) -> Scene {
    let mut scene = empty(1, 1);
    scene.camera.position = DVec3::new(0.0, 0.0, 4.0);
    scene.materials = vec![material];
    scene.spheres = vec![Sphere {
        center: DVec3::ZERO,
        radius: 1.0,
        material: 0,
        inside_out: false,
        uv_rotate: DVec3::ZERO,
    }];
    scene.lights = vec![light(point(0.0, 0.0, 4.0), 1.0, Attenuation::None)];
    scene.ambient = Vec3::ZERO;
    scene
}

#[test]
fn a_ball_lit_from_the_eye_shows_its_albedo_and_its_highlight() {
    let material =
        Material { diffuse: Vec3::splat(0.25), specular: Vec3::ZERO, exponent: 1.0, ..Material::NEUTRAL };
    assert_eq!(middle(&lit_sphere(material)), [code(0.25); 3]);
    assert_eq!(middle(&lit_sphere(Material { specular: Vec3::splat(0.5), ..material })), [code(0.75); 3]);
}

#[test]
fn inverse_square_divides_by_the_distance_to_the_surface() {
    let mut scene = lit_sphere(Material {
        diffuse: Vec3::splat(0.9),
        specular: Vec3::ZERO,
        exponent: 1.0,
        ..Material::NEUTRAL
    });
    scene.lights[0].attenuation = Attenuation::InverseSquare;
    assert_eq!(middle(&scene), [code(0.1); 3]);
}

#[test]
fn ambient_counts_once_whatever_the_number_of_lights() {
    let mut scene = lit_sphere(Material {
        diffuse: Vec3::splat(0.5),
        specular: Vec3::ZERO,
        exponent: 1.0,
        ..Material::NEUTRAL
    });
    scene.ambient = Vec3::splat(0.4);
    scene.lights = vec![light(point(0.0, 0.0, -9.0), 1.0, Attenuation::None); 7];
    assert_eq!(middle(&scene), [code(0.2); 3]);
}

#[test]
fn a_slanted_plane_follows_the_cosine() {
    let mut scene =
        lit_sphere(Material { diffuse: Vec3::ONE, specular: Vec3::ZERO, exponent: 1.0, ..Material::NEUTRAL });
    scene.spheres.clear();
    scene.planes = vec![Plane { point: DVec3::ZERO, normal: DVec3::Z, material: 0, size: 1.0 }];
    let direction = DVec3::new(0.0, -libm::sqrt(0.75), -0.5);
    scene.lights = vec![light(LightKind::Directional { direction }, 1.0, Attenuation::None)];
    assert_eq!(middle(&scene), [code(0.5); 3]);
}

#[test]
fn an_occluder_shades_unless_the_light_casts_no_shadows() {
    let mut scene = lit_sphere(Material {
        diffuse: Vec3::splat(0.5),
        specular: Vec3::ZERO,
        exponent: 1.0,
        ..Material::NEUTRAL
    });
    scene.lights[0].kind = point(0.0, 6.0, 6.0);
    let lit = middle(&scene);
    scene.spheres.push(Sphere {
        center: DVec3::new(0.0, 3.0, 3.5),
        radius: 0.4,
        material: 0,
        inside_out: false,
        uv_rotate: DVec3::ZERO,
    });
    assert_eq!(middle(&scene), [0; 3]);
    scene.lights[0].shadows = false;
    assert_eq!(middle(&scene), lit);
    assert_ne!(lit, [0; 3]);
}

#[test]
fn objects_behind_a_light_do_not_shade() {
    let mut scene = lit_sphere(Material {
        diffuse: Vec3::splat(0.5),
        specular: Vec3::ZERO,
        exponent: 1.0,
        ..Material::NEUTRAL
    });
    let lit = middle(&scene);
    scene.spheres.push(Sphere {
        center: DVec3::new(0.0, 0.0, 9.0),
        radius: 1.0,
        material: 0,
        inside_out: false,
        uv_rotate: DVec3::ZERO,
    });
    assert_eq!(middle(&scene), lit);
}

#[test]
fn the_gradient_runs_from_straight_down_to_straight_up() {
    let mut scene = empty(1, 1);
    scene.background = Background::Gradient { bottom: Vec3::ZERO, top: Vec3::ONE };
    scene.camera.position = DVec3::ZERO;
    scene.camera.fov = 1.0;
    scene.camera.up = DVec3::Z;
    let mut towards = |direction: DVec3| {
        scene.camera.look_at = direction;
        middle(&scene)
    };
    assert_eq!(towards(DVec3::Y), [255; 3]);
    assert_eq!(towards(DVec3::NEG_Y), [0; 3]);
    assert_eq!(towards(DVec3::X), [code(0.5); 3]);
}

#[test]
fn no_acne_on_planes_spheres_and_coplanar_triangles_at_any_angle() {
    let corner = |x: f64, z: f64| DVec3::new(x, 0.0, z);
    let grid = |i: i32| f64::from(i) * 0.37 - 3.0;
    for elevation in [89.0, 45.0, 5.0, 0.5, 0.1_f64] {
        let mut scene = empty(200, 150);
        scene.camera.position = DVec3::new(0.3, 1.5, 4.0);
        scene.ambient = Vec3::ZERO;
        let (s, c) = (libm::sin(elevation.to_radians()), libm::cos(elevation.to_radians()));
        let direction = DVec3::new(-0.6 * c, -s, -0.8 * c);
        scene.lights = vec![light(LightKind::Directional { direction }, 1.0, Attenuation::None)];
        for (i, j) in (0..16).flat_map(|i| (0..16).map(move |j| (i, j))) {
            let [a, b] = [corner(grid(i), grid(j)), corner(grid(i + 1), grid(j))];
            let [d, e] = [corner(grid(i + 1), grid(j + 1)), corner(grid(i), grid(j + 1))];
            scene.triangles.push(Triangle { vertices: [a, b, d], uvs: None, material: 1 });
            scene.triangles.push(Triangle { vertices: [a, d, e], uvs: None, material: 1 });
        }
        let mut planar = scene.clone();
        planar.triangles.clear();
        planar.planes = vec![Plane { point: DVec3::ZERO, normal: DVec3::Y, material: 1, size: 1.0 }];
        let mut unshadowed = scene.clone();
        unshadowed.lights[0].shadows = false;
        let view = FrameView::of(&scene);
        assert!(render(&scene, &[], &view).0 == render(&unshadowed, &[], &view).0, "triangles, {elevation}");
        unshadowed = planar.clone();
        unshadowed.lights[0].shadows = false;
        assert!(render(&planar, &[], &view).0 == render(&unshadowed, &[], &view).0, "plane, {elevation}");
    }
}

/// The facets of a convex mesh cannot shade each other: those that face the light are lit.
#[test]
fn no_acne_on_a_convex_mesh_under_any_light() {
    let mesh = Arc::new(CompiledMesh::compile(&ball(60, 90)).unwrap().0);
    for elevation in [80.0, 30.0, 2.0, -40.0_f64] {
        let mut scene = empty(240, 180);
        scene.camera.position = DVec3::new(0.0, 0.0, 3.0);
        let (s, c) = (libm::sin(elevation.to_radians()), libm::cos(elevation.to_radians()));
        scene.lights = vec![light(point(30.0 * c, 30.0 * s, 3.0), 1.0, Attenuation::None)];
        scene.models = vec![Model {
            mesh: mesh.id(),
            materials: vec![1, 2],
            normals: NormalMode::Flat,
            translate: DVec3::ZERO,
            rotate: DVec3::new(10.0, 20.0, 30.0),
            scale: DVec3::ONE,
            group: DMat3::IDENTITY,
        }];
        let mut unshadowed = scene.clone();
        unshadowed.lights[0].shadows = false;
        let meshes = [Arc::clone(&mesh)];
        let view = FrameView::of(&scene);
        assert!(
            render(&scene, &meshes, &view).0 == render(&unshadowed, &meshes, &view).0,
            "{elevation} degrees"
        );
    }
}

#[test]
fn a_scene_scaled_by_a_power_of_two_is_the_same_picture_bit_for_bit() {
    let mut scene = analytic(96, 64);
    scene.lights.iter_mut().for_each(|light| light.attenuation = Attenuation::None);
    let (expected, _) = render(&scene, &[], &FrameView::of(&scene));
    for exponent in [-40, -7, 1, 40] {
        let scaled = scaled(&scene, f64::from(exponent).exp2());
        let (image, _) = render(&scaled, &[], &FrameView::of(&scaled));
        assert!(image == expected, "2^{exponent}");
    }
    let (instanced, mesh) = instanced(96, 64);
    let (expected, _) = render(&instanced, std::slice::from_ref(&mesh), &FrameView::of(&instanced));
    for exponent in [-40, 10, 40] {
        let scaled = scaled(&instanced, f64::from(exponent).exp2());
        let (image, _) = render(&scaled, std::slice::from_ref(&mesh), &FrameView::of(&scaled));
        assert!(image == expected, "instances, 2^{exponent}");
    }
}

fn scaled(scene: &Scene, factor: f64) -> Scene {
    moved(scene, |p| p * factor, factor)
}

/// The scene with all its positions moved, and lengths multiplied.
fn moved(scene: &Scene, place: impl Fn(DVec3) -> DVec3, factor: f64) -> Scene {
    let mut scene = scene.clone();
    scene.camera.position = place(scene.camera.position);
    scene.camera.look_at = place(scene.camera.look_at);
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Point { position } | LightKind::Spot { position, .. } => *position = place(*position),
            LightKind::Directional { .. } => {}
        }
    }
    for model in &mut scene.models {
        model.translate = place(model.translate);
        model.scale *= factor;
    }
    for sphere in &mut scene.spheres {
        sphere.center = place(sphere.center);
        sphere.radius *= factor;
    }
    scene.planes.iter_mut().for_each(|plane| plane.point = place(plane.point));
    scene.triangles.iter_mut().for_each(|triangle| triangle.vertices = triangle.vertices.map(&place));
    scene
}

#[test]
fn a_scene_far_from_the_origin_gives_the_same_picture() {
    let (scene, mesh) = instanced(96, 64);
    let meshes = [mesh];
    let (near, _) = render(&scene, &meshes, &FrameView::of(&scene));
    for distance in [1e3, 1e5, 1e7] {
        let far = moved(&scene, |p| p + DVec3::new(distance, -distance, distance * 0.5), 1.0);
        let (image, _) = render(&far, &meshes, &FrameView::of(&far));
        let difference = rayfarm_tracer::image::compare(&image, &near).unwrap();
        assert!(difference.differing_pixels <= 2, "{distance}: {difference:?}");
    }
}

#[test]
fn a_frame_that_cannot_be_rendered_is_refused_with_the_limit() {
    let scene = analytic(1, 1);
    let compiled = Arc::new(CompiledScene::new(scene.clone(), [], []).unwrap());
    let refusal = |view: FrameView| PreparedFrame::new(Arc::clone(&compiled), &view).unwrap_err().to_string();
    let view = FrameView::of(&scene);
    assert!(refusal(FrameView { width: 0, ..view }).contains("16384"));
    assert!(refusal(FrameView { height: 20_000, ..view }).contains("16384"));
    assert!(refusal(FrameView { samples: 3, ..view }).contains("square number"));
    let mut wide = view;
    wide.camera.fov = 180.0;
    assert!(refusal(wide).contains("180"));
}

#[test]
fn rendering_stops_when_cancelled() {
    let scene = analytic(16, 64);
    let compiled = Arc::new(CompiledScene::new(scene.clone(), [], []).unwrap());
    let frame = PreparedFrame::new(compiled, &FrameView::of(&scene)).unwrap();
    let asked = std::cell::Cell::new(0);
    let after_three = || {
        asked.set(asked.get() + 1);
        asked.get() > 3
    };
    let mut out = vec![0; 16 * 64 * 3];
    assert_eq!(render_rows(&frame, 0..64, &mut out, &after_three), Err(Cancelled));
    assert_eq!(asked.get(), 4);
}

/// A frame of one band: cancellation between its tiles stops it, for every kind of sampling.
#[test]
fn rendering_stops_between_the_tiles_of_a_band() {
    let scene = analytic(128, 16);
    let compiled = Arc::new(CompiledScene::new(scene.clone(), [], []).unwrap());
    let quality = Quality { adaptive: true, ..FrameView::of(&scene).quality };
    let regular = FrameView::of(&scene);
    let adaptive = FrameView { samples: 4, quality, ..regular };
    for (view, tiles) in [(regular, 8), (adaptive, 9)] {
        let frame = PreparedFrame::new(Arc::clone(&compiled), &view).unwrap();
        let mut out = vec![0; 16 * 128 * 3];
        let asked = std::cell::Cell::new(0);
        let stop_at = |question: usize, out: &mut [u8]| {
            asked.set(0);
            let cancelled = || asked.replace(asked.get() + 1) == question;
            let stopped = render_rows(&frame, 0..16, out, &cancelled);
            (stopped.err(), asked.get())
        };
        let (whole, questions) = stop_at(usize::MAX, &mut out);
        assert!(whole.is_none() && questions >= tiles, "{questions} questions for {tiles} tiles");
        for question in 0..questions {
            assert_eq!(stop_at(question, &mut vec![0; out.len()]), (Some(Cancelled), question + 1));
        }
        // Cancelling has no side effects: the frame renders as before.
        let mut again = vec![0; out.len()];
        render_rows(&frame, 0..16, &mut again, &|| false).unwrap();
        assert_eq!(again, out);
    }
}

#[test]
fn cancelled_compilation_stops_at_every_step() {
    let mut scene = analytic(16, 16);
    let material = scene.spheres[0].material;
    let sphere = |i: u32| Sphere {
        center: DVec3::new(f64::from(i), f64::from(i % 7), 0.0),
        radius: 0.4,
        material,
        inside_out: false,
        uv_rotate: DVec3::ZERO,
    };
    scene.spheres = (0..3_000).map(sphere).collect();
    let asked = AtomicUsize::new(0);
    let compile = |question: usize| {
        asked.store(0, Relaxed);
        CompiledScene::new_unless(scene.clone(), [], [], &|| asked.fetch_add(1, Relaxed) == question)
    };
    let whole = Arc::new(compile(usize::MAX).unwrap());
    let questions = asked.load(Relaxed);
    // Rounds of clustering, passes of reinsertion, and the steps around them.
    assert!(questions > 40, "{questions} questions");
    for question in 0..questions {
        assert!(matches!(compile(question), Err(CompileError::Cancelled(_))), "question {question}");
        assert_eq!(asked.load(Relaxed), question + 1, "work goes on");
    }
    let view = FrameView::of(&scene);
    let frame = |cancelled: &IsCancelled<'_>| PreparedFrame::new_unless(Arc::clone(&whole), &view, cancelled);
    assert!(frame(&|| false).is_ok());
    for question in 0..3 {
        asked.store(0, Relaxed);
        let stopped = frame(&|| asked.fetch_add(1, Relaxed) == question);
        assert!(matches!(stopped, Err(CompileError::Cancelled(_))), "question {question}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn a_frame_cut_anywhere_is_the_same_frame(cuts in prop::collection::btree_set(1..60_u32, 0..6)) {
        let (scene, mesh) = instanced(40, 60);
        let view = FrameView::of(&scene);
        let (whole, _) = render(&scene, std::slice::from_ref(&mesh), &view);
        let frame = PreparedFrame::new(Arc::new(CompiledScene::new(scene, [mesh], []).unwrap()), &view).unwrap();
        let mut pieces = RgbImage::new(40, 60);
        let mut start = 0;
        for end in cuts.into_iter().chain([60]) {
            let bytes = &mut pieces.pixels[start as usize * 120..end as usize * 120];
            render_rows(&frame, start..end, bytes, &|| false).unwrap();
            start = end;
        }
        prop_assert!(pieces == whole);
    }
}
