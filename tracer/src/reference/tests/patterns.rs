//! Texture coordinates, patterns and normal maps of surfaces; pictures without light.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::super::Oracle;
use super::{BLACK, assert_near, empty, looking, marker, plane, point_light, seen, seen_with, sphere};
use crate::image::RgbImage;
use crate::scene::{
    Checker, CheckerSpace, Filter, FrameView, Material, NormalMap, Plane, Quality, Scene, Shading, Sphere,
    TextureMap,
};
use crate::srgb;
use crate::texture::Texture;

const COLORS: [Vec3; 2] = [Vec3::new(0.9, 0.5, 0.1), Vec3::new(0.2, 0.3, 0.4)];

/// A scene with one unlit material of a pattern.
fn with_pattern(size: f32, space: CheckerSpace) -> Scene {
    let pattern = Checker { colors: COLORS, size, space };
    let mut scene = empty();
    scene.materials = vec![Material { checker: Some(pattern), ..marker(Vec3::ONE) }];
    scene
}

fn expected(cell: i32) -> DVec3 {
    COLORS[cell.rem_euclid(2) as usize].as_dvec3()
}

#[test]
fn squares_on_a_floor_alternate() {
    for (space, origin) in [(CheckerSpace::World, 0.0), (CheckerSpace::Object, 0.3), (CheckerSpace::Uv, 0.3)]
    {
        let mut scene = with_pattern(0.5, space);
        // Textures repeat every two units: cells of half a repeat are one unit wide. v grows towards -Z.
        let (size, width) = if space == CheckerSpace::Uv { (2.0, 1.0) } else { (1.0, 0.5) };
        scene.planes = vec![Plane { size, ..plane(DVec3::new(0.3, 0.0, 0.3), DVec3::Y, 0) }];
        for (i, j) in (-3..3).flat_map(|j| (-3..3).map(move |i| (i, j))) {
            let middle = |cell: i32| origin + (f64::from(cell) + 0.5) * width;
            let at = DVec3::new(middle(i), 0.0, middle(j));
            // In space the floor shows the layer of cells below it; in texture space rows are counted towards -Z.
            let found = seen(&scene, at + DVec3::Y, DVec3::NEG_Y);
            assert_near(found, expected(i + j - 1), 0.0, &format!("{space:?} ({i}, {j})"));
        }
    }
}

#[test]
fn cubes_in_a_ball_start_at_its_centre() {
    let mut scene = with_pattern(10.0, CheckerSpace::Object);
    scene.spheres = vec![sphere(DVec3::new(1.0, 2.0, 3.0), 0.5, 0)];
    for octant in 0..8 {
        let sign = |axis: i32| if octant >> axis & 1 == 1 { -1.0 } else { 1.0 };
        let outwards = DVec3::new(sign(0), sign(1), sign(2));
        let found = seen(&scene, DVec3::new(1.0, 2.0, 3.0) + outwards, -outwards);
        let negative = (octant & 1) + (octant >> 1 & 1) + (octant >> 2);
        assert_near(found, expected(negative), 0.0, &format!("{outwards}"));
    }
}

/// A picture of 4 x 2 texels, each with a colour of its own.
fn picture() -> Arc<Texture> {
    let pixels = (0..8).flat_map(|i| [30 * i, 200, 10]).collect();
    Arc::new(Texture::new(&RgbImage { width: 4, height: 2, pixels }).unwrap())
}

fn texel(i: u8) -> DVec3 {
    DVec3::from_array([30 * i, 200, 10].map(srgb::decode))
}

fn textured(texture: &Texture) -> Scene {
    let mut scene = empty();
    scene.textures = vec![TextureMap::new(texture.id(), Filter::Nearest)];
    scene.materials = vec![Material { texture: Some(0), ..marker(Vec3::ONE) }];
    scene
}

/// A ball has the panorama that its centre would see: -Z is in the middle, +X to the right of it, +Y at the top.
#[test]
fn pictures_on_balls_are_laid_as_panoramas() {
    let texture = picture();
    let mut scene = textured(&texture);
    let outwards = |u: f64, height: f64| {
        let (s, c) = libm::sincos((u - 0.5) * std::f64::consts::TAU);
        DVec3::new(s, height, -c)
    };
    for (i, place) in
        (0..8).map(|i| (i, outwards((f64::from(i % 4) + 0.5) / 4.0, if i < 4 { 0.5 } else { -0.5 })))
    {
        scene.spheres = vec![sphere(DVec3::ZERO, 1.0, 0)];
        let found = seen_with(&scene, std::slice::from_ref(&texture), place * 3.0, -place);
        assert_near(found, texel(i), 1e-12, &format!("texel {i}"));
        // A quarter turn about +Y moves what is at -Z to -X.
        let turned = DVec3::new(place.z, place.y, -place.x);
        scene.spheres = vec![Sphere { uv_rotate: DVec3::Y * 90.0, ..sphere(DVec3::ZERO, 1.0, 0) }];
        let found = seen_with(&scene, std::slice::from_ref(&texture), turned * 3.0, -turned);
        assert_near(found, texel(i), 1e-12, &format!("texel {i}, turned"));
    }
}

