//! Affine maps, and the objects of a file in them.

use glam::{DMat3, DVec3};

use super::{Objects, Target};
use crate::rotation;
use crate::scene::data::{Disk, Sphere, Triangle};
use crate::scene::toml::material::Materials;
use crate::scene::toml::objects::ModelText;
use crate::scene::validate::MAX_COORDINATE;

/// Largest relative difference between scales that count as equal: matrices are written with six digits.
const TOLERANCE: f64 = 1e-5;

/// Message about an object that is placed out of range.
const TOO_FAR: &str = "its groups place it beyond 1e30";

/// An affine map: p becomes `linear` p + `translate`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    pub(super) linear: DMat3,
    pub(super) translate: DVec3,
}

impl Default for Placement {
    fn default() -> Self {
        Self { linear: DMat3::IDENTITY, translate: DVec3::ZERO }
    }
}

impl Placement {
    fn point(&self, point: DVec3) -> DVec3 {
        self.linear * point + self.translate
    }

    /// This map after another one.
    pub(super) fn of(&self, inner: &Self) -> Self {
        Self { linear: self.linear * inner.linear, translate: self.point(inner.translate) }
    }

    /// Whether it can be inverted, and its numbers are in range.
    pub(super) fn is_usable(&self) -> bool {
        let Self { linear, translate } = self;
        let determinant = linear.determinant();
        let in_range = [linear.x_axis, linear.y_axis, linear.z_axis, *translate].into_iter().all(in_range);
        in_range && determinant != 0.0 && determinant.is_finite() && linear.inverse().is_finite()
    }

    fn is_mirrored(&self) -> bool {
        self.linear.determinant() < 0.0
    }

    /// The factor of all lengths; `None` if it depends on the direction.
    fn uniform_scale(&self) -> Option<f64> {
        let DMat3 { x_axis, y_axis, z_axis } = self.linear;
        let scale = libm::cbrt(self.linear.determinant().abs());
        let square = scale * scale;
        let equal = |axis: DVec3| (axis.length_squared() - square).abs() <= 2.0 * TOLERANCE * square;
        let across = |a: DVec3, b: DVec3| a.dot(b).abs() <= 2.0 * TOLERANCE * square;
        let is_uniform = [x_axis, y_axis, z_axis].into_iter().all(equal)
            && across(x_axis, y_axis)
            && across(y_axis, z_axis)
            && across(z_axis, x_axis);
        is_uniform.then_some(scale)
    }
}

fn in_range(point: DVec3) -> bool {
    point.to_array().iter().all(|c| c.abs() <= MAX_COORDINATE)
}

impl Objects {
    /// Places an object. The error is the reason why it cannot be placed.
    pub(super) fn place_object(
        &mut self,
        target: Target,
        placement: &Placement,
        materials: &Materials,
    ) -> Result<(), String> {
        match target {
            Target::Model(index) => {
                let Some(model) = self.models.get_mut(index) else { return Ok(()) };
                (model.group, model.translate) = (placement.linear, placement.point(model.translate));
                place_closing(model, placement)?;
                if in_range(model.translate) { Ok(()) } else { Err(TOO_FAR.into()) }
            }
            Target::Sphere(index) => {
                if let Some(center) = self.closing.get_mut(&index) {
                    *center = placement.point(*center);
                    if !in_range(*center) {
                        return Err(TOO_FAR.into());
                    }
                }
                let sphere = self.spheres.get_mut(index);
                sphere.map_or(Ok(()), |sphere| place_sphere(sphere, placement, materials))
            }
            Target::Disk(index) => {
                self.disks.get_mut(index).map_or(Ok(()), |disk| place_disk(disk, placement))
            }
            Target::Triangles(range) => {
                let triangles = self.triangles.get_mut(range).unwrap_or_default();
                triangles.iter_mut().try_for_each(|triangle| place_triangle(triangle, placement))
            }
            // Groups are placed with what is in them.
            Target::Group(_) => Ok(()),
        }
    }
}

