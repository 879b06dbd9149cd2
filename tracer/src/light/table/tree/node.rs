//! A node of a light tree: up to sixteen parts, and their importance at a point.

use super::bound::Bound;
use super::{Receiver, Selection};
use crate::simd::vector::Vec3x16;
use crate::simd::{LANES, Lanes, Simd, SimdBase, SimdFloat, f32x16, select, splat};

/// Least cosine of a light that can be selected. Because angles are rounded, lights slightly behind a horizon have a probability too.
pub(crate) const LEAST_COSINE: f32 = 1e-3;

/// Least distance of lights, as a share of the size of the scene: nearer ones are as important as at this distance.
pub(crate) const LEAST_DISTANCE: f64 = 1e-5;

/// Parts of a node; lanes without one have no strength.
#[derive(Clone, Debug)]
pub(super) struct Node {
    center: [Lanes; 3],
    radius: Lanes,
    axis: [Lanes; 3],
    /// Cosine and sine of the largest angle between the axis and a normal.
    spread: [Lanes; 2],
    /// Cosine of the largest angle between a normal and light.
    emission: Lanes,
    /// Strengths that fall with the square of the distance, and that do not: of lights with an extent, and of all.
    strengths: [[Lanes; 2]; 2],
    /// Square of the least distance.
    least_square: f32,
    /// Bits of the parts that are nodes.
    inner: u32,
    /// The node, or the source, of each part.
    pub(super) child: [u32; LANES],
}

impl Node {
    /// A node without parts.
    pub(super) fn new(least_distance: f64) -> Self {
        Self {
            center: [Lanes::ZERO; 3],
            radius: Lanes([1.0; LANES]),
            axis: [Lanes::ZERO; 3],
            spread: [Lanes::ZERO; 2],
            emission: Lanes::ZERO,
            strengths: [[Lanes::ZERO; 2]; 2],
            least_square: ((least_distance * least_distance) as f32).max(f32::MIN_POSITIVE),
            inner: 0,
            child: [0; LANES],
        }
    }

    /// Sets a part; strengths are multiplied by `scale`.
    pub(super) fn set(&mut self, slot: usize, bound: &Bound, scale: f64, child: u32, is_inner: bool) {
        for axis in 0..3 {
            self.center[axis].0[slot] = bound.center[axis] as f32;
            self.axis[axis].0[slot] = bound.axis[axis] as f32;
        }
        // The centre is rounded, and so are points.
        let rounding = (bound.center.abs().max_element() + bound.radius) / f64::from(1 << 21);
        self.radius.0[slot] = (bound.radius + rounding) as f32;
        let (sine, cosine) = libm::sincos(bound.spread);
        self.spread[0].0[slot] = cosine as f32;
        self.spread[1].0[slot] = sine as f32;
        self.emission.0[slot] = libm::cos(bound.emission) as f32;
        for (strengths, given) in self.strengths.iter_mut().zip([bound.extended, bound.strength]) {
            for (lanes, value) in strengths.iter_mut().zip([given.inverse_square, given.constant]) {
                // Strengths above 0 remain above 0.
                let least = if value > 0.0 { f32::MIN_POSITIVE } else { 0.0 };
                lanes.0[slot] = ((value * scale) as f32).clamp(least, f32::MAX);
            }
        }
        self.inner |= u32::from(is_inner) << slot;
        self.child[slot] = child;
    }

    /// Whether a part is a node, and not a source.
    #[inline(always)]
    pub(super) fn is_inner(&self, slot: usize) -> bool {
        self.inner >> slot & 1 == 1
    }

    /// The importance of each part at a point.
    #[inline(always)]
    pub(super) fn importance<S: Simd>(
        &self,
        simd: S,
        receiver: &Receiver,
        selection: Selection,
    ) -> [f32; LANES] {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let least = splat(simd, LEAST_COSINE);
        let way = Vec3x16::load(simd, &self.center).sub(Vec3x16::splat(simd, receiver.point));
        let radius = self.radius.load(simd);
        let (square, radius_square) = (way.dot(way), radius * radius);
        let outside = square.simd_gt(radius_square);
        let inverse = one / select(outside, square, one).sqrt();
        // The angle of the sphere.
        let sphere = Angle::of_sine(simd, radius * inverse);
        let from_light = zero - Vec3x16::load(simd, &self.axis).dot(way) * inverse;
        let spread = Angle { cosine: self.spread[0].load(simd), sine: self.spread[1].load(simd) };
        let leaving = Angle::of_cosine(simd, from_light).less(simd, &spread).less(simd, &sphere).cosine;
        let emits = leaving.simd_gt(self.emission.load(simd) - least);
        let (arriving, arrives) = if receiver.normal == [0.0; 3] {
            (one, outside)
        } else {
            let normal = Vec3x16::splat(simd, receiver.normal);
            let arriving = Angle::of_cosine(simd, normal.dot(way) * inverse).less(simd, &sphere).cosine;
            (arriving, arriving.simd_gt(zero - least))
        };
        let cosines = select(emits & arrives, leaving.max(least) * arriving.max(least), zero);
        let cosines = select(outside, cosines, one);
        let square = square.max(radius_square).max(splat(simd, self.least_square));
        let [inverse_square, constant] = match selection {
            Selection::Extended => &self.strengths[0],
            Selection::All => &self.strengths[1],
        };
        let strength = inverse_square.load(simd) / square + constant.load(simd);
        (strength * cosines).to_array()
    }
}

/// An angle from 0 to pi.
struct Angle<S: Simd> {
    cosine: f32x16<S>,
    sine: f32x16<S>,
}

impl<S: Simd> Angle<S> {
    #[inline(always)]
    fn of_cosine(simd: S, cosine: f32x16<S>) -> Self {
        Self { cosine, sine: opposite(simd, cosine) }
    }

    /// An angle up to pi / 2.
    #[inline(always)]
    fn of_sine(simd: S, sine: f32x16<S>) -> Self {
        Self { cosine: opposite(simd, sine), sine }
    }

    /// The difference of two angles, at least 0.
    #[inline(always)]
    fn less(&self, simd: S, other: &Self) -> Self {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let within = self.cosine.simd_ge(other.cosine);
        let cosine = self.cosine * other.cosine + self.sine * other.sine;
        let sine = self.sine * other.cosine - self.cosine * other.sine;
        Self { cosine: select(within, one, cosine), sine: select(within, zero, sine) }
    }
}

/// sqrt(1 - x^2).
#[inline(always)]
fn opposite<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    (splat(simd, 1.0) - x * x).max(splat(simd, 0.0)).sqrt()
}
