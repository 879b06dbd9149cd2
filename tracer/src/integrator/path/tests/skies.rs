//! Skies as lights: a white one is a furnace, and the same light is the same picture from a panorama and from a cube map.

use std::f64::consts::{PI, TAU};

use super::*;
use crate::image::LinearImage;
use crate::scene::{Filter, Sky, SkyPicture, TextureMap};
use crate::texture::Texture;

/// Radiance of a sky by unit vectors.
type Radiance = dyn Fn(DVec3) -> f32;

fn picture(width: u32, height: u32, radiance: impl Fn(f64, f64) -> f32) -> Arc<Texture> {
    let place = |i: u32, count: u32| (f64::from(i) + 0.5) / f64::from(count);
    let texels = (0..width * height).map(|i| (place(i % width, width), place(i / width, height)));
    let pixels = texels.flat_map(|(s, t)| [radiance(s, t); 3]).collect();
    Arc::new(Texture::linear(&LinearImage { width, height, pixels }).unwrap().0)
}

fn panorama(side: u32, radiance: &Radiance) -> Vec<Arc<Texture>> {
    let at = |u: f64, v: f64| {
        let ((s, c), (sine, cosine)) = (libm::sincos((u - 0.5) * TAU), libm::sincos(v * PI));
        radiance(DVec3::new(s * sine, cosine, -c * sine))
    };
    vec![picture(2 * side, side, at)]
}

fn cube_map(side: u32, radiance: &Radiance) -> Vec<Arc<Texture>> {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let faces = [[x, -z, -y], [-x, z, -y], [y, x, z], [-y, x, -z], [z, x, -y], [-z, -x, -y]];
    let at = |[ahead, along_s, along_t]: [DVec3; 3]| {
        move |s: f64, t: f64| (ahead + along_s * (2.0 * s - 1.0) + along_t * (2.0 * t - 1.0)).normalize()
    };
    faces.map(|face| picture(side, side, |s, t| radiance(at(face)(s, t)))).into()
}

/// A floor with a ball and a wall under a sky: textures of one are a panorama, those of six a cube map.
fn outdoors(pictures: &[Arc<Texture>], rotate: f64) -> Scene {
    let sky =
        if pictures.len() == 6 { SkyPicture::Cubemap([0, 1, 2, 3, 4, 5]) } else { SkyPicture::Panorama(0) };
    let mut scene = floor();
    scene.camera = Camera { up: DVec3::Y, fov: 45.0, ..camera_at(DVec3::new(0.0, 1.5, 4.0)) };
    scene.spheres = vec![ball(DVec3::new(0.3, 0.5, 0.0), 0.5, 0)];
    scene.textures = pictures.iter().map(|face| TextureMap::new(face.id(), Filter::Bilinear)).collect();
    scene.background = Background::Sky(Sky { picture: sky, rotate, strength: 1.0 });
    scene
}

fn mean_under(pictures: Vec<Arc<Texture>>, scene: Scene, depth: u8) -> [f64; 3] {
    let view = path_view(&scene, 24, 256, depth);
    let compiled = Arc::new(CompiledScene::new(scene, [], pictures).unwrap());
    let frame = PreparedFrame::new(compiled, &view).unwrap();
    assert!(frame.light_table.is_some());
    let mut all = PixelSums::default();
    let pixels = sums(&frame, 0..24);
    pixels.iter().for_each(|pixel| all.add(pixel));
    all.rgb.map(|sum| sum as f64 / (pixels.len() as f64 * 256.0 * f64::from(1 << 20)))
}

#[test]
fn a_white_scene_in_a_white_cube_map_is_invisible() {
    for side in [1, 3, 40] {
        let pictures = cube_map(side, &|_| 1.0);
        let mut scene = outdoors(&pictures, 20.0);
        scene.planes.clear();
        scene.materials[0] = diffuse(Vec3::ONE);
        for found in mean_under(pictures, scene, 20) {
            assert!((found - 1.0).abs() < 0.003, "{side}: {found}");
        }
    }
}

#[test]
fn a_cube_map_lights_as_a_panorama_of_the_same_sky() {
    let sun = DVec3::new(0.4, 0.7, -0.5).normalize();
    let radiance = move |d: DVec3| {
        let glow = libm::exp(300.0 * (d.dot(sun) - 1.0));
        (0.3 + 0.2 * d.y + 0.1 * d.x + 30.0 * glow) as f32
    };
    for rotate in [0.0, 70.0] {
        let (cube, wide) = (cube_map(128, &radiance), panorama(256, &radiance));
        let (in_cube, in_wide) = (outdoors(&cube, rotate), outdoors(&wide, rotate));
        let (found, expected) = (mean_under(cube, in_cube, 4)[0], mean_under(wide, in_wide, 4)[0]);
        assert!((found / expected - 1.0).abs() < 0.01, "{rotate}: {found}, not {expected}");
    }
}

#[test]
fn all_levels_have_the_same_sums_under_a_cube_map() {
    let pictures = cube_map(8, &|d| (1.0 + d.x + 0.5 * d.y) as f32);
    let scene = outdoors(&pictures, 33.0);
    let view = path_view(&scene, 18, 3, 4);
    let compiled = Arc::new(CompiledScene::new(scene, [], pictures).unwrap());
    let mut frame = PreparedFrame::new(compiled, &view).unwrap();
    let expected = sums(&frame, 0..view.height);
    for level in simd::all() {
        frame.level = level;
        assert!(sums(&frame, 0..view.height) == expected, "{}", simd::name(level));
    }
}
