//! Primitives of the oracle, and their intersection by the textbook formulas.

use glam::{DVec2, DVec3};

use super::attributes::{Chart, Skin};
use crate::intersect::Primitive as Name;

/// A primitive in world space relative to the camera.
pub(super) struct Primitive {
    pub shape: Shape,
    pub material: u32,
    /// Its place in the scene.
    pub name: Name,
    /// Error bound of its position, across itself.
    pub error: f64,
    /// Whether its front is the side from which its corners are in clockwise order: a mirrored mesh.
    pub mirrored: bool,
}

#[allow(clippy::large_enum_variant, reason = "nearly all are triangles")]
pub(super) enum Shape {
    Triangle {
        corners: [DVec3; 3],
        normals: Option<[DVec3; 3]>,
        skin: Skin,
    },
    Sphere {
        center: DVec3,
        radius: f64,
        /// Whether the front is the inside.
        inside_out: bool,
        chart: Chart,
    },
    Disk {
        center: DVec3,
        normal: DVec3,
        radius: f64,
    },
    Plane {
        point: DVec3,
        normal: DVec3,
        chart: Chart,
    },
}

/// The hit of a ray with a shape.
pub(super) struct Crossing {
    pub t: f64,
    pub normal: DVec3,
    pub shading_normal: DVec3,
    /// Texture coordinates; zero if there are none.
    pub uv: DVec2,
    /// Derivatives of the point by u and by v; zero without texture coordinates.
    pub tangents: [DVec3; 2],
    /// Interpolated vertex colour.
    pub color: DVec3,
    /// Whether `normal` is on the back.
    pub mirrored: bool,
}

impl Crossing {
    /// The hit of a shape without corners.
    fn plain(t: f64, normal: DVec3) -> Self {
        Self {
            t,
            normal,
            shading_normal: normal,
            uv: DVec2::ZERO,
            tangents: [DVec3::ZERO; 2],
            color: DVec3::ONE,
            mirrored: false,
        }
    }

    fn on_chart(self, (uv, tangents): (DVec2, [DVec3; 2])) -> Self {
        Self { uv, tangents, ..self }
    }
}

impl Shape {
    /// Largest coordinate.
    pub(super) fn size(&self) -> f64 {
        match self {
            Shape::Triangle { corners, .. } => {
                corners.iter().map(|c| c.abs().max_element()).fold(0.0, f64::max)
            }
            Shape::Sphere { center, radius, .. } | Shape::Disk { center, radius, .. } => {
                center.abs().max_element() + radius
            }
            Shape::Plane { point, normal, .. } => point.dot(*normal).abs(),
        }
    }

    /// The nearest hit with t > `near`.
    pub(super) fn hit(&self, origin: DVec3, direction: DVec3, near: f64) -> Option<Crossing> {
        match self {
            Shape::Triangle { .. } => self.triangle_hit(origin, direction, near),
            Shape::Sphere { center, radius, .. } => {
                let from_center = origin - center;
                let unit = direction.normalize();
                let middle = -from_center.dot(unit);
                let closest = (from_center + unit * middle).length();
                let half_chord = (radius * radius - closest * closest).sqrt();
                let [t0, t1] = [-half_chord, half_chord].map(|half| (middle + half) / direction.length());
                let t = if t0 > near { t0 } else { t1 };
                (t > near).then(|| self.sphere_crossing(t, origin + direction * t)).flatten()
            }
            Shape::Disk { center, normal, radius } => {
                let t = (center - origin).dot(*normal) / direction.dot(*normal);
                let inside = (origin + direction * t - center).length() <= *radius;
                (inside && t > near && t.is_finite()).then_some(Crossing::plain(t, *normal))
            }
            Shape::Plane { point, normal, chart } => {
                let t = (point - origin).dot(*normal) / direction.dot(*normal);
                let place = || chart.of_plane(origin + direction * t - point);
                (t > near && t.is_finite()).then(|| Crossing::plain(t, *normal).on_chart(place()))
            }
        }
    }

    /// The second hit of a ray that starts on the shape: only a sphere is hit twice.
    pub(super) fn hit_again(&self, origin: DVec3, direction: DVec3) -> Option<Crossing> {
        let Shape::Sphere { center, .. } = self else { return None };
        // |o + t d - c| = |o - c|.
        let t = -2.0 * (origin - center).dot(direction) / direction.length_squared();
        (t > 0.0 && t.is_finite()).then(|| self.sphere_crossing(t, origin + direction * t)).flatten()
    }

    fn sphere_crossing(&self, t: f64, point: DVec3) -> Option<Crossing> {
        let Shape::Sphere { center, radius, inside_out, chart } = self else { return None };
        let normal = (point - center).normalize_or_zero();
        let crossing = Crossing::plain(t, normal).on_chart(chart.of_sphere(normal, *radius));
        Some(Crossing { mirrored: *inside_out, ..crossing })
    }

    fn triangle_hit(&self, origin: DVec3, direction: DVec3, near: f64) -> Option<Crossing> {
        let Shape::Triangle { corners: [a, b, c], normals, skin } = self else { return None };
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(ac);
        let determinant = ab.dot(p);
        let from_a = origin - a;
        let u = from_a.dot(p) / determinant;
        let q = from_a.cross(ab);
        let v = direction.dot(q) / determinant;
        let t = ac.dot(q) / determinant;
        if !(u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > near) {
            return None;
        }
        let normal = ab.cross(ac).normalize_or_zero();
        let interpolated =
            normals.and_then(|[na, nb, nc]| (na * (1.0 - u - v) + nb * u + nc * v).try_normalize());
        Some(Crossing {
            t,
            normal,
            shading_normal: interpolated.unwrap_or(normal),
            uv: skin.uv_at(u, v),
            tangents: skin.tangents(ab, ac),
            color: skin.color_at(u, v),
            mirrored: skin.mirrored,
        })
    }
}
