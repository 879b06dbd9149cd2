//! Kinds of camera, by geometry: the places of points in the picture.

use std::ops::Range;
use std::sync::Arc;

use crate::common::{analytic, empty, instanced, render};
use glam::{DVec3, Vec3};
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::scene::{
    Background, CameraKind, FovAxis, FrameView, Material, NormalMode, Quality, Scene, Sphere, Triangle,
};
use rayfarm_tracer::{CompiledScene, PreparedFrame, render_rows};

const WHITE: [u8; 3] = [255; 3];
const BLACK: [u8; 3] = [0; 3];

/// A white scene before black, where every hit is white, seen from `z` along -Z.
fn white(width: u32, height: u32, kind: CameraKind, z: f64) -> Scene {
    let mut scene = empty(width, height);
    scene.background = Background::Color(Vec3::ZERO);
    scene.materials = vec![Material { diffuse: Vec3::ONE, unlit: true, ..Material::NEUTRAL }];
    scene.camera.kind = kind;
    scene.camera.position = DVec3::new(0.0, 0.0, z);
    scene.camera.look_at = DVec3::new(0.0, 0.0, z - 1.0);
    scene
}

fn sphere(center: DVec3, radius: f64) -> Sphere {
    Sphere { center, radius, material: 0, inside_out: false, uv_rotate: DVec3::ZERO }
}

fn picture(scene: &Scene) -> RgbImage {
    render(scene, &[], &FrameView::of(scene)).0
}

/// Distance of the centre of a pixel from that of the picture, in pixels to the right and downwards.
fn from_center(image: &RgbImage, x: u32, y: u32) -> (f64, f64) {
    let from = |at: u32, side: u32| f64::from(at) + 0.5 - f64::from(side) / 2.0;
    (from(x, image.width), from(y, image.height))
}

/// Checks that each pixel is white where `is_white` says so, given its distance from the centre, and black elsewhere.
fn check_pixels(image: &RgbImage, is_white: impl Fn(f64, f64) -> bool) {
    for y in 0..image.height {
        for x in 0..image.width {
            let (across, along) = from_center(image, x, y);
            let expected = if is_white(across, along) { WHITE } else { BLACK };
            assert_eq!(image.pixel(x, y).unwrap(), expected, "pixel ({x}, {y})");
        }
    }
}

const ORTHOGRAPHIC: CameraKind = CameraKind::Orthographic { view_height: 4.0 };

#[test]
fn an_orthographic_picture_of_a_sphere_is_a_circle_at_any_distance() {
    // 20 pixels are one unit.
    for z in [2.0, 50.0, 1e4] {
        let mut scene = white(96, 80, ORTHOGRAPHIC, z);
        scene.spheres = vec![sphere(DVec3::ZERO, 1.0)];
        check_pixels(&picture(&scene), |x, y| x.hypot(y) < 20.0);
        scene.camera.zoom = 1.5;
        check_pixels(&picture(&scene), |x, y| x.hypot(y) < 30.0);
    }
}

#[test]
fn what_is_behind_the_plane_of_an_orthographic_camera_is_not_seen() {
    let mut scene = white(96, 80, ORTHOGRAPHIC, 0.0);
    // The plane cuts one sphere, whose far side is seen from within; the other one is behind it.
    scene.spheres = vec![sphere(DVec3::ZERO, 1.0), sphere(DVec3::new(0.0, 0.0, 1.6), 1.5)];
    check_pixels(&picture(&scene), |x, y| x.hypot(y) < 20.0);

    // A triangle that crosses the plane of the origins at x = 0, in front of it on the left.
    scene.spheres.clear();
    let slanted = [(-4.0, -4.0, -2.0), (-4.0, 4.0, -2.0), (4.0, 0.0, 2.0)];
    let vertices = slanted.map(|(x, y, z)| DVec3::new(x, y, z));
    scene.triangles = vec![Triangle { vertices, uvs: None, material: 0 }];
    check_pixels(&picture(&scene), |x, y| {
        let (x, y) = (x / 20.0, y / 20.0);
        x < 0.0 && y.abs() < (4.0 - x) / 2.0
    });
}

