//! Pictures that show no light but a property of the surfaces: see [`Shading`]. Rays without a hit are black.

use glam::DVec3;

use super::Oracle;
use super::camera::CameraRay;
use super::surface::SurfacePoint;
use crate::intersect::Primitive as Name;
use crate::scene::Shading;

/// 2^32 divided by the golden ratio.
const GOLDEN: u32 = 0x9e37_79b9;

impl Oracle {
    /// Linear RGB that a picture shows along a ray of the camera.
    pub(super) fn shown(&self, camera_ray: &CameraRay) -> DVec3 {
        let property = |of: &dyn Fn(&SurfacePoint) -> DVec3| {
            let hit = camera_ray.in_picture.then(|| self.surface(camera_ray.ray, None)).flatten();
            hit.map_or(DVec3::ZERO, |surface| of(&surface))
        };
        match self.view.quality.shading {
            Shading::Full | Shading::Diffuse => self.radiance(camera_ray),
            Shading::Normals => property(&|surface| (surface.ns + 1.0) / 2.0),
            Shading::Depth => property(&|surface| {
                let camera = &self.view.camera;
                DVec3::splat(1.0 / (1.0 + surface.way / camera.look_at.distance(camera.position)))
            }),
            Shading::Item => {
                property(&|surface| item_color(self.item(self.primitives[surface.primitive].name)))
            }
            Shading::Albedo => property(&|surface| self.diffuse(surface)),
        }
    }

    /// Index of the object of a primitive: models, spheres, triangles, disks and planes are numbered through.
    fn item(&self, name: Name) -> u32 {
        let scene = &self.scene;
        let triangles = scene.models.len() + scene.spheres.len();
        let disks = triangles + scene.triangles.len();
        let index = match name {
            Name::Model { model, .. } => model,
            Name::Sphere(index) => scene.models.len() + index,
            Name::Triangle(index) => triangles + index,
            Name::Disk(index) => disks + index,
            Name::Plane(index) => disks + scene.disks.len() + index,
        };
        index as u32
    }
}

/// The colour of an object: its hue is the fraction of index / golden ratio; brightness and paleness are bytes of a hash, the
/// finaliser of MurmurHash3 (Appleby, 2011).
fn item_color(index: u32) -> DVec3 {
    let mixed = |hash: u32, shift: u32, factor: u32| (hash ^ hash >> shift).wrapping_mul(factor);
    let hash = mixed(mixed(index.wrapping_add(1), 16, 0x85eb_ca6b), 13, 0xc2b2_ae35);
    let hash = hash ^ hash >> 16;
    let share = |shift: u32| f64::from(hash >> shift & 0xff) / 255.0;
    let (brightness, paleness) = (0.5 + 0.5 * share(0), 0.5 * share(8));
    // Sixths of the circle of hues: red at 0, green at 2, blue at 4.
    let hue = f64::from(index.wrapping_mul(GOLDEN)) / f64::from(u32::MAX) * 6.0;
    let channel = |own: f64| {
        let apart = (hue - own).abs().min(6.0 - (hue - own).abs());
        (2.0 - apart).clamp(0.0, 1.0)
    };
    let pure = DVec3::new(channel(0.0), channel(2.0), channel(4.0));
    (pure * (1.0 - paleness) + paleness) * brightness
}
