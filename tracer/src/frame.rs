//! One frame, ready to trace: everything in *eye space*.
//!
//! Eye space has the camera in its origin, keeps the world's axes, and is scaled by a power of two so that the scene
//! spans about one unit. A scene far from the world's origin therefore loses no digits, and a scene scaled by 2^k
//! gives the same numbers, bit for bit.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use crate::bvh::WideNode;
use crate::camera::PinholeRays;
use crate::cancel::{IsCancelled, go_on, never};
use crate::compile::{CompileError, CompiledScene, Item, Items, orientation, transformed_bounds};
use crate::light::EyeLight;
use crate::mesh::CompiledMesh;
use crate::plane::EyePlane;
use crate::render::TILE_SIZE;
use crate::scene::{Camera, FrameView, Light, Model, NormalMode, Quality, Scene, SceneFeatures, TextureMap};
use crate::simd::{self, Level};
use crate::sphere::EyeSphere;
use crate::texture::Texture;
use crate::tile::Affine;
use crate::trace::coincide::{FINE, mesh_rounding};

/// Widening of the boxes of the scene's tree, in eye units: rays are rounded to `f32` near them.
const BOX_PADDING: f64 = 1.0 / (1 << 20) as f64;

/// Rows of a band of tiles in frames with this view. Rows that begin and end on multiples of it waste nothing: a tile
/// has as many rays however many samples a pixel has, so with more samples it is fewer rows high. Adaptive
/// frames have bands of [`TILE_SIZE`] rows.
pub fn tile_rows(view: &FrameView) -> u32 {
    if view.is_adaptive() { TILE_SIZE } else { (TILE_SIZE / view.samples.isqrt().max(1)).max(1) }
}

/// One frame of a scene. Share it between render threads.
#[derive(Debug)]
pub struct PreparedFrame {
    scene: Arc<CompiledScene>,
    view: FrameView,
    /// Eye units per world unit: a power of two.
    pub(crate) per_unit: f64,
    pub(crate) rays: PinholeRays,
    /// Where the camera sees eye space: see [`PinholeRays::projection`].
    pub(crate) projection: Affine,
    pub(crate) items: Items,
    pub(crate) instances: Vec<Instance>,
    pub(crate) spheres: Vec<EyeSphere>,
    pub(crate) triangles: Vec<EyeTriangle>,
    pub(crate) planes: Vec<EyePlane>,
    /// How far rounding may have carried any surface of the frame, in eye units.
    pub(crate) coarsest: f64,
    pub(crate) lights: Vec<EyeLight>,
    /// The scene's tree, with the boxes of this frame.
    pub(crate) nodes: Vec<WideNode>,
    pub(crate) features: SceneFeatures,
    /// Which lanes it is traced with.
    pub(crate) level: Level,
}

/// A mesh, placed: eye = `linear` * mesh + `translation`.
#[derive(Debug)]
pub(crate) struct Instance {
    pub mesh: Arc<CompiledMesh>,
    pub linear: DMat3,
    pub translation: DVec3,
    /// Takes eye space back to mesh space.
    pub inverse: DMat3,
    /// Takes normals from mesh space to eye space, up to their length.
    pub normals: DMat3,
    pub smooth: bool,
    /// `linear` and `translation` as one.
    pub placement: Affine,
    /// Where the camera sees the mesh.
    pub projection: Affine,
    /// Whether a material of it has a texture.
    pub textured: bool,
    /// How far it may be off as a whole, in eye units: the digits of the numbers that placed it.
    pub off: f64,
    /// How far apart in mesh space, on each axis, points of surfaces may be that coincide.
    pub drift: f32,
    /// Whether a material of it takes the colours of its vertices.
    pub colored: bool,
    /// Which triangles can be cut out: see [`PreparedFrame::cutouts_of`].
    pub cutouts: Arc<[u16]>,
}

/// A triangle of the scene file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EyeTriangle {
    pub corners: [DVec3; 3],
    /// Unit normal, on the side from which the corners go round counter-clockwise.
    pub normal: DVec3,
    /// How far it may be off, in eye units.
    pub off: f64,
    /// It can be cut out.
    pub cut: bool,
}

