//! Texture coordinates, with and without whole repeats.

use glam::{DVec2, Vec2};

/// Largest texture coordinate, in magnitude. A triangle over which a picture repeats more often than once a pixel shows noise in
/// any case.
pub const MAX_UV: f64 = 1e6;

/// Largest texture coordinate without whole repeats: see [`without_repeats`].
const MAX_STORED_UV: f32 = 2e6 + 1.0;

/// Texture coordinates of a triangle without whole repeats of the picture, so that the smallest u and v are in [0, 1) and `f32`
/// keeps their digits; `None` when one is not finite or beyond [`MAX_UV`].
pub fn without_repeats(uvs: [DVec2; 3]) -> Option<[Vec2; 3]> {
    split_repeats(uvs).map(|(uvs, _)| uvs)
}

/// Texture coordinates as from [`without_repeats`], and the whole repeats that were removed: their sum is the input.
pub fn split_repeats(uvs: [DVec2; 3]) -> Option<([Vec2; 3], Vec2)> {
    let whole = uvs[0].min(uvs[1]).min(uvs[2]).floor();
    are_usable(&uvs).then(|| (uvs.map(|uv| (uv - whole).as_vec2()), whole.as_vec2()))
}

/// Whether texture coordinates are finite and within [`MAX_UV`].
pub fn are_usable(uvs: &[DVec2; 3]) -> bool {
    uvs.iter().all(|uv| uv.abs().cmple(DVec2::splat(MAX_UV)).all())
}

/// Whether a texture coordinate of a mesh or scene is one that a loader can have made.
pub(crate) fn is_usable(uv: Vec2) -> bool {
    // False for NaN.
    uv.to_array().iter().all(|c| c.abs() <= MAX_STORED_UV)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_repeats_are_removed() {
        let uvs = |x: f64| [DVec2::new(x, 0.25), DVec2::new(x + 1.5, -0.5), DVec2::new(x + 0.25, 0.0)];
        let near = without_repeats(uvs(0.125)).unwrap();
        assert_eq!(near, [Vec2::new(0.125, 1.25), Vec2::new(1.625, 0.5), Vec2::new(0.375, 1.0)]);
        for whole in [-999_999.0, -7.0, 3.0, 999_998.0] {
            assert_eq!(without_repeats(uvs(whole + 0.125)), Some(near));
        }
        assert!(near.into_iter().all(is_usable));
        let whole = split_repeats(uvs(-7.875)).unwrap();
        assert_eq!(whole, (near, Vec2::new(-8.0, -1.0)));
        for odd in [f64::NAN, f64::INFINITY, 1.1e6, -1e300] {
            assert_eq!(without_repeats(uvs(odd)), None);
        }
        let wide = without_repeats([DVec2::splat(-1e6), DVec2::splat(1e6), DVec2::ZERO]).unwrap();
        assert!(wide.into_iter().all(is_usable));
        assert!(![f32::NAN, f32::INFINITY, -1e7, 1e7].into_iter().any(|c| is_usable(Vec2::new(0.5, c))));
    }
}
