//! Ray against triangle, exactly: what every faster test falls back on where it is not certain.
//!
//! Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013), in `f64`: the triangle is sheared into a
//! space where the ray runs along an axis; an edge shared by two triangles gives both the same value with opposite
//! sign, to the bit, and an edge function of zero counts as inside for both. So a ray between two triangles hits one.

use glam::DVec3;

use crate::simd::three;

/// The bit that tells the sign of an `f64`.
const SIGN: u64 = 1 << 63;

/// The three axes in turn, the given one last.
#[inline(always)]
pub(crate) fn axes_ending_with(last: usize) -> [usize; 3] {
    // In place, and with as many rows and columns that no index is out of bounds: an array on the stack would be made for
    // each ray, and waited for.
    static AXES: [[u8; 4]; 4] = [[1, 2, 0, 0], [2, 0, 1, 0], [0, 1, 2, 0], [0, 1, 2, 0]];
    let row = &AXES[last % 4];
    three!(k => usize::from(row[k] % 4))
}

/// A ray prepared for triangles: o + t d, permuted and sheared so that d points along its largest axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShearedRay {
    origin: [f64; 3],
    axes: [usize; 3],
    shear: [f64; 3],
}

impl ShearedRay {
    /// `direction` need not be a unit vector; it must not be zero.
    #[inline(always)]
    pub(crate) fn new(origin: DVec3, direction: DVec3) -> Self {
        let [x, y, z] = direction.abs().to_array();
        let largest = if x >= y && x >= z { 0 } else { 1 + usize::from(y < z) };
        let axes @ [x, y, z] = axes_ending_with(largest);
        // Arrays, not vectors: an index that is not known is a branch there, which nobody can predict here.
        let direction = direction.to_array();
        let shear = [direction[x] / direction[z], direction[y] / direction[z], 1.0 / direction[z]];
        Self { origin: origin.to_array(), axes, shear }
    }

    /// Distance of the hit with t > 0, in lengths of the direction, whichever side of the triangle faces the ray.
    #[inline(always)]
    pub(crate) fn intersect(&self, corners: &[DVec3; 3]) -> Option<f64> {
        let [x, y, z] = self.axes;
        let [a, b, c] = three!(k => {
            let corner = corners[k].to_array();
            let depth = corner[z] - self.origin[z];
            [
                corner[x] - self.origin[x] - self.shear[0] * depth,
                corner[y] - self.origin[y] - self.shear[1] * depth,
                self.shear[2] * depth,
            ]
        });
        let edge = |p: [f64; 3], q: [f64; 3]| p[0] * q[1] - p[1] * q[0];
        let [wa, wb, wc] = [edge(c, b), edge(a, c), edge(b, a)];
        let determinant = wa + wb + wc;
        // Of two edge functions with different signs, one differs from the sum's. Compared with it, so that no branch asks
        // which side faces the ray: nobody can predict that.
        let sign = determinant.to_bits() & SIGN;
        let differs = |w: f64| f64::from_bits(w.to_bits() ^ sign) < 0.0;
        if differs(wa) | differs(wb) | differs(wc) | (determinant == 0.0) {
            return None;
        }
        let t = (wa * a[2] + wb * b[2] + wc * c[2]) / determinant;
        (t > 0.0 && t < f64::INFINITY).then_some(t)
    }
}
