//! The scene of the oracle, flattened to primitives.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use super::attributes::{Chart, Skin};
use super::shape::{Primitive, Shape};
use super::{F64_ERROR, Oracle};
use crate::intersect::Primitive as Name;
use crate::mesh::{CompiledMesh, MeshId};
use crate::scene::{FrameView, Model, NormalMode, Scene};
use crate::srgb;

/// Half a step of an `f32`, relative to the number: corners of meshes are rounded to it, and are within [-1, 1].
const HALF_STEP: f64 = 1.0 / (1 << 24) as f64;

/// The primitives of a scene in world space relative to the camera: models, spheres, triangles, disks,
/// planes.
pub(super) fn flatten(scene: &Scene, meshes: &[Arc<CompiledMesh>], view: &FrameView) -> Vec<Primitive> {
    let eye = view.camera.position;
    let mut primitives = Vec::new();
    for (index, model) in scene.models.iter().enumerate() {
        let find = |id: MeshId| meshes.iter().find(|mesh| mesh.id() == id);
        let Some(mesh) = find(model.mesh) else { continue };
        let linear = linear(model, view.spin);
        let scale = libm::exp2(f64::from(mesh.exponent()));
        let place = |p: Vec3| linear * (p.as_dvec3() * scale + mesh.center()) + (model.translate - eye);
        let placed = digits(&[model.translate, linear * mesh.center(), linear * DVec3::splat(scale), eye]);
        let turn_normal = |n: Vec3| linear.inverse().transpose() * n.as_dvec3();
        let mut triangles: Vec<u32> = mesh.triangles().collect();
        triangles.sort_unstable_by_key(|&i| mesh.source(i));
        for i in triangles {
            let smooth = model.normals == NormalMode::Smooth;
            let normals = mesh.corner_normals(i).filter(|_| smooth).map(|n| n.map(turn_normal));
            let corners = mesh.corners(i).map(place);
            let mut skin = Skin::new(mesh.corner_uvs(i));
            skin.uvs = skin.uvs.map(|uv| uv + mesh.whole_repeats(i).as_dvec2());
            if let Some(colors) = mesh.corner_colors(i) {
                skin.colors = colors.map(|color| DVec3::from_array(color.map(srgb::decode)));
            }
            let mirrored = linear.determinant() < 0.0;
            skin.mirrored = mirrored;
            let shape = Shape::Triangle { corners, normals, skin };
            let error = mesh_error(mesh.corners(i), linear * scale, corners) + placed;
            let material = model.materials[mesh.slot(i) as usize];
            let name = Name::Model { model: index, triangle: i };
            primitives.push(Primitive { shape, material, name, error, mirrored });
        }
    }
    for (index, sphere) in scene.spheres.iter().enumerate() {
        let shape = Shape::Sphere {
            center: sphere.center - eye,
            radius: sphere.radius,
            inside_out: sphere.inside_out,
            chart: Chart::sphere(rotation(sphere.uv_rotate.to_array())),
        };
        let name = Name::Sphere(index);
        primitives.push(Primitive { shape, material: sphere.material, name, error: 0.0, mirrored: false });
    }
    for (index, triangle) in scene.triangles.iter().enumerate() {
        let corners = triangle.vertices.map(|v| v - eye);
        let shape = Shape::Triangle { corners, normals: None, skin: Skin::new(triangle.uvs) };
        let error = digits(&triangle.vertices) + digits(&corners);
        let name = Name::Triangle(index);
        primitives.push(Primitive { shape, material: triangle.material, name, error, mirrored: false });
    }
    for (index, disk) in scene.disks.iter().enumerate() {
        let (center, radius) = (disk.center - eye, disk.radius);
        let shape = Shape::Disk { center, normal: disk.normal.normalize(), radius };
        let error = digits(&[disk.center, center]);
        let name = Name::Disk(index);
        primitives.push(Primitive { shape, material: disk.material, name, error, mirrored: false });
    }
    for (index, plane) in scene.planes.iter().enumerate() {
        let normal = plane.normal.normalize();
        let chart = Chart::plane(normal, plane.size);
        let shape = Shape::Plane { point: plane.point - eye, normal, chart };
        let error = digits(&[plane.point, plane.point - eye]);
        let name = Name::Plane(index);
        primitives.push(Primitive { shape, material: plane.material, name, error, mirrored: false });
    }
    primitives
}

impl Oracle {
    /// A point of a surface, relative to the camera, in the space of its object: the coordinates of a model's file; else world
    /// units from the centre of a sphere or a disk, from the point of a plane, from the first corner of a triangle.
    pub(super) fn in_object(&self, name: Name, point: DVec3) -> DVec3 {
        let in_world = self.view.camera.position + point;
        match name {
            Name::Model { model, .. } => {
                let model = &self.scene.models[model];
                linear(model, self.view.spin).inverse() * (in_world - model.translate)
            }
            Name::Sphere(index) => in_world - self.scene.spheres[index].center,
            Name::Triangle(index) => in_world - self.scene.triangles[index].vertices[0],
            Name::Disk(index) => in_world - self.scene.disks[index].center,
            Name::Plane(index) => in_world - self.scene.planes[index].point,
        }
    }

    /// The unit normal of a primitive's winding in the space of its object, from that in world space.
    pub(super) fn normal_in_object(&self, primitive: usize, in_world: DVec3) -> DVec3 {
        let Primitive { shape, name, .. } = &self.primitives[primitive];
        match (shape, name) {
            (Shape::Triangle { corners, .. }, Name::Model { .. }) => {
                let [a, b, c] = corners.map(|corner| self.in_object(*name, corner));
                (b - a).cross(c - a).normalize_or_zero()
            }
            _ => in_world,
        }
    }
}

/// Linear part of a model's transform to the world, with a spin in degrees about +Y.
pub(super) fn linear(model: &Model, spin: f64) -> DMat3 {
    let own = rotation(model.rotate.to_array()) * DMat3::from_diagonal(model.scale);
    rotation([0.0, spin, 0.0]) * model.group * own
}

/// Rounding error of points.
fn digits(points: &[DVec3]) -> f64 {
    F64_ERROR * points.iter().map(|point| point.abs().max_element()).sum::<f64>()
}

/// Error bound of a triangle across itself, whose corners are rounded to `f32` on three axes of its mesh; `linear` maps these
/// to the world.
fn mesh_error(corners: [Vec3; 3], linear: DMat3, [a, b, c]: [DVec3; 3]) -> f64 {
    let largest = corners.iter().map(|corner| corner.abs().max_element()).fold(0.0, f32::max);
    let step = (f64::from(largest) * HALF_STEP).min(HALF_STEP / 2.0);
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let across = linear.transpose() * normal;
    step * across.abs().element_sum()
}

/// Rotation about x, then y, then z, in degrees.
fn rotation(degrees: [f64; 3]) -> DMat3 {
    let [(sx, cx), (sy, cy), (sz, cz)] =
        degrees.map(|d| (libm::sin(d.to_radians()), libm::cos(d.to_radians())));
    let x = DMat3::from_cols(DVec3::X, DVec3::new(0.0, cx, sx), DVec3::new(0.0, -sx, cx));
    let y = DMat3::from_cols(DVec3::new(cy, 0.0, -sy), DVec3::Y, DVec3::new(sy, 0.0, cy));
    let z = DMat3::from_cols(DVec3::new(cz, sz, 0.0), DVec3::new(-sz, cz, 0.0), DVec3::Z);
    z * y * x
}
