//! Small scenes with every kind of light that paths find.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use crate::image::RgbImage;
use crate::mesh::{CompiledMesh, Mesh, MeshId, NamedMaterial};
use crate::scene::{
    Attenuation, Background, Camera, Filter, Light, LightKind, Material, Model, Motion, NormalMode, Plane,
    Scene, Sky, SkyPicture, Sphere, TextureMap, Triangle,
};
use crate::texture::Texture;

/// A scene with its meshes and textures.
pub(super) struct Furnished {
    pub scene: Scene,
    pub meshes: Vec<Arc<CompiledMesh>>,
    pub textures: Vec<Arc<Texture>>,
}

impl Furnished {
    fn plain(scene: Scene) -> Self {
        Self { scene, meshes: Vec::new(), textures: Vec::new() }
    }
}

pub(super) fn diffuse(color: Vec3) -> Material {
    Material { diffuse: color, specular: Vec3::ZERO, ..Material::NEUTRAL }
}

fn lamp(emission: Vec3) -> Material {
    Material { emission, ..diffuse(Vec3::ZERO) }
}

pub(super) fn glass(absorption: Vec3) -> Material {
    Material { transmit: Vec3::ONE, absorption, ..diffuse(Vec3::ZERO) }
}

pub(super) fn ball(center: DVec3, radius: f64, material: u32) -> Sphere {
    Sphere { center, radius, material, inside_out: false, uv_rotate: DVec3::ZERO }
}

fn light(kind: LightKind, color: Vec3) -> Light {
    Light { kind, color, attenuation: Attenuation::None, shadows: true, radius: 0.0, shadow_samples: None }
}

/// Two triangles; their front is the side from which a, b, c, d are in counter-clockwise order.
pub(super) fn quad([a, b, c, d]: [DVec3; 4], material: u32) -> [Triangle; 2] {
    [[a, b, c], [a, c, d]].map(|vertices| Triangle { vertices, uvs: None, material })
}

/// Corners of a horizontal rectangle, with the front above.
fn level(height: f64, half: f64) -> [DVec3; 4] {
    [[-1., 1.], [1., 1.], [1., -1.], [-1., -1.]].map(|[x, z]| DVec3::new(x * half, height, z * half))
}

/// A corner of a room with lamps: triangles, a ball that emits, a light with a radius, a point light. Materials 0 to 4; no surface is in
/// the centre.
pub(super) fn room() -> Scene {
    let mut triangles = Vec::new();
    triangles.extend(quad(level(-1.0, 2.0), 0));
    let wall = [[-2., -1.], [2., -1.], [2., 2.], [-2., 2.]].map(|[x, y]| DVec3::new(x, y, -2.0));
    triangles.extend(quad(wall, 1));
    let [a, b, c, d] = level(1.9, 0.5);
    triangles.extend(quad([d, c, b, a], 2));
    let with_radius = LightKind::Point { position: DVec3::new(1.5, 1.0, 1.0) };
    let with_radius = Light {
        radius: 0.2,
        attenuation: Attenuation::InverseSquare,
        ..light(with_radius, Vec3::new(0.9, 0.8, 0.7))
    };
    Scene {
        camera: Camera {
            position: DVec3::new(0.5, 0.7, 5.0),
            look_at: DVec3::ZERO,
            fov: 45.0,
            ..Camera::default()
        },
        background: Background::Color(Vec3::new(0.02, 0.03, 0.05)),
        lights: vec![
            light(LightKind::Point { position: DVec3::new(-1.5, 1.5, 1.0) }, Vec3::new(0.3, 0.4, 0.5)),
            with_radius,
        ],
        materials: vec![
            diffuse(Vec3::splat(0.7)),
            diffuse(Vec3::new(0.7, 0.2, 0.2)),
            lamp(Vec3::new(3.0, 2.5, 2.0)),
            diffuse(Vec3::new(0.3, 0.6, 0.8)),
            lamp(Vec3::new(0.5, 1.0, 4.0)),
        ],
        spheres: vec![ball(DVec3::new(0.0, -0.8, 0.8), 0.2, 4)],
        triangles,
        ..Scene::default()
    }
}

fn model(mesh: MeshId, material: u32, translate: DVec3, scale: DVec3) -> Model {
    let rotate = DVec3::new(0.0, 30.0, 0.0);
    let (materials, normals, group) = (vec![material], NormalMode::Flat, DMat3::IDENTITY);
    Model { mesh, materials, normals, translate, rotate, scale, group }
}

