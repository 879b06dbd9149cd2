//! Refraction, absorption, total internal reflection.

use glam::{DVec3, Vec3};

use super::{BLACK, assert_near, empty, marker, plane, seen, sphere};
use crate::scene::{Background, Material, Scene, Sphere};

const COLOR: Vec3 = Vec3::new(0.7, 0.5, 0.2);

fn glass(ior: f32) -> Material {
    Material { transmit: Vec3::ONE, ior, ..BLACK }
}

/// Glass between y = 0 and y = -`thickness`.
fn slab(material: Material, thickness: f64) -> Scene {
    let mut scene = empty();
    scene.materials = vec![material, marker(COLOR)];
    scene.planes = vec![plane(DVec3::ZERO, DVec3::Y, 0), plane(DVec3::NEG_Y * thickness, DVec3::NEG_Y, 0)];
    scene
}

/// Sine and cosine of the angle inside, by Snell's law.
fn inside(sine: f64, ior: f32) -> (f64, f64) {
    let sine = sine / f64::from(ior);
    (sine, (1.0 - sine * sine).sqrt())
}

#[test]
fn a_slab_shifts_rays_and_absorbs_along_the_slanted_way() {
    let (thickness, sine, cosine) = (2.0, 0.6, 0.8);
    for ior in [1.0, 1.3, 1.5, 2.4] {
        let absorption = Vec3::new(0.5, 1.0, 0.25);
        let mut scene = slab(Material { absorption, ..glass(ior) }, thickness);
        let (s, c) = inside(sine, ior);
        let leaves_at = DVec3::new(thickness * s / c, -thickness, 0.0);
        let direction = DVec3::new(sine, -cosine, 0.0);
        let left = absorption.as_dvec3().to_array().map(|share| libm::pow(share, thickness / c));
        for (aside, visible) in [(0.0, 1.0), (1.1e-6, 0.0)] {
            let across = DVec3::new(cosine, sine, 0.0) * aside;
            scene.spheres = vec![sphere(leaves_at + direction * 3.0 + across, 1e-6, 1)];
            let expected = COLOR.as_dvec3() * DVec3::from_array(left) * visible;
            let found = seen(&scene, -direction * 5.0, direction);
            assert_near(found, expected, 1e-9, &format!("index {ior}, {aside} off"));
        }
    }
}

#[test]
fn a_thin_sheet_neither_bends_nor_absorbs() {
    let sheet = Material { thin: true, absorption: Vec3::splat(0.1), ..glass(1.5) };
    let mut scene = slab(Material { transmit: Vec3::new(0.5, 0.25, 1.0), ..sheet }, 2.0);
    let direction = DVec3::new(0.6, -0.8, 0.0);
    scene.spheres = vec![sphere(direction * 5.0, 1e-6, 1)];
    let expected = COLOR.as_dvec3() * DVec3::new(0.25, 0.0625, 1.0);
    assert_near(seen(&scene, -direction * 5.0, direction), expected, 1e-12, "from above");
    // From between the sheets: the back of the lower one.
    let expected = COLOR.as_dvec3() * DVec3::new(0.5, 0.25, 1.0);
    assert_near(seen(&scene, direction, direction), expected, 1e-12, "from between");
}

/// Paraxial rays through a ball of radius r and index n meet at r (2 - n) / (2 (n - 1)) behind it.
#[test]
fn a_ball_has_the_focus_of_the_lens_formula() {
    let radius = 0.75;
    for ior in [1.25_f32, 1.5, 1.75] {
        let mut scene = empty();
        scene.materials = vec![glass(ior), marker(COLOR)];
        let n = f64::from(ior);
        let focus = -radius - radius * (2.0 - n) / (2.0 * (n - 1.0));
        for (along, visible) in [(0.0, 1.0), (0.01, 0.0), (-0.01, 0.0)] {
            let target = sphere(DVec3::Z * (focus + along), 1e-7, 1);
            scene.spheres = vec![sphere(DVec3::ZERO, radius, 0), target];
            for degrees in [0.0_f64, 50.0, 130.0, 250.0] {
                let (s, c) = libm::sincos(degrees.to_radians());
                let from = DVec3::new(1e-3 * c, 1e-3 * s, 4.0);
                let found = seen(&scene, from, DVec3::NEG_Z);
                assert_near(found, COLOR.as_dvec3() * visible, 1e-12, &format!("index {ior}, {along} off"));
            }
        }
    }
}

