//! Built-in scenes of simple shapes, for checks without a scene file.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use super::Subject;
use crate::mesh::{CompiledMesh, Mesh, MeshError, NamedMaterial};
use crate::scene::{
    Attenuation, Background, Camera, CameraKind, Light, LightKind, Material, Model, NormalMode, Plane,
    RenderSettings, Scene, Sphere,
};

/// Three scenes: a plane, spheres on it, and flat and smooth tori over it.
///
/// # Errors
/// None in practice: the torus is a valid mesh.
pub fn built_in() -> Result<Vec<Subject>, MeshError> {
    let plane = ground();
    let mut spheres = ground();
    for (x, z, radius) in [(-0.6, 0.0, 0.4), (0.5, 0.3, 0.3), (3.0, -9.0, 4.0), (0.1, 1.0, 0.01)] {
        spheres.spheres.push(Sphere {
            center: DVec3::new(x, radius, z),
            radius,
            material: 0,
            inside_out: false,
            uv_rotate: DVec3::ZERO,
        });
    }
    // One is sunk into the ground, one is the ground.
    spheres.spheres.push(Sphere {
        center: DVec3::new(0.3, 0.0, -1.2),
        radius: 0.5,
        material: 0,
        inside_out: false,
        uv_rotate: DVec3::ZERO,
    });
    spheres.spheres.push(Sphere {
        center: DVec3::new(0.0, -1e6, 0.0),
        radius: 1e6 - 1e-3,
        material: 0,
        inside_out: false,
        uv_rotate: DVec3::ZERO,
    });

    let (mesh, _) = CompiledMesh::compile(&torus(48, 32))?;
    let mut tori = ground();
    for (x, normals) in [(-0.8, NormalMode::Flat), (0.8, NormalMode::Smooth)] {
        tori.models.push(Model {
            mesh: mesh.id(),
            materials: vec![0],
            normals,
            translate: DVec3::new(x, 0.6, 0.0),
            rotate: DVec3::new(60.0, 25.0, 10.0),
            scale: DVec3::splat(0.6),
            group: DMat3::IDENTITY,
        });
    }
    let subject =
        |name: &str, scene, meshes| Subject { name: name.to_owned(), scene, meshes, textures: Vec::new() };
    Ok(vec![
        subject("a plane", plane, Vec::new()),
        subject("spheres", spheres, Vec::new()),
        subject("tori", tori, vec![Arc::new(mesh)]),
    ])
}

/// A plane under a light.
fn ground() -> Scene {
    let light = LightKind::Point { position: DVec3::new(2.0, 4.0, 3.0) };
    Scene {
        ambient: Vec3::splat(0.05),
        render: RenderSettings { width: 640, height: 480, ..RenderSettings::default() },
        camera: Camera {
            position: DVec3::new(0.3, 1.1, 3.5),
            look_at: DVec3::new(0.0, 0.4, 0.0),
            up: DVec3::Y,
            fov: 45.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        },
        background: Background::Color(Vec3::splat(0.3)),
        lights: vec![Light {
            kind: light,
            color: Vec3::ONE,
            attenuation: Attenuation::None,
            shadows: true,
            radius: 0.0,
            shadow_samples: None,
        }],
        materials: vec![Material::NEUTRAL],
        textures: Vec::new(),
        models: Vec::new(),
        spheres: Vec::new(),
        planes: vec![Plane { point: DVec3::ZERO, normal: DVec3::Y, material: 0, size: 1.0 }],
        triangles: Vec::new(),
        background_visible: true,
        disks: Vec::new(),
        ..Scene::default()
    }
}

/// A torus around the y axis with radii 1 and 0.4: closed, with a hole, facets in all orientations.
pub(super) fn torus(around: u32, across: u32) -> Mesh {
    let angle = |k: u32, n: u32| std::f64::consts::TAU * f64::from(k) / f64::from(n);
    let point = |i: u32, j: u32| {
        let ((su, cu), (sv, cv)) = (libm::sincos(angle(i, around)), libm::sincos(angle(j, across)));
        let radius = 1.0 + 0.4 * cv;
        DVec3::new(radius * cu, 0.4 * sv, radius * su)
    };
    let at = |i: u32, j: u32| (i % around) * across + j % across;
    let squares = || (0..around).flat_map(|i| (0..across).map(move |j| (i, j)));
    let triangles: Vec<[u32; 3]> = squares()
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    Mesh {
        positions: squares().map(|(i, j)| point(i, j)).collect(),
        triangle_materials: vec![0; triangles.len()],
        triangles,
        materials: vec![NamedMaterial::plain("torus", Material::NEUTRAL)],
        ..Mesh::default()
    }
}
