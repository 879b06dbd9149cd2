//! Reflection.

use glam::{DVec3, Vec3};

use super::{BLACK, assert_near, empty, marker, plane, seen, sphere};
use crate::scene::Material;

const SHARES: Vec3 = Vec3::new(0.9, 0.75, 0.5);

const COLOR: Vec3 = Vec3::new(0.7, 0.5, 0.2);

/// The n-th picture of an object between two mirrors is in the n-th copy of the room, unfolded at the mirrors, and has passed n
/// reflections.
#[test]
fn parallel_mirrors_repeat_what_is_between_them() {
    let mut scene = empty();
    scene.materials = vec![Material { reflect: SHARES, ..BLACK }, marker(COLOR)];
    scene.planes = vec![plane(DVec3::X, DVec3::X, 0), plane(DVec3::NEG_X, DVec3::X, 0)];
    let (eye, object, radius) = (DVec3::new(-0.2, 0.1, 0.0), DVec3::new(0.3, -0.4, -3.0), 0.01);
    scene.spheres = vec![sphere(object, radius, 1)];
    for copy in -9_i32..=9 {
        let side = if copy % 2 == 0 { 1.0 } else { -1.0 };
        let picture = DVec3::new(2.0 * f64::from(copy) + side * object.x, object.y, object.z);
        let weight = SHARES.as_dvec3().to_array().map(|share| libm::pow(share, f64::from(copy.abs())));
        // Eight bounces are followed.
        let visible = if copy.abs() <= 8 { 1.0 } else { 0.0 };
        let expected = COLOR.as_dvec3() * DVec3::from_array(weight) * visible;
        assert_near(seen(&scene, eye, picture - eye), expected, 1e-12, &format!("picture {copy}"));
        let next_to_it = picture + DVec3::Y * (1.1 * radius) - eye;
        assert_near(seen(&scene, eye, next_to_it), DVec3::ZERO, 0.0, &format!("next to picture {copy}"));
    }
}

#[test]
fn rays_that_can_add_too_little_are_not_followed() {
    let mut scene = empty();
    scene.materials = vec![Material { reflect: Vec3::splat(0.5), ..BLACK }, marker(Vec3::ONE)];
    scene.planes = vec![plane(DVec3::X, DVec3::X, 0), plane(DVec3::NEG_X, DVec3::X, 0)];
    scene.spheres = vec![sphere(DVec3::NEG_Z * 3.0, 0.01, 1)];
    scene.render.quality.min_contribution = 0.125;
    for (copy, expected) in [(0, 1.0), (1, 0.5), (2, 0.25), (3, 0.125), (4, 0.0)] {
        let picture = DVec3::new(2.0 * f64::from(copy), 0.0, -3.0);
        assert_near(seen(&scene, DVec3::ZERO, picture), DVec3::splat(expected), 1e-12, "picture");
    }
}

/// The normal of the polished inside of a ball has the same angle to both rays, and the reflected ray stays in the plane of both.
#[test]
fn a_concave_mirror_reflects_about_its_normal() {
    let mut scene = empty();
    scene.materials = vec![Material { reflect: Vec3::ONE, ..BLACK }, marker(COLOR)];
    // From (-0.6, 0, 0) straight down to (-0.6, -0.8, 0): the normal there is (0.6, 0.8, 0).
    let (hit, normal) = (DVec3::new(-0.6, -0.8, 0.0), DVec3::new(0.6, 0.8, 0.0));
    let cosine = normal.y;
    let reflected = normal * (2.0 * cosine) - DVec3::Y;
    scene.spheres = vec![sphere(DVec3::ZERO, 1.0, 0), sphere(hit + reflected * 0.7, 1e-6, 1)];
    let found = seen(&scene, DVec3::new(-0.6, 0.0, 0.0), DVec3::NEG_Y);
    assert_near(found, COLOR.as_dvec3(), 0.0, "the marker on the reflected ray");
}

/// A sheet that reflects and transmits everything inside a mirror: the rays double, all of them hit something, and each hit adds
/// the ambient light once.
#[test]
fn a_sample_has_at_most_1024_secondary_rays() {
    let mut scene = empty();
    scene.ambient = Vec3::splat(1.0 / 1025.0);
    let white =
        Material { diffuse: Vec3::ONE, specular: Vec3::ZERO, reflect: Vec3::ONE, ..Material::NEUTRAL };
    scene.materials = vec![Material { transmit: Vec3::ONE, thin: true, ..white }, white];
    scene.spheres = vec![sphere(DVec3::ZERO, 1.0, 0), sphere(DVec3::ZERO, 2.0, 1)];
    scene.render.quality.max_depth = 60;
    assert_near(seen(&scene, DVec3::ZERO, DVec3::X), DVec3::ONE, 1e-6, "1 + 1024 rays");
    // Up to the fourth generation: 1, 2, 3, 5 and 8 rays.
    scene.render.quality.max_depth = 4;
    assert_near(seen(&scene, DVec3::ZERO, DVec3::X) * 1025.0, DVec3::splat(19.0), 1e-4, "all rays");
}
