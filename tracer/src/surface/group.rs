//! The lanes of a block that hit one item.

use glam::Vec3;

use crate::rays::SurfaceSource;
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, SimdBase, f32x16, mask_of, mask32x16, select, splat};

/// The lanes of a block that hit one item.
pub(super) struct Group<'a, R: SurfaceSource, S: Simd> {
    pub rays: &'a R,
    pub block: usize,
    pub lanes: u32,
    /// Whether no other lane of the block hits anything.
    pub alone: bool,
    /// Directions of the rays in eye space.
    pub direction: Vec3x16<S>,
}

impl<R: SurfaceSource, S: Simd> Group<'_, R, S> {
    /// Puts vectors into these lanes.
    #[inline(always)]
    pub(super) fn put(&self, simd: S, new: Vec3x16<S>, old: &mut [Lanes; 3]) {
        for axis in 0..3 {
            self.put_one(simd, new.0[axis], &mut old[axis]);
        }
    }

    /// Puts numbers into these lanes.
    #[inline(always)]
    pub(super) fn put_one(&self, simd: S, new: f32x16<S>, old: &mut Lanes) {
        let put = if self.alone { new } else { select(mask_of(simd, self.lanes), new, old.load(simd)) };
        old.store(put);
    }
}

/// Puts three vectors into the lanes of a mask.
#[inline(always)]
pub(super) fn put<S: Simd>(simd: S, mask: mask32x16<S>, vectors: [Vec3; 3], lanes: &mut ThreeVectors<S>) {
    for k in 0..3 {
        for axis in 0..3 {
            lanes[k].0[axis] = select(mask, splat(simd, vectors[k][axis]), lanes[k].0[axis]);
        }
    }
}

/// The mean of a number of the three corners, by the weights of the second and the third.
#[inline(always)]
pub(super) fn barycentric_mean<S: Simd>(
    simd: S,
    [a, b, c]: [&Lanes; 3],
    [second, third]: [f32x16<S>; 2],
) -> f32x16<S> {
    let first = splat(simd, 1.0) - second - third;
    a.load(simd) * first + b.load(simd) * second + c.load(simd) * third
}

/// Three vectors in each lane.
pub(super) type ThreeVectors<S> = [Vec3x16<S>; 3];

/// Barycentric weights of the second and the third corner, by areas; clamped, so that rounding does not leave the triangle.
/// `at` is relative to the first corner, as `ab` and `ac` are.
#[inline(always)]
pub(super) fn barycentric<S: Simd>(
    simd: S,
    at: Vec3x16<S>,
    ab: Vec3x16<S>,
    ac: Vec3x16<S>,
) -> [f32x16<S>; 2] {
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let full = ab.cross(ac);
    let whole = one / full.dot(full);
    let u = (at.cross(ac).dot(full) * whole).max_precise(zero).min_precise(one);
    let v = (ab.cross(at).dot(full) * whole).max_precise(zero).min_precise(one - u);
    [u, v]
}
