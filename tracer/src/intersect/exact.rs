//! Exact intersection of one ray with one primitive, in `f64`.

use glam::{DVec3, Vec3};

use crate::compile::Item;
use crate::frame::{EyeTriangle, PreparedFrame};
use crate::rays::{PrimitiveId, Ray};
use crate::shape::ShearedRay;
use crate::simd::three;

/// The hit of one ray with one primitive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    /// Distance, in lengths of the ray's direction.
    pub t: f64,
    pub primitive: PrimitiveId,
}

impl Hit {
    /// Whether this hit is before another one of the same ray: at equal distances the lowest rank decides.
    pub(crate) fn wins_over(&self, other: &Hit, frame: &PreparedFrame) -> bool {
        self.t < other.t || (self.t == other.t && frame.rank(self.primitive) < frame.rank(other.primitive))
    }
}

impl PreparedFrame {
    /// The hit of a ray with one primitive. `starts_on` is the primitive that the ray starts on.
    pub(crate) fn hit_of(
        &self,
        ray: &Ray,
        primitive: PrimitiveId,
        starts_on: Option<PrimitiveId>,
    ) -> Option<Hit> {
        Some(Hit { t: self.t_of(ray, primitive, starts_on)?, primitive })
    }

    /// Order of primitives in the scene: item, then the position of the triangle in the mesh's source.
    pub(super) fn rank(&self, PrimitiveId { item, triangle }: PrimitiveId) -> (u32, u32) {
        let position = match self.items.get(item) {
            Item::Model(index) => self.instances[index].mesh.source(triangle),
            Item::Sphere(_) | Item::Triangle(_) | Item::Disk(_) => 0,
        };
        (item, position)
    }

    /// Unit normal on the front of a primitive at one of its points; zero on a triangle without an area.
    pub(crate) fn front_normal(&self, primitive: PrimitiveId, point: DVec3) -> DVec3 {
        let PrimitiveId { item, triangle } = primitive;
        if item >= self.items.first_plane() {
            return self.planes[(item - self.items.first_plane()) as usize].normal;
        }
        match self.items.get(item) {
            Item::Sphere(index) => {
                let outward = self.spheres[index].normal(point);
                if self.scene().spheres[index].inside_out { -outward } else { outward }
            }
            Item::Triangle(index) => self.triangles[index].normal,
            Item::Disk(index) => self.disks[index].plane.normal,
            Item::Model(index) => {
                let instance = &self.instances[index];
                let [a, b, c] = instance.mesh.corners(triangle).map(Vec3::as_dvec3);
                // Scaled first: the cross product of a tiny triangle may underflow. The map of normals keeps the front of mirrored meshes.
                (instance.normals * (b - a).cross(c - a).normalize_or_zero()).normalize_or_zero()
            }
        }
    }

    /// Whether the shading normals of a primitive are its geometric ones, apart from normal maps.
    pub(crate) fn is_flat(&self, PrimitiveId { item, .. }: PrimitiveId) -> bool {
        item >= self.items.first_plane()
            || !matches!(self.items.get(item), Item::Model(index) if self.instances[index].smooth)
    }

    /// Whether all points of a primitive are in one plane.
    pub(crate) fn is_planar(&self, PrimitiveId { item, .. }: PrimitiveId) -> bool {
        item >= self.items.first_plane() || !matches!(self.items.get(item), Item::Sphere(_))
    }

    /// Distance of the hit of a ray with one primitive. Of the primitive that the ray starts on only the far side counts,
    /// if it has one.
    pub(crate) fn t_of(
        &self,
        ray: &Ray,
        primitive: PrimitiveId,
        starts_on: Option<PrimitiveId>,
    ) -> Option<f64> {
        let PrimitiveId { item, triangle } = primitive;
        let own = starts_on == Some(primitive);
        if item >= self.items.first_plane() {
            let plane = &self.planes[(item - self.items.first_plane()) as usize];
            return plane.intersect(ray.origin, ray.direction).filter(|_| !own);
        }
        match self.items.get(item) {
            Item::Sphere(index) => self.spheres[index].intersect(ray.origin, ray.direction, own),
            Item::Model(_) | Item::Triangle(_) | Item::Disk(_) if own => None,
            Item::Disk(index) => self.disks[index].intersect(ray.origin, ray.direction),
            Item::Triangle(index) => {
                let EyeTriangle { corners, cut, .. } = &self.triangles[index];
                let t = ShearedRay::new(ray.origin, ray.direction).intersect(corners)?;
                (!cut || self.is_opaque(primitive, ray, corners, t)).then_some(t)
            }
            Item::Model(index) => {
                let instance = &self.instances[index];
                let local = instance.to_mesh(ray);
                let corners = instance.mesh.corners(triangle);
                let corners = three!(k => corners[k].as_dvec3());
                let t = ShearedRay::new(local.origin, local.direction).intersect(&corners)?;
                let solid = instance.cutouts.is_empty() || self.is_opaque(primitive, &local, &corners, t);
                solid.then_some(t)
            }
        }
    }
}
