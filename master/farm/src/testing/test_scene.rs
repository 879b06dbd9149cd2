//! A minimal scene, for tests that are not about pictures.

use glam::{DVec3, Vec3};
use rayfarm_tracer::scene::{Background, Camera, CameraKind, FrameView, Material, RenderSettings, Scene};

/// A scene without objects, of 32 x 64 pixels.
pub fn scene() -> Scene {
    Scene {
        ambient: Vec3::ZERO,
        render: RenderSettings { width: 32, height: 64, ..RenderSettings::default() },
        camera: Camera {
            position: DVec3::Z,
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            fov: 40.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        },
        background: Background::Color(Vec3::ONE),
        lights: Vec::new(),
        materials: vec![Material::NEUTRAL],
        textures: Vec::new(),
        models: Vec::new(),
        spheres: Vec::new(),
        planes: Vec::new(),
        triangles: Vec::new(),
        background_visible: true,
        disks: Vec::new(),
        ..Scene::default()
    }
}

/// The view of [`scene`].
pub fn view() -> FrameView {
    FrameView::of(&scene())
}