/// On a wall that faces the viewer pictures are upright, and repeat from its point on.
#[test]
fn pictures_on_walls_are_upright() {
    let texture = picture();
    let mut scene = textured(&texture);
    let point = DVec3::new(0.25, 0.5, -1.0);
    scene.planes = vec![Plane { size: 2.0, ..plane(point, DVec3::Z, 0) }];
    for (i, repeat) in (0..8).flat_map(|i| [-2.0, 0.0, 4.0].map(|repeat| (i, repeat))) {
        let (column, row) = (f64::from(i % 4), f64::from(1 - i / 4));
        let at = point + DVec3::new((column + 0.5) / 2.0 + repeat, (row + 0.5) + repeat, 1.0);
        let found = seen_with(&scene, std::slice::from_ref(&texture), at, DVec3::NEG_Z);
        assert_near(found, texel(i), 1e-12, &format!("texel {i}, {repeat} aside"));
    }
}

fn normals_of(scene: &Scene, textures: &[Arc<Texture>], from: DVec3, along: DVec3) -> DVec3 {
    let view = looking(scene, from, along);
    let quality = Quality { shading: Shading::Normals, ..view.quality };
    Oracle::new(scene, &[], textures, &FrameView { quality, ..view }).pixel(0, 0) * 2.0 - 1.0
}

/// A texel tilts the normal along u and v of the front; the back of the surface has the opposite normal.
#[test]
fn normal_maps_tilt_along_texture_coordinates() {
    let bytes = [203, 78, 178];
    let texture = Arc::new(Texture::new(&RgbImage { width: 1, height: 1, pixels: bytes.to_vec() }).unwrap());
    let mut scene = textured(&texture);
    scene.planes = vec![plane(DVec3::ZERO, DVec3::Z, 0)];
    let [x, y, z] = bytes.map(|byte| 2.0 * f64::from(byte) / 255.0 - 1.0);
    for strength in [0.0, 0.5, 1.0] {
        scene.materials[0] = Material { normal_map: Some(NormalMap { texture: 0, strength }), ..BLACK };
        let strength = f64::from(strength);
        let expected = DVec3::new(x * strength, y * strength, z).normalize();
        for (from, side) in [(DVec3::Z, 1.0), (DVec3::NEG_Z, -1.0)] {
            let found = normals_of(&scene, std::slice::from_ref(&texture), from, -from);
            assert_near(found, expected * side, 1e-12, &format!("strength {strength}, side {side}"));
        }
    }
}

/// A light that only the tilted normal faces does not shine; one that both face does, by the tilted one.
#[test]
fn light_comes_from_the_side_of_the_untilted_normal() {
    let texture =
        Arc::new(Texture::new(&RgbImage { width: 1, height: 1, pixels: vec![255, 128, 191] }).unwrap());
    let mut scene = textured(&texture);
    let map = NormalMap { texture: 0, strength: 1.0 };
    scene.materials = vec![Material { diffuse: Vec3::ONE, normal_map: Some(map), ..BLACK }];
    scene.planes = vec![plane(DVec3::ZERO, DVec3::Z, 0)];
    let normal = normals_of(&scene, std::slice::from_ref(&texture), DVec3::Z, DVec3::NEG_Z);
    assert!(normal.x > 0.8, "tilted along +X: {normal}");
    for (to_light, lit) in [
        (DVec3::new(1.0, 0.0, 0.1), true),
        (DVec3::new(1.0, 0.0, -0.1), false),
        (DVec3::new(-1.0, 0.0, 0.1), false),
    ] {
        scene.lights = vec![point_light(to_light * 9.0)];
        let cosine = if lit { normal.dot(to_light.normalize()) } else { 0.0 };
        let found = seen_with(&scene, std::slice::from_ref(&texture), DVec3::Z, DVec3::NEG_Z);
        assert_near(found, DVec3::splat(cosine), 1e-12, &format!("{to_light}"));
    }
}

#[test]
fn pictures_without_light_show_properties() {
    let mut scene = empty();
    scene.materials = vec![Material { diffuse: Vec3::new(0.1, 0.2, 0.3), reflect: Vec3::ONE, ..BLACK }];
    scene.spheres = vec![sphere(DVec3::NEG_Z * 4.0, 1.0, 0)];
    scene.planes = vec![plane(DVec3::NEG_Z * 9.0, DVec3::Z, 0)];
    scene.background = crate::scene::Background::Color(Vec3::ONE);
    let shown = |shading, along: DVec3| {
        // look_at is one unit away.
        let view = looking(&scene, DVec3::ZERO, along);
        let quality = Quality { shading, ..view.quality };
        Oracle::new(&scene, &[], &[], &FrameView { quality, ..view }).pixel(0, 0)
    };
    assert_near(shown(Shading::Normals, DVec3::NEG_Z), DVec3::new(0.5, 0.5, 1.0), 1e-12, "normal");
    assert_near(shown(Shading::Depth, DVec3::NEG_Z), DVec3::splat(0.25), 1e-12, "three units away");
    assert_near(shown(Shading::Albedo, DVec3::NEG_Z), DVec3::new(0.1, 0.2, 0.3), 1e-7, "albedo");
    for shading in [Shading::Normals, Shading::Depth, Shading::Albedo, Shading::Item] {
        assert_near(shown(shading, DVec3::Z), DVec3::ZERO, 0.0, "nothing");
    }
    let [ball, wall] = [DVec3::NEG_Z, DVec3::new(1.0, 0.0, -1.0)].map(|along| shown(Shading::Item, along));
    assert!((ball - wall).length() > 0.1, "objects differ: {ball}, {wall}");
}
