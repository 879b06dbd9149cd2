//! A frame ready to trace: the scene in *eye space*.
//!
//! Eye space has its origin at the camera, keeps the world's axes, and is scaled by a power of two so that the scene spans
//! about one unit. A scene far from the world's origin therefore loses no digits, and a scene scaled by 2^k gives the same
//! numbers, bit for bit.
//!
//! ```text
//!   camera     pixels to rays, and the camera's map from eye space to its picture
//!   affine     the maps
//!   instance   placed meshes
//!   motion     objects that move while the shutter is open
//!   placing    primitives in eye space
//!   passage    how light passes items along shadow rays
//!   sky        what rays that hit nothing see
//!   rounding   error bounds of placed geometry
//!   few        the primitives of scenes with few of them
//!   sources    the lights that paths select from
//!   volumes    volumes that scatter the light of paths
//! ```

mod affine;
mod camera;
mod few;
mod instance;
mod motion;
mod passage;
mod placing;
mod rounding;
mod sky;
mod sources;
mod volumes;

use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::bvh::WideNode;
use crate::cancel::{IsCancelled, go_on, never};
use crate::compile::{CompileError, CompiledScene, Item, Items, disk_reach, transformed_bounds};
use crate::light::EyeLight;
use crate::light::table::LightTable;
use crate::scene::{Background, Filter, FrameView, Light, Scene, SceneFeatures, TextureMap};
use crate::shape::{EyeDisk, EyePlane, EyeSphere};
use crate::simd::{self, Level};
use crate::texture::Texture;

pub(crate) use affine::Affine;
pub use camera::Basis;
pub(crate) use camera::{CameraRays, FisheyeRay, FisheyeRays, ParallelRays, PinholeRays};
pub(crate) use few::{Few, FewSphere, FewTriangle};
pub(crate) use instance::Instance;
use instance::ToEye;
pub(crate) use motion::{Motions, MovingItem, Pose};
use passage::Passage;
use placing::{coarsest, disks, planes, spheres, triangles, unit_of};
pub(crate) use rounding::{F64_ERROR, corner_rounding};
use sky::{seen_background, sky_rotation};
pub(crate) use volumes::{EyeBoundary, EyeVolume};

/// Padding of the boxes of the scene's tree, in eye units: rays are rounded to `f32` near them.
const BOX_PADDING: f64 = 1.0 / (1 << 20) as f64;

/// One frame of a scene: immutable, shared between render threads.
#[derive(Debug)]
pub struct PreparedFrame {
    scene: Arc<CompiledScene>,
    view: FrameView,
    /// Eye units per world unit: a power of two.
    pub(crate) per_unit: f64,
    pub(crate) rays: CameraRays,
    /// Map from eye space to the camera's picture: see [`CameraRays::picture_map`].
    pub(crate) to_picture: Affine,
    pub(crate) items: Items,
    pub(crate) instances: Vec<Instance>,
    pub(crate) spheres: Vec<EyeSphere>,
    pub(crate) triangles: Vec<EyeTriangle>,
    pub(crate) disks: Vec<EyeDisk>,
    pub(crate) planes: Vec<EyePlane>,
    /// Largest error bound of any surface, in eye units.
    pub(crate) coarsest: f64,
    pub(crate) lights: Vec<EyeLight>,
    /// The primitives, if these are few; only in frames whose rays bounce.
    pub(crate) few: Option<Few>,
    /// The lights that paths select from; only in frames of the path integrator.
    pub(crate) light_table: Option<LightTable>,
    /// The volumes; only in frames of the path integrator.
    pub(crate) volumes: Vec<EyeVolume>,
    /// The items that move while the shutter is open, if the frame shows their motion: they are in no other structure.
    pub(crate) motions: Option<Box<Motions>>,
    /// Whether a model that does not move is all there is to hit, apart from planes.
    pub(crate) is_single_model: bool,
    /// The background as rays of the camera see it.
    pub(crate) seen_background: Background,
    /// Sine and cosine of the rotation of a sky.
    pub(crate) sky_rotation: [f32; 2],
    /// The scene's tree, with the boxes of this frame.
    pub(crate) nodes: Vec<WideNode>,
    pub(crate) features: SceneFeatures,
    /// How light passes each item and plane; empty in scenes where none lets it pass.
    passages: Vec<Passage>,
    /// Whether an item dims the light that passes it.
    has_translucent_items: bool,
    /// The level of SIMD that renders the frame.
    pub(crate) level: Level,
}

