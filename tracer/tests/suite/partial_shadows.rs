//! Soft shadows and light through transparent surfaces, against geometry: a light above a ground, occluders between them, and a
//! camera below the occluders that looks down.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::scene::{
    Attenuation, Camera, Disk, FrameView, Material, Plane, Quality, Scene, Sphere, Triangle,
};

use crate::common::{empty, light, point, render};

/// Pixels along a side of the picture: 1 world unit of the ground.
const SIDE: u32 = 64;

/// Height of the light.
const HEIGHT: f64 = 3.0;

/// Materials of the scene by index.
const GROUND: u32 = 0;
const OCCLUDER: u32 = 1;
const PANE: u32 = 2;
const SHADOWLESS: u32 = 3;

/// The ground, with a light of a radius above its middle.
fn ground(radius: f64) -> Scene {
    let mut scene = empty(SIDE, SIDE);
    let matte = Material { diffuse: Vec3::ONE, specular: Vec3::ZERO, ..Material::NEUTRAL };
    scene.materials = vec![
        matte,
        matte,
        Material { transmit: Vec3::new(0.5, 1.0, 0.8), ..matte },
        Material { casts_shadow: false, ..matte },
    ];
    scene.ambient = Vec3::ZERO;
    scene.camera = Camera {
        position: DVec3::Y * 0.5,
        look_at: DVec3::ZERO,
        up: DVec3::NEG_Z,
        fov: 90.0,
        ..scene.camera
    };
    scene.planes = vec![Plane { point: DVec3::ZERO, normal: DVec3::Y, material: GROUND, size: 1.0 }];
    scene.lights = vec![light(point(0.0, HEIGHT, 0.0), 0.8, Attenuation::None)];
    scene.lights[0].radius = radius;
    scene
}

/// Two triangles at a height, from x = `from` to x = `to`.
fn pane(height: f64, from: f64, to: f64, material: u32) -> [Triangle; 2] {
    let corner = |x: f64, z: f64| DVec3::new(x, height, z);
    let [a, b, c, d] = [corner(from, -5.0), corner(to, -5.0), corner(to, 5.0), corner(from, 5.0)];
    [[a, b, c], [a, c, d]].map(|vertices| Triangle { vertices, uvs: None, material })
}

fn ball(center: DVec3, radius: f64, material: u32) -> Sphere {
    Sphere { center, radius, material, inside_out: false, uv_rotate: DVec3::ZERO }
}

fn picture(scene: &Scene, samples: u32) -> RgbImage {
    render(scene, &[], &FrameView { samples, ..FrameView::of(scene) }).0
}

/// The linear value of an 8-bit channel.
fn linear(byte: u8) -> f64 {
    let encoded = f64::from(byte) / 255.0;
    if encoded <= 0.04045 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
}

/// S_j of a pixel: its light as a share of that without occluders.
fn shares(scene: &Scene, full: &Scene, samples: u32) -> Vec<[f64; 3]> {
    let (found, full) = (picture(scene, samples), picture(full, samples));
    let pairs = found.pixels.chunks_exact(3).zip(full.pixels.chunks_exact(3));
    pairs.map(|(found, full)| [0, 1, 2].map(|i| linear(found[i]) / linear(full[i]))).collect()
}

/// x of the middle of a column of pixels, on the ground.
fn place_of(column: usize) -> f64 {
    (column as f64 + 0.5) / f64::from(SIDE) - 0.5
}

