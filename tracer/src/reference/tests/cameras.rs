//! Rays of the camera.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use glam::{DVec3, Vec3};

use super::super::Oracle;
use super::{assert_near, empty, marker, plane};
use crate::scene::{Background, Camera, CameraKind, Disk, FovAxis, FrameView, Scene};

fn view(kind: CameraKind, fov: f64, [width, height]: [u32; 2]) -> FrameView {
    let scene = empty();
    let camera = Camera { kind, fov, ..scene.camera };
    FrameView { camera, width, height, ..FrameView::of(&scene) }
}

/// Origin and direction of the ray through a place, and whether it is in the picture.
fn ray(view: &FrameView, x: f64, y: f64) -> (DVec3, DVec3, bool) {
    let seen = Oracle::new(&empty(), &[], &[], view).camera_ray(x, y);
    (seen.ray.origin, seen.ray.direction, seen.in_picture)
}

#[test]
fn the_field_of_view_spans_its_axis() {
    let slanted = |x: f64, y: f64| DVec3::new(x, y, -1.0).normalize();
    for (fov_axis, right, top) in [(FovAxis::Vertical, 2.0, 1.0), (FovAxis::Horizontal, 1.0, 0.5)] {
        let view = view(CameraKind::Pinhole { fov_axis }, 90.0, [8, 4]);
        assert_near(ray(&view, 8.0, 2.0).1, slanted(right, 0.0), 1e-14, "right border");
        assert_near(ray(&view, 4.0, 0.0).1, slanted(0.0, top), 1e-14, "top border");
        assert_near(ray(&view, 0.0, 4.0).1, slanted(-right, -top), 1e-14, "bottom left corner");
    }
}

#[test]
fn parallel_rays_start_on_the_plane_of_the_camera() {
    let mut view = view(CameraKind::Orthographic { view_height: 3.0 }, 40.0, [8, 4]);
    view.camera.zoom = 1.5;
    for (x, y, origin) in [
        (4.0, 2.0, DVec3::ZERO),
        (8.0, 0.0, DVec3::new(2.0, 1.0, 0.0)),
        (0.0, 1.0, DVec3::new(-2.0, 0.5, 0.0)),
    ] {
        let (from, along, in_picture) = ray(&view, x, y);
        assert_near(from, origin, 1e-14, "origin");
        assert_near(along, DVec3::NEG_Z, 0.0, "direction");
        assert!(in_picture);
    }
}

/// A disk of radius 1 covers the same pixels at any distance, and none from behind the camera's plane.
#[test]
fn parallel_pictures_show_sizes_at_any_distance() {
    let covered = |z: f64| {
        let scene = Scene {
            materials: vec![marker(Vec3::ONE)],
            disks: vec![Disk { center: DVec3::new(0.5, 0.0, z), normal: DVec3::Z, radius: 1.0, material: 0 }],
            ..empty()
        };
        let view = view(CameraKind::Orthographic { view_height: 4.0 }, 40.0, [64, 64]);
        let picture = Oracle::new(&scene, &[], &[], &view).render();
        picture.pixels.chunks_exact(3).map(|pixel| pixel[0] == 255).collect::<Vec<_>>()
    };
    let near = covered(-1e-3);
    let area = near.iter().filter(|covered| **covered).count() as f64 / 256.0;
    assert!((area - PI).abs() < 0.05, "{area}");
    assert!(near == covered(-1e6));
    assert!(covered(1e-3).iter().all(|covered| !covered));
}

#[test]
fn angles_of_a_fisheye_grow_with_the_distance_from_the_centre() {
    let half_turn = view(CameraKind::Fisheye, 180.0, [8, 4]);
    let diagonal = DVec3::new(FRAC_1_SQRT_2, 0.0, -FRAC_1_SQRT_2);
    for (x, y, direction) in
        [(4.0, 2.0, DVec3::NEG_Z), (4.0, 0.0, DVec3::Y), (2.0, 2.0, DVec3::NEG_X), (5.0, 2.0, diagonal)]
    {
        let (_, along, in_picture) = ray(&half_turn, x, y);
        assert_near(along, direction, 1e-14, "direction");
        assert!(in_picture);
    }
    assert!(!ray(&half_turn, 6.1, 2.0).2 && !ray(&half_turn, 2.5, 0.5).2, "outside of the circle");
    let full_turn = view(CameraKind::Fisheye, 360.0, [4, 8]);
    assert_near(ray(&full_turn, 2.0, 2.0).1, DVec3::Z, 1e-14, "the rim is behind");
    assert_near(ray(&full_turn, 0.0, 0.0).1, DVec3::Z, 1e-14, "nothing is further behind");
}

/// Outside of its circle a fisheye camera shows the background in front of everything.
#[test]
fn only_the_background_is_outside_of_the_circle() {
    let mut scene = empty();
    scene.background = Background::Color(Vec3::splat(0.25));
    scene.materials = vec![marker(Vec3::ONE)];
    scene.planes = vec![plane(DVec3::NEG_Z, DVec3::Z, 0), plane(DVec3::Z, DVec3::Z, 0)];
    let view = view(CameraKind::Fisheye, 170.0, [16, 16]);
    let shown = |scene: &Scene, x, y| Oracle::new(scene, &[], &[], &view).pixel(x, y);
    assert_near(shown(&scene, 8, 8), DVec3::ONE, 0.0, "inside");
    assert_near(shown(&scene, 0, 0), DVec3::splat(0.25), 0.0, "outside");
    scene.background_visible = false;
    assert_near(shown(&scene, 0, 0), DVec3::ZERO, 0.0, "without a visible background");
}
