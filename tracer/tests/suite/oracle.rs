//! The fast path compared with `reference`, the f64 oracle. Pixels may differ only where the two hit different sides
//! of an edge, and these are counted.

use std::path::Path;
use std::sync::Arc;

use crate::common::{analytic, empty, instanced, light, point, render};
use glam::{DVec3, Vec3};
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::mesh::CompiledMesh;
use rayfarm_tracer::reference::Oracle;
use rayfarm_tracer::scene::{Attenuation, FrameView, Scene, Sphere};

/// Number of pixels with a channel that differs by more than one step.
fn off(a: &RgbImage, b: &RgbImage) -> usize {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let pairs = a.pixels.chunks_exact(3).zip(b.pixels.chunks_exact(3));
    pairs.filter(|(a, b)| a.iter().zip(b.iter()).any(|(a, b)| a.abs_diff(*b) > 1)).count()
}

fn off_from_oracle(scene: &Scene, meshes: &[Arc<CompiledMesh>], view: &FrameView) -> usize {
    let (image, counts) = render(scene, meshes, view);
    assert_eq!(counts.primary, u64::from(view.width * view.height * view.samples));
    off(&image, &Oracle::new(scene, meshes, &[], view).render())
}

#[test]
fn analytic_primitives_and_all_lights() {
    let scene = analytic(320, 240);
    for samples in [1, 4] {
        let view = FrameView { samples, ..FrameView::of(&scene) };
        assert_eq!(off_from_oracle(&scene, &[], &view), 0, "{samples} samples");
    }
}

#[test]
fn instances_flat_and_smooth_turned_and_stretched() {
    let (scene, mesh) = instanced(120, 90);
    for spin in [0.0, 33.0] {
        let view = FrameView { spin, ..FrameView::of(&scene) };
        assert_eq!(off_from_oracle(&scene, std::slice::from_ref(&mesh), &view), 0, "spin {spin}");
    }
}

#[test]
fn narrow_and_wide_fields_of_view() {
    let scene = analytic(64, 64);
    for (fov, zoom) in [(0.01, 1.0), (1.0, 100.0), (120.0, 1.0), (179.0, 1.0)] {
        let mut view = FrameView::of(&scene);
        (view.camera.fov, view.camera.zoom) = (fov, zoom);
        assert_eq!(off_from_oracle(&scene, &[], &view), 0, "fov {fov}, zoom {zoom}");
    }
}

#[test]
fn sizes_at_the_limits() {
    let scene = analytic(1, 1);
    for (width, height) in [(1, 1), (16384, 1), (1, 16384)] {
        let view = FrameView { width, height, ..FrameView::of(&scene) };
        assert_eq!(off_from_oracle(&scene, &[], &view), 0, "{width}x{height}");
    }
}

#[test]
fn a_ground_sphere_of_a_million_and_a_speck_on_it() {
    let mut scene = empty(160, 120);
    scene.spheres = vec![
        Sphere {
            center: DVec3::new(0.0, -1e6 - 1.0, 0.0),
            radius: 1e6,
            material: 2,
            inside_out: false,
            uv_rotate: DVec3::ZERO,
        },
        Sphere {
            center: DVec3::new(0.0, 0.0, 0.0),
            radius: 0.8,
            material: 0,
            inside_out: false,
            uv_rotate: DVec3::ZERO,
        },
        Sphere {
            center: DVec3::new(0.0, 0.45, 3.6),
            radius: 1e-6,
            material: 1,
            inside_out: false,
            uv_rotate: DVec3::ZERO,
        },
    ];
    scene.lights = vec![light(point(3.0, 4.0, 1.0), 1.0, Attenuation::None)];
    assert_eq!(off_from_oracle(&scene, &[], &FrameView::of(&scene)), 0);
}

#[test]
fn exponents_from_zero_to_a_million() {
    let mut scene = analytic(160, 120);
    for exponent in [0.0, 0.5, 1.0, 1e3, 1e6] {
        scene.materials.iter_mut().for_each(|material| {
            (material.exponent, material.specular) = (exponent, Vec3::splat(0.5));
        });
        assert_eq!(off_from_oracle(&scene, &[], &FrameView::of(&scene)), 0, "exponent {exponent}");
    }
}

#[test]
fn no_light_a_light_on_a_surface_one_at_the_camera_and_a_thousand() {
    let mut scene = analytic(80, 60);
    let eye = scene.camera.position;
    let on_the_ball = scene.spheres[0].center + DVec3::new(0.0, scene.spheres[0].radius, 0.0);
    let ring = |i: u32| {
        let angle = f64::from(i) * 0.1;
        light(point(3.0 * libm::cos(angle), 3.0, 3.0 * libm::sin(angle)), 0.001, Attenuation::None)
    };
    let choices = [
        vec![],
        vec![light(point(eye.x, eye.y, eye.z), 1.0, Attenuation::None)],
        vec![light(point(on_the_ball.x, on_the_ball.y, on_the_ball.z), 0.1, Attenuation::InverseSquare)],
        (0..1000).map(ring).collect(),
    ];
    for lights in choices {
        scene.lights = lights;
        let wrong = off_from_oracle(&scene, &[], &FrameView::of(&scene));
        assert_eq!(wrong, 0, "{} lights", scene.lights.len());
    }
}
/// The benchmark scene of the 2009 system TheMatrixDistributed, if its mesh is available: every 97th pixel is
/// compared with the oracle.
#[test]
fn workload_w1_every_97th_pixel() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/workloads/w1.toml");
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
        return;
    }
    let loaded = rayfarm_tracer::scene::load(&path).unwrap();
    let view = FrameView { width: 256, height: 192, ..FrameView::of(&loaded.scene) };
    let (image, _) = render(&loaded.scene, &loaded.meshes, &view);
    let oracle = Oracle::new(&loaded.scene, &loaded.meshes, &loaded.textures, &view);
    let tested: Vec<u32> = (0..view.width * view.height).step_by(97).collect();
    let wrong = tested.iter().filter(|&&i| {
        let (x, y) = (i % view.width, i / view.width);
        let expected = oracle.encoded_pixel(x, y);
        let found = image.pixel(x, y).unwrap();
        found.iter().zip(expected).any(|(a, b)| a.abs_diff(b) > 1)
    });
    let wrong = wrong.count();
    assert_eq!(wrong, 0, "of {} pixels", tested.len());
}
