//! Primitives of the oracle, and their intersection by the textbook formulas.

use glam::{DVec2, DVec3, Vec2};

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
    Triangle { corners: [DVec3; 3], normals: Option<[DVec3; 3]>, skin: Skin },
    Sphere { center: DVec3, radius: f64 },
    Disk { center: DVec3, normal: DVec3, radius: f64 },
    Plane { point: DVec3, normal: DVec3 },
}

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
}

/// The hit of a ray with a shape.
pub(super) struct Crossing {
    pub t: f64,
    pub normal: DVec3,
    pub shading_normal: DVec3,
    /// Texture coordinates; zero if there are none.
    pub uv: DVec2,
    /// Interpolated vertex colour.
    pub color: DVec3,
    /// Whether `normal` is on the back.
    pub mirrored: bool,
}

impl Crossing {
    /// The hit of a shape without corners.
    fn plain(t: f64, normal: DVec3) -> Self {
        Self { t, normal, shading_normal: normal, uv: DVec2::ZERO, color: DVec3::ONE, mirrored: false }
    }
}

impl Shape {
    /// Largest coordinate.
    pub(super) fn size(&self) -> f64 {
        match self {
            Shape::Triangle { corners, .. } => {
                corners.iter().map(|c| c.abs().max_element()).fold(0.0, f64::max)
            }
            Shape::Sphere { center, radius } => center.abs().max_element() + radius,
            Shape::Disk { center, radius, .. } => center.abs().max_element() + radius,
            Shape::Plane { point, normal } => point.dot(*normal).abs(),
        }
    }

    /// The nearest hit with t > `near`.
    pub(super) fn hit(&self, origin: DVec3, direction: DVec3, near: f64) -> Option<Crossing> {
        match *self {
            Shape::Triangle { corners: [a, b, c], normals, skin } => {
                let (ab, ac) = (b - a, c - a);
                let p = direction.cross(ac);
                let determinant = ab.dot(p);
                let from_a = origin - a;
                let u = from_a.dot(p) / determinant;
                let q = from_a.cross(ab);
                let v = direction.dot(q) / determinant;
                let t = ac.dot(q) / determinant;
                let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
                let ng = ab.cross(ac).normalize_or_zero();
                let ns =
                    normals.and_then(|[na, nb, nc]| (na * (1.0 - u - v) + nb * u + nc * v).try_normalize());
                let [a, b, c] = skin.uvs;
                let uv = a + (b - a) * u + (c - a) * v;
                let [a, b, c] = skin.colors;
                let color = a + (b - a) * u + (c - a) * v;
                let (shading_normal, mirrored) = (ns.unwrap_or(ng), skin.mirrored);
                (inside && t > near).then_some(Crossing {
                    t,
                    normal: ng,
                    shading_normal,
                    uv,
                    color,
                    mirrored,
                })
            }
            Shape::Sphere { center, radius } => {
                let from_center = origin - center;
                let unit = direction.normalize();
                let middle = -from_center.dot(unit);
                let closest = (from_center + unit * middle).length();
                let half_chord = (radius * radius - closest * closest).sqrt();
                let [t0, t1] = [-half_chord, half_chord].map(|half| (middle + half) / direction.length());
                let t = if t0 > near { t0 } else { t1 };
                let normal = (origin + direction * t - center).normalize_or_zero();
                (t > near).then_some(Crossing::plain(t, normal))
            }
            Shape::Disk { center, normal, radius } => {
                let t = (center - origin).dot(normal) / direction.dot(normal);
                let inside = (origin + direction * t - center).length() <= radius;
                (inside && t > near && t.is_finite()).then_some(Crossing::plain(t, normal))
            }
            Shape::Plane { point, normal } => {
                let t = (point - origin).dot(normal) / direction.dot(normal);
                (t > near && t.is_finite()).then_some(Crossing::plain(t, normal))
            }
        }
    }
}
