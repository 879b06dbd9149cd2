//! A point to look from, near or infinitely far, and the picture it sees.
//!
//! A lens takes a point of some space (a mesh, or eye space) to (a, b, g): depth g along its axis. Seen from a point,
//! its place in the picture is (a / g, b / g) and its closeness z = 1 / g; seen along parallel rays, (a, b) and z = -g.
//! Either way z is linear over the picture of a plane, and what is closer has more of it. The map to (a, b, g) is affine, so a lens for a mesh is a lens for eye space after the
//! placement of the mesh: made in `f64`, once per mesh and tile, then rounded.

use glam::{DMat3, DVec3};

use crate::simd::three;

/// Relative error of a number that went through a handful of `f32` operations.
pub(super) const ROUNDING: f32 = 1.0 / (1 << 22) as f32;

/// The same for `f64`.
const EXACT_ROUNDING: f64 = 1.0 / (1_u64 << 50) as f64;

/// The scene lies this far from the eye at most, in eye units, also when it spins.
const SCENE: f64 = 2.0;

/// Of one space into another: a row for each coordinate there, three factors and a constant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Affine(pub [[f64; 4]; 3]);

impl Affine {
    /// p -> `linear` p + `constant`.
    pub(crate) fn new(linear: DMat3, constant: DVec3) -> Self {
        Self([0, 1, 2].map(|i| linear.row(i).extend(constant[i]).to_array()))
    }

    /// First `inner`, then this.
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

    /// Of a map to (a, b, g): the same picture, so many times as large.
    #[inline(always)]
    pub(crate) fn enlarged(&self, by: f64) -> Affine {
        let [mut a, mut b, g] = self.0;
        for column in 0..4 {
            a[column] *= by;
            b[column] *= by;
        }
        Affine([a, b, g])
    }

    /// Of a map to (a, b, g): the same with the place (x, y) of the picture in its middle.
    #[inline(always)]
    pub(crate) fn centered(&self, x: f64, y: f64) -> Affine {
        let [mut a, mut b, g] = self.0;
        for column in 0..4 {
            a[column] -= x * g[column];
            b[column] -= y * g[column];
        }
        Affine([a, b, g])
    }

    fn apply(&self, point: DVec3) -> DVec3 {
        DVec3::from_array(three!(i => {
            let [x, y, z, constant] = self.0[i];
            x * point.x + y * point.y + z * point.z + constant
        }))
    }
}

/// See the module.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lens {
    /// Rows for a, b and g: three factors and a constant.
    pub rows: [[f32; 4]; 3],
    /// Error of a and b, and of g, for points with coordinates of at most `reach`.
    pub error: [f32; 2],
    /// Seen along parallel rays, not from a point.
    pub parallel: bool,
    /// Error of [`Lens::exact`] for points of the scene.
    pub exact_error: f64,
    /// How far apart points of surfaces may be that coincide, in units of the space that it looks at.
    pub drift: f64,
    exact: Affine,
}

impl Lens {
    /// A lens for points with coordinates of at most `reach`.
    #[inline(always)]
    pub(crate) fn new(exact: Affine, reach: f64, parallel: bool) -> Self {
        let mut size = [0.0; 3];
        let mut exact_size = 0.0_f64;
        for i in 0..3 {
            let row = exact.0[i];
            let factors = row[0].abs() + row[1].abs() + row[2].abs();
            size[i] = factors * reach + row[3].abs();
            exact_size = exact_size.max(factors * reach.max(SCENE) + row[3].abs());
        }
        Self { exact_error: exact_size * EXACT_ROUNDING, ..Self::with_sizes(exact, size, parallel) }
    }

    /// Of a picture of eye space: what surfaces may be off in a and b, and in g, each by `coarsest` on its own side. A closeness has at
    /// least three times the errors of (a, b, g) as its own: it is enough that they are as large as half of the distance.
    pub(crate) fn drift(picture: &Affine, coarsest: f64) -> [f32; 2] {
        let off = three!(i => {
            let [x, y, z, _] = picture.0[i];
            DVec3::new(x, y, z).length() * coarsest
        });
        [off[0].max(off[1]) as f32, off[2] as f32]
    }

