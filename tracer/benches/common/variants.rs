//! One scene with and without each feature: used features have a cost, unused features must have none.
//!
//! The scene is a ring of 100,352 uneven triangles over a floor of two. They fill the picture, so that every ray hits
//! something.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::mesh::{CompileOptions, CompiledMesh, Mesh};
use rayfarm_tracer::scene::{
    Attenuation, Background, Camera, CameraKind, Filter, FrameView, Light, LightKind, LoadedScene, Material,
    Model, NormalMode, RenderSettings, Scene, TextureMap, Triangle,
};
use rayfarm_tracer::texture::Texture;
use rayfarm_tracer::{CompiledScene, PreparedFrame};

use super::ring::{self, WAVES};
use super::{compile, prepare, stop};

/// A scene of the comparison.
pub(crate) struct Variant {
    pub(crate) name: &'static str,
    /// The variant that differs in one property; `None` for the first one.
    pub(crate) baseline: &'static str,
    change: fn(&mut Setting),
}

const fn variant(name: &'static str, baseline: &'static str, change: fn(&mut Setting)) -> Variant {
    Variant { name, baseline, change }
}

const PLAIN: &str = "ambient term only";
const ONE: &str = "one light";
const SHADOWS: &str = "one light with shadows";
const FOUR: &str = "four rings in one mesh";

/// All variants, each after the one with which it is compared. The last five have features that no pixel uses.
pub(crate) const VARIANTS: [Variant; 17] = [
    variant(PLAIN, "", |_| {}),
    variant(ONE, PLAIN, |to| to.light([-2.0, 5.0, 2.5], false)),
    variant(SHADOWS, ONE, Setting::lit),
    variant("specular", SHADOWS, |to| to.lit_and_worn(|material| material.specular = Vec3::splat(0.3))),
    variant("smooth normals", SHADOWS, |to| {
        to.lit();
        to.normals = NormalMode::Smooth;
    }),
    variant("texture, nearest", SHADOWS, |to| to.lit_and_textured(Filter::Nearest)),
    variant("texture, bilinear", SHADOWS, |to| to.lit_and_textured(Filter::Bilinear)),
    variant("second light with shadows", SHADOWS, |to| {
        to.lit();
        to.light([3.0, 4.0, 1.0], true);
    }),
    variant("4 samples", SHADOWS, |to| {
        to.lit();
        to.scene.render.samples = 4;
    }),
    variant(FOUR, SHADOWS, |to| to.lit_with(Rings::FourInOneMesh)),
    variant("four instances of a ring", FOUR, |to| to.lit_with(Rings::FourInstances)),
    variant("all but samples and instances", SHADOWS, |to| {
        to.lit_and_textured(Filter::Bilinear);
        to.light([3.0, 4.0, 1.0], true);
        to.normals = NormalMode::Smooth;
        to.scene.materials.iter_mut().for_each(|material| material.specular = Vec3::splat(0.3));
    }),
    variant("no normals and coordinates in the mesh", SHADOWS, |to| to.lit_with(Rings::OneBare)),
    variant("a specular material that nothing wears", SHADOWS, |to| {
        to.lit();
        to.scene.materials.push(Material { specular: Vec3::splat(0.3), ..MATERIAL });
    }),
    variant("a texture that nothing wears", SHADOWS, |to| {
        to.lit();
        to.picture(Filter::Bilinear);
        to.scene.materials.push(Material { texture: Some(0), ..MATERIAL });
    }),
    variant("an exponent without a specular colour", SHADOWS, |to| {
        to.lit_and_worn(|material| material.exponent = 40.0);
    }),
    variant("a spot light that shines elsewhere", SHADOWS, |to| {
        to.lit();
        let kind = LightKind::Spot {
            position: DVec3::new(0.0, 6.0, 0.0),
            direction: DVec3::Y,
            beam_angle: 30.0,
            penumbra: 0.0,
        };
        to.scene.lights.push(Light { kind, ..LIGHT });
    }),
];

const MATERIAL: Material =
    Material { diffuse: Vec3::new(0.7, 0.6, 0.45), specular: Vec3::ZERO, exponent: 1.0, ..Material::NEUTRAL };

const LIGHT: Light = Light {
    kind: LightKind::Point { position: DVec3::ZERO },
    color: Vec3::splat(0.6),
    attenuation: Attenuation::None,
    shadows: true,
    radius: 0.0,
    shadow_samples: None,
};

/// Geometry on the floor, with the same number of triangles in each case.
#[derive(Clone, Copy)]
enum Rings {
    One,
    /// One ring whose mesh has neither normals nor texture coordinates.
    OneBare,
    FourInOneMesh,
    FourInstances,
}

/// A variant under construction.
struct Setting {
    scene: Scene,
    textures: Vec<Arc<Texture>>,
    rings: Rings,
    normals: NormalMode,
}

impl Variant {
    /// The finished scene, for a size in pixels.
    pub(crate) fn prepare(&self, width: u32, height: u32) -> PreparedFrame {
        let mut setting = Setting {
            scene: ambient_only(width, height),
            textures: vec![],
            rings: Rings::One,
            normals: NormalMode::Flat,
        };
        (self.change)(&mut setting);
        let view = FrameView::of(&setting.scene);
        prepare(&setting.compile(), &view)
    }
}

