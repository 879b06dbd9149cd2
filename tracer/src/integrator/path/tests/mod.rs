//! Paths: the same bits however they are rendered, and pictures that follow from the equations by hand.

mod many_lamps;
mod skies;

use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::compile::CompiledScene;
use crate::film::PixelSums;
use crate::frame::PreparedFrame;
use crate::integrator::render_rows;
use crate::scene::{
    Attenuation, Background, Camera, CameraKind, FrameView, Integrator, Lens, Light, LightKind, Material,
    PathSettings, PixelFormat, Plane, Quality, Sampler, Scene, Sphere, Triangle,
};
use crate::simd;

/// Bytes of a pixel of sums.
const BYTES: usize = PixelFormat::Sums.bytes_per_pixel();

pub(super) fn diffuse(color: Vec3) -> Material {
    Material { diffuse: color, specular: Vec3::ZERO, ..Material::NEUTRAL }
}

pub(super) fn lamp(emission: Vec3) -> Material {
    Material { emission, ..diffuse(Vec3::ZERO) }
}

pub(super) fn ball(center: DVec3, radius: f64, material: u32) -> Sphere {
    Sphere { center, radius, material, inside_out: false, uv_rotate: DVec3::ZERO }
}

pub(super) fn light(kind: LightKind) -> Light {
    Light {
        kind,
        color: Vec3::new(0.9, 0.8, 0.7),
        attenuation: Attenuation::None,
        shadows: true,
        radius: 0.0,
        shadow_samples: None,
    }
}

/// A camera at `position` that looks at the origin.
pub(super) fn camera_at(position: DVec3) -> Camera {
    Camera { position, look_at: DVec3::ZERO, up: DVec3::NEG_Z, fov: 10.0, ..Camera::default() }
}

pub(super) fn path_view(scene: &Scene, side: u32, samples: u32, depth: u8) -> FrameView {
    FrameView {
        width: side,
        height: side,
        samples,
        integrator: Integrator::Path(PathSettings::default()),
        quality: Quality { max_depth: depth, ..Quality::default() },
        format: PixelFormat::Sums,
        ..FrameView::of(scene)
    }
}

pub(super) fn compiled(scene: &Scene) -> Arc<CompiledScene> {
    Arc::new(CompiledScene::new(scene.clone(), [], []).unwrap())
}

pub(super) fn sums(frame: &PreparedFrame, rows: std::ops::Range<u32>) -> Vec<PixelSums> {
    let mut bytes = vec![0xa5; rows.len() * frame.row_bytes()];
    render_rows(frame, rows, &mut bytes, &|| false).unwrap();
    bytes.as_chunks::<BYTES>().0.iter().map(PixelSums::from_bytes).collect()
}

/// Mean radiance of all pixels.
pub(super) fn mean(scene: &Scene, view: &FrameView) -> [f64; 3] {
    let frame = PreparedFrame::new(compiled(scene), view).unwrap();
    let mut all = PixelSums::default();
    let pixels = sums(&frame, 0..view.height);
    pixels.iter().for_each(|pixel| all.add(pixel));
    let per_sample = 1.0 / (pixels.len() as f64 * f64::from(view.samples) * f64::from(1 << 20));
    all.rgb.map(|sum| sum as f64 * per_sample)
}

/// A box of triangles and balls with lamps of every kind.
pub(super) fn furnished() -> Scene {
    let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let quad = |a: DVec3, b: DVec3, c: DVec3, d: DVec3, material| {
        [[a, b, c], [a, c, d]].map(|vertices| Triangle { vertices, uvs: None, material })
    };
    let mut triangles = Vec::new();
    triangles.extend(quad(
        corner(-2., -1., 2.),
        corner(2., -1., 2.),
        corner(2., -1., -2.),
        corner(-2., -1., -2.),
        0,
    ));
    triangles.extend(quad(
        corner(-2., -1., -2.),
        corner(2., -1., -2.),
        corner(2., 2., -2.),
        corner(-2., 2., -2.),
        1,
    ));
    triangles.extend(quad(
        corner(-0.5, 1.9, -0.5),
        corner(0.5, 1.9, -0.5),
        corner(0.5, 1.9, 0.5),
        corner(-0.5, 1.9, 0.5),
        2,
    ));
    let mut lamp_with_radius = light(LightKind::Point { position: DVec3::new(1.5, 1.0, 1.0) });
    lamp_with_radius.radius = 0.2;
    Scene {
        camera: Camera { fov: 50.0, up: DVec3::Y, ..camera_at(DVec3::new(0.5, 0.7, 5.0)) },
        background: Background::Color(Vec3::new(0.02, 0.03, 0.05)),
        lights: vec![light(LightKind::Point { position: DVec3::new(-1.5, 1.5, 1.0) }), lamp_with_radius],
        materials: vec![
            diffuse(Vec3::splat(0.7)),
            diffuse(Vec3::new(0.7, 0.2, 0.2)),
            lamp(Vec3::new(3.0, 2.5, 2.0)),
            Material { transmit: Vec3::ONE, absorption: Vec3::new(0.9, 0.8, 0.7), ..diffuse(Vec3::ZERO) },
            Material { reflect: Vec3::splat(0.8), ..diffuse(Vec3::splat(0.1)) },
            lamp(Vec3::new(0.5, 1.0, 4.0)),
        ],
        spheres: vec![
            ball(DVec3::new(-0.8, -0.5, 0.0), 0.5, 3),
            ball(DVec3::new(0.8, -0.4, -0.5), 0.6, 4),
            ball(DVec3::new(0.0, -0.8, 0.8), 0.2, 5),
        ],
        triangles,
        ..Scene::default()
    }
}

