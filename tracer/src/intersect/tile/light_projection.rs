//! A projection from a light whose picture suits the points of a tile: towards their middle, with axes along the rows and
//! columns of the tile.

use glam::{DVec3, Vec3};

use crate::frame::Affine;
use crate::rays::{BLOCKS, Projection, ShadowTarget, TileRays};
use crate::simd::vector::Vec3x16;
use crate::simd::{Lanes, Simd, SimdBase, fma, mask_of, select, splat, three};

/// Largest distance of points from the axis of the light's picture; tiles with farther points are tested ray by ray.
const WIDEST: f64 = 8.0;

/// Least sine of the angle between the tile's axes for which the axes of the light's picture follow them.
const LEAST_SINE: f64 = 0.125;

/// Bounds of points, and their mean directions along the tile.
pub(super) struct Extent {
    lo: Vec3,
    hi: Vec3,
    /// Mean directions of the points along the rows and the columns of the tile, of any length.
    across: DVec3,
    along: DVec3,
}

impl Extent {
    /// The extent of the live points; `grid` has their places in the camera's picture.
    #[inline(always)]
    pub(super) fn of<S: Simd>(
        simd: S,
        points: &[[Lanes; 3]; BLOCKS],
        grid: &TileRays,
        live: &[u32; BLOCKS],
    ) -> Self {
        let zero = splat(simd, 0.0);
        let mut lo = Vec3x16::splat(simd, [f32::INFINITY; 3]);
        let mut hi = Vec3x16::splat(simd, [f32::NEG_INFINITY; 3]);
        let mut sums = [Vec3x16::splat(simd, [0.0; 3]); 3];
        let mut weights = [zero; 3];
        for block in 0..BLOCKS {
            if live[block] == 0 {
                continue;
            }
            let mask = mask_of(simd, live[block]);
            let p = Vec3x16::load(simd, &points[block]);
            let one = select(mask, splat(simd, 1.0), zero);
            let weight = [one, one * grid.x[block].load(simd), one * grid.y[block].load(simd)];
            for axis in 0..3 {
                let at = select(mask, p.0[axis], zero);
                lo.0[axis] = select(mask, lo.0[axis].min(at), lo.0[axis]);
                hi.0[axis] = select(mask, hi.0[axis].max(at), hi.0[axis]);
                for i in 0..3 {
                    sums[i].0[axis] = fma(weight[i], at, sums[i].0[axis]);
                }
            }
            for i in 0..3 {
                weights[i] += weight[i];
            }
        }
        let sum = three!(i => DVec3::from_array(three!(axis => f64::from(sums[i].0[axis].reduce_sum()))));
        let weight = three!(i => f64::from(weights[i].reduce_sum()));
        Self {
            lo: Vec3::from_array(three!(axis => lo.0[axis].reduce_min())),
            hi: Vec3::from_array(three!(axis => hi.0[axis].reduce_max())),
            across: sum[1] - sum[0] * (weight[1] / weight[0]),
            along: sum[2] - sum[0] * (weight[2] / weight[0]),
        }
    }

    /// A projection from the light towards the middle of the points; `None` if they are too far apart, at the light, or not
    /// finite.
    pub(super) fn projection(&self, light: ShadowTarget) -> Option<Projection> {
        let &Self { lo, hi, across, along } = self;
        if !(across + along).is_finite() {
            // A point of a plane may exceed the range of an `f32`: the tile is tested ray by ray.
            return None;
        }
        let middle = self.middle().as_dvec3();
        let reach = f64::from(lo.abs().max(hi.abs()).max_element());
        // The map of a projection from a point.
        let towards = |axis: DVec3, from: DVec3| {
            let (u, v) = picture_axes(axis, across, along);
            let rows = [u, v, axis];
            Affine(three!(i => rows[i].extend(-rows[i].dot(from)).to_array()))
        };
        match light {
            ShadowTarget::Parallel(to_light) => {
                Some(Projection::new(towards(-to_light, middle), reach, true))
            }
            ShadowTarget::Point(light) => {
                let axis = middle - light;
                // The angle of the ball around the points, seen from the light, is limited.
                let least = (hi - lo).as_dvec3() * (0.5 * (1.0 + 1.0 / WIDEST));
                let in_front = axis.length_squared() > least.length_squared();
                in_front.then(|| Projection::new(towards(near_one(axis), light), reach, false))
            }
        }
    }

    /// The middle of the bounds.
    pub(super) fn middle(&self) -> Vec3 {
        (self.lo + self.hi) * 0.5
    }

    /// Largest distance of a point from `place` on each axis.
    pub(super) fn reach_from(&self, place: Vec3) -> DVec3 {
        (self.hi - place).max(place - self.lo).as_dvec3()
    }
}

/// Rows of a projection for its picture: perpendicular to `axis`, the first to `along` and the second to `across`, so that
/// blocks of rays fill their rectangles. Their lengths do not matter, so a square root is avoided.
fn picture_axes(axis: DVec3, across: DVec3, along: DVec3) -> (DVec3, DVec3) {
    let (across, along) = (near_one(across), near_one(along));
    let (u, v) = (along.cross(axis), axis.cross(across));
    let (uu, vv) = (u.length_squared(), v.length_squared());
    let volume = across.cross(along).dot(axis);
    // The squared sine of the angle between the two, seen from the light, times the squared lengths.
    if volume * volume * axis.length_squared() > LEAST_SINE * LEAST_SINE * uu * vv {
        return (near_one(u), near_one(v));
    }
    let longer = if uu > vv { near_one(u) } else { near_one(v) };
    if longer.length_squared() > 0.25 {
        (longer, axis.cross(longer))
    } else {
        axis.normalize().any_orthonormal_pair()
    }
}

/// Scales a vector by a power of two, so that its largest component is in [1, 2). Zero stays zero.
fn near_one(vector: DVec3) -> DVec3 {
    let exponent = vector.abs().max_element().to_bits() & (0x7ff << 52);
    vector * f64::from_bits((2046_u64 << 52).saturating_sub(exponent))
}
