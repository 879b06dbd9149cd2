//! Skies: known texels in known directions, pictures made of a function, seams and poles, and the frames that show them.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use proptest::prelude::*;

use super::background;
use crate::compile::CompiledScene;
use crate::frame::PreparedFrame;
use crate::image::{LinearImage, RgbImage};
use crate::integrator::render_rows;
use crate::rays::{Ray, RayBatch};
use crate::rotation::about_y;
use crate::scene::{
    Background, Camera, CameraKind, Filter, FrameView, RenderSettings, Scene, Sky, SkyPicture, TextureMap,
};
use crate::simd::{self, LANES, Lanes, dispatch};
use crate::srgb;
use crate::texture::Texture;

const SIDE: u32 = 16;

/// A frame of nothing but a sky of these pictures: one is a panorama, six are a cube map.
fn frame(textures: Vec<Texture>, rotate: f64, strength: f32) -> PreparedFrame {
    prepared(scene(&textures, rotate, strength), textures)
}

fn scene(textures: &[Texture], rotate: f64, strength: f32) -> Scene {
    let picture =
        if textures.len() == 6 { SkyPicture::Cubemap([0, 1, 2, 3, 4, 5]) } else { SkyPicture::Panorama(0) };
    Scene {
        ambient: Vec3::ZERO,
        render: RenderSettings { width: SIDE, height: SIDE, ..RenderSettings::default() },
        camera: Camera {
            position: DVec3::ZERO,
            look_at: DVec3::NEG_Z,
            up: DVec3::Y,
            fov: 90.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        },
        background: Background::Sky(Sky { picture, rotate, strength }),
        background_visible: true,
        lights: Vec::new(),
        materials: Vec::new(),
        textures: textures.iter().map(|texture| TextureMap::new(texture.id(), Filter::Bilinear)).collect(),
        models: Vec::new(),
        spheres: Vec::new(),
        disks: Vec::new(),
        planes: Vec::new(),
        triangles: Vec::new(),
        ..Scene::default()
    }
}

fn prepared(scene: Scene, textures: Vec<Texture>) -> PreparedFrame {
    scene.validate().unwrap();
    let view = FrameView::of(&scene);
    let compiled = CompiledScene::new(scene, [], textures.into_iter().map(Arc::new)).unwrap();
    PreparedFrame::new(Arc::new(compiled), &view).unwrap()
}

/// Radiance in some directions, the same on every level.
fn seen(frame: &mut PreparedFrame, directions: &[DVec3]) -> Vec<Vec3> {
    let mut at = |level| {
        frame.level = level;
        let frame = &*frame;
        directions.chunks(LANES).flat_map(|some| in_block(frame, some)).collect::<Vec<_>>()
    };
    let first = at(simd::best());
    let bits = |colors: &[Vec3]| colors.iter().map(|c| c.to_array().map(f32::to_bits)).collect::<Vec<_>>();
    for level in simd::all() {
        assert_eq!(bits(&at(level)), bits(&first), "{}", simd::name(level));
    }
    first
}

fn in_block(frame: &PreparedFrame, directions: &[DVec3]) -> Vec<Vec3> {
    let mut batch = RayBatch::new(frame);
    for (index, &direction) in directions.iter().enumerate() {
        batch.set(index, Ray { origin: DVec3::ZERO, direction }, f64::INFINITY, None);
    }
    let mut colors = [Lanes::ZERO; 3];
    dispatch!(frame.level, simd => background(simd, &batch, 0, &mut colors));
    let color = |lane: usize| Vec3::new(colors[0].0[lane], colors[1].0[lane], colors[2].0[lane]);
    (0..directions.len()).map(color).collect()
}

fn linear(texel: [u8; 3]) -> Vec3 {
    Vec3::from(texel.map(|code| srgb::decode(code) as f32))
}

/// Direction of a place on a face of a cube map, s from the left and t from the top, by the inverse of OpenGL's table.
fn on_face(face: usize, s: f64, t: f64) -> DVec3 {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let [major, along_s, along_t] =
        [[x, -z, -y], [-x, z, -y], [y, x, z], [-y, x, -z], [z, x, -y], [-z, -x, -y]][face];
    major + along_s * (2.0 * s - 1.0) + along_t * (2.0 * t - 1.0)
}

/// Direction of a place of a panorama, u from the left and v from the top.
fn on_panorama(u: f64, v: f64) -> DVec3 {
    let ((sin_phi, cos_phi), (sin_theta, cos_theta)) =
        (libm::sincos((u - 0.5) * std::f64::consts::TAU), libm::sincos(v * std::f64::consts::PI));
    DVec3::new(sin_phi * sin_theta, cos_theta, -cos_phi * sin_theta)
}

