//! Exact places of hits, ray by ray in `f64`: the point in the space of the world, of its object and of textures.
//!
//! Texture coordinates of a sphere are those of a panorama at the outward unit normal, in the frame that its rotation turns:
//! u = 1/2 + atan2(x, -z) / 2 pi, v = 1 - acos(y) / pi, so that v grows upwards. Those of a plane with normal n are along
//! u = Y x n / |Y x n|, or +X where |n.y| > 0.999, and v = n x u, from the plane's point, in units of its size. Disks have none.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec2, DVec3, Vec2};

use crate::compile::Item;
use crate::frame::PreparedFrame;
use crate::rays::{PrimitiveId, SurfaceSource};
use crate::scene::rotation;

/// Normals with a larger |y| have the texture axis +X.
const UPRIGHT: f64 = 0.999;

/// The place of a hit.
pub(super) struct Place<'a> {
    frame: &'a PreparedFrame,
    on: Primitive,
    /// In eye space.
    pub point: DVec3,
    /// Unit direction of the ray.
    pub direction: DVec3,
    /// From the ray's origin, in eye units.
    pub distance: f64,
}

/// The primitive that a point is on; corners and the point are in the space of the mesh, or in eye space.
enum Primitive {
    Plane(usize),
    Sphere(usize),
    Disk(usize),
    Triangle { index: usize, corners: [DVec3; 3] },
    Model { index: usize, triangle: u32, corners: [DVec3; 3], at: DVec3 },
}

impl<'a> Place<'a> {
    /// The place where a ray hits a primitive; `None` if it does not.
    pub(super) fn of<R: SurfaceSource>(
        rays: &'a R,
        block: usize,
        lane: usize,
        primitive: PrimitiveId,
    ) -> Option<Self> {
        let (frame, ray) = (rays.frame(), rays.ray(block, lane));
        let t = frame.t_of(&ray, primitive, rays.starts_on(block, lane))?;
        let PrimitiveId { item, triangle } = primitive;
        let first_plane = frame.items.first_plane();
        let on = if item >= first_plane {
            Primitive::Plane((item - first_plane) as usize)
        } else {
            match frame.items.get(item) {
                Item::Sphere(index) => Primitive::Sphere(index),
                Item::Disk(index) => Primitive::Disk(index),
                Item::Triangle(index) => {
                    Primitive::Triangle { index, corners: frame.triangles[index].corners }
                }
                Item::Model(index) => {
                    let instance = &frame.instances[index];
                    let local = instance.to_mesh(&ray);
                    let corners = instance.mesh.corners(triangle).map(|corner| corner.as_dvec3());
                    let at = local.origin + local.direction * t;
                    Primitive::Model { index, triangle, corners, at }
                }
            }
        };
        let length = ray.direction.length();
        let (point, direction) = (ray.origin + ray.direction * t, ray.direction / length);
        Some(Self { frame, on, point, direction, distance: t * length })
    }

    /// The point in world space, in world units.
    pub(super) fn in_world(&self) -> DVec3 {
        self.point / self.frame.per_unit + self.frame.view().camera.position
    }

    /// The point relative to the origin of its object: for a model in the coordinates of its file, else in world units along the
    /// world's axes from the centre of a sphere or a disk, the point of a plane or the first corner of a triangle.
    pub(super) fn in_object(&self) -> DVec3 {
        let relative = |origin: DVec3| {
            (self.point - (origin - self.frame.view().camera.position) * self.frame.per_unit)
                / self.frame.per_unit
        };
        let scene = self.frame.scene();
        match &self.on {
            Primitive::Plane(index) => relative(scene.planes[*index].point),
            Primitive::Sphere(index) => relative(scene.spheres[*index].center),
            Primitive::Disk(index) => relative(scene.disks[*index].center),
            Primitive::Triangle { index, .. } => relative(scene.triangles[*index].vertices[0]),
            Primitive::Model { index, at, .. } => {
                let mesh = &self.frame.instances[*index].mesh;
                *at * libm::exp2(f64::from(mesh.exponent())) + mesh.center()
            }
        }
    }