/// A ray that comes through the centre of all bodies is not bent; it is absorbed by the innermost body on each part of its way.
#[test]
fn bodies_in_bodies_absorb_each_on_its_own_part() {
    let mut scene = empty();
    let body = |ior, absorption| Material { absorption: Vec3::splat(absorption), ..glass(ior) };
    scene.materials = vec![body(1.5, 0.5), body(1.33, 0.25), marker(Vec3::ONE)];
    let bubble = Sphere { inside_out: true, ..sphere(DVec3::ZERO, 0.25, 1) };
    scene.spheres = vec![
        sphere(DVec3::ZERO, 1.0, 0),
        sphere(DVec3::ZERO, 0.5, 1),
        bubble,
        sphere(DVec3::Z * -3.0, 0.1, 2),
    ];
    // 2 x 0.25 units of water; in the bubble in the water is what is around the water: glass.
    let expected = libm::pow(0.5, 1.0 + 0.5) * libm::pow(0.25, 0.5);
    assert_near(seen(&scene, DVec3::Z * 3.0, DVec3::NEG_Z), DVec3::splat(expected), 1e-9, "the marker");
    // The camera is in the glass: 0.25 units of the way to the marker are glass.
    let expected = libm::pow(0.5, 0.25);
    assert_near(seen(&scene, DVec3::Z * -0.75, DVec3::NEG_Z), DVec3::splat(expected), 1e-9, "from inside");
}

/// Bodies that touch: their surfaces coincide, and rays enter the one as they leave the other.
#[test]
fn light_passes_from_body_to_body_where_they_touch() {
    let absorption = [0.5_f32, 0.25];
    let body = |ior, absorption| Material { absorption: Vec3::splat(absorption), ..glass(ior) };
    for indices in [[1.5, 1.25], [1.25, 1.5], [1.5, 1.5]] {
        let mut scene = empty();
        scene.materials =
            vec![body(indices[0], absorption[0]), body(indices[1], absorption[1]), marker(COLOR)];
        let at = |y: f64, normal: DVec3, material| plane(DVec3::Y * y, normal, material);
        scene.planes = vec![
            at(0.0, DVec3::Y, 0),
            at(-1.0, DVec3::NEG_Y, 0),
            at(-1.0, DVec3::Y, 1),
            at(-2.0, DVec3::NEG_Y, 1),
        ];
        let direction = DVec3::new(0.6, -0.8, 0.0);
        let (mut aside, mut left) = (0.0, 1.0);
        for (ior, share) in indices.into_iter().zip(absorption) {
            let (s, c) = inside(0.6, ior);
            aside += s / c;
            left *= libm::pow(f64::from(share), 1.0 / c);
        }
        scene.spheres = vec![sphere(DVec3::new(aside, -2.0, 0.0) + direction, 1e-6, 2)];
        for turned in [false, true] {
            if turned {
                scene.planes.reverse();
            }
            let found = seen(&scene, -direction, direction);
            assert_near(found, COLOR.as_dvec3() * left, 1e-9, &format!("{indices:?}, turned {turned}"));
        }
    }
}