impl Setting {
    fn light(&mut self, position: [f64; 3], shadows: bool) {
        let kind = LightKind::Point { position: position.into() };
        self.scene.lights.push(Light { kind, shadows, ..LIGHT });
    }

    fn lit(&mut self) {
        self.light([-2.0, 5.0, 2.5], true);
    }

    fn lit_with(&mut self, rings: Rings) {
        self.lit();
        self.rings = rings;
    }

    fn lit_and_worn(&mut self, change: fn(&mut Material)) {
        self.lit();
        self.scene.materials.iter_mut().for_each(change);
    }

    fn lit_and_textured(&mut self, filter: Filter) {
        self.picture(filter);
        self.lit_and_worn(|material| material.texture = Some(0));
    }

    /// 512 x 512 texels: 1 MB, more than fits into the first-level cache.
    fn picture(&mut self, filter: Filter) {
        let mut picture = RgbImage::new(512, 512);
        for (index, byte) in picture.pixels.iter_mut().enumerate() {
            *byte = ((index * 37) ^ (index >> 9)) as u8;
        }
        match Texture::new(&picture) {
            Ok(texture) => {
                self.scene.textures.push(TextureMap::new(texture.id(), filter));
                self.textures.push(Arc::new(texture));
            }
            Err(error) => stop(&error),
        }
    }

    fn compile(mut self) -> Arc<CompiledScene> {
        let mesh = match self.rings {
            Rings::One => ring::mesh(224, &[DVec3::ZERO]),
            Rings::OneBare => Mesh { uvs: vec![], ..ring::mesh(224, &[DVec3::ZERO]) },
            Rings::FourInOneMesh => ring::mesh(112, &PLACES),
            Rings::FourInstances => ring::mesh(112, &[DVec3::ZERO]),
        };
        let options =
            CompileOptions { normals: !matches!(self.rings, Rings::OneBare), ..CompileOptions::default() };
        let mesh = match CompiledMesh::compile_with(&mesh, options) {
            Ok((mesh, _)) => Arc::new(mesh),
            Err(error) => stop(&error),
        };
        let (places, scale): (&[DVec3], f64) = match self.rings {
            Rings::One | Rings::OneBare => (&[DVec3::ZERO], 1.0),
            Rings::FourInOneMesh => (&[DVec3::ZERO], 0.5),
            Rings::FourInstances => (&PLACES, 0.5),
        };
        let model = |&translate: &DVec3| Model {
            mesh: mesh.id(),
            materials: vec![0],
            normals: self.normals,
            translate: translate * scale,
            rotate: DVec3::ZERO,
            scale: DVec3::splat(scale),
            group: DMat3::IDENTITY,
        };
        self.scene.models = places.iter().map(model).collect();
        let warnings = vec![];
        let mesh_files = Vec::new();
        compile(LoadedScene {
            scene: self.scene,
            meshes: vec![mesh],
            mesh_files,
            textures: self.textures,
            warnings,
            animation: None,
        })
    }
}

/// Centres of four rings, in units of a ring.
const PLACES: [DVec3; 4] = [
    DVec3::new(-1.2, 0.0, -1.2),
    DVec3::new(1.2, 0.0, -1.2),
    DVec3::new(-1.2, 0.0, 1.2),
    DVec3::new(1.2, 0.0, 1.2),
];

/// The floor, and a camera that sees only it.
fn ambient_only(width: u32, height: u32) -> Scene {
    let (far, repeats) = (40.0, 40.0 * WAVES as f32);
    let at = |x: f64, z: f64| (DVec3::new(x * far, -0.5, z * far), glam::vec2(x as f32, z as f32) * repeats);
    let corners = [at(-1.0, 1.0), at(1.0, 1.0), at(1.0, -1.0), at(-1.0, -1.0)];
    let triangle = |[a, b, c]: [usize; 3]| Triangle {
        vertices: [corners[a].0, corners[b].0, corners[c].0],
        uvs: Some([corners[a].1, corners[b].1, corners[c].1]),
        material: 1,
    };
    Scene {
        ambient: Vec3::splat(0.1),
        render: RenderSettings { width, height, ..RenderSettings::default() },
        camera: Camera {
            position: DVec3::new(0.0, 2.6, 2.0),
            look_at: DVec3::new(0.0, -0.1, 0.0),
            up: DVec3::Y,
            fov: 42.0,
            zoom: 1.0,
            kind: CameraKind::PINHOLE,
        },
        background: Background::Color(Vec3::ZERO),
        lights: vec![],
        materials: vec![MATERIAL, Material { diffuse: Vec3::splat(0.5), ..MATERIAL }],
        textures: vec![],
        models: vec![],
        spheres: vec![],
        planes: vec![],
        triangles: vec![triangle([0, 1, 2]), triangle([0, 2, 3])],
        background_visible: true,
        disks: Vec::new(),
        ..Scene::default()
    }
}