impl PreparedFrame {
    /// Places a compiled scene before a camera. The cost grows with the number of instances, not of triangles.
    ///
    /// # Errors
    /// A view that cannot be rendered: its size, samples or camera are out of range.
    pub fn new(scene: Arc<CompiledScene>, view: &FrameView) -> Result<Self, CompileError> {
        Self::new_unless(scene, view, &never)
    }

    /// [`PreparedFrame::new`], unless it is cancelled: the question is asked between steps, of which none takes longer
    /// than to look at every instance.
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
        let source = scene.scene();
        let unit = unit_of(&scene, &view.camera);
        let to_eye = |world: DVec3| (world - view.camera.position) / unit;
        let rays = PinholeRays::new(view);
        let projection = rays.projection();
        let mut instances: Vec<Instance> = source
            .models
            .iter()
            .zip(scene.meshes())
            .zip(scene.coverings())
            .map(|((model, mesh), covering)| Instance {
                textured: covering.textured,
                colored: covering.colored,
                cutouts: Arc::clone(&covering.cutouts),
                ..Instance::new(model, mesh, view.spin, to_eye, unit, &projection)
            })
            .collect();
        go_on(cancelled)?;
        let (triangles, planes) = (triangles(source, &to_eye, unit), planes(source, &to_eye, unit));
        let coarsest = coarsest(&instances, &triangles, &planes);
        instances.iter_mut().for_each(|instance| instance.drift = instance.drift_of(coarsest));
        let mut frame = Self {
            view: *view,
            per_unit: 1.0 / unit,
            rays,
            projection,
            items: Items::of(source),
            instances,
            spheres: spheres(source, &to_eye, unit),
            triangles,
            planes,
            coarsest,
            lights: lights(source, &view.quality, &to_eye, unit),
            nodes: Vec::new(),
            features: scene.features().at(&view.quality),
            level: simd::best(),
            scene,
        };
        go_on(cancelled)?;
        frame.nodes = frame.scene.tree().refitted(|item| frame.item_bounds(frame.items.get(item)));
        Ok(frame)
    }

    /// What is rendered.
    pub fn view(&self) -> &FrameView {
        &self.view
    }

    /// Rows of a band of its tiles: see [`tile_rows`].
    pub fn tile_rows(&self) -> u32 {
        tile_rows(&self.view)
    }

    /// Pixels per row.
    pub fn width(&self) -> u32 {
        self.view.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.view.height
    }

    /// World bounds of everything finite.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.scene.bounds()
    }

    /// The scene as plain data.
    pub fn scene(&self) -> &Scene {
        self.scene.scene()
    }

    /// The scene's textures, and how they are looked up.
    pub(crate) fn textures(&self) -> &[(Arc<Texture>, TextureMap)] {
        self.scene.textures()
    }

    /// The items in a leaf of the scene's tree.
    pub(crate) fn items_of(&self, block: u32) -> &[u32] {
        &self.scene.tree().blocks[block as usize]
    }

    /// Bounds of an item in eye space, padded.
    fn item_bounds(&self, item: Item) -> (Vec3, Vec3) {
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
        };
        ((lo - BOX_PADDING).as_vec3(), (hi + BOX_PADDING).as_vec3())
    }
}

impl Instance {
    /// Whether its triangles are flat and of one colour each.
    #[inline(always)]
    pub(crate) fn is_bare(&self) -> bool {
        !self.smooth && !self.textured && !self.colored
    }

    fn new(
        model: &Model,
        mesh: &Arc<CompiledMesh>,
        spin: f64,
        to_eye: impl Fn(DVec3) -> DVec3,
        unit: f64,
        projection: &Affine,
    ) -> Self {
        let orientation = orientation(model, spin);
        // Powers of two only: exact.
        let linear = orientation * (libm::exp2(f64::from(mesh.exponent())) / unit);
        let inverse = linear.inverse();
        let translation = to_eye(model.translate) + orientation * mesh.center() / unit;
        let placement = Affine::new(linear, translation);
        let numbers =
            (model.translate.abs() + (orientation * mesh.center()).abs()) / unit + translation.abs();
        let off = FINE * (numbers.max_element() + largest_of(&linear));
        Self {
            mesh: Arc::clone(mesh),
            linear,
            translation,
            placement,
            projection: projection.after(&placement),
            inverse,
            normals: inverse.transpose(),
            smooth: model.normals == NormalMode::Smooth,
            textured: false,
            off,
            drift: 0.0,
            colored: false,
            cutouts: Arc::default(),
        }
    }

