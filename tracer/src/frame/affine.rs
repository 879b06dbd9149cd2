//! Affine maps in `f64`: placements of meshes, and maps from a space to a picture.

use glam::{DMat3, DVec3};

use crate::simd::three;

/// An affine map: one row per output coordinate, three factors and a constant.
///
/// A map to (a, b, g) takes a point to its homogeneous place in a picture: see `rays::Projection`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Affine(pub [[f64; 4]; 3]);

impl Affine {
    /// The map of every point to itself.
    pub(crate) const IDENTITY: Self =
        Self([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]);

    /// The map p -> `linear` p + `constant`.
    pub(crate) fn new(linear: DMat3, constant: DVec3) -> Self {
        Self([0, 1, 2].map(|i| linear.row(i).extend(constant[i]).to_array()))
    }

    /// The composition: `inner`, then `self`.
    #[inline(always)]
    pub(crate) fn after(&self, inner: &Affine) -> Affine {
        let mut rows = [[0.0; 4]; 3];
        for i in 0..3 {
            let outer = self.0[i];
            for column in 0..4 {
                rows[i][column] = outer[0] * inner.0[0][column]
                    + outer[1] * inner.0[1][column]
                    + outer[2] * inner.0[2][column];
            }
            rows[i][3] += outer[3];
        }
        Affine(rows)
    }

    /// The same map to (a, b, g), with the picture coordinates a and b enlarged by a factor.
    #[inline(always)]
    pub(crate) fn enlarged(&self, by: f64) -> Affine {
        let [mut a, mut b, g] = self.0;
        for column in 0..4 {
            a[column] *= by;
            b[column] *= by;
        }
        Affine([a, b, g])
    }

    /// A map to (a, b, g) with the origin of the picture moved to (x, y), for rays from a point: the place is (a / g, b / g).
    #[inline(always)]
    pub(crate) fn centered(&self, x: f64, y: f64) -> Affine {
        let [mut a, mut b, g] = self.0;
        for column in 0..4 {
            a[column] -= x * g[column];
            b[column] -= y * g[column];
        }
        Affine([a, b, g])
    }

    /// A map to (a, b, g) with the origin of the picture moved to (x, y), for parallel rays: the place is (a, b).
    #[inline(always)]
    pub(crate) fn shifted(&self, x: f64, y: f64) -> Affine {
        let [mut a, mut b, g] = self.0;
        a[3] -= x;
        b[3] -= y;
        Affine([a, b, g])
    }

    /// The image of a point.
    pub(crate) fn apply(&self, point: DVec3) -> DVec3 {
        DVec3::from_array(three!(i => {
            let [x, y, z, constant] = self.0[i];
            x * point.x + y * point.y + z * point.z + constant
        }))
    }
}