#[test]
fn an_orthographic_picture_of_a_mesh_is_that_of_a_pinhole_camera_far_away() {
    let (mut scene, mesh) = instanced(120, 90);
    scene.background = Background::Color(Vec3::splat(0.2));
    let (distance, height) = (3e3, 4.0);
    let away = (scene.camera.position - scene.camera.look_at).normalize();
    scene.camera.position = scene.camera.look_at + away * distance;
    scene.camera.fov = (2.0 * libm::atan(height / 2.0 / distance)).to_degrees();
    let (far, _) = render(&scene, std::slice::from_ref(&mesh), &FrameView::of(&scene));
    scene.camera.kind = CameraKind::Orthographic { view_height: height };
    scene.camera.position = scene.camera.look_at + away * 10.0;
    let (parallel, _) = render(&scene, std::slice::from_ref(&mesh), &FrameView::of(&scene));
    let differ = |(a, b): (&[u8], &[u8])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 3);
    let others = far.pixels.chunks(3).zip(parallel.pixels.chunks(3)).filter(|pair| differ(*pair)).count();
    // Edges of things and of shadows: near the centre places differ by up to 1 / 1000 of the height.
    assert!(others < 120 * 90 / 100, "{others} pixels differ");
    let background = parallel.pixel(0, 0).unwrap();
    let covered = parallel.pixels.chunks(3).filter(|pixel| *pixel != background).count();
    assert!(covered > 120 * 90 / 4, "{covered} pixels show something");
}

#[test]
fn a_horizontal_field_of_view_is_the_vertical_one_of_the_turned_picture() {
    // Spheres at the ends of the field of view of 90 degrees, and within it.
    let horizontal = CameraKind::Pinhole { fov_axis: FovAxis::Horizontal };
    for (kind, (width, height)) in [(horizontal, (90, 30)), (CameraKind::PINHOLE, (30, 90))] {
        let mut scene = white(width, height, kind, 0.0);
        scene.camera.fov = 90.0;
        let along = if width > height { DVec3::X } else { DVec3::Y };
        scene.spheres = vec![sphere((DVec3::NEG_Z + along) * 10.0, 0.5)];
        let image = picture(&scene);
        let white_pixels = |image: &RgbImage| {
            let all = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
            let at = |&(x, y): &(u32, u32)| image.pixel(x, y).unwrap() == WHITE;
            all.filter(at).map(|(x, y)| from_center(image, x, y)).collect::<Vec<_>>()
        };
        let found = white_pixels(&image);
        // 4.5 pixels a unit at depth 10: half of the sphere is inside, at most some pixels from the edge of the picture.
        let end = |&(x, y): &(f64, f64)| if width > height { x } else { -y };
        assert!((4..=40).contains(&found.len()), "{found:?}");
        assert!(found.iter().all(|place| end(place) > 41.0), "{found:?}");
        assert!(found.iter().any(|place| end(place) == 44.5), "{found:?}");
    }
}

#[test]
fn a_fisheye_camera_shows_angles_in_proportion_to_the_distance_from_the_centre() {
    // A sphere with an angular radius of 3 degrees, at an angle of `theta` to the right or above.
    let radius = 10.0 * libm::sin(3_f64.to_radians());
    for (fov, theta) in [(180.0, 90.0), (200.0, 90.0), (180.0, 45.0), (360.0, 150.0), (60.0, 20.0)] {
        for (width, height) in [(100, 100), (140, 100)] {
            for side in [DVec3::X, DVec3::Y] {
                let mut scene = white(width, height, CameraKind::Fisheye, 0.0);
                scene.camera.fov = fov;
                let (sin, cos) = libm::sincos(f64::to_radians(theta));
                scene.spheres = vec![sphere((DVec3::NEG_Z * cos + side * sin) * 10.0, radius)];
                let image = picture(&scene);
                let mut found = 0;
                for y in 0..height {
                    for x in 0..width {
                        let (across, along) = from_center(&image, x, y);
                        let distance = across.hypot(along);
                        // The direction of the pixel by the formula, and its angle to the middle of the sphere.
                        let angle = distance / 50.0 * fov / 2.0;
                        let (sin, cos) = libm::sincos(angle.to_radians());
                        let direction = DVec3::new(across / distance * sin, -along / distance * sin, -cos);
                        let middle = scene.spheres[0].center / 10.0;
                        let away = libm::acos(direction.dot(middle).clamp(-1.0, 1.0)).to_degrees();
                        let expected = distance <= 50.0 && away < 3.0;
                        if (away - 3.0).abs() > 1e-6 {
                            let color = image.pixel(x, y).unwrap();
                            assert_eq!(color == WHITE, expected, "{fov}, {theta}, ({x}, {y}): {away}");
                        }
                        found += u32::from(expected);
                    }
                }
                assert!(found >= 4, "{fov}, {theta}: {found} pixels");
            }
        }
    }
}

