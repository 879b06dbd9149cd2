//! Textures on spheres and planes, near and far.

use super::*;

const RED: [u8; 3] = [255, 0, 0];
const GREEN: [u8; 3] = [0, 255, 0];
const BLUE: [u8; 3] = [0, 0, 255];
const WHITE: [u8; 3] = [255; 3];

/// A picture of four pixels: red and green above blue and white.
fn quarters(x: u32, y: u32) -> [u8; 3] {
    [[RED, GREEN], [BLUE, WHITE]][y as usize][x as usize]
}

/// The pixels around the centre, from the left and from the top.
fn around_center(picture: &[[u8; 3]], off: u32) -> [[u8; 3]; 4] {
    let [before, behind] = [SIDE / 2 - off, SIDE / 2 + off - 1];
    [(before, before), (behind, before), (before, behind), (behind, behind)]
        .map(|(x, y)| pixel(picture, x, y))
}

fn textured_ball() -> (Scene, Arc<Texture>) {
    let mut scene = empty();
    let texture = add_texture(&mut scene, [2, 2], Filter::Nearest, quarters);
    scene.materials[0].texture = Some(0);
    scene.spheres = vec![ball()];
    (scene, texture)
}

/// Seen from +Z, the seam of a panorama is in the middle: its left end on the left, where u starts.
#[test]
fn the_seam_of_a_sphere_is_behind() {
    let (mut scene, texture) = textured_ball();
    for off in [1, 6] {
        let seen = |scene: &Scene| {
            let picture = rendered(scene, &[], &[Arc::clone(&texture)], Quality::default());
            around_center(&picture, off)
        };
        assert_eq!(seen(&scene), [RED, GREEN, BLUE, WHITE], "{off}");
        scene.spheres[0].uv_rotate = DVec3::new(0.0, 180.0, 0.0);
        assert_eq!(seen(&scene), [GREEN, RED, WHITE, BLUE], "turned, {off}");
        scene.spheres[0].uv_rotate = DVec3::ZERO;
    }
}

#[test]
fn poles_show_the_ends_of_the_picture() {
    let (mut scene, texture) = textured_ball();
    for (height, ends) in [(6.0, [RED, GREEN]), (-6.0, [BLUE, WHITE])] {
        scene.camera.position = DVec3::new(0.0, height, 0.0);
        scene.camera.up = DVec3::Z;
        for filter in [Filter::Nearest, Filter::Trilinear] {
            let quality = Quality { filter: Some(filter), ..Quality::default() };
            let picture = rendered(&scene, &[], &[Arc::clone(&texture)], quality);
            let nearest = filter == Filter::Nearest;
            assert!(around_center(&picture, 1).iter().all(|color| !nearest || ends.contains(color)));
        }
    }
}

#[test]
fn planes_far_away_keep_their_texture() {
    let mut scene = empty();
    above(&mut scene);
    let code = |x: u32, y: u32| [(x * 60) as u8, (y * 60) as u8, ((x + y) % 2 * 255) as u8];
    let texture = add_texture(&mut scene, [4, 4], Filter::Bilinear, code);
    scene.materials[0].texture = Some(0);
    scene.planes = vec![floor()];
    let seen = |scene: &Scene| rendered(scene, &[], &[Arc::clone(&texture)], Quality::default());
    let near = seen(&scene);
    // Powers of two, so that the camera's own numbers stay exact.
    let far = DVec3::new(f64::from(1 << 20), 0.0, -f64::from(1 << 21));
    scene.camera.position += far;
    scene.camera.look_at += far;
    // The plane's point stays: millions of repeats between it and the camera.
    assert_eq!(different(&seen(&scene), &near, 1), 0);
    scene.planes[0].point = far;
    assert_eq!(different(&seen(&scene), &near, 0), 0);
}

#[test]
fn planes_and_triangles_with_the_same_coordinates_look_the_same() {
    let mut scene = empty();
    above(&mut scene);
    let code = |x: u32, y: u32| [(x * 60) as u8, (y * 60) as u8, 90];
    let texture = add_texture(&mut scene, [4, 4], Filter::Bilinear, code);
    scene.materials[0].texture = Some(0);
    scene.planes = vec![floor()];
    let by_triangles = Scene { planes: vec![], triangles: floor_of_triangles().to_vec(), ..scene.clone() };
    for filter in [Filter::Bilinear, Filter::Trilinear] {
        let quality = Quality { filter: Some(filter), ..Quality::default() };
        let seen = |scene: &Scene| rendered(scene, &[], &[Arc::clone(&texture)], quality);
        let (plane, triangles) = (seen(&scene), seen(&by_triangles));
        let on_both: Vec<_> = points_of_floor(&scene.camera)
            .into_iter()
            .filter(|(_, point)| point.abs().max_element() < 8.9)
            .collect();
        assert!(on_both.len() > 1000);
        for ([x, y], _) in on_both {
            let [a, b] = [&plane, &triangles].map(|picture| pixel(picture, x, y));
            assert_eq!(different(&[a], &[b], 1), 0, "{filter:?} at {x}, {y}: {a:?}, {b:?}");
        }
    }
}

/// A board of black and white texels, each much smaller than a pixel, is the grey of half the light.
#[test]
fn a_fine_texture_far_away_is_its_mean() {
    let mut scene = empty();
    above(&mut scene);
    let board = |x: u32, y: u32| [if (x + y).is_multiple_of(2) { 255 } else { 0 }; 3];
    let texture = add_texture(&mut scene, [64, 64], Filter::Trilinear, board);
    scene.materials[0].texture = Some(0);
    scene.planes = vec![Plane { size: 0.5, ..floor() }];
    let seen = |quality| rendered(&scene, &[], &[Arc::clone(&texture)], quality);
    let (smooth, grey) = (seen(Quality::default()), [188; 3]);
    let floor: Vec<_> = points_of_floor(&scene.camera).iter().map(|([x, y], _)| y * SIDE + x).collect();
    let off = |picture: &[[u8; 3]]| {
        floor.iter().filter(|&&i| different(&[picture[i as usize]], &[grey], 2) > 0).count()
    };
    assert!(floor.len() > 2000);
    assert_eq!(off(&smooth), 0);
    let aliased = seen(Quality { filter: Some(Filter::Bilinear), ..Quality::default() });
    assert!(off(&aliased) > floor.len() / 4);
}

#[test]
fn texels_larger_than_pixels_are_filtered_as_by_the_bilinear_filter() {
    let mut scene = empty();
    let code = |x: u32, y: u32| [(x * 30) as u8, (y * 30) as u8, (x * y * 4) as u8];
    let texture = add_texture(&mut scene, [8, 8], Filter::Bilinear, code);
    scene.materials[0].texture = Some(0);
    // Seen straight on: 64 pixels show 3.8 units of 4 repeats.
    scene.planes = vec![Plane { normal: DVec3::Z, size: 2.0, ..floor() }];
    let seen = |filter| {
        let quality = Quality { filter, ..Quality::default() };
        rendered(&scene, &[], &[Arc::clone(&texture)], quality)
    };
    assert_eq!(seen(Some(Filter::Trilinear)), seen(None));
    let smaller = Scene { planes: vec![Plane { size: 0.1, ..scene.planes[0] }], ..scene.clone() };
    let seen = |filter| {
        let quality = Quality { filter: Some(filter), ..Quality::default() };
        rendered(&smaller, &[], &[Arc::clone(&texture)], quality)
    };
    assert_ne!(seen(Filter::Trilinear), seen(Filter::Bilinear));
}
