//! Volumes: pictures that follow from Beer's law and from the conservation of energy, and the same bits however they are rendered.

use glam::{DVec3, Vec3};

use super::super::tests::{camera_at, compiled, diffuse, floor, furnished, light, mean, path_view, sums};
use super::*;
use crate::film::PixelSums;
use crate::frame::PreparedFrame;
use crate::scene::{Background, Camera, FrameView, LightKind, Scene, Triangle, Volume, VolumeBoundary};
use crate::simd;

fn in_box(lower: DVec3, upper: DVec3, density: f64, color: f32) -> Volume {
    Volume { boundary: VolumeBoundary::Box { lower, upper }, density, color: Vec3::splat(color) }
}

fn in_ball(center: DVec3, radius: f64, density: f64, color: f32) -> Volume {
    Volume { boundary: VolumeBoundary::Sphere { center, radius }, density, color: Vec3::splat(color) }
}

/// A volume between two heights, far wider than high.
fn layer(from: f64, to: f64, density: f64, color: f32) -> Volume {
    in_box(DVec3::new(-50.0, from, -50.0), DVec3::new(50.0, to, 50.0), density, color)
}

/// Nothing but a background, seen from above at a small angle.
fn empty(background: f32) -> Scene {
    Scene {
        camera: Camera { fov: 0.5, ..camera_at(DVec3::new(0.0, 3.0, 0.0)) },
        background: Background::Color(Vec3::splat(background)),
        materials: vec![diffuse(Vec3::splat(0.5))],
        ..Scene::default()
    }
}

#[test]
fn directions_are_uniform_over_the_sphere() {
    let count = 100;
    let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
    for i in 0..count * count {
        let at = |k: usize| (k as f64 + 0.5) / count as f64;
        let direction = on_sphere([at(i % count), at(i / count)]);
        assert!((direction.length() - 1.0).abs() < 1e-12);
        sum += direction;
        squares += direction * direction;
    }
    let total = (count * count) as f64;
    assert!((sum / total).abs().max_element() < 1e-3, "{sum}");
    assert!((squares / total - 1.0 / 3.0).abs().max_element() < 1e-3, "{squares}");
}

#[test]
fn a_black_volume_dims_what_is_behind_it_by_its_optical_depth() {
    for (density, overlapping) in [(0.3, 0.0), (2.0, 0.0), (0.3, 0.7)] {
        let mut scene = empty(1.0);
        scene.volumes = vec![layer(0.0, 1.0, density, 0.0), layer(0.5, 1.0, overlapping, 0.0)];
        let found = mean(&scene, &path_view(&scene, 8, 256, 4))[0];
        let expected = (-density - 0.5 * overlapping).exp();
        assert!((found / expected - 1.0).abs() < 0.01, "{found}, not {expected}");
    }
}

#[test]
fn a_black_volume_dims_a_surface_behind_it_and_none_before_it() {
    let mut scene = empty(0.0);
    scene.planes = floor().planes;
    scene.materials[0].emission = Vec3::ONE;
    let with = |scene: &Scene| mean(scene, &path_view(scene, 8, 256, 4))[0];
    let alone = with(&scene);
    scene.volumes = vec![layer(1.0, 2.0, 1.0, 0.0)];
    let dimmed = with(&scene);
    scene.volumes = vec![layer(-3.0, -0.01, 1.0, 0.0)];
    assert_eq!(with(&scene), alone);
    let expected = alone * (-1.0_f64).exp();
    assert!((dimmed / expected - 1.0).abs() < 0.01, "{dimmed}, not {expected}");
}

#[test]
fn a_volume_dims_the_light_of_lamps_on_surfaces() {
    let mut scene = floor();
    scene.camera.fov = 0.2;
    let direction = DVec3::new(0.6, -0.8, 0.0);
    let position = DVec3::new(-4.8, 6.4, 0.0);
    for kind in [LightKind::Directional { direction }, LightKind::Point { position }] {
        scene.lights = vec![light(kind)];
        scene.volumes.clear();
        let view = path_view(&scene, 4, 4, 1);
        let clear = mean(&scene, &view)[0];
        // Above the camera, and below the point light: the way through is its height over the cosine.
        scene.volumes = vec![layer(4.0, 5.0, 0.5, 0.3)];
        let expected = clear * (-0.5_f64 / 0.8).exp();
        let dimmed = mean(&scene, &view)[0];
        assert!(clear > 0.0 && (dimmed / expected - 1.0).abs() < 2e-3, "{kind:?}: {dimmed}, not {expected}");
    }
}

#[test]
fn a_layer_scatters_light_once_as_the_integral_says() {
    let direction = DVec3::NEG_Y;
    let mut scene = empty(0.0);
    scene.lights = vec![light(LightKind::Directional { direction })];
    for density in [0.2, 1.0] {
        scene.volumes = vec![layer(0.0, 1.0, density, 0.8)];
        // Light along the line of sight: c E / 4 pi times the integral of d exp(-2 d s) over the layer, with E = pi I.
        let expected = 0.8 * 0.9 / 4.0 * (1.0 - (-2.0 * density).exp()) / 2.0;
        let found = mean(&scene, &path_view(&scene, 8, 256, 1))[0];
        assert!((found / expected - 1.0).abs() < 0.02, "{found}, not {expected}");
    }
}