/// A ray at 60 degrees in glass never leaves it: each of its hits adds the ambient light once.
#[test]
fn total_internal_reflection_ends_at_max_depth() {
    for fresnel in [false, true] {
        let material = Material { diffuse: Vec3::ONE, reflect: Vec3::ONE, fresnel, ..glass(1.5) };
        let material = if fresnel { material } else { Material { reflect: Vec3::ZERO, ..material } };
        let mut scene = slab(material, 1.0);
        scene.background = Background::Color(Vec3::splat(100.0));
        scene.ambient = Vec3::splat(0.125);
        let direction = DVec3::new(libm::sqrt(0.75), -0.5, 0.0);
        for max_depth in [0, 1, 7, 255] {
            scene.render.quality.max_depth = max_depth;
            let expected = DVec3::splat(0.125 * (f64::from(max_depth) + 1.0));
            let found = seen(&scene, DVec3::NEG_Y * 0.5, direction);
            assert_near(found, expected, 1e-9, &format!("depth {max_depth}, fresnel {fresnel}"));
        }
    }
}

/// Below the critical angle the share is that of the textbook: 0.04 for glass at straight incidence, from both sides.
#[test]
fn fresnel_shares_are_those_of_the_textbook() {
    let material = Material { reflect: Vec3::ONE, fresnel: true, ..glass(1.5) };
    let mut scene = slab(material, 1.0);
    scene.background = Background::Color(Vec3::ONE);
    scene.render.quality.max_depth = 1;
    scene.planes.truncate(1);
    let along = |degrees: f64| {
        let (s, c) = libm::sincos(degrees.to_radians());
        DVec3::new(s, -c, 0.0)
    };
    // All light is either reflected or transmitted.
    for degrees in [0.0, 30.0, 56.31, 80.0] {
        assert_near(seen(&scene, DVec3::Y, along(degrees)), DVec3::ONE, 1e-12, "both shares");
    }
    scene.materials[0].transmit = Vec3::ZERO;
    // At Brewster's angle atan(n) the reflected share is ((n^2 - 1) / (n^2 + 1))^2 / 2.
    let brewster = libm::atan(1.5).to_degrees();
    let across = 1.25 / 3.25;
    for (degrees, share) in [(0.0, 0.04), (brewster, across * across / 2.0), (89.999_999, 1.0)] {
        assert_near(seen(&scene, DVec3::Y, along(degrees)), DVec3::splat(share), 1e-6, "reflected");
    }
    assert_near(seen(&scene, DVec3::NEG_Y, DVec3::Y), DVec3::splat(0.04), 1e-12, "from inside");
}

/// Glass that absorbs nothing is invisible in a white world: all that enters leaves.
#[test]
fn energy_is_conserved() {
    let mut scene = empty();
    scene.background = Background::Color(Vec3::ONE);
    scene.render.quality.max_depth = 60;
    scene.materials = vec![Material { reflect: Vec3::ONE, fresnel: true, ..glass(1.5) }];
    scene.spheres = vec![sphere(DVec3::ZERO, 1.0, 0)];
    for aside in [0.0, 0.3, 0.7, 0.9, 0.98] {
        let found = seen(&scene, DVec3::new(aside, 0.0, 4.0), DVec3::NEG_Z);
        assert_near(found, DVec3::ONE, 1e-3, &format!("{aside} off the axis"));
    }
    // With mirrors and nested bodies rays are cut off: there is less light, never more.
    scene.materials.push(Material { reflect: Vec3::ONE, ..BLACK });
    scene.materials.push(Material { ior: 1.2, ..scene.materials[0] });
    scene.spheres.push(sphere(DVec3::new(0.2, 0.0, 0.1), 0.6, 2));
    scene.spheres.push(sphere(DVec3::new(1.5, 0.3, -1.0), 0.8, 1));
    scene.planes = vec![plane(DVec3::NEG_Y, DVec3::Y, 1)];
    scene.render.quality.max_depth = 9;
    for i in 0..40 {
        let aside = DVec3::new(f64::from(i % 8) * 0.3 - 1.0, f64::from(i / 8) * 0.35 - 0.9, 4.0);
        let found = seen(&scene, aside, DVec3::new(0.0, -0.1, -1.0));
        assert!(found.min_element() >= 0.0 && found.max_element() <= 1.0 + 1e-12, "{aside}: {found}");
    }
}
