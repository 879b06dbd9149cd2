//! Surface points: what a ray hits, with its normals on the side of the ray.

use glam::{DVec2, DVec3};

use super::Oracle;
use super::camera::Ray;

/// A point of a surface that a ray hits.
pub(super) struct SurfacePoint {
    /// Index of its primitive.
    pub primitive: usize,
    pub position: DVec3,
    /// Unit direction of the ray.
    pub direction: DVec3,
    /// Length of the ray.
    pub way: f64,
    /// Length of the way before the ray: see [`Ray::before`].
    pub before: f64,
    /// Place of the ray's sample: see [`Ray::place`].
    pub place: usize,
    /// Geometric unit normal on the side of the ray.
    pub ng: DVec3,
    /// Shading unit normal on the same side.
    pub ns: DVec3,
    /// The shading normal without a normal map.
    pub untilted: DVec3,
    /// Geometric unit normal by the winding of a triangle, outwards of a sphere, or that of a plane or disk.
    pub winding_normal: DVec3,
    /// Whether the ray hits the front side.
    pub front: bool,
    /// Index of its material in the scene.
    pub material_index: u32,
    /// Texture coordinates.
    pub uv: DVec2,
    /// Derivatives of the point by u and by v.
    pub tangents: [DVec3; 2],
    /// Interpolated vertex colour.
    pub vertex_color: DVec3,
    /// Distance from the point within which other surfaces coincide with this one; 0 if there are none.
    pub coincidence: f64,
}

impl Oracle {
    /// The point that a ray hits.
    pub(super) fn surface(&self, ray: Ray, starts_on: Option<usize>) -> Option<SurfacePoint> {
        let Ray { origin, direction, place, before } = ray;
        let found = self.closest(origin, direction, f64::INFINITY, starts_on)?;
        let primitive = &self.primitives[found.primitive];
        let hit = &found.crossing;
        let position = origin + direction * hit.t;
        let behind = hit.normal.dot(direction) > 0.0;
        let ng = if behind { -hit.normal } else { hit.normal };
        let ns = if hit.shading_normal.dot(ng) < 0.0 { -hit.shading_normal } else { hit.shading_normal };
        let surface = SurfacePoint {
            primitive: found.primitive,
            position,
            direction,
            way: hit.t,
            before,
            place,
            ng,
            ns,
            untilted: ns,
            winding_normal: hit.normal,
            front: behind == hit.mirrored,
            material_index: primitive.material,
            uv: hit.uv,
            tangents: hit.tangents,
            vertex_color: hit.color,
            coincidence: found.coincidence,
        };
        Some(SurfacePoint { ns: self.mapped_normal(&surface), ..surface })
    }
}

impl SurfacePoint {
    /// Origin of rays that leave the point: where surfaces coincide, on the side of the ray, so that transmitted rays cross all of
    /// them, and reflected ones none.
    pub(super) fn clear_origin(&self) -> DVec3 {
        self.position + self.ng * (2.0 * self.coincidence)
    }

    /// Origin of the refracted ray of a path. A ray that started before coincident surfaces has crossed one of them and meets the other
    /// one here: behind it, the first is not crossed again. `near` is a distance that only such rays end within.
    pub(super) fn refraction_origin(&self, near: f64) -> DVec3 {
        let is_second = self.coincidence == 0.0 && self.way * self.ng.dot(self.direction).abs() <= near;
        if is_second { self.position - self.ng * near } else { self.clear_origin() }
    }
}