    /// See [`Instance::drift`]: two surfaces may be off, each as far as the coarsest one.
    fn drift_of(&self, coarsest: f64) -> f32 {
        (2.0 * coarsest * largest_of(&self.inverse)) as f32
    }
}

/// World units per eye unit: the power of two next to the distance from the camera to the far end of what is finite.
/// Scaling the world by a power of two scales it exactly as much.
fn unit_of(scene: &CompiledScene, camera: &Camera) -> f64 {
    let reach = match scene.bounds() {
        Some((lo, hi)) => (lo - camera.position).abs().max((hi - camera.position).abs()).max_element(),
        None => (camera.look_at - camera.position).length(),
    };
    if !(reach > 0.0 && reach.is_finite()) {
        return 1.0;
    }
    let (_, exponent) = libm::frexp(reach);
    libm::exp2(f64::from(exponent))
}

fn lights(scene: &Scene, quality: &Quality, to_eye: &impl Fn(DVec3) -> DVec3, unit: f64) -> Vec<EyeLight> {
    let cast = |light: &Light| Light { shadows: light.shadows && quality.shadows, ..*light };
    scene.lights.iter().map(|light| EyeLight::new(&cast(light), to_eye, unit)).collect()
}

fn spheres(scene: &Scene, to_eye: &impl Fn(DVec3) -> DVec3, unit: f64) -> Vec<EyeSphere> {
    let place = |sphere: &crate::scene::Sphere| EyeSphere {
        center: to_eye(sphere.center),
        radius: sphere.radius / unit,
    };
    scene.spheres.iter().map(place).collect()
}

/// The length of the longest row or column.
fn largest_of(matrix: &DMat3) -> f64 {
    let of = |matrix: &DMat3| matrix.x_axis.length().max(matrix.y_axis.length()).max(matrix.z_axis.length());
    of(matrix).max(of(&matrix.transpose()))
}

fn coarsest(instances: &[Instance], triangles: &[EyeTriangle], planes: &[EyePlane]) -> f64 {
    let of_instances = instances.iter().map(|instance| mesh_rounding(&instance.linear) + instance.off);
    let of_others = triangles.iter().map(|triangle| triangle.off).chain(planes.iter().map(|plane| plane.off));
    of_instances.chain(of_others).fold(0.0, f64::max)
}

/// How far off points may be, in eye units, by the digits that they have in the world and in eye space.
fn digits_of(world: &[DVec3], eye: &[DVec3], unit: f64) -> f64 {
    let largest = |points: &[DVec3]| points.iter().map(|point| point.abs().max_element()).fold(0.0, f64::max);
    FINE * (largest(world) / unit + largest(eye))
}

fn triangles(scene: &Scene, to_eye: &impl Fn(DVec3) -> DVec3, unit: f64) -> Vec<EyeTriangle> {
    let place = |triangle: &crate::scene::Triangle| {
        let corners @ [a, b, c] = triangle.vertices.map(to_eye);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let cut = triangle.uvs.is_some() && scene.materials[triangle.material as usize].cutout.is_some();
        EyeTriangle { corners, normal, off: digits_of(&triangle.vertices, &corners, unit), cut }
    };
    scene.triangles.iter().map(place).collect()
}

fn planes(scene: &Scene, to_eye: &impl Fn(DVec3) -> DVec3, unit: f64) -> Vec<EyePlane> {
    let place = |plane: &crate::scene::Plane| EyePlane {
        normal: plane.normal.normalize_or_zero(),
        offset: plane.normal.normalize_or_zero().dot(to_eye(plane.point)),
        off: digits_of(&[plane.point], &[to_eye(plane.point)], unit),
    };
    scene.planes.iter().map(place).collect()
}