fn mesh(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    let triangle_materials = vec![0; triangles.len()];
    let materials = vec![NamedMaterial::plain("m", Material::NEUTRAL)];
    Mesh { positions, triangles, triangle_materials, materials, ..Mesh::default() }
}

fn compiled(mesh: &Mesh) -> Vec<Arc<CompiledMesh>> {
    CompiledMesh::compile(mesh).into_iter().map(|(mesh, _)| Arc::new(mesh)).collect()
}

/// A closed mesh, its fronts outside.
fn octahedron() -> Mesh {
    let [x, y, z] = DVec3::AXES;
    let equator = [z, x, -z, -x];
    let positions = equator.into_iter().chain([y, -y]).collect();
    let sides = (0..4_u32).flat_map(|i| [[i, (i + 1) % 4, 4], [(i + 1) % 4, i, 5]]);
    mesh(positions, sides.collect())
}

/// The room with two diffuse balls.
pub(super) fn diffuse_room() -> Furnished {
    let mut scene = room();
    scene.spheres.push(ball(DVec3::new(-0.8, -0.5, 0.0), 0.5, 3));
    scene.spheres.push(ball(DVec3::new(0.8, -0.4, -0.5), 0.6, 0));
    Furnished::plain(scene)
}

/// The room with a glass ball, a mirror ball that is diffuse as well, a coated ball, a sheet, and two pieces of glass that are the same mesh, one
/// of them mirrored.
pub(super) fn room_of_mirrors() -> Furnished {
    let mut scene = room();
    let first = scene.materials.len() as u32;
    scene.materials.extend([
        glass(Vec3::new(0.9, 0.8, 0.7)),
        Material { reflect: Vec3::new(0.8, 0.7, 0.6), ..diffuse(Vec3::splat(0.1)) },
        Material { reflect: Vec3::ONE, fresnel: true, ..diffuse(Vec3::new(0.2, 0.5, 0.2)) },
        Material { thin: true, ..glass(Vec3::ONE) },
    ]);
    scene.spheres.push(ball(DVec3::new(-0.8, -0.5, 0.0), 0.5, first));
    scene.spheres.push(ball(DVec3::new(0.8, -0.4, -0.5), 0.6, first + 1));
    scene.spheres.push(ball(DVec3::new(-0.3, 0.6, -1.2), 0.4, first + 2));
    let sheet = [[1.0, -1.0], [1.9, -1.0], [1.9, 1.2], [1.0, 1.2]].map(|[x, y]| DVec3::new(x, y, 1.0));
    scene.triangles.extend(quad(sheet, first + 3));
    let meshes = compiled(&octahedron());
    let gem = |x: f64, scale: DVec3| model(meshes[0].id(), first, DVec3::new(x, -0.6, 1.0), scale);
    scene.models = vec![gem(-0.5, DVec3::splat(0.3)), gem(0.5, DVec3::new(-0.3, 0.3, 0.3))];
    Furnished { scene, meshes, textures: Vec::new() }
}

/// A floor under water that absorbs light, with a lamp and a point light in the water; the water has no bottom around the floor.
pub(super) fn water() -> Furnished {
    let mut scene = room();
    scene.lights = vec![light(LightKind::Point { position: DVec3::new(0.9, -0.2, 0.5) }, Vec3::ONE)];
    let first = scene.materials.len() as u32;
    scene.materials.push(glass(Vec3::new(0.5, 0.7, 0.9)));
    scene.triangles.retain(|triangle| triangle.material == 0);
    scene.planes = vec![Plane { point: DVec3::Y * 0.5, normal: DVec3::Y, material: first, size: 1.0 }];
    scene.spheres.push(ball(DVec3::new(-0.8, -0.5, 0.0), 0.5, 3));
    scene.camera.position = DVec3::new(0.5, 3.0, 4.0);
    scene.background = Background::Gradient { bottom: Vec3::splat(0.1), top: Vec3::new(0.3, 0.5, 0.9) };
    Furnished::plain(scene)
}

