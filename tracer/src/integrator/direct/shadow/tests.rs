//! Shadows that are not all or nothing: the same bytes on every level and in every cut, for primary and secondary rays.

use std::ops::Range;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::compile::CompiledScene;
use crate::frame::PreparedFrame;
use crate::integrator::render_rows;
use crate::rays::RayCounts;
use crate::scene::{
    Attenuation, Background, Camera, CameraKind, Disk, FrameView, Light, LightKind, Material, Plane, Quality,
    RenderSettings, Scene, Sphere, Triangle,
};
use crate::simd;

const WIDTH: u32 = 52;
const HEIGHT: u32 = 37;

/// A ground that mirrors, opaque, glass, coloured and shadowless items, and three lights: a point and a spot with an extent, and
/// a sun.
fn scene() -> Scene {
    let sphere = |x: f64, y: f64, z: f64, radius: f64, material: u32| Sphere {
        center: DVec3::new(x, y, z),
        radius,
        material,
        inside_out: false,
        uv_rotate: DVec3::ZERO,
    };
    let light = |kind: LightKind, radius: f64| Light {
        kind,
        color: Vec3::splat(0.4),
        attenuation: Attenuation::None,
        shadows: true,
        radius,
        shadow_samples: None,
    };
    let corner = |x: f64, y: f64| DVec3::new(x, y, -0.4);
    Scene {
        ambient: Vec3::splat(0.05),
        render: RenderSettings { width: WIDTH, height: HEIGHT, ..RenderSettings::default() },
        camera: Camera {
            position: DVec3::new(0.3, 1.4, 4.0),
            look_at: DVec3::new(0.0, 0.3, 0.0),
            up: DVec3::Y,
            fov: 45.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        },
        background: Background::Color(Vec3::new(0.2, 0.3, 0.5)),
        lights: vec![
            light(LightKind::Point { position: DVec3::new(0.8, 2.5, 1.0) }, 0.5),
            light(
                LightKind::Spot {
                    position: DVec3::new(-1.5, 2.0, 1.5),
                    direction: DVec3::new(1.0, -1.3, -1.0).normalize(),
                    beam_angle: 60.0,
                    penumbra: 10.0,
                },
                0.3,
            ),
            light(LightKind::Directional { direction: DVec3::new(0.3, -1.0, -0.2).normalize() }, 0.0),
        ],
        materials: vec![
            Material { reflect: Vec3::splat(0.3), ..Material::NEUTRAL },
            Material::NEUTRAL,
            Material { transmit: Vec3::new(0.8, 0.9, 0.7), ior: 1.4, ..Material::NEUTRAL },
            Material { transmit: Vec3::new(0.9, 0.2, 0.3), thin: true, ..Material::NEUTRAL },
            Material { casts_shadow: false, ..Material::NEUTRAL },
        ],
        textures: Vec::new(),
        models: Vec::new(),
        spheres: vec![
            sphere(-0.8, 0.4, 0.0, 0.4, 1),
            sphere(0.2, 0.35, 0.7, 0.35, 2),
            sphere(1.0, 0.3, 0.2, 0.3, 4),
        ],
        planes: vec![Plane { point: DVec3::ZERO, normal: DVec3::Y, material: 0, size: 1.0 }],
        triangles: vec![Triangle {
            vertices: [corner(0.0, 0.0), corner(1.4, 0.1), corner(0.6, 1.5)],
            uvs: None,
            material: 1,
        }],
        disks: vec![Disk {
            center: DVec3::new(0.3, 1.4, 0.8),
            normal: DVec3::new(0.2, 1.0, 0.1).normalize(),
            radius: 0.4,
            material: 3,
        }],
        background_visible: true,
        ..Scene::default()
    }
}

/// The views that are compared: samples a pixel, and whether they are adaptive.
fn views(scene: &Scene) -> Vec<FrameView> {
    let view = |(samples, adaptive, shadow_samples)| {
        let quality = Quality { adaptive, shadow_samples, ..Quality::default() };
        FrameView { samples, quality, ..FrameView::of(scene) }
    };
    [(1, false, 16), (4, false, 5), (9, true, 3), (1, false, 70)].map(view).to_vec()
}

fn rendered(frame: &PreparedFrame, rows: Range<u32>) -> (Vec<u8>, RayCounts) {
    let mut bytes = vec![0; rows.len() * frame.row_bytes()];
    let counts = render_rows(frame, rows, &mut bytes, &|| false).unwrap();
    (bytes, counts)
}

#[test]
fn every_level_gives_the_same_bytes_and_counts() {
    let scene = scene();
    let compiled = Arc::new(CompiledScene::new(scene.clone(), [], []).unwrap());
    for view in views(&scene) {
        let mut frame = PreparedFrame::new(Arc::clone(&compiled), &view).unwrap();
        let best = rendered(&frame, 0..HEIGHT);
        for level in simd::all() {
            frame.level = level;
            assert!(rendered(&frame, 0..HEIGHT) == best, "{}, {view:?}", simd::name(level));
        }
    }
}

#[test]
fn every_cut_into_rows_gives_the_same_bytes() {
    let scene = scene();
    let compiled = Arc::new(CompiledScene::new(scene.clone(), [], []).unwrap());
    for view in views(&scene) {
        let frame = PreparedFrame::new(Arc::clone(&compiled), &view).unwrap();
        let (whole, _) = rendered(&frame, 0..HEIGHT);
        for rows in [1, 3, 10] {
            let pieces = (0..HEIGHT).step_by(rows).map(|top| top..(top + rows as u32).min(HEIGHT));
            let pieces: Vec<u8> = pieces.flat_map(|rows| rendered(&frame, rows).0).collect();
            assert!(pieces == whole, "{rows} rows, {view:?}");
        }
    }
}

/// The colour of the thin disk's shadow: red light passes, the others hardly.
#[test]
fn colored_glass_colors_the_shadow() {
    let mut scene = scene();
    scene.lights.truncate(1);
    scene.materials[0] = Material { diffuse: Vec3::ONE, specular: Vec3::ZERO, ..Material::NEUTRAL };
    scene.spheres.clear();
    scene.triangles.clear();
    let picture = |scene: &Scene| {
        let compiled = Arc::new(CompiledScene::new(scene.clone(), [], []).unwrap());
        rendered(&PreparedFrame::new(compiled, &FrameView::of(scene)).unwrap(), 0..HEIGHT).0
    };
    let with = picture(&scene);
    scene.disks.clear();
    let without = picture(&scene);
    let pairs = || with.chunks_exact(3).zip(without.chunks_exact(3));
    // The ground is grey without the disk.
    let ground = || pairs().filter(|(_, before)| before[0] == before[1] && before[1] == before[2]);
    let redder = ground().filter(|(after, _)| after[0] > after[1] + 20).count();
    assert!(redder > 30, "{redder} pixels");
    assert!(ground().all(|(after, _)| after[0] >= after[1]), "no shadow is greener than the light");
}
