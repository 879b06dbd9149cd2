//! Exact intersection tests of one ray with one shape, in `f64`.
//!
//! These tests decide every hit that a `f32` filter leaves open, so all levels of SIMD, all tiles
//! and all single rays agree to the last bit.

mod disk;
mod plane;
mod sphere;
mod triangle;

pub(crate) use disk::EyeDisk;
pub(crate) use plane::EyePlane;
pub(crate) use sphere::EyeSphere;
pub(crate) use triangle::{ShearedRay, axes_ending_with};