/// An edge at height 1 above the line x = 0: by similar triangles its penumbra reaches r h / (H - h) to both sides, and the light
/// within it is the share of a disc on one side of a line.
#[test]
fn a_penumbra_has_the_width_and_the_profile_of_similar_triangles() {
    for radius in [0.1, 0.4, 0.7] {
        let mut scene = ground(radius);
        scene.triangles = pane(1.0, -5.0, 0.0, OCCLUDER).to_vec();
        let full = Scene { triangles: vec![], ..scene.clone() };
        // The plane through a place and the edge touches the ball there.
        let reach = radius / ((HEIGHT - 1.0) * (HEIGHT - 1.0) - radius * radius).sqrt();
        // Largest difference of one set, and of four.
        for (samples, most) in [(1, 0.24), (4, 0.11)] {
            let mut sums = [0.0; SIDE as usize];
            for (index, share) in shares(&scene, &full, samples).into_iter().enumerate() {
                let column = index % SIDE as usize;
                let (x, half_pixel) = (place_of(column), 0.5 / f64::from(SIDE));
                // Distance of the light's centre from that plane, in radii.
                let at = (x * (HEIGHT - 1.0) / ((x * x + 1.0).sqrt() * radius)).clamp(-1.0, 1.0);
                let expected = 0.5 + (at * (1.0 - at * at).sqrt() + libm::asin(at)) / PI;
                // The light changes within a pixel; the rest is the rounding to bytes.
                let slack = half_pixel / reach + 0.02;
                let what = format!("radius {radius}, {samples} samples, x = {x}: {share:?}, {expected}");
                assert!((share[0] - expected).abs() < most + slack, "{what}");
                if x < -reach - half_pixel {
                    assert_eq!(share, [0.0; 3], "umbra: {what}");
                }
                if x > reach + half_pixel {
                    assert_eq!(share, [1.0; 3], "outside: {what}");
                }
                sums[column] += share[0] / f64::from(SIDE);
            }
            if samples == 4 {
                // Up to the rounding to bytes.
                assert!(sums.is_sorted_by(|a, b| *a <= b + 0.005), "not ascending: {sums:?}");
            }
        }
    }
}

#[test]
fn the_number_of_points_is_the_lights_own_or_that_of_the_quality() {
    let mut scene = ground(0.6);
    scene.triangles = pane(1.0, -5.0, 0.0, OCCLUDER).to_vec();
    scene.lights[0].shadow_samples = Some(256);
    let by_light = picture(&scene, 1);
    scene.lights[0].shadow_samples = None;
    let with = |shadow_samples| {
        let quality = Quality { shadow_samples, ..Quality::default() };
        render(&scene, &[], &FrameView { quality, ..FrameView::of(&scene) })
    };
    assert!(by_light.pixels == with(256).0.pixels);
    assert!(with(16).0.pixels == picture(&scene, 1).pixels);
    let (_, few) = with(16);
    let (_, many) = with(256);
    assert_eq!((few.shadow, many.shadow), (16 * few.primary, 256 * few.primary), "all are above the horizon");
}

#[test]
fn a_light_without_shadows_has_no_soft_ones() {
    let mut scene = ground(0.6);
    scene.triangles = pane(1.0, -5.0, 0.0, OCCLUDER).to_vec();
    scene.lights[0].shadows = false;
    let (image, counts) = render(&scene, &[], &FrameView::of(&scene));
    assert_eq!(counts.shadow, 0);
    scene.triangles.clear();
    scene.lights[0].shadows = true;
    assert!(image.pixels == picture(&scene, 1).pixels);
}

#[test]
fn a_tiny_radius_gives_the_hard_shadow() {
    let mut scene = ground(1e-9);
    scene.spheres = vec![ball(DVec3::Y, 0.2, OCCLUDER)];
    let soft = picture(&scene, 1);
    scene.lights[0].radius = 0.0;
    let hard = picture(&scene, 1);
    assert!(soft.pixels == hard.pixels);
    let dark = hard.pixels.chunks_exact(3).filter(|pixel| **pixel == [0, 0, 0]).count();
    assert!(dark > 100 && dark < 4000, "{dark}");
}

/// The ball of the light reaches through the ground: right below its centre, half a radius above the ground, the share of its
/// disc above the ground is 1 - F(-1/2) = 0.8045. An occluder inside of the light's ball leaves what is below and around it.
#[test]
fn lights_that_reach_into_surfaces_count_above_the_horizon() {
    let mut scene = ground(2.0);
    scene.lights[0].kind = point(0.0, 1.0, 0.0);
    let mut full = scene.clone();
    full.lights[0].radius = 0.0;
    let share = shares(&scene, &full, 4);
    let middle = share[(SIDE / 2 * SIDE + SIDE / 2) as usize];
    assert!((middle[0] - 0.8045).abs() < 0.05, "{middle:?}");
    scene.spheres = vec![ball(DVec3::Y * 1.5, 0.7, OCCLUDER)];
    let partly = shares(&scene, &full, 4)[(SIDE / 2 * SIDE + SIDE / 2) as usize];
    assert!(partly[0] < middle[0] - 0.04 && partly[0] > 0.3, "{partly:?}");
    // The light's centre on the ground.
    scene.lights[0].kind = point(0.0, 0.0, 0.0);
    assert_eq!(picture(&scene, 1).pixels.len(), (SIDE * SIDE * 3) as usize);
}

