//! What is at a hit: the point, its normals, its material.

use glam::{DVec3, Vec3};

use super::{Hit, PrimitiveId, Ray};
use crate::compile::Item;
use crate::frame::{Instance, PreparedFrame};

/// How far a ray is lifted off the surface that it leaves, relative to the largest coordinate that went into its
/// origin. Points are computed in `f64` by about ten operations: 2^-40 is a thousand times their error, and still
/// 2^16 times below the resolution of `f32` meshes.
const LIFT: f64 = 1.0 / (1_u64 << 40) as f64;

/// A point of a surface, as shading needs it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    /// In eye space.
    pub point: DVec3,
    /// Geometric unit normal on the viewer's side.
    pub ng: DVec3,
    /// Shading unit normal, on the same side of the surface as `ng`.
    pub ns: Vec3,
    /// Index into the scene's materials.
    pub material: u32,
    /// What was hit.
    pub primitive: PrimitiveId,
    /// Largest coordinate that went into `point`.
    magnitude: f64,
}

impl Surface {
    /// A ray from here towards `direction`, lifted off the surface on the side it goes to.
    pub(crate) fn leave(&self, direction: DVec3) -> Ray {
        let side = if self.ng.dot(direction) < 0.0 { -1.0 } else { 1.0 };
        Ray { origin: self.point + self.ng * (side * LIFT * self.magnitude), direction }
    }
}

impl PreparedFrame {
    /// Looks up what a hit has hit.
    pub(crate) fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let scene = self.scene();
        let item = hit.primitive.item;
        if item >= self.items.first_plane() {
            let index = (item - self.items.first_plane()) as usize;
            let normal = self.planes[index].normal;
            return analytic(ray, hit, normal, scene.planes[index].material);
        }
        match self.items.get(item) {
            Item::Sphere(index) => {
                let normal = self.spheres[index].normal(ray.origin + ray.direction * hit.t);
                analytic(ray, hit, normal, scene.spheres[index].material)
            }
            Item::Triangle(index) => {
                let [a, b, c] = self.triangles[index].corners;
                let ng = (b - a).cross(c - a).normalize_or_zero();
                let point = interpolate([a, b, c], hit.uv);
                let magnitude = point.abs().max_element();
                facing(ray, hit, Parts { point, ng, ns: ng, magnitude }, scene.triangles[index].material)
            }
            Item::Model(index) => {
                let instance = &self.instances[index];
                let slot = instance.mesh.slot(hit.primitive.triangle) as usize;
                // `CompiledScene::new` made sure that there is one per slot.
                facing(ray, hit, mesh_parts(instance, hit), scene.models[index].materials[slot])
            }
        }
    }
}

/// A point with its normals, whichever way they point.
struct Parts {
    point: DVec3,
    ng: DVec3,
    ns: DVec3,
    magnitude: f64,
}

fn mesh_parts(instance: &Instance, hit: &Hit) -> Parts {
    let triangle = hit.primitive.triangle;
    let corners = instance.mesh.corners(triangle).map(Vec3::as_dvec3);
    let offset = instance.linear * interpolate(corners, hit.uv);
    let point = offset + instance.translation;
    let [a, b, c] = corners;
    let ng = (instance.normals * (b - a).cross(c - a)).normalize_or_zero();
    let ns = if instance.smooth { smooth_normal(instance, triangle, hit.uv).unwrap_or(ng) } else { ng };
    Parts { point, ng, ns, magnitude: offset.abs().max(instance.translation.abs()).max_element() }
}

/// Interpolated between the corners; `None` where the mesh has none there, or they cancel.
fn smooth_normal(instance: &Instance, triangle: u32, uv: (f64, f64)) -> Option<DVec3> {
    let normals = instance.mesh.corner_normals(triangle)?.map(Vec3::as_dvec3);
    (instance.normals * interpolate(normals, uv)).try_normalize()
}

fn interpolate([a, b, c]: [DVec3; 3], (u, v): (f64, f64)) -> DVec3 {
    a * (1.0 - u - v) + b * u + c * v
}

/// Planes and spheres: one normal, the point from the ray.
fn analytic(ray: &Ray, hit: &Hit, normal: DVec3, material: u32) -> Surface {
    let point = ray.origin + ray.direction * hit.t;
    let magnitude = point.abs().max(ray.origin.abs()).max_element();
    facing(ray, hit, Parts { point, ng: normal, ns: normal, magnitude }, material)
}

/// Turns the normals to the viewer: the geometric one by where the ray comes from, the shading one to its side.
fn facing(ray: &Ray, hit: &Hit, parts: Parts, material: u32) -> Surface {
    let Parts { point, ng, ns, magnitude } = parts;
    let ng = if ng.dot(ray.direction) > 0.0 { -ng } else { ng };
    let ns = if ns.dot(ng) < 0.0 { -ns } else { ns };
    Surface { point, ng, ns: ns.as_vec3(), material, primitive: hit.primitive, magnitude }
}
