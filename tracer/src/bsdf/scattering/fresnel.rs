//! Fresnel shares in lanes: exact for a dielectric and for a sheet of one, and the weight of Schlick's approximation ("An inexpensive BRDF
//! model for physically-based rendering", 1994).

use crate::simd::{Simd, SimdBase, SimdFloat, f32x16, select, splat};

/// Square of the cosine on the far side of an interface with eta = n_from / n_to; negative for total internal reflection.
#[inline(always)]
pub(super) fn transmitted_square<S: Simd>(simd: S, cosine: f32x16<S>, eta: f32x16<S>) -> f32x16<S> {
    let one = splat(simd, 1.0);
    one - eta * eta * ((one - cosine) * (one + cosine)).max(splat(simd, 0.0))
}

/// Share of unpolarised light that a dielectric reflects; 1 for total internal reflection and cosines from 0 down, 0 where eta is 1.
#[inline(always)]
pub(super) fn exact<S: Simd>(simd: S, cosine: f32x16<S>, eta: f32x16<S>) -> f32x16<S> {
    let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let square = transmitted_square(simd, cosine, eta);
    let through = square.simd_gt(zero) & cosine.simd_gt(zero);
    let cosine = select(through, cosine, one);
    let transmitted = select(through, square, one).sqrt();
    let parallel = (cosine - eta * transmitted) / (cosine + eta * transmitted);
    let across = (eta * cosine - transmitted) / (eta * cosine + transmitted);
    let share = splat(simd, 0.5) * (parallel * parallel + across * across);
    select(eta.simd_eq(one), zero, select(through, share, one))
}

/// Share that a sheet with two surfaces of a share each reflects: 2 F / (1 + F).
#[inline(always)]
pub(super) fn of_sheet<S: Simd>(simd: S, share: f32x16<S>) -> f32x16<S> {
    (share + share) / (splat(simd, 1.0) + share)
}

/// (1 - cos)^5.
#[inline(always)]
pub(super) fn schlick<S: Simd>(simd: S, cosine: f32x16<S>) -> f32x16<S> {
    let rest = (splat(simd, 1.0) - cosine).max(splat(simd, 0.0));
    let square = rest * rest;
    square * square * rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{LANES, all, dispatch};

    #[inline(always)]
    fn shares<S: Simd>(simd: S, cosines: [f32; LANES], eta: f32) -> [[f32; LANES]; 2] {
        let share = exact(simd, f32x16::load_array(simd, cosines), splat(simd, eta));
        [share.to_array(), of_sheet(simd, share).to_array()]
    }

    #[test]
    fn shares_in_lanes_are_those_in_double_precision() {
        for eta in [0.4_f32, 1.0 / 1.5, 0.9, 1.0, 1.1, 1.5, 2.4] {
            for step in 0..64 {
                let cosines = std::array::from_fn(|lane| (step * LANES + lane + 1) as f32 / 1024.0);
                let first = dispatch!(all()[0], simd => shares(simd, cosines, eta));
                for level in all() {
                    let here = dispatch!(level, simd => shares(simd, cosines, eta));
                    assert_eq!(here.map(|row| row.map(f32::to_bits)), first.map(|row| row.map(f32::to_bits)));
                }
                for (lane, &cosine) in cosines.iter().enumerate() {
                    let (c, eta) = (f64::from(cosine), f64::from(eta));
                    // Next to the critical angle the share has no bounded slope.
                    if (1.0 - eta * eta * (1.0 - c * c)).abs() < 1e-3 {
                        continue;
                    }
                    let expected = crate::bsdf::fresnel(c, eta);
                    let found = f64::from(first[0][lane]);
                    assert!((found - expected).abs() < 2e-5, "{eta} {c}: {found}, not {expected}");
                    let sheet = 2.0 * expected / (1.0 + expected);
                    assert!((f64::from(first[1][lane]) - sheet).abs() < 5e-5);
                }
            }
        }
    }
}
