//! Pictures all around.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::{BLACK, assert_near, empty, plane, seen, seen_with};
use crate::image::RgbImage;
use crate::scene::{Background, Filter, Material, Scene, Sky, SkyPicture, TextureMap};
use crate::srgb;
use crate::texture::Texture;

/// A picture whose pixel (x, y), from the top left corner, has its place as its colour.
fn picture(width: u32, height: u32, blue: u8) -> Arc<Texture> {
    let pixels = (0..height).flat_map(|y| (0..width).flat_map(move |x| [20 * x as u8, 20 * y as u8, blue]));
    Arc::new(Texture::new(&RgbImage { width, height, pixels: pixels.collect() }).unwrap())
}

/// The linear colour of that pixel.
fn color(x: u8, y: u8, blue: u8) -> DVec3 {
    DVec3::from_array([20 * x, 20 * y, blue].map(srgb::decode))
}

fn with_sky(textures: &[Arc<Texture>], picture: SkyPicture, rotate: f64, strength: f32) -> Scene {
    let textures = textures.iter().map(|texture| TextureMap::new(texture.id(), Filter::Bilinear)).collect();
    Scene { textures, background: Background::Sky(Sky { picture, rotate, strength }), ..empty() }
}

/// The direction at a place of a panorama, from its left border and its top.
fn around(u: f64, from_top: f64) -> DVec3 {
    let ((s, c), (ring, height)) =
        (libm::sincos((u - 0.5) * std::f64::consts::TAU), libm::sincos(from_top * std::f64::consts::PI));
    DVec3::new(ring * s, height, -ring * c)
}

#[test]
fn a_panorama_has_its_centre_ahead_and_its_first_row_above() {
    let textures = [picture(8, 4, 50)];
    let scene = with_sky(&textures, SkyPicture::Panorama(0), 0.0, 2.0);
    for (x, y) in (0..4).flat_map(|y| (0..8).map(move |x| (x, y))) {
        let direction = around((f64::from(x) + 0.5) / 8.0, (f64::from(y) + 0.5) / 4.0);
        let found = seen_with(&scene, &textures, DVec3::new(3.0, 2.0, 1.0), direction);
        assert_near(found, color(x, y, 50) * 2.0, 1e-12, &format!("texel ({x}, {y})"));
    }
    // Between four texels; across the border; beyond the last row.
    let seen = |u, from_top| seen_with(&scene, &textures, DVec3::ZERO, around(u, from_top)) / 2.0;
    let mean = (color(3, 1, 50) + color(4, 1, 50) + color(3, 2, 50) + color(4, 2, 50)) / 4.0;
    assert_near(seen(0.5, 0.5), mean, 1e-12, "the centre");
    let mean = color(7, 1, 50) * 0.75 + color(0, 1, 50) * 0.25;
    assert_near(seen(7.75 / 8.0, 1.5 / 4.0), mean, 1e-12, "the border");
    assert_near(seen(2.5 / 8.0, 0.03), color(2, 0, 50), 1e-12, "above the first row");
}

/// A quarter turn about +Y moves what is ahead, at -Z, to the left, at -X.
#[test]
fn a_sky_turns_as_models_do() {
    let textures = [picture(8, 4, 50)];
    let still = with_sky(&textures, SkyPicture::Panorama(0), 0.0, 1.0);
    let turned = with_sky(&textures, SkyPicture::Panorama(0), 90.0, 1.0);
    for direction in [DVec3::new(0.1, 0.2, -1.0), DVec3::new(0.7, -0.3, 0.4), DVec3::new(-0.5, 0.6, 0.9)] {
        let to = DVec3::new(direction.z, direction.y, -direction.x);
        let [before, after] = [(&still, direction), (&turned, to)]
            .map(|(scene, direction)| seen_with(scene, &textures, DVec3::ZERO, direction));
        assert_near(after, before, 1e-12, "turned");
    }
}

/// Section 8.13 of the OpenGL 4.6 specification: s and t of each face at a direction towards its top left quarter.
#[test]
fn faces_of_a_cube_are_those_of_the_table() {
    let textures: Vec<_> = (0..6).map(|face| picture(4, 4, 40 * face)).collect();
    let scene = with_sky(&textures, SkyPicture::Cubemap([0, 1, 2, 3, 4, 5]), 0.0, 1.0);
    let (s, t) = (-0.75, -0.25);
    let directions = [
        DVec3::new(1.0, -t, -s),
        DVec3::new(-1.0, -t, s),
        DVec3::new(s, 1.0, t),
        DVec3::new(s, -1.0, -t),
        DVec3::new(s, -t, 1.0),
        DVec3::new(-s, -t, -1.0),
    ];
    for (face, direction) in (0..6).zip(directions) {
        let found = seen_with(&scene, &textures, DVec3::ZERO, direction);
        assert_near(found, color(0, 1, 40 * face), 1e-12, &format!("face {face}"));
    }
    // At the border of a face nothing of its neighbour is mixed in.
    let found = seen_with(&scene, &textures, DVec3::ZERO, DVec3::new(1.0, 0.25, 0.999));
    assert_near(found, color(0, 1, 0), 1e-12, "the border of +X");
}

#[test]
fn a_hidden_background_is_reflected() {
    let mut scene = Scene {
        background: Background::Gradient { bottom: Vec3::ZERO, top: Vec3::ONE },
        background_visible: false,
        ..empty()
    };
    assert_near(seen(&scene, DVec3::Y, DVec3::Y), DVec3::ZERO, 0.0, "the background");
    scene.materials = vec![Material { reflect: Vec3::ONE, ..BLACK }];
    scene.planes = vec![plane(DVec3::ZERO, DVec3::Y, 0)];
    assert_near(seen(&scene, DVec3::Y, DVec3::NEG_Y), DVec3::ONE, 1e-12, "its reflection");
    assert_near(seen(&scene, DVec3::Y, DVec3::new(0.8, -0.6, 0.0)), DVec3::splat(0.8), 1e-12, "slanted");
}