/// A picture whose texels all differ.
fn colorful(width: u32, height: u32, salt: u32) -> RgbImage {
    let pixels = (0..3 * width * height).map(|i| ((i * 37 + salt * 101 + 11) % 251) as u8).collect();
    RgbImage { width, height, pixels }
}

#[test]
fn the_centre_of_each_texel_of_a_cube_map_is_where_the_table_says() {
    let pictures: Vec<_> = (0..6).map(|face| colorful(2, 2, face)).collect();
    let mut frame = frame(pictures.iter().map(|picture| Texture::new(picture).unwrap()).collect(), 0.0, 1.0);
    // The texels at the upper left of the pictures, by hand.
    let corners = [
        DVec3::new(1.0, 0.5, 0.5),
        DVec3::new(-1.0, 0.5, -0.5),
        DVec3::new(-0.5, 1.0, -0.5),
        DVec3::new(-0.5, -1.0, 0.5),
        DVec3::new(-0.5, 0.5, 1.0),
        DVec3::new(0.5, 0.5, -1.0),
    ];
    let found = seen(&mut frame, &corners);
    for (face, color) in found.into_iter().enumerate() {
        assert_eq!(color, linear(pictures[face].pixel(0, 0).unwrap()), "face {face}");
        assert_eq!(on_face(face, 0.25, 0.25), corners[face]);
    }
    for length in [1.0, 3.0, 1e-20, 1e20] {
        for (face, picture) in pictures.iter().enumerate() {
            let places = [(0, 0), (1, 0), (0, 1), (1, 1)];
            let directions = places
                .map(|(x, y)| on_face(face, (f64::from(x) + 0.5) / 2.0, (f64::from(y) + 0.5) / 2.0) * length);
            for ((x, y), color) in places.into_iter().zip(seen(&mut frame, &directions)) {
                let expected = linear(picture.pixel(x, y).unwrap());
                assert!((color - expected).abs().max_element() < 1e-6, "face {face} at {x} {y}, {length}");
            }
        }
    }
}

