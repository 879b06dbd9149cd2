//! The trilinear filter of far textures.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::super::pyramid::levels;
use super::{BLACK, assert_near, empty, marker, plane, seen_with};
use crate::image::RgbImage;
use crate::scene::{Filter, Material, Plane, Scene, TextureMap};
use crate::srgb;
use crate::texture::Texture;

fn picture(width: u32, height: u32, code: impl Fn(u32, u32) -> u8) -> Arc<Texture> {
    let codes = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| code(x, y));
    let pixels = codes.flat_map(|code| [code; 3]).collect();
    Arc::new(Texture::new(&RgbImage { width, height, pixels }).unwrap())
}

/// Each texel of a level is the mean of the area that it covers, so that the last one is the mean of the picture.
#[test]
fn levels_are_means_down_to_one_texel() {
    let code = |x: u32, y: u32| (x * 37 + y * 91) as u8;
    for (width, height, sizes) in [
        (8, 2, vec![[8, 2], [4, 1], [2, 1], [1, 1]]),
        (5, 3, vec![[5, 3], [2, 1], [1, 1]]),
        (1, 1, vec![[1, 1]]),
    ] {
        let all = levels(&picture(width, height, code));
        assert_eq!(all.iter().map(|level| [level.width, level.height]).collect::<Vec<_>>(), sizes);
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| srgb::decode(code(x, y))));
        let mean = texels.sum::<f64>() / f64::from(width * height);
        assert_near(
            all[sizes.len() - 1].texel(0, 0),
            DVec3::splat(mean),
            1e-12,
            &format!("{width} x {height}"),
        );
    }
    let fourth = levels(&picture(4, 4, code))[1].texel(1, 0);
    // Rows are counted from the bottom.
    let corners = [(2, 2), (3, 2), (2, 3), (3, 3)].map(|(x, y)| srgb::decode(code(x, y)));
    assert_near(fourth, DVec3::splat(corners.iter().sum::<f64>() / 4.0), 1e-12, "a quarter of four texels");
}

/// A wall with a board of black and white squares, one texel each, of which a pixel shows `texels` along its height.
fn board(texture: &Texture, distance: f64, texels: f64) -> Scene {
    let mut scene = empty();
    scene.textures = vec![TextureMap::new(texture.id(), Filter::Trilinear)];
    scene.materials =
        vec![Material { texture: Some(0), ..marker(Vec3::ONE) }, Material { reflect: Vec3::ONE, ..BLACK }];
    let pixel = 2.0 * libm::tan(20_f64.to_radians()) * distance;
    // The middle of the picture is the centre of a white texel.
    let size = pixel * 8.0 / texels;
    let point = DVec3::new(-0.5, -0.5, 0.0) * (size / 8.0) - DVec3::Z * distance;
    scene.planes = vec![Plane { size, ..plane(point, DVec3::Z, 0) }];
    scene
}

#[test]
fn far_boards_are_grey_and_near_ones_are_sharp() {
    let texture = picture(8, 8, |x, y| if (x + y) % 2 == 1 { 255 } else { 0 });
    let textures = [Arc::clone(&texture)];
    for distance in [1.0, 7.0, 1e6] {
        // Half a level: the mean of the sharp and the grey picture.
        for (texels, expected) in
            [(0.1, 1.0), (1.0, 1.0), (std::f64::consts::SQRT_2, 0.75), (2.0, 0.5), (4.0, 0.5), (100.0, 0.5)]
        {
            let scene = board(&texture, distance, texels);
            let found = seen_with(&scene, &textures, DVec3::ZERO, DVec3::NEG_Z);
            assert_near(found, DVec3::splat(expected), 1e-6, &format!("{texels} texels, {distance} away"));
        }
    }
}

/// The cone of a sample grows along the whole way: a picture in a mirror is as far as both ways together.
#[test]
fn pictures_in_mirrors_are_filtered_over_the_whole_way() {
    let texture = picture(8, 8, |x, y| if (x + y) % 2 == 1 { 255 } else { 0 });
    let mut scene = board(&texture, 3.0, std::f64::consts::SQRT_2);
    // One unit to the mirror behind the camera, and two back to the wall.
    scene.planes[0].point.z = -1.0;
    scene.planes.push(plane(DVec3::Z, DVec3::NEG_Z, 1));
    let found = seen_with(&scene, &[texture], DVec3::ZERO, DVec3::Z);
    assert_near(found, DVec3::splat(0.75), 1e-6, "one unit and two units away");
}
