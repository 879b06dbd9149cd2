//! Attributes of points on shapes: texture coordinates with their derivatives, vertex colours.

use std::f64::consts::PI;

use glam::{DMat3, DVec2, DVec3, Vec2};

/// Attributes of the corners of a triangle, besides normals.
#[derive(Clone, Copy)]
pub(super) struct Skin {
    /// Texture coordinates; zero if there are none.
    pub uvs: [DVec2; 3],
    /// Linear RGB; white if there are none.
    pub colors: [DVec3; 3],
    /// Whether the instance is mirrored: the front is then opposite to (b - a) x (c - a).
    pub mirrored: bool,
}

impl Skin {
    pub(super) fn new(uvs: Option<[Vec2; 3]>) -> Self {
        let uvs = uvs.unwrap_or_default().map(Vec2::as_dvec2);
        Self { uvs, colors: [DVec3::ONE; 3], mirrored: false }
    }

    /// Texture coordinates at a + u (b - a) + v (c - a).
    pub(super) fn uv_at(&self, u: f64, v: f64) -> DVec2 {
        let [a, b, c] = self.uvs;
        a + (b - a) * u + (c - a) * v
    }

    pub(super) fn color_at(&self, u: f64, v: f64) -> DVec3 {
        let [a, b, c] = self.colors;
        a + (b - a) * u + (c - a) * v
    }

    /// Derivatives of the point by the texture coordinates, from the edges b - a and c - a; zero where the coordinates do not span
    /// an area.
    pub(super) fn tangents(&self, ab: DVec3, ac: DVec3) -> [DVec3; 2] {
        let [a, b, c] = self.uvs;
        let (d, e) = (b - a, c - a);
        let determinant = d.perp_dot(e);
        if determinant == 0.0 {
            return [DVec3::ZERO; 2];
        }
        [(ab * e.y - ac * d.y) / determinant, (ac * d.x - ab * e.x) / determinant]
    }
}

/// Texture coordinates of a shape without corners: its axes in world space.
#[derive(Clone, Copy)]
pub(super) struct Chart {
    axes: DMat3,
    /// World units per repeat, of a plane.
    size: f64,
}

impl Chart {
    /// A sphere whose coordinates are rotated.
    pub(super) fn sphere(rotation: DMat3) -> Self {
        Self { axes: rotation, size: 1.0 }
    }

    /// A plane: u and v along two axes that depend on its unit normal.
    pub(super) fn plane(normal: DVec3, size: f64) -> Self {
        let u = if normal.y.abs() > 0.999 { DVec3::X } else { DVec3::Y.cross(normal).normalize() };
        Self { axes: DMat3::from_cols(u, normal.cross(u), normal), size }
    }

    /// Coordinates of a point relative to the origin of the plane.
    pub(super) fn of_plane(&self, from_origin: DVec3) -> (DVec2, [DVec3; 2]) {
        let [u, v] = [self.axes.x_axis, self.axes.y_axis];
        let uv = DVec2::new(from_origin.dot(u), from_origin.dot(v)) / self.size;
        (uv, [u * self.size, v * self.size])
    }

    /// Coordinates of a point of a sphere, those of a panorama: u = 1/2 + atan2(x, -z) / 2 pi and v = 1 - acos(y) / pi of the
    /// outward normal.
    pub(super) fn of_sphere(&self, normal: DVec3, radius: f64) -> (DVec2, [DVec3; 2]) {
        let n = self.axes.transpose() * normal;
        let uv = DVec2::new(
            0.5 + libm::atan2(n.x, -n.z) / (2.0 * PI),
            1.0 - libm::acos(n.y.clamp(-1.0, 1.0)) / PI,
        );
        let ring = libm::hypot(n.x, n.z);
        let by_u = DVec3::new(-n.z, 0.0, n.x) * (2.0 * PI * radius);
        let upwards = DVec3::new(-n.x * n.y, ring * ring, -n.z * n.y) / ring;
        let by_v = if ring > 0.0 { upwards * (PI * radius) } else { DVec3::ZERO };
        (uv, [self.axes * by_u, self.axes * by_v])
    }
}