/// Many lights without extent: points, spots and directional ones.
pub(super) fn many_lights() -> Furnished {
    let mut furnished = diffuse_room();
    let scene = &mut furnished.scene;
    for i in 0..20 {
        let (s, c) = libm::sincos(f64::from(i) * 2.4);
        let position = DVec3::new(1.5 * c, 0.5 + 0.05 * f64::from(i), 1.5 * s);
        let color = Vec3::new(0.1 + 0.01 * i as f32, 0.2, 0.3 - 0.01 * i as f32);
        let kind = match i % 3 {
            0 => LightKind::Point { position },
            1 => {
                let direction = (DVec3::NEG_Y - position * 0.3).normalize();
                LightKind::Spot { position, direction, beam_angle: 70.0, penumbra: 20.0 }
            }
            _ => LightKind::Directional { direction: DVec3::new(c, -2.0, s).normalize() },
        };
        let attenuation =
            Attenuation::Polynomial { constant: 0.5, linear: 0.1 * f64::from(i), quadratic: 0.3 };
        scene.lights.push(Light { attenuation, ..light(kind, color) });
    }
    furnished
}

/// Balls on a floor under a turned panorama with a small sun, and two lamps that are the same mesh, one of them mirrored.
pub(super) fn outdoors() -> Furnished {
    let (width, height) = (32, 16);
    let pixels = (0..height).flat_map(|y| {
        (0..width).flat_map(move |x| match (x, y) {
            (9, 4) => [255, 250, 230],
            _ if y < 8 => [40 + 4 * y as u8, 60, 90 + x as u8],
            _ => [30, 25, 20],
        })
    });
    let picture = RgbImage { width, height, pixels: pixels.collect() };
    let textures: Vec<Arc<Texture>> = Texture::new(&picture).into_iter().map(Arc::new).collect();
    let corners = vec![DVec3::ZERO, DVec3::new(0.4, 0.0, 0.1), DVec3::new(0.0, 0.5, 0.0)];
    let meshes = compiled(&mesh(corners, vec![[0, 1, 2]]));
    let mut scene = room();
    scene.lights.clear();
    scene.triangles.truncate(2);
    let lamp = |x: f64, scale: DVec3| model(meshes[0].id(), 2, DVec3::new(x, -0.9, 0.9), scale);
    scene.models = vec![lamp(-0.3, DVec3::ONE), lamp(0.9, DVec3::new(-1.0, 1.0, 1.0))];
    scene.spheres.push(ball(DVec3::new(-0.8, -0.5, 0.0), 0.5, 3));
    scene.textures = vec![TextureMap::new(textures[0].id(), Filter::Bilinear)];
    scene.background = Background::Sky(Sky { picture: SkyPicture::Panorama(0), rotate: 35.0, strength: 1.5 });
    Furnished { scene, meshes, textures }
}

/// The room with two balls that move, one of them of a mirror, and three models of one mesh: one that moves, one that rotates in a group,
/// one that does both.
pub(super) fn moving_room() -> Furnished {
    let mut scene = room();
    let mirror = scene.materials.len() as u32;
    scene.materials.push(Material { reflect: Vec3::new(0.8, 0.7, 0.6), ..diffuse(Vec3::splat(0.1)) });
    scene.spheres.push(ball(DVec3::new(-1.3, -0.5, 0.0), 0.5, 3));
    scene.spheres.push(ball(DVec3::new(0.8, -0.4, -0.5), 0.4, mirror));
    let meshes = compiled(&octahedron());
    let gem = |place: DVec3, scale: DVec3| model(meshes[0].id(), 3, place, scale);
    let grouped = Model {
        group: DMat3::from_rotation_x(0.7) * DMat3::from_diagonal(DVec3::new(-0.5, 0.5, 0.5)),
        ..gem(DVec3::new(1.2, 0.6, 0.2), DVec3::new(1.0, 0.6, 0.8))
    };
    scene.models = vec![
        gem(DVec3::new(-0.6, 0.3, 0.6), DVec3::splat(0.3)),
        grouped,
        gem(DVec3::new(0.1, -0.4, 1.0), DVec3::new(0.4, 0.2, 0.3)),
        gem(DVec3::new(-1.4, 1.2, -0.6), DVec3::splat(0.3)),
    ];
    scene.motions = vec![
        Motion::Sphere { sphere: 1, center: DVec3::new(-0.7, -0.2, 0.3) },
        Motion::Model {
            model: 1,
            translate: scene.models[1].translate,
            rotate: DVec3::new(20.0, 75.0, -30.0),
        },
        Motion::Model { model: 0, translate: DVec3::new(-0.2, 0.8, 0.7), rotate: scene.models[0].rotate },
        Motion::Sphere { sphere: 2, center: DVec3::new(0.5, -0.4, -0.9) },
        Motion::Model {
            model: 2,
            translate: DVec3::new(0.5, -0.3, 1.1),
            rotate: DVec3::new(0.0, 210.0, 15.0),
        },
    ];
    Furnished { scene, meshes, textures: Vec::new() }
}