    /// The unit normal in eye space: outwards of a sphere, that of a plane or a disk, of a triangle on the side from which its
    /// corners are in counter-clockwise order.
    pub(super) fn normal(&self) -> DVec3 {
        match &self.on {
            Primitive::Plane(index) => self.frame.planes[*index].normal,
            Primitive::Sphere(index) => self.frame.spheres[*index].normal(self.point),
            Primitive::Disk(index) => self.frame.disks[*index].plane.normal,
            Primitive::Triangle { corners, .. } => normal_of(corners),
            Primitive::Model { index, corners, .. } => {
                let linear = self.frame.instances[*index].linear;
                let [a, b, c] = *corners;
                (linear * (b - a)).cross(linear * (c - a)).normalize_or_zero()
            }
        }
    }

    /// [`Place::normal`] in the space of [`Place::in_object`].
    pub(super) fn normal_in_object(&self) -> DVec3 {
        match &self.on {
            Primitive::Model { corners, .. } => normal_of(corners),
            _ => self.normal(),
        }
    }

    /// Whether the ray comes to the front: to the side of the normal, but for mirrored models and spheres that are turned inside out.
    pub(super) fn is_front(&self) -> bool {
        let inverted = match &self.on {
            Primitive::Model { index, .. } => self.frame.instances[*index].linear.determinant() < 0.0,
            Primitive::Sphere(index) => self.frame.scene().spheres[*index].inside_out,
            _ => false,
        };
        (self.normal().dot(self.direction) < 0.0) != inverted
    }

    /// Texture coordinates, with their whole repeats; `None` without any.
    pub(super) fn uv(&self) -> Option<DVec2> {
        match &self.on {
            Primitive::Disk(_) => None,
            Primitive::Sphere(index) => {
                let turned = self.sphere_frame(*index).transpose() * self.normal();
                let u = 0.5 + libm::atan2(turned.x, -turned.z) / TAU;
                Some(DVec2::new(u, 1.0 - libm::acos(turned.y.clamp(-1.0, 1.0)) / PI))
            }
            Primitive::Plane(index) => {
                let plane = &self.frame.scene().planes[*index];
                let [u, v] = plane_axes(plane.normal);
                let from_point = self.in_object();
                Some(DVec2::new(from_point.dot(u), from_point.dot(v)) / plane.size)
            }
            Primitive::Triangle { corners, .. } => Some(self.interpolated(corners, self.point)?),
            Primitive::Model { corners, at, .. } => Some(self.interpolated(corners, *at)?),
        }
    }

    /// Steps on the surface, in eye space, along which u and v grow by one while the other stays; `None` where they do not exist.
    pub(super) fn uv_steps(&self) -> Option<[DVec3; 2]> {
        let steps = match &self.on {
            Primitive::Disk(_) => return None,
            Primitive::Sphere(index) => {
                let (radius, turn) = (self.frame.spheres[*index].radius, self.sphere_frame(*index));
                let at = turn.transpose() * self.normal();
                let north = (DVec3::Y - at * at.y).normalize_or_zero();
                [turn * DVec3::new(-at.z, 0.0, at.x) * (TAU * radius), turn * north * (PI * radius)]
            }
            Primitive::Plane(index) => {
                let plane = &self.frame.scene().planes[*index];
                plane_axes(plane.normal).map(|axis| axis * (plane.size * self.frame.per_unit))
            }
            Primitive::Triangle { corners, .. } => triangle_steps(corners, &self.corner_uvs()?)?,
            Primitive::Model { index, corners, .. } => {
                let linear = self.frame.instances[*index].linear;
                triangle_steps(corners, &self.corner_uvs()?)?.map(|step| linear * step)
            }
        };
        let usable = |step: &DVec3| step.is_finite() && *step != DVec3::ZERO;
        steps.iter().all(usable).then_some(steps)
    }