/// A triangle of the scene file, in eye space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EyeTriangle {
    pub corners: [DVec3; 3],
    /// Unit normal on the side from which the corners are in counter-clockwise order.
    pub normal: DVec3,
    /// Error bound of its position, in eye units.
    pub error: f64,
    /// Whether alpha cuts it out.
    pub cut: bool,
}

impl PreparedFrame {
    /// Places a compiled scene in eye space. The cost grows with the number of instances, not of triangles.
    ///
    /// # Errors
    /// [`CompileError::Frame`]: size, samples or camera of the view are out of range.
    pub fn new(scene: Arc<CompiledScene>, view: &FrameView) -> Result<Self, CompileError> {
        Self::new_unless(scene, view, &never)
    }

    /// [`PreparedFrame::new`] with cancellation. `cancelled` is polled between steps, each of which visits every instance
    /// at most once.
    ///
    /// # Errors
    /// As [`PreparedFrame::new`], and [`CompileError::Cancelled`].
    pub fn new_unless(
        scene: Arc<CompiledScene>,
        view: &FrameView,
        cancelled: &IsCancelled<'_>,
    ) -> Result<Self, CompileError> {
        view.validate()?;
        go_on(cancelled)?;
        let scene = scene.for_view(view);
        let source = scene.scene();
        let sweeps = motion::sweeps(&scene, view);
        let to_eye = ToEye { eye: view.camera.position, unit: unit_of(&scene, &view.camera, &sweeps) };
        let rays = CameraRays::new(view, 1.0 / to_eye.unit);
        let to_picture = rays.picture_map();
        let mut instances: Vec<Instance> = source
            .models
            .iter()
            .zip(scene.meshes())
            .zip(scene.attributes())
            .map(|((model, mesh), attributes)| {
                Instance::new(model, mesh, attributes, view.spin, &to_eye, &to_picture)
            })
            .collect();
        go_on(cancelled)?;
        let motions = Motions::new(&sweeps, &to_eye, cancelled)?;
        let (triangles, disks, planes) =
            (triangles(source, &to_eye), disks(source, &to_eye), planes(source, &to_eye));
        let flat = disks.iter().map(|disk| &disk.plane).chain(&planes);
        let coarsest = coarsest(&instances, &triangles, flat);
        instances.iter_mut().for_each(|instance| instance.set_drift(coarsest));
        let mut frame = Self {
            view: *view,
            per_unit: 1.0 / to_eye.unit,
            rays,
            to_picture,
            items: Items::of(source),
            instances,
            spheres: spheres(source, &to_eye),
            triangles,
            disks,
            planes,
            coarsest,
            lights: lights(&scene, view, &to_eye),
            few: None,
            light_table: None,
            volumes: Vec::new(),
            is_single_model: source.models.len() == 1
                && Items::of(source).range().len() == 1
                && motions.is_none(),
            motions,
            seen_background: seen_background(source),
            sky_rotation: sky_rotation(source),
            nodes: Vec::new(),
            passages: Vec::new(),
            has_translucent_items: false,
            features: features_of(&scene, view),
            level: simd::best(),
            scene,
        };
        if frame.features.volumes && view.integrator.path().is_some() {
            frame.volumes = volumes::volumes(&frame.scene, view.spin, &to_eye, &frame.to_picture);
        }
        go_on(cancelled)?;
        frame.make_pyramids();
        go_on(cancelled)?;
        let bounces = frame.features.bounces || view.integrator.path().is_some();
        frame.few = bounces.then(|| Few::of(&frame)).flatten();
        frame.light_table = view.integrator.path().and_then(|_| sources::light_table(&frame));
        frame.passages = frame.find_passages();
        frame.has_translucent_items = frame.passages.contains(&Passage::Dimmed);
        frame.nodes = frame.scene.tree().refitted(|item| frame.item_bounds(frame.items.get(item)));
        Ok(frame)
    }

    /// The view that is rendered.
    pub fn view(&self) -> &FrameView {
        &self.view
    }

    /// Pixels per row.
    pub fn width(&self) -> u32 {
        self.view.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.view.height
    }