#[test]
fn all_levels_and_cuts_have_the_same_sums() {
    let scene = furnished();
    let mut view = FrameView { width: 18, height: 19, ..path_view(&scene, 1, 3, 5) };
    for kind in [CameraKind::PINHOLE, CameraKind::Orthographic { view_height: 3.0 }, CameraKind::Fisheye] {
        view.camera.kind = kind;
        // Other cameras have no lens.
        let apertures: &[f64] = if kind == CameraKind::PINHOLE { &[0.0, 0.1] } else { &[0.0] };
        for &aperture in apertures {
            view.lens = Lens { aperture, focus_distance: None };
            let mut frame = PreparedFrame::new(compiled(&scene), &view).unwrap();
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
}

#[test]
fn passes_add_up_to_all_samples_at_once() {
    let scene = furnished();
    let whole = path_view(&scene, 20, 37, 5);
    let frame = PreparedFrame::new(compiled(&scene), &whole).unwrap();
    let expected = sums(&frame, 0..20);
    let mut film = vec![PixelSums::default(); 400];
    let mut first_sample = 0;
    for samples in [1, 1, 2, 4, 8, 16, 5] {
        let pass = FrameView { first_sample, samples, ..whole };
        let frame = PreparedFrame::new(compiled(&scene), &pass).unwrap();
        film.iter_mut().zip(sums(&frame, 0..20)).for_each(|(film, pass)| film.add(&pass));
        first_sample += samples;
    }
    assert!(film == expected);
    assert!(expected.iter().any(|sums| sums.even > 0));
}

#[test]
fn a_white_scene_in_a_white_sky_is_invisible() {
    let scene = Scene {
        camera: Camera { up: DVec3::Y, fov: 40.0, ..camera_at(DVec3::new(0.0, 0.5, 4.0)) },
        background: Background::Color(Vec3::ONE),
        materials: vec![diffuse(Vec3::ONE)],
        spheres: vec![ball(DVec3::ZERO, 0.5, 0), ball(DVec3::new(0.9, 0.0, 0.0), 0.3, 0)],
        ..Scene::default()
    };
    let view = path_view(&scene, 24, 16, 64);
    let frame = PreparedFrame::new(compiled(&scene), &view).unwrap();
    for pixel in sums(&frame, 0..24) {
        // Between the balls a few of the paths have more than 64 vertices.
        assert!(pixel.mean(16).iter().all(|&value| (0.98..=1.000_001).contains(&value)), "{pixel:?}");
    }
}

/// A grey floor, seen from above.
pub(super) fn floor() -> Scene {
    Scene {
        camera: camera_at(DVec3::new(0.0, 3.0, 0.0)),
        materials: vec![diffuse(Vec3::splat(0.5)), lamp(Vec3::new(8.0, 4.0, 2.0))],
        planes: vec![Plane { point: DVec3::ZERO, normal: DVec3::Y, material: 0, size: 1.0 }],
        ..Scene::default()
    }
}

#[test]
fn an_emitting_ball_lights_a_floor_as_the_formula_says() {
    let mut scene = floor();
    let (center, radius) = (DVec3::new(2.0, 1.5, 0.0), 0.5);
    scene.spheres = vec![ball(center, radius, 1)];
    scene.camera.fov = 0.5;
    // E = pi L (r / d)^2 cos, for a ball above the horizon; the floor reflects c_d E / pi.
    let distance = center.length();
    let expected = 0.5 * (radius / distance).powi(2) * (center.y / distance);
    for sampler in [Sampler::Sobol, Sampler::Independent] {
        let mut view = path_view(&scene, 8, 64, 1);
        view.integrator = Integrator::Path(PathSettings { sampler, ..PathSettings::default() });
        for (found, emission) in mean(&scene, &view).into_iter().zip([8.0, 4.0, 2.0]) {
            let error = (found / (emission * expected) - 1.0).abs();
            assert!(error < 0.01, "{sampler:?}: {found}, not {}", emission * expected);
        }
    }
}

#[test]
fn an_emitting_triangle_shines_to_its_front_only() {
    let mut scene = floor();
    let small = 0.05;
    let [a, b, c] = [DVec3::new(0., 2., 0.), DVec3::new(small, 2., 0.), DVec3::new(0., 2., small)];
    scene.camera = Camera { fov: 1.0, ..camera_at(DVec3::new(0.0, 1.0, 0.0)) };
    // L A cos cos / r^2 from a small lamp straight above, times c_d / pi.
    let expected = 4.0 * (small * small / 2.0) / 4.0 * 0.5 / std::f64::consts::PI;
    let mut with = |vertices| {
        scene.triangles = vec![Triangle { vertices, uvs: None, material: 1 }];
        mean(&scene, &path_view(&scene, 4, 256, 1))[1]
    };
    let down = with([a, b, c]);
    assert!((down / expected - 1.0).abs() < 0.01, "{down}, not {expected}");
    assert_eq!(with([a, c, b]), 0.0);
}

#[test]
fn lights_without_extent_are_those_of_the_direct_integrator() {
    let spot = LightKind::Spot {
        position: DVec3::new(0.3, 2.0, 0.0),
        direction: DVec3::NEG_Y,
        beam_angle: 60.0,
        penumbra: 40.0,
    };
    let kinds = [
        LightKind::Point { position: DVec3::new(1.0, 2.0, 0.5) },
        LightKind::Directional { direction: DVec3::new(0.3, -1.0, 0.2).normalize() },
        spot,
    ];
    for kind in kinds {
        let mut scene = floor();
        scene.camera.fov = 0.2;
        scene.lights = vec![light(kind)];
        let paths = mean(&scene, &path_view(&scene, 4, 4, 1));
        let direct = FrameView {
            format: PixelFormat::Rgb8,
            ..FrameView { width: 1, height: 1, ..FrameView::of(&scene) }
        };
        let frame = PreparedFrame::new(compiled(&scene), &direct).unwrap();
        let mut bytes = [0; 3];
        render_rows(&frame, 0..1, &mut bytes, &|| false).unwrap();
        let encoded = crate::srgb::encode(Vec3::from_array(paths.map(|value| value as f32)));
        for channel in 0..3 {
            assert!(encoded[channel].abs_diff(bytes[channel]) <= 1, "{kind:?}: {encoded:?}, not {bytes:?}");
        }
    }
}

#[test]
fn many_lights_have_the_mean_of_all() {
    let mut scene = floor();
    let place = |i: u32| DVec3::new(f64::from(i % 8) - 3.5, 1.5, f64::from(i / 8) - 3.5);
    scene.lights = (0..64).map(|i| light(LightKind::Point { position: place(i) })).collect();
    for light in &mut scene.lights {
        light.attenuation = Attenuation::InverseSquare;
    }
    // More than are computed at once: one is selected.
    let selected = mean(&scene, &path_view(&scene, 8, 256, 1));
    let mut all = [0.0; 3];
    for light in scene.lights.clone() {
        let one = Scene { lights: vec![light], ..scene.clone() };
        let found = mean(&one, &path_view(&one, 8, 1, 1));
        all = [0, 1, 2].map(|channel| all[channel] + found[channel]);
    }
    for channel in 0..3 {
        assert!((selected[channel] / all[channel] - 1.0).abs() < 0.03, "{selected:?}, not {all:?}");
    }
}

#[test]
fn a_lamp_with_a_radius_is_its_centre_where_nothing_is_before_it() {
    let mut scene = floor();
    scene.camera.fov = 0.2;
    let mut lamp = light(LightKind::Point { position: DVec3::new(0.0, 2.0, 0.0) });
    scene.lights = vec![lamp];
    let point = mean(&scene, &path_view(&scene, 4, 1, 1))[0];
    lamp.radius = 0.2;
    scene.lights = vec![lamp];
    let ball = mean(&scene, &path_view(&scene, 4, 256, 1))[0];
    // The mean cosine over the cone of directions is (1 + cos) / 2.
    let cosine = (1.0_f64 - 0.01).sqrt();
    let expected = point * (1.0 + cosine) / 2.0;
    assert!((ball / expected - 1.0).abs() < 2e-3, "{ball}, not {expected}");
}

#[test]
fn roulette_and_seeds_change_the_noise_and_not_the_mean() {
    let scene = furnished();
    let mut view = path_view(&scene, 24, 64, 8);
    let first = mean(&scene, &view);
    for settings in [
        PathSettings { roulette: false, ..PathSettings::default() },
        PathSettings { seed: 5, ..PathSettings::default() },
        PathSettings { sampler: Sampler::Independent, ..PathSettings::default() },
    ] {
        view.integrator = Integrator::Path(settings);
        let other = mean(&scene, &view);
        assert_ne!(first, other);
        for channel in 0..3 {
            assert!(
                (other[channel] / first[channel] - 1.0).abs() < 0.02,
                "{settings:?}: {other:?}, {first:?}"
            );
        }
    }
}

#[test]
fn a_limit_of_indirect_light_darkens_and_leaves_direct_light() {
    let scene = furnished();
    let at = |clamp_indirect, depth| {
        let mut view = path_view(&scene, 24, 16, depth);
        view.integrator = Integrator::Path(PathSettings { clamp_indirect, ..PathSettings::default() });
        mean(&scene, &view)[0]
    };
    assert!(at(0.05, 8) < 0.98 * at(0.0, 8));
    assert_eq!(at(1e6, 8), at(0.0, 8));
}