    /// With errors that cover what surfaces may be off that coincide (in the picture and in depth; in the space that it looks at), so that
    /// their closeness is never told apart for certain.
    #[inline(always)]
    pub(crate) fn drifting(self, in_picture: [f32; 2], in_space: f64) -> Self {
        let error = [self.error[0].max(in_picture[0]), self.error[1].max(in_picture[1])];
        Self { error, drift: in_space, ..self }
    }

    /// The volume in (a, b, g) of a unit of the space.
    pub(super) fn volume(&self) -> f64 {
        let [a, b, g] = three!(i => {
            let [x, y, z, _] = self.exact.0[i];
            DVec3::new(x, y, z)
        });
        a.dot(b.cross(g)).abs()
    }

    /// `size` bounds the numbers that go into each row.
    #[inline(always)]
    fn with_sizes(exact: Affine, size: [f64; 3], parallel: bool) -> Self {
        let mut rows = [[0.0; 4]; 3];
        for i in 0..3 {
            for column in 0..4 {
                rows[i][column] = exact.0[i][column] as f32;
            }
        }
        let error = [size[0].max(size[1]) as f32 * ROUNDING, size[2] as f32 * ROUNDING];
        let exact_error = size[0].max(size[1]).max(size[2]) * EXACT_ROUNDING;
        Self { rows, error, parallel, exact_error, drift: 0.0, exact }
    }

    /// The same picture of another space, of which `placement` is the place in this one.
    #[inline(always)]
    pub(crate) fn of(&self, placement: &Affine, reach: f64) -> Lens {
        let lens = Lens::new(self.exact.after(placement), reach, self.parallel);
        // What the placement was rounded by stays, also where its constant cancels ours.
        Lens { exact_error: lens.exact_error + self.exact_error, ..lens }
    }

    /// The same picture, of points given relative to a place of this space, at most `reach` from it on each axis: their few
    /// digits are then all spent on where they differ.
    #[inline(always)]
    pub(super) fn relative_to(&self, place: DVec3, reach: DVec3) -> Lens {
        let mut exact = self.exact;
        let here = self.exact.apply(place);
        let mut size = [0.0; 3];
        for i in 0..3 {
            let row = &mut exact.0[i];
            row[3] = here[i];
            size[i] = row[0].abs() * reach.x + row[1].abs() * reach.y + row[2].abs() * reach.z + row[3].abs();
        }
        Lens::with_sizes(exact, size, self.parallel)
    }

    /// (a, b, g) of a point, but for [`Lens::exact_error`].
    pub(crate) fn exact(&self, point: DVec3) -> DVec3 {
        self.exact.apply(point)
    }
}

/// A rectangle of the picture as planes through the point: boxes beside it are seen by a dot product a plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frustum {
    /// Four sides, then the depth: three factors and a constant. A side is positive outside.
    pub planes: [[f32; 4]; 5],
    /// Error of each.
    pub error: [f32; 5],
    /// Nothing is behind a lens that sees along parallel rays.
    pub parallel: bool,
}

impl Frustum {
    pub(super) fn new(lens: &Lens, [x_lo, x_hi, y_lo, y_hi]: [f32; 4]) -> Self {
        let [a, b, g] = lens.rows;
        let scale = if lens.parallel { [0.0, 0.0, 0.0, 1.0] } else { g };
        let side = |row: [f32; 4], sign: f32, at: f32| {
            [
                sign * (row[0] - at * scale[0]),
                sign * (row[1] - at * scale[1]),
                sign * (row[2] - at * scale[2]),
                sign * (row[3] - at * scale[3]),
            ]
        };
        let error = |at: f32| 4.0 * (lens.error[0] + at.abs() * (lens.error[1] + ROUNDING));
        Self {
            planes: [side(a, 1.0, x_hi), side(a, -1.0, x_lo), side(b, 1.0, y_hi), side(b, -1.0, y_lo), g],
            error: [error(x_hi), error(x_lo), error(y_hi), error(y_lo), 4.0 * lens.error[1]],
            parallel: lens.parallel,
        }
    }
}