    /// The rotation of a sphere's texture coordinates.
    fn sphere_frame(&self, index: usize) -> DMat3 {
        rotation::of_model(self.frame.scene().spheres[index].uv_rotate)
    }

    /// Texture coordinates at the corners, without whole repeats.
    fn corner_uvs(&self) -> Option<[DVec2; 3]> {
        let uvs = match &self.on {
            Primitive::Triangle { index, .. } => self.frame.scene().triangles[*index].uvs,
            Primitive::Model { index, triangle, .. } => {
                self.frame.instances[*index].mesh.corner_uvs(*triangle)
            }
            _ => None,
        };
        Some(uvs?.map(Vec2::as_dvec2))
    }

    fn interpolated(&self, &[a, b, c]: &[DVec3; 3], point: DVec3) -> Option<DVec2> {
        let uvs = self.corner_uvs()?;
        let repeats = match &self.on {
            Primitive::Model { index, triangle, .. } => {
                self.frame.instances[*index].mesh.whole_repeats(*triangle).as_dvec2()
            }
            _ => DVec2::ZERO,
        };
        let (ab, ac, at) = (b - a, c - a, point - a);
        let full = ab.cross(ac);
        let whole = full.dot(full);
        let second = (at.cross(ac).dot(full) / whole).clamp(0.0, 1.0);
        let third = (ab.cross(at).dot(full) / whole).clamp(0.0, 1.0 - second);
        Some(uvs[0] * (1.0 - second - third) + uvs[1] * second + uvs[2] * third + repeats)
    }
}

fn normal_of(&[a, b, c]: &[DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

/// Axes of u and v of a plane.
pub(super) fn plane_axes(normal: DVec3) -> [DVec3; 2] {
    let u = if normal.y.abs() > UPRIGHT { DVec3::X } else { DVec3::Y.cross(normal).normalize_or(DVec3::X) };
    [u, normal.cross(u)]
}

/// dp/du and dp/dv of a triangle: the edges are the uv differences times these.
fn triangle_steps(&[a, b, c]: &[DVec3; 3], uvs: &[DVec2; 3]) -> Option<[DVec3; 2]> {
    let (ab, ac) = (b - a, c - a);
    let (to_b, to_c) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
    let area = to_b.perp_dot(to_c);
    (area != 0.0).then(|| [(ab * to_c.y - ac * to_b.y) / area, (ac * to_b.x - ab * to_c.x) / area])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn planes_have_right_handed_axes() {
        for normal in [DVec3::X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::new(0.6, 0.0, -0.8)] {
            let [u, v] = plane_axes(normal);
            assert!((u.cross(v) - normal).length() < 1e-15, "{normal}");
        }
        // A wall seen from the front: u to the right, v upwards.
        assert_eq!(plane_axes(DVec3::Z), [DVec3::X, DVec3::Y]);
        // A floor: v away from a camera that looks down -Z.
        assert_eq!(plane_axes(DVec3::Y), [DVec3::X, DVec3::NEG_Z]);
    }

    proptest! {
        #[test]
        fn steps_of_a_triangle_lead_from_corner_to_corner(
            corners in prop::array::uniform9(-1.0..1.0_f64), uvs in prop::array::uniform6(-1.0..1.0_f64),
        ) {
            let [ax, ay, az, bx, by, bz, cx, cy, cz] = corners;
            let corners = [DVec3::new(ax, ay, az), DVec3::new(bx, by, bz), DVec3::new(cx, cy, cz)];
            let uvs = [DVec2::new(uvs[0], uvs[1]), DVec2::new(uvs[2], uvs[3]), DVec2::new(uvs[4], uvs[5])];
            prop_assume!((uvs[1] - uvs[0]).perp_dot(uvs[2] - uvs[0]).abs() > 1e-2);
            let [along_u, along_v] = triangle_steps(&corners, &uvs).unwrap();
            for k in 1..3 {
                let by = uvs[k] - uvs[0];
                let reached = corners[0] + along_u * by.x + along_v * by.y;
                prop_assert!((reached - corners[k]).length() < 1e-10);
            }
        }
    }
}