/// Places a model as it is when the shutter closes.
fn place_closing(model: &mut ModelText, placement: &Placement) -> Result<(), String> {
    let Some([translate, rotate]) = &mut model.closing else { return Ok(()) };
    *translate = placement.point(*translate);
    if *rotate != model.rotate && placement.uniform_scale().is_none() {
        return Err(
            "its groups scale this model, which rotates, by different factors along its axes: scale the model instead"
                .into(),
        );
    }
    if in_range(*translate) { Ok(()) } else { Err(TOO_FAR.into()) }
}

fn place_sphere(sphere: &mut Sphere, placement: &Placement, materials: &Materials) -> Result<(), String> {
    let scale = placement.uniform_scale().ok_or(
        "its groups scale this sphere by different factors along its axes: a sphere needs one factor for all; \
         write it as a model",
    )?;
    let mirrored = placement.is_mirrored();
    if mirrored && materials.needs_uvs(sphere.material) {
        return Err("its groups mirror this sphere, which has a texture: turn it instead".into());
    }
    sphere.center = placement.point(sphere.center);
    sphere.radius *= scale;
    if !mirrored && placement.linear != DMat3::IDENTITY {
        sphere.uv_rotate =
            degrees_of(placement.linear * (1.0 / scale) * rotation::of_model(sphere.uv_rotate));
    }
    let fits = in_range(sphere.center) && sphere.radius > 0.0 && sphere.radius <= MAX_COORDINATE;
    if fits { Ok(()) } else { Err(TOO_FAR.into()) }
}

/// The degrees of a rotation about x, then y, then z: the inverse of [`rotation::of_model`].
fn degrees_of(turn: DMat3) -> DVec3 {
    let DMat3 { x_axis, y_axis, z_axis } = turn;
    let cos_y = x_axis.truncate().length();
    let y = libm::atan2(-x_axis.z, cos_y);
    // With y at a right angle x and z turn about one axis: all of it counts as x.
    let (x, z) = if cos_y > 1e-12 {
        (libm::atan2(y_axis.z, z_axis.z), libm::atan2(x_axis.y, x_axis.x))
    } else {
        (libm::atan2(-z_axis.y, y_axis.y), 0.0)
    };
    DVec3::new(x, y, z) * (180.0 / std::f64::consts::PI)
}

fn place_disk(disk: &mut Disk, placement: &Placement) -> Result<(), String> {
    let u = disk.normal.any_orthonormal_vector();
    let v = disk.normal.cross(u);
    let (across_u, across_v) = (placement.linear * u, placement.linear * v);
    let square = across_u.length() * across_v.length();
    let equal = (across_u.length_squared() - square).abs() <= 2.0 * TOLERANCE * square;
    if !equal || across_u.dot(across_v).abs() > 2.0 * TOLERANCE * square {
        return Err("its groups make an ellipse of this disk: it needs one factor along all of it".into());
    }
    // Normals are mapped by the inverse transpose, so the front remains the front in a mirrored group.
    let normal = across_u.cross(across_v).normalize_or_zero();
    disk.normal = if placement.is_mirrored() { -normal } else { normal };
    disk.center = placement.point(disk.center);
    disk.radius *= square.sqrt();
    let fits = in_range(disk.center) && disk.radius > 0.0 && disk.radius <= MAX_COORDINATE;
    if fits && disk.normal != DVec3::ZERO { Ok(()) } else { Err(TOO_FAR.into()) }
}

/// In a mirrored group two corners are swapped, so that the front remains the front.
fn place_triangle(triangle: &mut Triangle, placement: &Placement) -> Result<(), String> {
    triangle.vertices = triangle.vertices.map(|vertex| placement.point(vertex));
    if placement.is_mirrored() {
        triangle.vertices.swap(1, 2);
        if let Some(uvs) = &mut triangle.uvs {
            uvs.swap(1, 2);
        }
    }
    if triangle.vertices.into_iter().all(in_range) { Ok(()) } else { Err(TOO_FAR.into()) }
}

#[cfg(test)]
mod tests;
