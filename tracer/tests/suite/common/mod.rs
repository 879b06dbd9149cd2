//! Generated scenes for tests.
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::mesh::{CompiledMesh, Mesh, NamedMaterial};
use rayfarm_tracer::scene::{
    Attenuation, Background, Camera, CameraKind, FrameView, Light, LightKind, Material, Model, NormalMode,
    Plane, RenderSettings, Scene, Sphere, Triangle,
};
use rayfarm_tracer::texture::Texture;
use rayfarm_tracer::{CompiledScene, PreparedFrame, RayCounts, render_rows};

/// An empty scene with a background, a camera at z = 4 that looks at the origin, and three materials.
pub(crate) fn empty(width: u32, height: u32) -> Scene {
    let material =
        |diffuse, specular, exponent| Material { diffuse, specular, exponent, ..Material::NEUTRAL };
    Scene {
        ambient: Vec3::splat(0.06),
        render: RenderSettings { width, height, ..RenderSettings::default() },
        camera: Camera {
            position: DVec3::new(0.0, 0.5, 4.0),
            look_at: DVec3::ZERO,
            up: DVec3::Y,
            fov: 45.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        },
        background: Background::Gradient { bottom: Vec3::new(0.3, 0.25, 0.2), top: Vec3::new(0.2, 0.4, 0.8) },
        lights: vec![],
        materials: vec![
            material(Vec3::new(0.7, 0.3, 0.2), Vec3::splat(0.4), 40.0),
            material(Vec3::new(0.2, 0.5, 0.3), Vec3::ZERO, 1.0),
            material(Vec3::splat(0.6), Vec3::splat(0.2), 8.5),
        ],
        textures: vec![],
        models: vec![],
        spheres: vec![],
        planes: vec![],
        triangles: vec![],
        background_visible: true,
        disks: Vec::new(),
        ..Scene::default()
    }
}

pub(crate) fn light(kind: LightKind, color: f32, attenuation: Attenuation) -> Light {
    Light { kind, color: Vec3::splat(color), attenuation, shadows: true, radius: 0.0, shadow_samples: None }
}

pub(crate) fn point(x: f64, y: f64, z: f64) -> LightKind {
    LightKind::Point { position: DVec3::new(x, y, z) }
}

/// Spheres, a plane, triangles; point, spot and directional light; the three attenuations.
pub(crate) fn analytic(width: u32, height: u32) -> Scene {
    let mut scene = empty(width, height);
    scene.planes.push(Plane { point: DVec3::new(0.0, -1.0, 0.0), normal: DVec3::Y, material: 2, size: 1.0 });
    for (x, z, radius, material) in [(-0.9, 0.0, 0.7, 0), (0.8, -0.8, 0.9, 1), (0.3, 1.2, 0.25, 2)] {
        scene.spheres.push(Sphere {
            center: DVec3::new(x, radius - 1.0, z),
            radius,
            material,
            inside_out: false,
            uv_rotate: DVec3::ZERO,
        });
    }
    let quad = [(-2.0, -1.0), (2.0, -1.0), (2.0, 1.6), (-2.0, 1.6)].map(|(x, y)| DVec3::new(x, y, -2.5));
    scene.triangles = vec![
        Triangle { vertices: [quad[0], quad[1], quad[2]], uvs: None, material: 1 },
        Triangle { vertices: [quad[0], quad[2], quad[3]], uvs: None, material: 1 },
    ];
    let spot = LightKind::Spot {
        position: DVec3::new(-2.0, 3.0, 2.0),
        direction: DVec3::new(0.5, -0.9, -0.6).normalize(),
        beam_angle: 50.0,
        penumbra: 12.0,
    };
    let sun = LightKind::Directional { direction: DVec3::new(-0.4, -0.8, -0.3).normalize() };
    let polynomial = Attenuation::Polynomial { constant: 1.0, linear: 0.1, quadratic: 0.02 };
    scene.lights = vec![
        light(point(2.0, 2.5, 2.0), 4.0, Attenuation::InverseSquare),
        light(spot, 0.8, polynomial),
        light(sun, 0.3, Attenuation::None),
    ];
    scene
}

