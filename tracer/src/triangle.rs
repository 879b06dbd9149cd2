//! Ray against triangle, exactly: what every faster test falls back on where it is not certain.
//!
//! Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013), in `f64`: the triangle is sheared into a
//! space where the ray runs along an axis; an edge shared by two triangles gives both the same value with opposite
//! sign, to the bit, and an edge function of zero counts as inside for both. So a ray between two triangles hits one.

use glam::DVec3;

/// A ray prepared for triangles: o + t d, permuted and sheared so that d points along its largest axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShearedRay {
    origin: DVec3,
    axes: [usize; 3],
    shear: DVec3,
}

impl ShearedRay {
    /// `direction` need not be a unit vector; it must not be zero.
    pub(crate) fn new(origin: DVec3, direction: DVec3) -> Self {
        let z = direction.abs().max_position();
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let shear = DVec3::new(direction[x] / direction[z], direction[y] / direction[z], 1.0 / direction[z]);
        Self { origin, axes: [x, y, z], shear }
    }

    /// Distance of the hit with t > 0, in lengths of the direction, whichever side of the triangle faces the ray.
    pub(crate) fn intersect(&self, corners: &[DVec3; 3]) -> Option<f64> {
        let [x, y, z] = self.axes;
        let [a, b, c] = corners.map(|corner| {
            let relative = corner - self.origin;
            DVec3::new(
                relative[x] - self.shear.x * relative[z],
                relative[y] - self.shear.y * relative[z],
                self.shear.z * relative[z],
            )
        });
        let edge = |p: DVec3, q: DVec3| p.x * q.y - p.y * q.x;
        let weights = [edge(c, b), edge(a, c), edge(b, a)];
        if weights.iter().any(|&w| w < 0.0) && weights.iter().any(|&w| w > 0.0) {
            return None;
        }
        let [wa, wb, wc] = weights;
        let determinant = wa + wb + wc;
        if determinant == 0.0 {
            return None;
        }
        let t = (wa * a.z + wb * b.z + wc * c.z) / determinant;
        (t > 0.0 && t.is_finite()).then_some(t)
    }
}
