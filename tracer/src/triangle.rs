//! Ray against triangle: watertight edges in `f32`, distance and barycentrics in `f64`.
//!
//! Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013): the triangle is sheared into a space
//! where the ray runs along an axis; an edge shared by two triangles gives both the same value with opposite sign, to
//! the bit, so a ray between them hits one of them. Where an edge function is exactly zero it is decided in `f64`.
//! What passes (one or two triangles a ray) gets its distance in `f64`, so that no hit needs a tolerance.

use glam::{DVec3, Vec3};

/// A ray prepared for many triangles: o + t d, permuted and sheared so that d points along its largest axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleRay {
    origin: Vec3,
    axes: [usize; 3],
    shear: Vec3,
    exact_origin: DVec3,
    exact_direction: DVec3,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TriangleHit {
    /// Distance in lengths of the ray's direction.
    pub t: f64,
    /// Weight of the second corner.
    pub u: f64,
    /// Weight of the third corner; the first has 1 - u - v.
    pub v: f64,
}

impl TriangleRay {
    /// `direction` need not be a unit vector; it must not be zero.
    pub(crate) fn new(origin: DVec3, direction: DVec3) -> Self {
        let single = direction.as_vec3();
        let z = single.abs().max_position();
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if single[z] < 0.0 {
            // Keeps the winding.
            (x, y) = (y, x);
        }
        let shear = Vec3::new(single[x] / single[z], single[y] / single[z], 1.0 / single[z]);
        Self {
            origin: origin.as_vec3(),
            axes: [x, y, z],
            shear,
            exact_origin: origin,
            exact_direction: direction,
        }
    }

    /// The hit with t > 0, whichever side of the triangle faces the ray.
    #[inline(always)]
    pub(crate) fn intersect(&self, corners: &[Vec3; 3]) -> Option<TriangleHit> {
        if self.passes(corners) { self.locate(&corners.map(Vec3::as_dvec3)) } else { None }
    }

    /// As [`TriangleRay::intersect`] for corners with more digits; `rounded` are the same, rounded.
    #[inline(always)]
    pub(crate) fn intersect_exact(&self, rounded: &[Vec3; 3], corners: &[DVec3; 3]) -> Option<TriangleHit> {
        if self.passes(rounded) { self.locate(corners) } else { None }
    }

    /// Whether the line of the ray passes inside the three edges, or exactly through one.
    #[inline(always)]
    fn passes(&self, corners: &[Vec3; 3]) -> bool {
        let [x, y, z] = self.axes;
        let flat = corners.map(|corner| {
            let relative = corner - self.origin;
            [relative[x] - self.shear.x * relative[z], relative[y] - self.shear.y * relative[z]]
        });
        let edge = |[px, py]: [f32; 2], [qx, qy]: [f32; 2]| px * qy - py * qx;
        let mut edges = [edge(flat[2], flat[1]), edge(flat[0], flat[2]), edge(flat[1], flat[0])];
        if edges.contains(&0.0) {
            edges = exact_edges(&flat);
        }
        !(edges.iter().any(|&e| e < 0.0) && edges.iter().any(|&e| e > 0.0))
    }

    /// Distance and barycentrics of a ray that is known to pass the edges (Moeller and Trumbore, 1997).
    #[inline(never)]
    fn locate(&self, &[a, b, c]: &[DVec3; 3]) -> Option<TriangleHit> {
        let (ab, ac) = (b - a, c - a);
        let p = self.exact_direction.cross(ac);
        let determinant = ab.dot(p);
        if determinant == 0.0 {
            return None;
        }
        let from_a = self.exact_origin - a;
        let q = from_a.cross(ab);
        let t = ac.dot(q) / determinant;
        // Clamped: the edges were decided before, and rounding must not place the hit outside.
        let u = (from_a.dot(p) / determinant).clamp(0.0, 1.0);
        let v = (self.exact_direction.dot(q) / determinant).clamp(0.0, 1.0 - u);
        (t > 0.0 && t.is_finite()).then_some(TriangleHit { t, u, v })
    }
}

/// Signs of the edge functions, from products that are exact in `f64`. The values are only ever compared with zero.
fn exact_edges(flat: &[[f32; 2]; 3]) -> [f32; 3] {
    let edge = |[px, py]: [f32; 2], [qx, qy]: [f32; 2]| {
        let value = f64::from(px) * f64::from(qy) - f64::from(py) * f64::from(qx);
        if value > 0.0 {
            1.0
        } else if value < 0.0 {
            -1.0
        } else {
            0.0
        }
    };
    [edge(flat[2], flat[1]), edge(flat[0], flat[2]), edge(flat[1], flat[0])]
}
