//! Default camera, light and background of a scene whose file has none: the camera shows the whole scene, and the
//! light is above the camera's shoulder.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use crate::bvh::WIDTH;
use crate::material::Material;
use crate::mesh::{CompiledMesh, MeshId, TriangleBlock};
use crate::rotation;
use crate::scene::data::{
    Attenuation, Background, Camera, Disk, Light, LightKind, Model, NormalMode, RenderSettings, Scene,
};
use crate::scene::import::Up;

/// Lower and upper corner of an axis-aligned box.
pub(super) type Bounds = (DVec3, DVec3);

/// Vertical field of view of the default camera in degrees.
const FOV: f64 = 45.0;
/// Direction from the centre of the scene towards the camera: from the front, the right and above.
const TOWARDS_CAMERA: DVec3 = DVec3::new(0.6, 0.35, 1.0);
/// Share of the picture's width or height that is filled, whichever is reached first.
const FILLED: f64 = 0.9;
/// Least distance of the camera from the geometry, as a share of the geometry's radius.
const NEAREST: f64 = 0.05;
/// Offset of the light to the left of the camera and above it, in distances from the camera to its look-at point.
const SHOULDER: (f64, f64) = (0.35, 0.5);
const AMBIENT: Vec3 = Vec3::splat(0.1);
const BACKGROUND: Background = Background::Color(Vec3::splat(0.2));

/// A model as a scene of its own, framed for a picture of `size`, or of the default size.
pub(super) fn bare_model(mesh: &CompiledMesh, up: Up, size: Option<(u32, u32)>) -> Scene {
    let materials: Vec<Material> = mesh.materials().into_iter().map(|slot| slot.material).collect();
    let normals = if mesh.has_normals() { NormalMode::Smooth } else { NormalMode::Flat };
    let (rotate, scale) = up.before(DVec3::ZERO, DVec3::ONE);
    let render = RenderSettings::default();
    let camera = camera_showing_mesh(mesh, rotate, size.unwrap_or((render.width, render.height)));
    Scene {
        ambient: AMBIENT,
        render,
        camera,
        background: BACKGROUND,
        lights: vec![default_light(&camera)],
        has_default_light: true,
        models: vec![Model {
            mesh: mesh.id(),
            materials: (0..materials.len() as u32).collect(),
            normals,
            translate: DVec3::ZERO,
            rotate,
            scale,
            group: DMat3::IDENTITY,
        }],
        materials,
        textures: Vec::new(),
        spheres: Vec::new(),
        planes: Vec::new(),
        triangles: Vec::new(),
        background_visible: true,
        disks: Vec::new(),
        ..Scene::default()
    }
}

/// A camera whose picture the box fills. Without bounds it shows a cube of two units around the origin.
pub(super) fn camera_showing(bounds: Option<Bounds>, size: (u32, u32)) -> Camera {
    let bounds = bounds.unwrap_or((-DVec3::ONE, DVec3::ONE));
    let axes = Axes::of(bounds, size);
    let reach = corners_of(bounds).map(|corner| axes.reach(corner)).reduce(Reach::max);
    axes.camera(reach.unwrap_or(Reach::NOTHING))
}

/// A camera whose picture the mesh fills.
fn camera_showing_mesh(mesh: &CompiledMesh, rotate: DVec3, size: (u32, u32)) -> Camera {
    let turn = rotation::of_model(rotate);
    let axes = Axes::of(around(corners_of(mesh.bounds()).map(|corner| turn * corner)), size);
    let (center, scale) = (mesh.center(), libm::exp2(f64::from(mesh.exponent())));
    let reach_of = |block: &TriangleBlock| {
        let lanes = (0..WIDTH).flat_map(|lane| block.corners(lane));
        let corners = lanes.map(|corner| axes.reach(turn * (center + corner.as_dvec3() * scale)));
        // Lanes without a triangle are NaN, which `max` ignores.
        corners.fold(Reach::NOTHING, Reach::max)
    };
    let reach = mesh.blocks().par_iter().map(reach_of).reduce(|| Reach::NOTHING, Reach::max);
    axes.camera(reach)
}

/// Axes and slopes of a picture around the centre of the geometry.
struct Axes {
    center: DVec3,
    /// Half of the diagonal of the geometry's bounds.
    radius: f64,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Half width of the filled part of the picture, at unit distance.
    slope_x: f64,
    slope_y: f64,
}

impl Axes {
    fn of((lower, upper): Bounds, (width, height): (u32, u32)) -> Self {
        let forward = -TOWARDS_CAMERA.normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let (sin, cos) = rotation::sin_cos_degrees(FOV / 2.0);
        let slope_y = FILLED * sin / cos;
        Self {
            center: lower * 0.5 + upper * 0.5,
            radius: ((upper - lower) * 0.5).length(),
            right,
            up: right.cross(forward),
            forward,
            slope_x: slope_y * f64::from(width.max(1)) / f64::from(height.max(1)),
            slope_y,
        }
    }

    /// Extent of a point beyond the planes through the centre that are parallel to the sides of the filled part of
    /// the view frustum.
    fn reach(&self, point: DVec3) -> Reach {
        let to = point - self.center;
        let (x, y, ahead) = (to.dot(self.right), to.dot(self.up), to.dot(self.forward));
        let (side_x, side_y) = (self.slope_x * ahead, self.slope_y * ahead);
        Reach { right: x - side_x, left: -x - side_x, top: y - side_y, bottom: -y - side_y, nearest: -ahead }
    }