#[test]
fn outside_of_its_circle_a_fisheye_camera_shows_the_background() {
    for fov in [100.0, 360.0] {
        let mut scene = white(60, 40, CameraKind::Fisheye, 0.0);
        scene.camera.fov = fov;
        // All around the camera.
        scene.spheres = vec![sphere(DVec3::ZERO, 3.0)];
        check_pixels(&picture(&scene), |x, y| x.hypot(y) <= 20.0);
    }
    // A gradient over the elevation: in a corner of a square the angle is 45 degrees times the square root of 2.
    let mut scene = white(501, 501, CameraKind::Fisheye, 0.0);
    scene.camera.fov = 90.0;
    scene.background = Background::Gradient { bottom: Vec3::ZERO, top: Vec3::ONE };
    let image = picture(&scene);
    let theta = (500.0_f64 / 501.0 * 45.0 * libm::sqrt(2.0)).to_radians();
    let height = libm::sin(theta) / libm::sqrt(2.0);
    let expected = rayfarm_tracer::srgb::encode(Vec3::splat(((height + 1.0) / 2.0) as f32));
    assert!(image.pixel(0, 0).unwrap()[0].abs_diff(expected[0]) <= 1, "{expected:?}");
    assert!(image.pixel(500, 0).unwrap()[0].abs_diff(expected[0]) <= 1, "{expected:?}");
}

fn kinds() -> [(CameraKind, f64); 4] {
    let horizontal = CameraKind::Pinhole { fov_axis: FovAxis::Horizontal };
    [(horizontal, 60.0), (ORTHOGRAPHIC, 40.0), (CameraKind::Fisheye, 190.0), (CameraKind::Fisheye, 360.0)]
}

/// Spheres, triangles and a plane, one of them a mirror and one of glass.
fn bouncing(width: u32, height: u32) -> Scene {
    let mut scene = analytic(width, height);
    scene.materials[0].reflect = Vec3::splat(0.5);
    scene.materials[1].transmit = Vec3::splat(0.8);
    scene
}

fn rows_of(frame: &PreparedFrame, rows: Range<u32>) -> Vec<u8> {
    let mut bytes = vec![0x5a; rows.len() * frame.width() as usize * 3];
    render_rows(frame, rows, &mut bytes, &|| false).unwrap();
    bytes
}

#[test]
fn a_picture_of_any_camera_with_bounces_does_not_depend_on_its_cuts() {
    let scene = bouncing(61, 45);
    let compiled = Arc::new(CompiledScene::new(scene.clone(), [], []).unwrap());
    for (kind, fov) in kinds() {
        for (samples, adaptive) in [(1, false), (4, false), (9, true)] {
            let mut view = FrameView { samples, ..FrameView::of(&scene) };
            view.quality = Quality { adaptive, ..view.quality };
            (view.camera.kind, view.camera.fov) = (kind, fov);
            let frame = PreparedFrame::new(Arc::clone(&compiled), &view).unwrap();
            let whole = rows_of(&frame, 0..45);
            let cuts = [0, 1, 7, 16, 17, 30, 45];
            let pieces = cuts.windows(2).flat_map(|cut| rows_of(&frame, cut[0]..cut[1]));
            assert!(pieces.eq(whole), "{kind:?}, {samples} samples");
        }
    }
}

#[test]
fn a_scaled_scene_gives_the_same_picture_of_any_camera() {
    let (scene, mesh) = instanced(48, 36);
    for (kind, fov) in kinds() {
        let at = |factor: f64| {
            let mut scene = scene.clone();
            scene.camera.kind = match kind {
                CameraKind::Orthographic { view_height } => {
                    CameraKind::Orthographic { view_height: view_height * factor }
                }
                other => other,
            };
            scene.camera.fov = fov;
            scene.camera.position *= factor;
            scene.camera.look_at *= factor;
            scene.planes.iter_mut().for_each(|plane| plane.point *= factor);
            for model in &mut scene.models {
                model.translate *= factor;
                model.scale *= factor;
                model.normals = NormalMode::Flat;
            }
            scene.lights.clear();
            scene.ambient = Vec3::ONE;
            render(&scene, std::slice::from_ref(&mesh), &FrameView::of(&scene)).0.pixels
        };
        let own = at(1.0);
        for exponent in [-30, 30] {
            assert!(at(libm::exp2(f64::from(exponent))) == own, "{kind:?}, 2^{exponent}");
        }
    }
}