/// A torus around the Y axis: closed, with a hole, facets of all orientations.
pub(crate) fn torus(around: u32, across: u32) -> Mesh {
    let point = |i: u32, j: u32| {
        let [u, v] =
            [(i, around), (j, across)].map(|(k, n)| std::f64::consts::TAU * f64::from(k) / f64::from(n));
        let ring = 0.7 + 0.3 * libm::cos(v);
        DVec3::new(ring * libm::cos(u), 0.3 * libm::sin(v), ring * libm::sin(u))
    };
    let positions = (0..around).flat_map(|i| (0..across).map(move |j| point(i, j))).collect();
    let at = |i: u32, j: u32| (i % around) * across + j % across;
    let triangles: Vec<[u32; 3]> = (0..around)
        .flat_map(|i| (0..across).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            [[a, b, c], [a, c, d]]
        })
        .collect();
    mesh_of(positions, triangles)
}

/// A ball of the given number of rings and sectors: closed and convex.
pub(crate) fn ball(rings: u32, sectors: u32) -> Mesh {
    let mut positions = vec![DVec3::Y, DVec3::NEG_Y];
    for (ring, sector) in (1..rings).flat_map(|ring| (0..sectors).map(move |sector| (ring, sector))) {
        let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
        let around = std::f64::consts::TAU * f64::from(sector) / f64::from(sectors);
        let (s, c) = (libm::sin(polar), libm::cos(polar));
        positions.push(DVec3::new(s * libm::cos(around), c, s * libm::sin(around)));
    }
    let at = |ring: u32, sector: u32| 2 + (ring - 1) * sectors + sector % sectors;
    let mut triangles = Vec::new();
    for sector in 0..sectors {
        triangles.push([0, at(1, sector + 1), at(1, sector)]);
        triangles.push([1, at(rings - 1, sector), at(rings - 1, sector + 1)]);
        for ring in 1..rings - 1 {
            let (a, b) = (at(ring, sector), at(ring, sector + 1));
            triangles.push([a, b, at(ring + 1, sector + 1)]);
            triangles.push([a, at(ring + 1, sector + 1), at(ring + 1, sector)]);
        }
    }
    mesh_of(positions, triangles)
}

fn mesh_of(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    let triangle_materials = (0..triangles.len()).map(|i| (i / 40 % 2) as u16).collect();
    let slot = |name: &str| NamedMaterial::plain(name, Material::NEUTRAL);
    let materials = vec![slot("a"), slot("b")];
    Mesh { positions, triangles, triangle_materials, materials, ..Mesh::default() }
}

/// Three placements of one torus over a plane, one of them stretched and smooth.
pub(crate) fn instanced(width: u32, height: u32) -> (Scene, Arc<CompiledMesh>) {
    let (mesh, _) = CompiledMesh::compile(&torus(40, 24)).unwrap();
    let mut scene = empty(width, height);
    scene.planes.push(Plane { point: DVec3::new(0.0, -1.0, 0.0), normal: DVec3::Y, material: 2, size: 1.0 });
    let model = |translate: [f64; 3], rotate: [f64; 3], scale: [f64; 3], normals| Model {
        mesh: mesh.id(),
        materials: vec![0, 1],
        normals,
        translate: translate.into(),
        rotate: rotate.into(),
        scale: scale.into(),
        group: DMat3::IDENTITY,
    };
    scene.models = vec![
        model([-0.9, 0.0, 0.0], [70.0, 20.0, 5.0], [0.8; 3], NormalMode::Flat),
        model([0.9, -0.4, -0.5], [0.0, 30.0, 0.0], [1.0, 1.7, 0.6], NormalMode::Smooth),
        model([0.2, 0.9, -1.5], [90.0, 0.0, 40.0], [-0.5, 0.5, 0.5], NormalMode::Smooth),
    ];
    scene.lights = vec![light(point(2.0, 4.0, 3.0), 0.9, Attenuation::None)];
    (scene, Arc::new(mesh))
}

/// Renders all rows at once.
pub(crate) fn render(scene: &Scene, meshes: &[Arc<CompiledMesh>], view: &FrameView) -> (RgbImage, RayCounts) {
    render_textured(scene, meshes, &[], view)
}

/// Renders all rows of a scene with textures.
pub(crate) fn render_textured(
    scene: &Scene,
    meshes: &[Arc<CompiledMesh>],
    textures: &[Arc<Texture>],
    view: &FrameView,
) -> (RgbImage, RayCounts) {
    let (meshes, textures) = (meshes.iter().cloned(), textures.iter().cloned());
    let compiled = Arc::new(CompiledScene::new(scene.clone(), meshes, textures).unwrap());
    let frame = PreparedFrame::new(compiled, view).unwrap();
    let mut image = RgbImage::new(view.width, view.height);
    let counts = render_rows(&frame, 0..view.height, &mut image.pixels, &|| false).unwrap();
    (image, counts)
}