#[test]
fn the_faces_of_a_cube_map_are_around_the_camera() {
    let face = |color: u8| Texture::new(&RgbImage { width: 1, height: 1, pixels: vec![color; 3] }).unwrap();
    let codes = [10, 50, 90, 130, 170, 210];
    let mut frame = frame(codes.map(face).into(), 0.0, 1.0);
    let [right, left, up, down, behind, ahead] =
        [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let found = seen(&mut frame, &[right, left, up, down, behind, ahead]);
    assert_eq!(found, codes.map(|code| linear([code; 3])));
}

#[test]
fn the_centre_of_each_texel_of_a_panorama_is_where_the_equation_says() {
    let picture = colorful(8, 4, 3);
    let mut frame = frame(vec![Texture::new(&picture).unwrap()], 0.0, 1.0);
    for (x, y) in (0..4).flat_map(|y| (0..8).map(move |x| (x, y))) {
        let direction = on_panorama((f64::from(x) + 0.5) / 8.0, (f64::from(y) + 0.5) / 4.0);
        for length in [1.0, 1e-25, 1e25] {
            let color = seen(&mut frame, &[direction * length])[0];
            let expected = linear(picture.pixel(x, y).unwrap());
            assert!((color - expected).abs().max_element() < 1e-5, "{x} {y}: {color} {expected}");
        }
    }
    // Ahead is the middle of the picture, +X a quarter to the right of it.
    let between = |columns: [u32; 2]| {
        let texels = columns.map(|x| [1, 2].map(|y| linear(picture.pixel(x, y).unwrap())));
        (texels[0][0] + texels[0][1] + texels[1][0] + texels[1][1]) / 4.0
    };
    let directions = [DVec3::NEG_Z, DVec3::X, DVec3::NEG_X, DVec3::Z];
    for (color, columns) in seen(&mut frame, &directions).into_iter().zip([[3, 4], [5, 6], [1, 2], [7, 0]]) {
        assert!((color - between(columns)).abs().max_element() < 1e-5, "{columns:?}");
    }
}

#[test]
fn a_rotated_sky_looks_as_a_model_of_it_would() {
    let cube = || (0..6).map(|face| Texture::new(&colorful(8, 8, face)).unwrap()).collect::<Vec<_>>();
    let panorama = || vec![Texture::new(&colorful(16, 8, 1)).unwrap()];
    let directions: Vec<_> =
        (0..64).map(|i| on_panorama(f64::from(i % 8) / 8.0 + 0.03, f64::from(i / 8) / 8.0 + 0.06)).collect();
    for textures in [&cube as &dyn Fn() -> Vec<Texture>, &panorama] {
        let unturned = seen(&mut frame(textures(), 0.0, 1.0), &directions);
        for degrees in [90.0, -90.0, 180.0, 30.0, 1e9 + 12.5] {
            let turned: Vec<_> = directions.iter().map(|&direction| about_y(degrees) * direction).collect();
            let found = seen(&mut frame(textures(), degrees, 1.0), &turned);
            for (a, b) in found.iter().zip(&unturned) {
                assert!((*a - *b).abs().max_element() < 1e-4, "{degrees}: {a} {b}");
            }
        }
    }
    // By 90 degrees +Z turns to +X: the face that was behind is on the right.
    let face = |color: u8| Texture::new(&RgbImage { width: 1, height: 1, pixels: vec![color; 3] }).unwrap();
    let mut frame = frame([10, 50, 90, 130, 170, 210].map(face).into(), 90.0, 1.0);
    assert_eq!(seen(&mut frame, &[DVec3::X])[0], linear([170; 3]));
}

/// A smooth sky: channels between 0 and 1, with gradients of at most 1 per radian.
fn smooth(direction: DVec3) -> [f32; 3] {
    let d = direction.normalize();
    [0.5 + 0.5 * d.x, 0.5 + 0.25 * (d.y + d.z), 0.5 + 0.5 * d.x * d.y].map(|channel| channel as f32)
}

fn smooth_picture(width: u32, height: u32, direction: impl Fn(f64, f64) -> DVec3) -> Texture {
    let place = |x: u32, y: u32| {
        direction((f64::from(x) + 0.5) / f64::from(width), (f64::from(y) + 0.5) / f64::from(height))
    };
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let pixels = places.flat_map(|(x, y)| smooth(place(x, y))).collect();
    Texture::linear(&LinearImage { width, height, pixels }).unwrap().0
}

#[test]
fn pictures_made_of_a_function_show_the_function() {
    let mut panorama = frame(vec![smooth_picture(512, 256, on_panorama)], 0.0, 1.0);
    let faces = (0..6).map(|face| smooth_picture(256, 256, |s, t| on_face(face, s, t)));
    let mut cube = frame(faces.collect(), 0.0, 1.0);
    // A spiral over the sphere.
    let directions: Vec<_> = (0..4000)
        .map(|i| on_panorama((f64::from(i) * 0.618_034).fract(), (f64::from(i) + 0.5) / 4000.0))
        .collect();
    let [of_panorama, of_cube] = [&mut panorama, &mut cube].map(|frame| seen(frame, &directions));
    for (i, &direction) in directions.iter().enumerate() {
        let expected = Vec3::from(smooth(direction));
        // One part in 512 by the format, and half a texel (pi / 512) at the borders that end interpolation.
        for (found, what) in [(of_panorama[i], "panorama"), (of_cube[i], "cube map")] {
            let error = (found - expected).abs().max_element();
            assert!(error < 0.002 + 0.0062, "{what} at {direction}: {found}, not {expected}");
        }
    }
}

#[test]
fn skies_have_no_seams() {
    let mut panorama = frame(vec![Texture::new(&colorful(16, 8, 5)).unwrap()], 0.0, 1.0);
    for height in [-5.0, -1.0, 0.0, 0.3, 2.0] {
        let sides = [1e-7, -1e-7, 0.0, -0.0].map(|x| DVec3::new(x, height, 1.0));
        let found = seen(&mut panorama, &sides);
        for color in &found {
            assert!((*color - found[0]).abs().max_element() < 1e-4, "{height}: {found:?}");
        }
    }
    let faces = (0..6).map(|face| smooth_picture(64, 64, |s, t| on_face(face, s, t)));
    let mut cube = frame(faces.collect(), 0.0, 1.0);
    for (face, along) in (0..6).flat_map(|face| (0..20).map(move |along| (face, f64::from(along) / 20.0))) {
        let (inside, outside) = (1e-6, 1.0 + 1e-6);
        let inside = [on_face(face, inside, along), on_face(face, along, inside)];
        let beyond = [on_face(face, 1.0 - outside, along), on_face(face, along, 1.0 - outside)];
        let pairs = seen(&mut cube, &inside).into_iter().zip(seen(&mut cube, &beyond));
        for (inside, beyond) in pairs {
            // Half a texel (1/64 of the gradient) on both sides, and the format.
            assert!((inside - beyond).abs().max_element() < 0.02, "face {face} at {along}");
        }
    }
}

#[test]
fn directions_with_zeros_are_defined() {
    let zeros = [0.0, -0.0, 1e-40, -1e-40, 1.0, -1.0];
    let count = zeros.len();
    let directions: Vec<_> = (0..count * count * count)
        .map(|i| DVec3::new(zeros[i % count], zeros[i / count % count], zeros[i / count / count]))
        .collect();
    let panorama = frame(vec![Texture::new(&colorful(16, 8, 5)).unwrap()], 33.0, 1.0);
    let cube = frame((0..6).map(|face| Texture::new(&colorful(3, 3, face)).unwrap()).collect(), 33.0, 1.0);
    for mut frame in [panorama, cube] {
        for (color, direction) in seen(&mut frame, &directions).into_iter().zip(&directions) {
            assert!(color.cmpge(Vec3::ZERO).all() && color.cmple(Vec3::ONE).all(), "{direction}: {color}");
        }
    }
}

fn rendered(frame: &PreparedFrame) -> Vec<u8> {
    let mut bytes = vec![0; (SIDE * SIDE * 3) as usize];
    render_rows(frame, 0..SIDE, &mut bytes, &|| false).unwrap();
    bytes
}

#[test]
fn the_camera_sees_a_sky_unless_it_is_invisible() {
    let textures = || vec![Texture::new(&colorful(16, 8, 5)).unwrap()];
    let mut frame = frame(textures(), 20.0, 1.0);
    let picture = rendered(&frame);
    // The field of view is 90 degrees: the view plane reaches from -1 to 1.
    let place = |index: u32| (f64::from(index) + 0.5) / f64::from(SIDE) * 2.0 - 1.0;
    for (x, y) in [(0, 0), (15, 0), (3, 9), (8, 8), (15, 15)] {
        let color = seen(&mut frame, &[DVec3::new(place(x), -place(y), -1.0)])[0];
        let first = (3 * (y * SIDE + x)) as usize;
        for (found, expected) in picture[first..first + 3].iter().zip(srgb::encode(color)) {
            assert!(found.abs_diff(expected) <= 1, "{x} {y}");
        }
    }
    for background in [None, Some(Background::Color(Vec3::ONE))] {
        let mut hidden = Scene { background_visible: false, ..scene(&textures(), 20.0, 1.0) };
        hidden.background = background.unwrap_or(hidden.background);
        let mut frame = prepared(hidden, textures());
        assert!(rendered(&frame).iter().all(|&byte| byte == 0));
        // Rays that are not the camera's see it.
        assert!(seen(&mut frame, &[DVec3::NEG_Z])[0].min_element() > 0.0);
    }
}

#[test]
fn strength_is_a_factor_and_bright_skies_are_clamped_after_the_mean() {
    // Columns of 0 and 16 in turn.
    let pixels = (0..8).flat_map(|x| [if x % 2 == 1 { 16.0 } else { 0.0 }; 3]).collect();
    let textures = vec![Texture::linear(&LinearImage { width: 8, height: 1, pixels }).unwrap().0];
    let mut scene = scene(&textures, 0.0, 0.5);
    scene.render.samples = 16;
    let mut frame = prepared(scene, textures);
    let brightest = seen(&mut frame, &[on_panorama(0.1875, 0.5)])[0];
    assert!((brightest - 8.0).abs().max_element() < 1e-4, "{brightest}");
    let picture = rendered(&frame);
    // A row of pixels, each with samples of 0 to 8.
    let place = |sample: u32| (f64::from(sample) + 0.5) / f64::from(4 * SIDE) * 2.0 - 1.0;
    let mut mixed = 0;
    for pixel in 0..SIDE {
        let samples: Vec<_> =
            (0..16).map(|i| DVec3::new(place(4 * pixel + i % 4), -place(4 * 8 + i / 4), -1.0)).collect();
        let radiance = seen(&mut frame, &samples);
        let mean = radiance.iter().sum::<Vec3>() / 16.0;
        let clamped_first = radiance.iter().map(|color| color.min(Vec3::ONE)).sum::<Vec3>() / 16.0;
        let [expected, other] = [mean, clamped_first].map(|color| srgb::encode(color)[0]);
        let found = picture[(3 * (8 * SIDE + pixel)) as usize];
        assert!(found.abs_diff(expected) <= 1, "pixel {pixel}: {found}, not {expected}");
        mixed += u32::from(expected.abs_diff(other) > 2);
    }
    assert!(mixed > 0, "the two orders give the same pixels");
}

proptest! {
    #[test]
    fn every_direction_has_a_radiance_within_that_of_the_texels(
        components in prop::array::uniform3(-1.0_f64..1.0), exponent in -37_i32..37, rotate in -1e30_f64..1e30,
    ) {
        let direction = DVec3::from_array(components) * libm::pow(10.0, f64::from(exponent));
        let faces = (0..6).map(|face| Texture::new(&colorful(1 + face, 3, face)).unwrap()).collect();
        let panorama = vec![Texture::new(&colorful(5, 7, 5)).unwrap()];
        for textures in [faces, panorama] {
            let color = seen(&mut frame(textures, rotate, 1.0), &[direction])[0];
            prop_assert!(color.cmpge(Vec3::ZERO).all() && color.cmple(Vec3::splat(1.0)).all(), "{}", color);
        }
    }
}
