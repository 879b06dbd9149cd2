//! Primitives of the scene in eye space, and the unit of that space.

use glam::DVec3;

use super::instance::ToEye;
use super::motion::Sweep;
use super::rounding::{mesh_rounding, placement_rounding};
use super::{EyeTriangle, Instance};
use crate::compile::CompiledScene;
use crate::scene::{Camera, Scene};
use crate::shape::{EyeDisk, EyePlane, EyeSphere};

/// World units per eye unit: the power of two next to the distance from the camera to the far end of all finite primitives.
/// Scaling the world by a power of two scales the unit by the same factor.
pub(super) fn unit_of(scene: &CompiledScene, camera: &Camera, sweeps: &[Sweep]) -> f64 {
    let swept = sweeps.iter().map(|sweep| sweep.bounds);
    let reach = match scene.bounds().into_iter().chain(swept).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) {
        Some((lo, hi)) => (lo - camera.position).abs().max((hi - camera.position).abs()).max_element(),
        None => (camera.look_at - camera.position).length(),
    };
    if !(reach > 0.0 && reach.is_finite()) {
        return 1.0;
    }
    let (_, exponent) = libm::frexp(reach);
    libm::exp2(f64::from(exponent))
}

pub(super) fn spheres(scene: &Scene, to_eye: &ToEye) -> Vec<EyeSphere> {
    let place = |sphere: &crate::scene::Sphere| EyeSphere {
        center: to_eye.point(sphere.center),
        radius: sphere.radius / to_eye.unit,
    };
    scene.spheres.iter().map(place).collect()
}

pub(super) fn triangles(scene: &Scene, to_eye: &ToEye) -> Vec<EyeTriangle> {
    let place = |triangle: &crate::scene::Triangle| {
        let corners @ [a, b, c] = triangle.vertices.map(|vertex| to_eye.point(vertex));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let cut = triangle.uvs.is_some() && scene.materials[triangle.material as usize].cutout.is_some();
        let error = placement_rounding(&triangle.vertices, &corners, to_eye.unit);
        EyeTriangle { corners, normal, error, cut }
    };
    scene.triangles.iter().map(place).collect()
}

pub(super) fn planes(scene: &Scene, to_eye: &ToEye) -> Vec<EyePlane> {
    scene.planes.iter().map(|plane| plane_through(plane.point, plane.normal, to_eye)).collect()
}

pub(super) fn disks(scene: &Scene, to_eye: &ToEye) -> Vec<EyeDisk> {
    let place = |disk: &crate::scene::Disk| EyeDisk {
        center: to_eye.point(disk.center),
        radius: disk.radius / to_eye.unit,
        plane: plane_through(disk.center, disk.normal, to_eye),
    };
    scene.disks.iter().map(place).collect()
}

fn plane_through(point: DVec3, normal: DVec3, to_eye: &ToEye) -> EyePlane {
    let (normal, placed) = (normal.normalize_or_zero(), to_eye.point(point));
    let error = placement_rounding(&[point], &[placed], to_eye.unit);
    EyePlane { normal, offset: normal.dot(placed), error }
}

/// The largest error bound of any surface.
pub(super) fn coarsest<'a>(
    instances: &[Instance],
    triangles: &[EyeTriangle],
    planes: impl Iterator<Item = &'a EyePlane>,
) -> f64 {
    let of_instances = instances.iter().map(|instance| mesh_rounding(&instance.linear) + instance.error);
    let of_triangles = triangles.iter().map(|triangle| triangle.error);
    let of_planes = planes.map(|plane| plane.error);
    of_instances.chain(of_triangles).chain(of_planes).fold(0.0, f64::max)
}
