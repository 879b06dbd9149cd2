//! The oracle against physics: scenes whose radiance is known by hand.
//!
//! ```text
//!   cull      boxes of triangles
//!   mirrors   reflection, and the number of rays
//!   paths     single paths of the path integrator
//!   glass     refraction, absorption, total internal reflection, energy
//!   shadows   penumbrae, transparent occluders, smooth surfaces
//!   cameras   rays of the camera
//!   skies     pictures all around
//!   filters   textures of far surfaces
//!   patterns  texture coordinates, checkers, normal maps, pictures without light
//! ```

mod cameras;
mod cull;
mod filters;
mod glass;
mod mirrors;
mod paths;
mod patterns;
mod shadows;
mod skies;

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::Oracle;
use crate::scene::{
    Attenuation, Background, Camera, CameraKind, FrameView, Light, LightKind, Material, Plane, Quality,
    RenderSettings, Scene, Sphere,
};
use crate::texture::Texture;

/// Black, without lights.
const BLACK: Material = Material { diffuse: Vec3::ZERO, specular: Vec3::ZERO, ..Material::NEUTRAL };

/// A black scene of 1 x 1 pixels in which all rays are followed.
fn empty() -> Scene {
    let quality = Quality { max_depth: 8, min_contribution: 0.0, ..Quality::default() };
    Scene {
        ambient: Vec3::ZERO,
        render: RenderSettings { width: 1, height: 1, quality, ..RenderSettings::default() },
        camera: Camera {
            position: DVec3::ZERO,
            look_at: DVec3::NEG_Z,
            up: DVec3::Y,
            fov: 40.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        },
        background: Background::Color(Vec3::ZERO),
        background_visible: true,
        lights: vec![],
        materials: vec![],
        textures: vec![],
        models: vec![],
        spheres: vec![],
        disks: vec![],
        planes: vec![],
        triangles: vec![],
        ..Scene::default()
    }
}

/// A material that shows a colour, lit or not.
fn marker(color: Vec3) -> Material {
    Material { diffuse: color, unlit: true, ..BLACK }
}

fn sphere(center: DVec3, radius: f64, material: u32) -> Sphere {
    Sphere { center, radius, material, inside_out: false, uv_rotate: DVec3::ZERO }
}

fn plane(point: DVec3, normal: DVec3, material: u32) -> Plane {
    Plane { point, normal, material, size: 1.0 }
}

fn point_light(position: DVec3) -> Light {
    Light {
        kind: LightKind::Point { position },
        color: Vec3::ONE,
        attenuation: Attenuation::None,
        shadows: true,
        radius: 0.0,
        shadow_samples: None,
    }
}

/// The camera at a point, looking along a direction.
fn looking(scene: &Scene, from: DVec3, along: DVec3) -> FrameView {
    let up = if along.normalize().y.abs() > 0.9 { DVec3::Z } else { DVec3::Y };
    let camera = Camera { position: from, look_at: from + along, up, ..scene.camera };
    FrameView { camera, ..FrameView::of(scene) }
}

/// What a ray of the camera sees.
fn seen(scene: &Scene, from: DVec3, along: DVec3) -> DVec3 {
    seen_with(scene, &[], from, along)
}

fn seen_with(scene: &Scene, textures: &[Arc<Texture>], from: DVec3, along: DVec3) -> DVec3 {
    Oracle::new(scene, &[], textures, &looking(scene, from, along)).pixel(0, 0)
}

fn assert_near(found: DVec3, expected: DVec3, tolerance: f64, what: &str) {
    assert!((found - expected).abs().max_element() <= tolerance, "{what}: {found}, expected {expected}");
}