    /// The nearest camera whose filled part contains everything within these planes. Two opposite planes touch it.
    fn camera(&self, reach: Reach) -> Camera {
        let from_x = (reach.left + reach.right) / (2.0 * self.slope_x);
        let from_y = (reach.top + reach.bottom) / (2.0 * self.slope_y);
        let distance = from_x.max(from_y).max(reach.nearest + NEAREST * self.radius);
        let (x, y) = ((reach.right - reach.left) / 2.0, (reach.top - reach.bottom) / 2.0);
        let look_at = self.center + self.right * x + self.up * y;
        Camera {
            position: look_at - self.forward * distance,
            look_at,
            up: DVec3::Y,
            fov: FOV,
            zoom: 1.0,
            kind: crate::scene::CameraKind::PINHOLE,
        }
    }
}

/// Extents of geometry: see [`Axes::reach`].
#[derive(Clone, Copy)]
struct Reach {
    right: f64,
    left: f64,
    top: f64,
    bottom: f64,
    /// Extent towards the camera.
    nearest: f64,
}

impl Reach {
    const NOTHING: Self = Self {
        right: f64::NEG_INFINITY,
        left: f64::NEG_INFINITY,
        top: f64::NEG_INFINITY,
        bottom: f64::NEG_INFINITY,
        nearest: f64::NEG_INFINITY,
    };

    fn max(self, other: Self) -> Self {
        Self {
            right: self.right.max(other.right),
            left: self.left.max(other.left),
            top: self.top.max(other.top),
            bottom: self.bottom.max(other.bottom),
            nearest: self.nearest.max(other.nearest),
        }
    }
}

/// A white point light above the camera's shoulder, at a distance in proportion to that of the look-at point.
pub(super) fn default_light(camera: &Camera) -> Light {
    let forward = camera.look_at - camera.position;
    let distance = forward.length();
    let right = forward.cross(camera.up).normalize_or_zero();
    let up = right.cross(forward).normalize_or_zero();
    let (left_share, up_share) = SHOULDER;
    Light {
        kind: LightKind::Point {
            position: camera.position + (up * up_share - right * left_share) * distance,
        },
        color: Vec3::ONE,
        attenuation: Attenuation::None,
        shadows: true,
        radius: 0.0,
        shadow_samples: None,
    }
}

/// The point on a camera's axis nearest to the centre of the scene, so that orbits are around the scene. Without
/// bounds it is one unit ahead; for a centre behind the camera it is at the centre's distance.
pub(super) fn point_on_axis(position: DVec3, direction: DVec3, bounds: Option<Bounds>) -> DVec3 {
    let Some((lower, upper)) = bounds else { return position + direction };
    let to_center = lower * 0.5 + upper * 0.5 - position;
    let ahead = to_center.dot(direction);
    let fallback = if to_center == DVec3::ZERO { 1.0 } else { to_center.length() };
    // Nearly sideways is treated like behind: the point would nearly coincide with the camera.
    let usable = ahead > fallback / 1024.0;
    position + direction * if usable { ahead } else { fallback }
}

/// World bounds of all finite geometry; `None` if there is none.
pub(super) fn bounds(scene: &Scene, meshes: &[Arc<CompiledMesh>]) -> Option<Bounds> {
    let of_mesh = |id: MeshId| meshes.iter().find(|mesh| mesh.id() == id).map(|mesh| mesh.bounds());
    let models = scene.models.iter().filter_map(|model| Some(of_model(model, of_mesh(model.mesh)?)));
    let spheres = scene.spheres.iter().map(|s| (s.center - s.radius, s.center + s.radius));
    let disks = scene.disks.iter().map(of_disk);
    let triangles = scene.triangles.iter().map(|t| around(t.vertices));
    models.chain(spheres).chain(disks).chain(triangles).reduce(union)
}

fn of_model(model: &Model, bounds: Bounds) -> Bounds {
    let matrix = model.group * rotation::of_model(model.rotate) * DMat3::from_diagonal(model.scale);
    around(corners_of(bounds).map(|corner| matrix * corner + model.translate))
}

fn of_disk(disk: &Disk) -> Bounds {
    // Along an axis a circle reaches as far as the sine of the angle between the axis and the normal.
    let sines = (DVec3::ONE - disk.normal * disk.normal).max(DVec3::ZERO).to_array().map(f64::sqrt);
    let reach = DVec3::from_array(sines) * disk.radius;
    (disk.center - reach, disk.center + reach)
}

fn corners_of((lower, upper): Bounds) -> impl Iterator<Item = DVec3> {
    (0..8).map(move |corner| {
        let side = |axis: u32, lower: f64, upper: f64| if corner & (1 << axis) == 0 { lower } else { upper };
        DVec3::new(side(0, lower.x, upper.x), side(1, lower.y, upper.y), side(2, lower.z, upper.z))
    })
}

fn around(points: impl IntoIterator<Item = DVec3>) -> Bounds {
    points.into_iter().map(|point| (point, point)).reduce(union).unwrap_or_default()
}

fn union(a: Bounds, b: Bounds) -> Bounds {
    (a.0.min(b.0), a.1.max(b.1))
}

#[cfg(test)]
mod tests;
