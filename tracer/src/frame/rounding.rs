//! Error bounds of placed geometry: how far rounding moves a surface.
//!
//! Corners of a mesh are rounded to `f32`, so each point of a triangle, a mean of its corners, is off by at most half a step
//! of the largest corner on each axis. All other placements are `f64`, and off by some steps of the numbers that went into
//! them.

use glam::{DMat3, DVec3, Vec3};

use crate::simd::three;

/// Half a step of an `f32` in [1/2, 1): coordinates of a mesh are within [-1, 1].
const STEP_OF_MESHES: f64 = 1.0 / (1 << 25) as f64;

/// Largest half step of an `f32`, relative to the number.
const RELATIVE_STEP: f64 = 1.0 / (1 << 24) as f64;

/// Relative error of a number after a handful of `f64` operations.
pub(crate) const F64_ERROR: f64 = 1.0 / (1_u64 << 50) as f64;

/// Error bound of a point of a triangle of a mesh, on each axis of the mesh.
pub(crate) fn corner_rounding(corners: &[Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(Vec3::abs);
    let largest = a.max(b).max(c).max_element();
    (f64::from(largest) * RELATIVE_STEP).min(STEP_OF_MESHES)
}

/// Error bound of any point of a mesh in eye space. `linear` places the mesh; its columns are perpendicular to each other.
pub(crate) fn mesh_rounding(linear: &DMat3) -> f64 {
    let squares = three!(axis => linear.col(axis).length_squared());
    STEP_OF_MESHES * (squares[0] + squares[1] + squares[2]).sqrt()
}

/// Error bound of points with these coordinates in the world and in eye space, in eye units.
pub(crate) fn placement_rounding(world: &[DVec3], eye: &[DVec3], unit: f64) -> f64 {
    let largest = |points: &[DVec3]| points.iter().map(|point| point.abs().max_element()).fold(0.0, f64::max);
    F64_ERROR * (largest(world) / unit + largest(eye))
}

/// The length of the longest row or column.
pub(crate) fn largest_axis(matrix: &DMat3) -> f64 {
    let of = |matrix: &DMat3| matrix.x_axis.length().max(matrix.y_axis.length()).max(matrix.z_axis.length());
    of(matrix).max(of(&matrix.transpose()))
}
