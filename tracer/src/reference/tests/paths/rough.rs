//! Rough surfaces: metals, plastic, highlights, frosted glass, and textures of roughness and metal.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};

use super::scenes::{Furnished, ball, diffuse, glass, quad, room};
use crate::image::RgbImage;
use crate::scene::{Filter, Material, MetallicRoughness, Plane, TextureMap};
use crate::texture::Texture;

fn rough(base: Vec3, metallic: f32, roughness: f32) -> Material {
    let model =
        MetallicRoughness { metallic, roughness, transmission: 0.0, specular_factor: 1.0, texture: None };
    diffuse(base).with_metallic_roughness(model)
}

fn frosted(material: Material, roughness: f32) -> Material {
    let model = MetallicRoughness {
        metallic: 0.1,
        roughness,
        transmission: 0.8,
        specular_factor: 0.7,
        texture: None,
    };
    material.with_metallic_roughness(model)
}

/// The room with balls of metal, of plastic, with a highlight and of frosted glass, a frosted sheet, and smooth metal.
pub(super) fn rough_room() -> Furnished {
    let mut scene = room();
    let first = scene.materials.len() as u32;
    let amber = Material { diffuse: Vec3::new(0.9, 0.8, 0.5), ..glass(Vec3::new(0.9, 0.8, 0.7)) };
    scene.materials.extend([
        rough(Vec3::new(0.9, 0.7, 0.4), 1.0, 0.5),
        rough(Vec3::new(0.2, 0.4, 0.8), 0.0, 0.3),
        Material { specular: Vec3::new(0.3, 0.2, 0.1), exponent: 30.0, ..diffuse(Vec3::new(0.3, 0.5, 0.4)) },
        frosted(amber, 0.6),
        frosted(Material { thin: true, ..amber }, 0.4),
        rough(Vec3::new(0.6, 0.7, 0.8), 1.0, 0.0),
        rough(Vec3::new(0.5, 0.6, 0.3), 0.4, 0.9),
    ]);
    scene.spheres.extend([
        ball(DVec3::new(-1.2, -0.5, 0.0), 0.5, first),
        ball(DVec3::new(1.2, -0.5, -0.5), 0.5, first + 1),
        ball(DVec3::new(0.0, -0.4, -1.0), 0.6, first + 2),
        ball(DVec3::new(-0.4, -0.6, 1.0), 0.3, first + 3),
        ball(DVec3::new(0.6, 0.7, -1.0), 0.4, first + 5),
        ball(DVec3::new(-0.8, 0.8, -0.8), 0.4, first + 6),
    ]);
    let sheet = [[0.7, -1.0], [1.6, -1.0], [1.6, 0.3], [0.7, 0.3]].map(|[x, y]| DVec3::new(x, y, 0.85));
    scene.triangles.extend(quad(sheet, first + 4));
    Furnished { scene, meshes: Vec::new(), textures: Vec::new() }
}

/// The room with a texture of roughness and metal on a plane in place of its floor, on balls, one of them of glass where there is no metal,
/// and on its wall.
pub(super) fn rough_textures() -> Furnished {
    let pixels = (0..64_u32).flat_map(|i| [17, 110 + (i * 53 % 140) as u8, (i * 29 % 256) as u8]);
    let picture = RgbImage { width: 8, height: 8, pixels: pixels.collect() };
    let textures: Vec<Arc<Texture>> = Texture::new(&picture).into_iter().map(Arc::new).collect();
    let textured = |base: Vec3, transmission: f32| {
        let model = MetallicRoughness {
            metallic: 1.0,
            roughness: 0.9,
            transmission,
            specular_factor: 1.0,
            texture: Some(0),
        };
        diffuse(base).with_metallic_roughness(model)
    };
    let mut scene = room();
    scene.textures = vec![TextureMap::new(textures[0].id(), Filter::Bilinear)];
    let first = scene.materials.len() as u32;
    scene
        .materials
        .extend([textured(Vec3::new(0.9, 0.7, 0.4), 0.0), textured(Vec3::new(0.9, 0.8, 0.7), 0.9)]);
    // The floor is a plane.
    scene.triangles.drain(..2);
    scene.planes = vec![Plane { point: DVec3::NEG_Y, normal: DVec3::Y, material: first, size: 1.5 }];
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Vec2::from_array);
    for (triangle, uvs) in scene.triangles.iter_mut().zip([[0, 1, 2], [0, 2, 3]]) {
        triangle.material = first;
        triangle.uvs = Some(uvs.map(|corner| corners[corner]));
    }
    scene.spheres.push(ball(DVec3::new(-0.8, -0.5, 0.0), 0.5, first));
    scene.spheres.push(ball(DVec3::new(0.8, -0.3, 0.2), 0.5, first + 1));
    Furnished { scene, meshes: Vec::new(), textures }
}
