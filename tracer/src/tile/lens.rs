//! A point to look from, near or infinitely far, and the picture it sees.
//!
//! A lens takes a point of some space (a mesh, or eye space) to (a, b, g): depth g along its axis. Seen from a point,
//! its place in the picture is (a / g, b / g) and its closeness z = 1 / g; seen along parallel rays, (a, b) and z = -g.
//! Either way z is linear over the picture of a plane, and what is closer has more of it. The map to (a, b, g) is affine, so a lens for a mesh is a lens for eye space after the
//! placement of the mesh: made in `f64`, once per mesh and tile, then rounded.

use glam::{DMat3, DVec3, Vec3};

/// Relative error of a number that went through a handful of `f32` operations.
pub(super) const ROUNDING: f32 = 1.0 / (1 << 22) as f32;

/// See the module.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lens {
    /// Rows for a, b and g: three factors and a constant.
    pub rows: [[f32; 4]; 3],
    /// Error of a and b, and of g, for points with coordinates of at most `reach`.
    pub error: [f32; 2],
    /// Seen along parallel rays, not from a point.
    pub parallel: bool,
    linear: DMat3,
    constant: DVec3,
}

impl Lens {
    /// (a, b, g) = `linear` p + `constant`, for points with coordinates of at most `reach`.
    pub(crate) fn new(linear: DMat3, constant: DVec3, reach: f64) -> Self {
        let row = |i: usize| linear.row(i).extend(constant[i]);
        let size = |i: usize| linear.row(i).abs().element_sum() * reach + constant[i].abs();
        Self {
            rows: [0, 1, 2].map(|i| row(i).as_vec4().to_array()),
            error: [size(0).max(size(1)) as f32 * ROUNDING, size(2) as f32 * ROUNDING],
            parallel: false,
            linear,
            constant,
        }
    }

    /// The same, seen along parallel rays.
    pub(crate) fn parallel(linear: DMat3, constant: DVec3, reach: f64) -> Self {
        Self { parallel: true, ..Self::new(linear, constant, reach) }
    }

    /// The same picture of another space: p = `linear` q + `translation`.
    pub(crate) fn of(&self, linear: DMat3, translation: DVec3, reach: f64) -> Lens {
        let (linear, constant) = (self.linear * linear, self.linear * translation + self.constant);
        Lens { parallel: self.parallel, ..Lens::new(linear, constant, reach) }
    }

    /// No closeness in a box is greater, given a depth that nothing in it is nearer than.
    pub(super) fn z_most(&self, depth: f32) -> f32 {
        if self.parallel {
            -depth
        } else if depth > 0.0 {
            1.0 / depth
        } else {
            f32::INFINITY
        }
    }

    /// Rounded twice only, for triangles that need more digits.
    pub(super) fn exact(&self, point: Vec3) -> DVec3 {
        self.linear * point.as_dvec3() + self.constant
    }

    /// For points with more digits than a mesh has.
    pub(crate) fn exact_point(&self, point: DVec3) -> DVec3 {
        self.linear * point + self.constant
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
        let side =
            |row: [f32; 4], sign: f32, at: f32| std::array::from_fn(|i| sign * (row[i] - at * scale[i]));
        let error = |at: f32| 4.0 * (lens.error[0] + at.abs() * (lens.error[1] + ROUNDING));
        Self {
            planes: [side(a, 1.0, x_hi), side(a, -1.0, x_lo), side(b, 1.0, y_hi), side(b, -1.0, y_lo), g],
            error: [error(x_hi), error(x_lo), error(y_hi), error(y_lo), 4.0 * lens.error[1]],
            parallel: lens.parallel,
        }
    }
}