    /// World bounds of all finite primitives.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.scene.bounds()
    }

    /// The scene as plain data.
    pub fn scene(&self) -> &Scene {
        self.scene.scene()
    }

    /// The scene's textures with their maps.
    pub(crate) fn textures(&self) -> &[(Arc<Texture>, TextureMap)] {
        self.scene.textures()
    }

    /// The filter of a texture in this frame.
    pub(crate) fn filter_of(&self, map: &TextureMap) -> Filter {
        self.view.quality.filter.unwrap_or(map.filter)
    }

    /// Makes the smaller pictures of the textures of surfaces that need them; those of earlier frames are kept.
    fn make_pyramids(&self) {
        if !self.features.textured {
            return;
        }
        let of_materials = self.scene().materials.iter().flat_map(|m| [m.texture, m.emission_texture]);
        for index in of_materials.flatten() {
            let (texture, map) = &self.textures()[index as usize];
            if self.filter_of(map) == Filter::Trilinear {
                texture.pyramid();
            }
        }
    }

    /// The items in a leaf of the scene's tree.
    pub(crate) fn items_of(&self, block: u32) -> &[u32] {
        &self.scene.tree().blocks[block as usize]
    }

    /// Whether some but not all light may pass an item or plane along shadow rays.
    #[inline(always)]
    pub(crate) fn is_translucent(&self, item: u32) -> bool {
        self.passages.get(item as usize) == Some(&Passage::Dimmed)
    }

    /// Whether all light passes an item or plane along shadow rays.
    #[inline(always)]
    pub(crate) fn is_clear(&self, item: u32) -> bool {
        self.passages.get(item as usize) == Some(&Passage::Free)
    }

    /// Whether there are items that some but not all light may pass.
    #[inline(always)]
    pub(crate) fn has_translucent_items(&self) -> bool {
        self.has_translucent_items
    }

    /// Whether light may pass anything along shadow rays.
    pub(crate) fn has_passages(&self) -> bool {
        !self.passages.is_empty()
    }

    fn find_passages(&self) -> Vec<Passage> {
        let scene = self.scene();
        let of_paths = self.view.integrator.path().is_some();
        if !(self.features.transparent && !of_paths || self.features.shadowless) {
            return Vec::new();
        }
        let of = |indices: &[u32]| {
            let materials = indices.iter().map(|index| &scene.materials[*index as usize]);
            if of_paths { Passage::of_paths(materials) } else { Passage::of(materials) }
        };
        let of_items = self.items.range().map(|index| match self.items.get(index) {
            Item::Model(i) => of(&scene.models[i].materials),
            Item::Sphere(i) => of(&[scene.spheres[i].material]),
            Item::Triangle(i) => of(&[scene.triangles[i].material]),
            Item::Disk(i) => of(&[scene.disks[i].material]),
        });
        of_items.chain(scene.planes.iter().map(|plane| of(&[plane.material]))).collect()
    }

    /// Bounds of an item in eye space, padded.
    pub(crate) fn item_bounds(&self, item: Item) -> (Vec3, Vec3) {
        let (lo, hi) = match item {
            Item::Model(i) => {
                let instance = &self.instances[i];
                let (lo, hi) = instance.mesh.root_bounds();
                transformed_bounds((lo.as_dvec3(), hi.as_dvec3()), instance.linear, instance.translation)
            }
            Item::Sphere(i) => {
                let EyeSphere { center, radius } = self.spheres[i];
                (center - radius, center + radius)
            }
            Item::Triangle(i) => {
                let [a, b, c] = self.triangles[i].corners;
                (a.min(b).min(c), a.max(b).max(c))
            }
            Item::Disk(i) => {
                let EyeDisk { center, radius, plane } = &self.disks[i];
                let reach = disk_reach(plane.normal, *radius);
                (*center - reach, *center + reach)
            }
        };
        ((lo - BOX_PADDING).as_vec3(), (hi + BOX_PADDING).as_vec3())
    }
}

/// The features that the frame of a view shows.
fn features_of(scene: &CompiledScene, view: &FrameView) -> SceneFeatures {
    let features = scene.features().at(&view.quality);
    SceneFeatures { rough_textured: features.rough_textured && view.integrator.path().is_some(), ..features }
}

fn lights(scene: &CompiledScene, view: &FrameView, to_eye: &ToEye) -> Vec<EyeLight> {
    let (source, quality) = (scene.scene(), &view.quality);
    let shines = scene.features().emissive || matches!(source.background, Background::Sky(_));
    if source.has_default_light && shines && view.integrator.path().is_some() {
        return Vec::new();
    }
    let cast = |light: &Light| Light {
        shadows: light.shadows && quality.shadows,
        shadow_samples: Some(light.shadow_samples_at(&source.render.quality, quality)),
        ..*light
    };
    let place = |light: &Light| EyeLight::new(&cast(light), |world| to_eye.point(world), to_eye.unit);
    source.lights.iter().map(place).collect()
}