#[test]
fn white_volumes_in_a_white_sky_are_invisible() {
    let mut scene = empty(1.0);
    scene.camera = Camera { up: DVec3::Y, fov: 40.0, ..camera_at(DVec3::new(0.0, 0.5, 4.0)) };
    scene.volumes = vec![
        in_ball(DVec3::ZERO, 0.7, 3.0, 1.0),
        in_box(DVec3::new(0.2, -0.5, -0.5), DVec3::new(1.2, 0.5, 0.5), 2.0, 1.0),
    ];
    let view = path_view(&scene, 20, 8, 64);
    let frame = PreparedFrame::new(compiled(&scene), &view).unwrap();
    for pixel in sums(&frame, 0..20) {
        assert!(pixel.mean(8).iter().all(|&value| (0.99..=1.000_001).contains(&value)), "{pixel:?}");
    }
}

#[test]
fn sampled_and_hit_lamps_add_up_in_volumes() {
    // Inside of a box that shines evenly a white volume is invisible, and a grey one is as dark as its paths are long.
    let mut scene = empty(0.0);
    scene.materials[0] = super::super::tests::lamp(Vec3::ONE);
    let corner = |i: usize| {
        let side = |bit: usize| if i >> bit & 1 == 1 { 2.0 } else { -2.0 };
        DVec3::new(side(0), side(1), side(2))
    };
    for [a, b, c, d] in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        .map(|f| f.map(corner))
    {
        for vertices in [[a, b, c], [a, c, d]] {
            // Fronts face the inside.
            let [u, v, w] = vertices;
            let inwards = (v - u).cross(w - u).dot(u) < 0.0;
            let vertices = if inwards { vertices } else { [u, w, v] };
            scene.triangles.push(Triangle { vertices, uvs: None, material: 0 });
        }
    }
    scene.camera = Camera { up: DVec3::Y, fov: 30.0, ..camera_at(DVec3::new(0.0, 0.0, 1.5)) };
    scene.volumes = vec![in_ball(DVec3::ZERO, 0.8, 1.5, 1.0)];
    let found = mean(&scene, &path_view(&scene, 16, 128, 64));
    assert!(found.iter().all(|value| (value - 1.0).abs() < 0.01), "{found:?}");
}

#[test]
fn all_levels_cuts_and_passes_have_the_same_sums() {
    let mut scene = furnished();
    scene.volumes = vec![
        in_ball(DVec3::new(-0.8, -0.5, 0.0), 0.7, 1.5, 0.8),
        layer(-0.5, 0.5, 0.2, 0.9),
        in_box(DVec3::new(0.1, -1.0, -1.0), DVec3::new(1.0, 1.0, 1.0), 0.7, 0.5),
    ];
    let view = FrameView { width: 17, height: 19, ..path_view(&scene, 1, 4, 5) };
    let mut frame = PreparedFrame::new(compiled(&scene), &view).unwrap();
    let expected = sums(&frame, 0..view.height);
    for level in simd::all() {
        frame.level = level;
        assert!(sums(&frame, 0..view.height) == expected, "{}", simd::name(level));
    }
    frame.level = simd::best();
    for (top, bottom) in [(0, 1), (1, 16), (16, 19)] {
        let pixels = top as usize * 17..bottom as usize * 17;
        assert!(sums(&frame, top..bottom) == expected[pixels], "rows {top} to {bottom}");
    }
    let mut film = vec![PixelSums::default(); expected.len()];
    for (first_sample, samples) in [(0, 1), (1, 1), (2, 2)] {
        let pass = FrameView { first_sample, samples, ..view };
        let frame = PreparedFrame::new(compiled(&scene), &pass).unwrap();
        film.iter_mut().zip(sums(&frame, 0..view.height)).for_each(|(film, pass)| film.add(&pass));
    }
    assert!(film == expected);
}

#[test]
fn a_scene_scaled_by_a_power_of_two_has_the_same_sums() {
    let at = |scale: f64| {
        let mut scene = empty(0.3);
        scene.camera = camera_at(DVec3::new(0.1, 3.0, 0.2) * scale);
        scene.lights = vec![light(LightKind::Point { position: DVec3::new(1.0, 2.0, 0.5) * scale })];
        scene.volumes = vec![in_ball(DVec3::ZERO, 0.7 * scale, 1.5 / scale, 0.8)];
        let view = path_view(&scene, 16, 4, 5);
        sums(&PreparedFrame::new(compiled(&scene), &view).unwrap(), 0..16)
    };
    assert!(at(1.0) == at(1024.0) && at(1.0) == at(1.0 / 4096.0));
}

#[test]
fn volumes_of_no_density_change_nothing() {
    let mut scene = furnished();
    let view = path_view(&scene, 16, 4, 5);
    let without = sums(&PreparedFrame::new(compiled(&scene), &view).unwrap(), 0..16);
    scene.volumes = vec![layer(-1.0, 1.0, 0.0, 0.5)];
    assert!(sums(&PreparedFrame::new(compiled(&scene), &view).unwrap(), 0..16) == without);
}
