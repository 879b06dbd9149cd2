//! Exact ray-triangle intersection: the fallback of every filter.
//!
//! Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013), in `f64`. The triangle is sheared into a
//! space where the ray follows an axis. An edge shared by two triangles has the same edge function in both, with opposite
//! signs and to the bit, and an edge function of zero counts as inside. A ray between two triangles hits one of them.

use glam::DVec3;

use crate::simd::three;

/// Sign bit of an `f64`.
const SIGN: u64 = 1 << 63;

/// The three axes in cyclic order, ending with `last`.
#[inline(always)]
pub(crate) fn axes_ending_with(last: usize) -> [usize; 3] {
    // A static table: an array on the stack is written for each ray, and the loads wait for the stores. Padded to powers of
    // two, so that no index needs a bounds check.
    static AXES: [[u8; 4]; 4] = [[1, 2, 0, 0], [2, 0, 1, 0], [0, 1, 2, 0], [0, 1, 2, 0]];
    let row = &AXES[last % 4];
    three!(k => usize::from(row[k] % 4))
}

/// A ray o + t d, permuted and sheared so that d is parallel to its largest axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShearedRay {
    origin: [f64; 3],
    axes: [usize; 3],
    shear: [f64; 3],
}

impl ShearedRay {
    /// Prepares a ray. `direction` has any length but zero.
    #[inline(always)]
    pub(crate) fn new(origin: DVec3, direction: DVec3) -> Self {
        let [x, y, z] = direction.abs().to_array();
        let largest = if x >= y && x >= z { 0 } else { 1 + usize::from(y < z) };
        let axes @ [x, y, z] = axes_ending_with(largest);
        // An array: indexing a vector by a variable is a branch, which is unpredictable here.
        let direction = direction.to_array();
        let shear = [direction[x] / direction[z], direction[y] / direction[z], 1.0 / direction[z]];
        Self { origin: origin.to_array(), axes, shear }
    }

    /// Distance t > 0 of the hit, in lengths of the direction, on either side of the triangle.
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
        // Of two edge functions with different signs, one has a sign different from that of their sum. Comparing with the
        // sum avoids a branch on the side that faces the ray, which is unpredictable.
        let sign = determinant.to_bits() & SIGN;
        let differs = |w: f64| f64::from_bits(w.to_bits() ^ sign) < 0.0;
        if differs(wa) | differs(wb) | differs(wc) | (determinant == 0.0) {
            return None;
        }
        let t = (wa * a[2] + wb * b[2] + wc * c[2]) / determinant;
        (t > 0.0 && t < f64::INFINITY).then_some(t)
    }
}
