//! What surfaces look like, by pictures of small scenes, the same on every level of SIMD.

mod details;
mod terminator;
mod textures;

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2, Vec3};

use crate::compile::CompiledScene;
use crate::frame::{Basis, PreparedFrame};
use crate::image::RgbImage;
use crate::integrator::render_rows;
use crate::mesh::CompiledMesh;
use crate::scene::{
    Attenuation, Background, Camera, CameraKind, Filter, FrameView, Light, LightKind, Material, Plane,
    Quality, RenderSettings, Scene, Sphere, Tiling, Triangle,
};
use crate::simd;
use crate::texture::{Texture, TextureMap};

/// Width and height of the pictures.
const SIDE: u32 = 64;

/// A scene without objects and lights, in which a diffuse surface shows its own colour. The camera looks from z = 6 at the origin.
fn empty() -> Scene {
    Scene {
        ambient: Vec3::ONE,
        render: RenderSettings { width: SIDE, height: SIDE, ..RenderSettings::default() },
        camera: Camera {
            position: DVec3::new(0.0, 0.0, 6.0),
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            fov: 35.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        },
        background: Background::Color(Vec3::ZERO),
        background_visible: true,
        lights: vec![],
        materials: vec![white()],
        textures: vec![],
        models: vec![],
        spheres: vec![],
        disks: vec![],
        planes: vec![],
        triangles: vec![],
        ..Scene::default()
    }
}

fn white() -> Material {
    Material { diffuse: Vec3::ONE, specular: Vec3::ZERO, ..Material::NEUTRAL }
}

/// A white directional light along `direction`.
fn sun(direction: DVec3) -> Light {
    Light {
        kind: LightKind::Directional { direction: direction.normalize() },
        color: Vec3::ONE,
        attenuation: Attenuation::None,
        shadows: true,
        radius: 0.0,
        shadow_samples: None,
    }
}

fn ball() -> Sphere {
    Sphere { center: DVec3::ZERO, radius: 1.0, material: 0, inside_out: false, uv_rotate: DVec3::ZERO }
}

/// The plane y = 0.
fn floor() -> Plane {
    Plane { point: DVec3::ZERO, normal: DVec3::Y, material: 0, size: 1.0 }
}

/// Two triangles over [-9, 9] in the plane y = 0, with the texture coordinates of [`floor`].
fn floor_of_triangles() -> [Triangle; 2] {
    let corner = |x: f64, z: f64| (DVec3::new(x, 0.0, z), Vec2::new(x as f32, -z as f32));
    let [a, b, c, d] = [corner(-9.0, 9.0), corner(9.0, 9.0), corner(9.0, -9.0), corner(-9.0, -9.0)];
    [[a, b, c], [a, c, d]].map(|corners| Triangle {
        vertices: corners.map(|(place, _)| place),
        uvs: Some(corners.map(|(_, uv)| uv)),
        material: 0,
    })
}

/// A camera above the plane y = 0.
fn above(scene: &mut Scene) {
    scene.camera.position = DVec3::new(0.25, 2.0, 4.0);
    scene.camera.look_at = DVec3::new(0.25, 0.0, -2.0);
}

/// Adds a picture to a scene, `color_of` pixels from its top left corner.
fn add_texture(
    scene: &mut Scene,
    [width, height]: [u32; 2],
    filter: Filter,
    color_of: impl Fn(u32, u32) -> [u8; 3],
) -> Arc<Texture> {
    let color_of = &color_of;
    let pixels = (0..height).flat_map(|y| (0..width).flat_map(move |x| color_of(x, y))).collect();
    let texture = Arc::new(Texture::new(&RgbImage { width, height, pixels }).unwrap());
    scene.textures.push(TextureMap { texture: texture.id(), filter, tiling: Tiling::default() });
    texture
}

/// Renders a scene on every level, and asserts that all give the same bytes.
fn rendered(
    scene: &Scene,
    meshes: &[Arc<CompiledMesh>],
    textures: &[Arc<Texture>],
    quality: Quality,
) -> Vec<[u8; 3]> {
    let compiled = CompiledScene::new(scene.clone(), meshes.to_vec(), textures.to_vec()).unwrap();
    let view = FrameView { quality, ..FrameView::of(scene) };
    let mut frame = PreparedFrame::new(Arc::new(compiled), &view).unwrap();
    let mut bytes_at = |level| {
        frame.level = level;
        let mut bytes = vec![0; (SIDE * SIDE * 3) as usize];
        render_rows(&frame, 0..SIDE, &mut bytes, &|| false).unwrap();
        bytes
    };
    let first = bytes_at(simd::best());
    for level in simd::all() {
        assert!(bytes_at(level) == first, "with {}", simd::name(level));
    }
    first.chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}

/// Number of pixels that differ by more than `steps`.
fn different(a: &[[u8; 3]], b: &[[u8; 3]], steps: u8) -> usize {
    let far = |(a, b): &(&[u8; 3], &[u8; 3])| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > steps);
    a.iter().zip(b).filter(far).count()
}

fn pixel(picture: &[[u8; 3]], x: u32, y: u32) -> [u8; 3] {
    picture[(y * SIDE + x) as usize]
}

/// The points of the plane y = 0 that pixels show: column, row, x and z.
fn points_of_floor(camera: &Camera) -> Vec<([u32; 2], DVec2)> {
    let Basis { forward, right, up } = Basis::of(camera);
    let reach = libm::tan(camera.fov.to_radians() / 2.0);
    let along = |i: u32| (2.0 * (f64::from(i) + 0.5) / f64::from(SIDE) - 1.0) * reach;
    let pixels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| [x, y]));
    let point = |[x, y]: [u32; 2]| {
        let direction = forward + right * along(x) - up * along(y);
        let t = -camera.position.y / direction.y;
        let point = camera.position + direction * t;
        (t > 0.0).then_some(([x, y], DVec2::new(point.x, point.z)))
    };
    pixels.filter_map(point).collect()
}
