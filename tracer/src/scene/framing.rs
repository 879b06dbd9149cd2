//! What a scene looks like when nobody said: a camera that shows all of it, a light above the camera's shoulder, a
//! neutral background.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use super::{
    Attenuation, Background, Camera, Light, LightKind, Material, Model, NormalMode, RenderSettings, Scene,
    rotation,
};
use crate::mesh::{CompiledMesh, MeshId};

/// Lower and upper corner of a box along the axes.
pub(super) type Bounds = (DVec3, DVec3);

/// Vertical field of view of a camera that nobody set.
const FOV: f64 = 40.0;
/// From the middle of what is shown towards the camera: from the front, a little from the right and from above.
const TOWARDS_CAMERA: DVec3 = DVec3::new(0.45, 0.35, 1.0);
/// A little air around what is shown.
const MARGIN: f64 = 1.05;
/// The light's place, in distances from the camera to what it looks at: to the left of the camera and above it.
const SHOULDER: (f64, f64) = (0.35, 0.5);
const AMBIENT: Vec3 = Vec3::splat(0.1);
const BACKGROUND: Background = Background::Color(Vec3::splat(0.2));

/// A model by itself.
pub(super) fn bare_model(mesh: &CompiledMesh) -> Scene {
    let materials: Vec<Material> = mesh.materials().into_iter().map(|slot| slot.material).collect();
    let normals = if mesh.has_normals() { NormalMode::Smooth } else { NormalMode::Flat };
    let camera = camera_showing(Some(mesh.bounds()));
    Scene {
        ambient: AMBIENT,
        render: RenderSettings::default(),
        camera,
        background: BACKGROUND,
        lights: vec![default_light(&camera)],
        models: vec![Model {
            mesh: mesh.id(),
            materials: (0..materials.len() as u32).collect(),
            normals,
            translate: DVec3::ZERO,
            rotate: DVec3::ZERO,
            scale: DVec3::ONE,
        }],
        materials,
        textures: Vec::new(),
        spheres: Vec::new(),
        planes: Vec::new(),
        triangles: Vec::new(),
    }
}

/// A camera that sees the sphere around the bounds, in every picture that is at least as wide as high. Without bounds
/// it sees the unit sphere.
pub(super) fn camera_showing(bounds: Option<Bounds>) -> Camera {
    let (lower, upper) = bounds.unwrap_or((-DVec3::ONE, DVec3::ONE));
    let center = lower * 0.5 + upper * 0.5;
    let radius = ((upper - lower) * 0.5).length();
    // Tangents to the sphere, not to its middle: the near half stands out further.
    let (sin, _) = rotation::sin_cos_degrees(FOV / 2.0);
    let distance = MARGIN * radius / sin;
    let position = center + TOWARDS_CAMERA / TOWARDS_CAMERA.length() * distance;
    Camera { position, look_at: center, up: DVec3::Y, fov: FOV, zoom: 1.0 }
}

/// A white point light above the camera's shoulder, as far as what the camera looks at asks for.
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
    }
}

/// The point on a camera's axis that is nearest to the middle of the scene, so that orbits go round the scene. One
/// unit ahead where nothing finite is there, and as far as the scene's middle where that lies behind the camera.
pub(super) fn point_on_axis(position: DVec3, direction: DVec3, bounds: Option<Bounds>) -> DVec3 {
    let Some((lower, upper)) = bounds else { return position + direction };
    let to_center = lower * 0.5 + upper * 0.5 - position;
    let ahead = to_center.dot(direction);
    let fallback = if to_center == DVec3::ZERO { 1.0 } else { to_center.length() };
    // Nearly sideways is no better than behind: the point would fall onto the camera.
    let usable = ahead > fallback / 1024.0;
    position + direction * if usable { ahead } else { fallback }
}

/// World bounds of everything finite; `None` when there is nothing.
pub(super) fn bounds(scene: &Scene, meshes: &[Arc<CompiledMesh>]) -> Option<Bounds> {
    let of_mesh = |id: MeshId| meshes.iter().find(|mesh| mesh.id() == id).map(|mesh| mesh.bounds());
    let models = scene.models.iter().filter_map(|model| Some(of_model(model, of_mesh(model.mesh)?)));
    let spheres = scene.spheres.iter().map(|s| (s.center - s.radius, s.center + s.radius));
    let triangles = scene.triangles.iter().map(|t| around(t.vertices));
    models.chain(spheres).chain(triangles).reduce(union)
}

fn of_model(model: &Model, (lower, upper): Bounds) -> Bounds {
    let matrix = rotation::of_model(model.rotate) * DMat3::from_diagonal(model.scale);
    let corners = (0..8).map(|corner| {
        let side = |axis: u32, lower: f64, upper: f64| if corner & (1 << axis) == 0 { lower } else { upper };
        let corner =
            DVec3::new(side(0, lower.x, upper.x), side(1, lower.y, upper.y), side(2, lower.z, upper.z));
        matrix * corner + model.translate
    });
    around(corners)
}

fn around(points: impl IntoIterator<Item = DVec3>) -> Bounds {
    points.into_iter().map(|point| (point, point)).reduce(union).unwrap_or_default()
}

fn union(a: Bounds, b: Bounds) -> Bounds {
    (a.0.min(b.0), a.1.max(b.1))
}

#[cfg(test)]
mod tests;