/// The room with glass that moves: a ball, and two pieces that are the same mesh, one of them mirrored.
pub(super) fn moving_glass() -> Furnished {
    let mut furnished = room_of_mirrors();
    let scene = &mut furnished.scene;
    let [first, second] = [&scene.models[0], &scene.models[1]].map(|model| model.translate);
    let rotate = DVec3::new(10.0, 50.0, 0.0);
    scene.motions = vec![
        Motion::Sphere { sphere: 1, center: DVec3::new(-0.6, -0.4, 0.2) },
        Motion::Model { model: 0, translate: first + DVec3::new(0.2, 0.1, 0.0), rotate },
        Motion::Model { model: 1, translate: second, rotate: -rotate },
    ];
    furnished
}

/// The room with a hundred small lamps: balls, triangles, lights with a radius, points and spots.
pub(super) fn many_lamps() -> Furnished {
    let mut furnished = diffuse_room();
    let scene = &mut furnished.scene;
    for i in 0..100_u32 {
        let (s, c) = libm::sincos(f64::from(i) * 2.4);
        let distance = 0.2 * f64::from(i + 1).sqrt();
        let place = DVec3::new(distance * c, 1.0 + 0.4 * libm::sin(f64::from(i)), distance * s - 0.3);
        let point = LightKind::Point { position: place };
        let color = Vec3::new(0.01, 0.02, 0.015);
        let falling = Light { attenuation: Attenuation::InverseSquare, ..light(point, color) };
        match i % 5 {
            0 | 1 => scene.spheres.push(ball(place, 0.02, 4)),
            2 => {
                let towards = DVec3::new(0.07 * s, -0.05, 0.03 * c);
                let vertices = [place, place + DVec3::new(0.06, 0.01, 0.02), place + towards];
                scene.triangles.push(Triangle { vertices, uvs: None, material: 2 });
            }
            3 => scene.lights.push(Light { radius: 0.03, ..falling }),
            _ => {
                let direction = (DVec3::NEG_Y - place * 0.3).normalize();
                let kind = LightKind::Spot { position: place, direction, beam_angle: 80.0, penumbra: 20.0 };
                scene.lights.push(Light { kind, ..falling });
            }
        }
    }
    furnished
}

/// The floor under the turned panorama, with many lamps.
pub(super) fn lamps_outdoors() -> Furnished {
    let mut furnished = outdoors();
    for i in 0..30_u32 {
        let (s, c) = libm::sincos(f64::from(i) * 2.4);
        let place = DVec3::new(0.25 * f64::from(i).sqrt() * c, 0.3 + 0.01 * f64::from(i), 0.3 * s);
        furnished.scene.spheres.push(ball(place, 0.05, 4));
    }
    furnished
}

/// Balls on a floor under a turned cube map with a small sun, and a lamp.
pub(super) fn under_a_cube_map() -> Furnished {
    let mut furnished = outdoors();
    let face = |index: u32| {
        let pixels = (0..64).flat_map(|i| match (index, i) {
            (2, 27) => [255, 250, 230],
            (3, _) => [20, 15, 10],
            (5, _) => [0; 3],
            _ => [40 + 5 * index as u8, 60 + i as u8, 90],
        });
        RgbImage { width: 8, height: 8, pixels: pixels.collect() }
    };
    furnished.textures = (0..6).flat_map(|index| Texture::new(&face(index))).map(Arc::new).collect();
    let scene = &mut furnished.scene;
    scene.textures =
        furnished.textures.iter().map(|face| TextureMap::new(face.id(), Filter::Bilinear)).collect();
    let picture = SkyPicture::Cubemap([0, 1, 2, 3, 4, 5]);
    scene.background = Background::Sky(Sky { picture, rotate: 35.0, strength: 1.5 });
    furnished
}