#[test]
fn panes_multiply_the_light_by_their_colors() {
    let colors = [Vec3::new(0.5, 1.0, 0.8), Vec3::new(0.6, 0.25, 1.0)];
    for radius in [0.0, 0.3] {
        let mut scene = ground(radius);
        let full = scene.clone();
        scene.materials[PANE as usize].transmit = colors[0];
        scene.materials.push(Material { transmit: colors[1], ..scene.materials[PANE as usize] });
        let second = scene.materials.len() as u32 - 1;
        scene.triangles =
            pane(1.0, -5.0, 5.0, PANE).into_iter().chain(pane(1.5, -5.0, 5.0, second)).collect();
        let product = colors[0] * colors[1];
        for share in shares(&scene, &full, 1) {
            for channel in 0..3 {
                let (found, expected) = (share[channel], f64::from(product[channel]));
                assert!((found - expected).abs() < 0.02, "radius {radius}: {share:?}, {product}");
            }
        }
        // An opaque surface above them.
        scene.triangles.extend(pane(2.0, -5.0, 5.0, OCCLUDER));
        assert!(picture(&scene, 1).pixels.iter().all(|&byte| byte == 0));
    }
}

#[test]
fn both_sides_of_a_glass_ball_count_and_one_side_of_a_disk() {
    let mut scene = ground(0.0);
    let full = scene.clone();
    let color = scene.materials[PANE as usize].transmit.as_dvec3();
    let middle = (SIDE / 2 * SIDE + SIDE / 2) as usize;
    let check = |scene: &Scene, expected: DVec3| {
        let found = DVec3::from_array(shares(scene, &full, 1)[middle]);
        assert!((found - expected).abs().max_element() < 0.02, "{found}, {expected}");
    };
    scene.spheres = vec![ball(DVec3::Y, 0.3, PANE)];
    check(&scene, color * color);
    scene.disks = vec![Disk { center: DVec3::Y * 2.0, normal: DVec3::Y, radius: 1.0, material: PANE }];
    check(&scene, color * color * color);
    // A ball around the light: its far side is behind the light.
    scene.disks.clear();
    scene.spheres = vec![ball(DVec3::Y * HEIGHT, 0.3, PANE)];
    check(&scene, color);
    scene.spheres.clear();
    scene.planes.push(Plane { point: DVec3::Y * 2.0, normal: DVec3::Y, material: PANE, size: 1.0 });
    check(&scene, color);
}

#[test]
fn surfaces_that_cast_no_shadow_change_no_light() {
    for radius in [0.0, 0.3] {
        let mut scene = ground(radius);
        let full = picture(&scene, 1);
        scene.spheres = vec![ball(DVec3::Y, 0.3, SHADOWLESS)];
        scene.triangles = pane(1.5, -5.0, 5.0, SHADOWLESS).to_vec();
        assert!(picture(&scene, 1).pixels == full.pixels, "radius {radius}");
        // Behind it an opaque one still does.
        scene.spheres.push(ball(DVec3::Y * 2.0, 0.3, OCCLUDER));
        let shadowed = picture(&scene, 1);
        scene.spheres.remove(0);
        scene.triangles.clear();
        assert!(picture(&scene, 1).pixels == shadowed.pixels, "radius {radius}");
        assert!(shadowed.pixels != full.pixels);
    }
}

#[test]
fn light_ends_behind_256_transparent_surfaces() {
    let mut scene = ground(0.0);
    // As near to clear as a number may be: clear surfaces are no occluders at all, and do not count.
    scene.materials[PANE as usize].transmit = Vec3::splat(1.0 - f32::EPSILON / 2.0);
    let disk = |index: u32| Disk {
        center: DVec3::Y * (0.6 + 0.005 * f64::from(index)),
        normal: DVec3::Y,
        radius: 9.0,
        material: PANE,
    };
    scene.disks = (0..256).map(disk).collect();
    let lit = picture(&scene, 1);
    assert!(lit.pixels.iter().any(|&byte| byte > 0));
    scene.disks.push(disk(256));
    assert!(picture(&scene, 1).pixels.iter().all(|&byte| byte == 0));
    scene.materials[PANE as usize].transmit = Vec3::ONE;
    assert!(picture(&scene, 1).pixels == lit.pixels);
}
