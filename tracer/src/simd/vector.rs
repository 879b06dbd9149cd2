//! Three-vectors of sixteen lanes, of plain operations.

use fearless_simd::{Simd, SimdBase, SimdFloat, f32x16};

use super::math::to_unit;
use super::{Lanes, select, splat, three};

/// Whether fused operations are emulated by hundreds of instructions: on x86 processors without AVX2.
const fn emulates_fused<S: Simd>() -> bool {
    cfg!(target_arch = "x86_64") && size_of::<S::f32s>() == 16
}

/// a b - c d without cancellation (Kahan's algorithm).
#[inline(always)]
fn difference<S: Simd>(a: f32x16<S>, b: f32x16<S>, c: f32x16<S>, d: f32x16<S>) -> f32x16<S> {
    // Inlined everywhere, the emulation would be two thirds of the tracer's code.
    if const { emulates_fused::<S>() } { difference_called(a, b, c, d) } else { difference_here(a, b, c, d) }
}

#[inline(never)]
fn difference_called<S: Simd>(a: f32x16<S>, b: f32x16<S>, c: f32x16<S>, d: f32x16<S>) -> f32x16<S> {
    difference_here(a, b, c, d)
}

#[inline(always)]
fn difference_here<S: Simd>(a: f32x16<S>, b: f32x16<S>, c: f32x16<S>, d: f32x16<S>) -> f32x16<S> {
    let cd = c * d;
    let error = (-c).mul_add_precise(d, cd);
    a.mul_add_precise(b, -cd) + error
}

/// x, y and z.
#[derive(Clone, Copy)]
pub(crate) struct Vec3x16<S: Simd>(pub(crate) [f32x16<S>; 3]);

impl<S: Simd> Vec3x16<S> {
    #[inline(always)]
    pub(crate) fn splat(simd: S, value: [f32; 3]) -> Self {
        Self(three!(i => splat(simd, value[i])))
    }

    #[inline(always)]
    pub(crate) fn load(simd: S, lanes: &[Lanes; 3]) -> Self {
        Self([lanes[0].load(simd), lanes[1].load(simd), lanes[2].load(simd)])
    }

    #[inline(always)]
    pub(crate) fn store(self, lanes: &mut [Lanes; 3]) {
        lanes[0].store(self.0[0]);
        lanes[1].store(self.0[1]);
        lanes[2].store(self.0[2]);
    }

    #[inline(always)]
    pub(crate) fn add(self, other: Self) -> Self {
        Self(three!(i => self.0[i] + other.0[i]))
    }

    #[inline(always)]
    pub(crate) fn sub(self, other: Self) -> Self {
        Self(three!(i => self.0[i] - other.0[i]))
    }

    #[inline(always)]
    pub(crate) fn mul(self, other: Self) -> Self {
        Self(three!(i => self.0[i] * other.0[i]))
    }

    #[inline(always)]
    pub(crate) fn scale(self, factor: f32x16<S>) -> Self {
        Self(three!(i => self.0[i] * factor))
    }

    #[inline(always)]
    pub(crate) fn dot(self, other: Self) -> f32x16<S> {
        let Self([x, y, z]) = self.mul(other);
        x + y + z
    }

    /// The cross product, precise even for nearly parallel vectors.
    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        let ([ax, ay, az], [bx, by, bz]) = (self.0, other.0);
        Self([difference(ay, bz, az, by), difference(az, bx, ax, bz), difference(ax, by, ay, bx)])
    }

    /// Magnitude of the largest component.
    #[inline(always)]
    pub(crate) fn size(self) -> f32x16<S> {
        let [x, y, z] = self.0;
        x.abs().max(y.abs()).max(z.abs())
    }

    /// The unit vector; NaN for vectors of length zero.
    #[inline(always)]
    pub(crate) fn normalize(self, simd: S) -> Self {
        // Scaled by a power of two first: squares of small numbers underflow.
        let near_one = self.scale(to_unit(simd, self.size()));
        near_one.scale(splat(simd, 1.0) / near_one.dot(near_one).sqrt())
    }

    /// The product of a matrix, given by its columns, and this vector.
    #[inline(always)]
    pub(crate) fn transform(self, simd: S, columns: &[[f32; 3]; 3]) -> Self {
        let [x, y, z] = self.0;
        let columns = three!(i => Self::splat(simd, columns[i]));
        columns[0].scale(x).add(columns[1].scale(y)).add(columns[2].scale(z))
    }

    /// Two unit vectors across unit vectors and each other (Duff et al., "Building an Orthonormal Basis, Revisited", 2017).
    #[inline(always)]
    pub(crate) fn basis(self, simd: S) -> [Self; 2] {
        let [x, y, z] = self.0;
        let one = splat(simd, 1.0);
        let sign = select(z.simd_lt(splat(simd, 0.0)), -one, one);
        let a = -one / (sign + z);
        let b = x * y * a;
        [Self([one + sign * x * x * a, sign * b, -(sign * x)]), Self([b, sign + y * y * a, -y])]
    }
}
