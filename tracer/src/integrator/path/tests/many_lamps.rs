//! Scenes with many lamps: the same bits on all levels, and the mean that the formulas say.

use super::*;

/// A floor under a square of lamps that emit, `side` along each side.
fn under_lamps(side: u32, radius: f64) -> Scene {
    let mut scene = floor();
    scene.camera = Camera { fov: 1.0, ..camera_at(DVec3::new(0.0, 0.5, 0.0)) };
    scene.spheres = places(side).map(|place| ball(place, radius, 1)).collect();
    scene
}

fn places(side: u32) -> impl Iterator<Item = DVec3> {
    let along = move |i: u32| (f64::from(i) - f64::from(side - 1) / 2.0) * 0.5;
    (0..side * side).map(move |i| DVec3::new(along(i % side), 1.0, along(i / side)))
}

#[test]
fn many_balls_light_a_floor_as_the_formula_says() {
    for (side, radius) in [(2, 0.1), (3, 0.1), (5, 0.1), (24, 0.01)] {
        let scene = under_lamps(side, radius);
        // E = pi L (r / d)^2 cos for each.
        let sum: f64 = places(side).map(|place| (radius / place.length()).powi(2) / place.length()).sum();
        let found = mean(&scene, &path_view(&scene, 8, 256, 1));
        for (found, emission) in found.into_iter().zip([8.0, 4.0, 2.0]) {
            let expected = 0.5 * emission * sum;
            let error = (found / expected - 1.0).abs();
            assert!(error < 0.01, "{side} x {side} lamps: {found}, not {expected}");
        }
    }
}

#[test]
fn many_spots_light_a_floor_as_the_formula_says() {
    let mut scene = floor();
    scene.camera = Camera { fov: 0.5, ..camera_at(DVec3::new(0.0, 0.9, 0.0)) };
    let half_angle = 40.0_f64;
    scene.lights = places(12)
        .map(|position| Light {
            attenuation: Attenuation::InverseSquare,
            ..light(LightKind::Spot {
                position,
                direction: DVec3::NEG_Y,
                beam_angle: 2.0 * half_angle,
                penumbra: 0.0,
            })
        })
        .collect();
    let lit = places(12).filter(|place| place.y / place.length() > libm::cos(half_angle.to_radians()));
    let sum: f64 = lit.map(|place| 1.0 / place.length().powi(3)).sum();
    let found = mean(&scene, &path_view(&scene, 8, 256, 1));
    for (found, color) in found.into_iter().zip([0.9, 0.8, 0.7]) {
        let expected = 0.5 * color * sum;
        assert!((found / expected - 1.0).abs() < 0.01, "{found}, not {expected}");
    }
}

#[test]
fn all_levels_and_cuts_have_the_same_sums_under_many_lamps() {
    let mut scene = furnished();
    let lamps = places(6).map(|place| ball(place * 0.5, 0.02, 5));
    scene.spheres.extend(lamps);
    let view = FrameView { width: 18, height: 19, ..path_view(&scene, 1, 3, 5) };
    let mut frame = PreparedFrame::new(compiled(&scene), &view).unwrap();
    assert!(frame.light_table.as_ref().unwrap().has_tree());
    let expected = sums(&frame, 0..view.height);
    for level in simd::all() {
        frame.level = level;
        assert!(sums(&frame, 0..view.height) == expected, "{}", simd::name(level));
    }
    for (top, bottom) in [(0, 5), (5, 19)] {
        let pixels = top as usize * 18..bottom as usize * 18;
        assert!(sums(&frame, top..bottom) == expected[pixels], "rows {top} to {bottom}");
    }
}
