//! The scale at which a picture is rendered.

use serde::{Deserialize, Serialize};

use super::word_of;

/// Share of a picture's width and height that is rendered; the result is enlarged to the full size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum RenderScale {
    /// A sixteenth of the pixels.
    Quarter,
    /// A ninth of the pixels.
    Third,
    /// A quarter of the pixels.
    Half,
    /// Nine sixteenths of the pixels.
    ThreeQuarters,
    /// Every pixel.
    #[default]
    Full,
}

impl RenderScale {
    /// All scales, the smallest first.
    pub const ALL: [Self; 5] = [Self::Quarter, Self::Third, Self::Half, Self::ThreeQuarters, Self::Full];

    /// Each scale with its word.
    pub const WORDS: [(&'static str, Self); 5] = [
        ("1", Self::Full),
        ("3/4", Self::ThreeQuarters),
        ("1/2", Self::Half),
        ("1/3", Self::Third),
        ("1/4", Self::Quarter),
    ];

    /// Rendered pixels per pixel along a side.
    pub fn factor(self) -> f64 {
        match self {
            Self::Quarter => 0.25,
            Self::Third => 1.0 / 3.0,
            Self::Half => 0.5,
            Self::ThreeQuarters => 0.75,
            Self::Full => 1.0,
        }
    }

    /// The scale as a fraction: `1`, `3/4`, `1/2`, `1/3`, `1/4`.
    pub fn word(self) -> &'static str {
        word_of(&Self::WORDS, &self)
    }

    /// Rendered pixels along a side of `side` pixels, rounded up: at least one.
    pub fn of(self, side: u32) -> u32 {
        match self {
            Self::Quarter => side.div_ceil(4),
            Self::Third => side.div_ceil(3),
            Self::Half => side.div_ceil(2),
            Self::ThreeQuarters => side - side / 4,
            Self::Full => side,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_side_is_scaled_and_rounded_up() {
        for side in [1_u32, 2, 3, 4, 5, 767, 768, 1023, 16_384] {
            for (scale, part, parts) in [
                (RenderScale::Full, 1, 1),
                (RenderScale::ThreeQuarters, 3, 4),
                (RenderScale::Half, 1, 2),
                (RenderScale::Third, 1, 3),
                (RenderScale::Quarter, 1, 4),
            ] {
                assert_eq!(scale.of(side), (side * part).div_ceil(parts), "{side} {scale:?}");
                assert!((scale.factor() - f64::from(part) / f64::from(parts)).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn scales_are_ordered_and_each_has_a_word() {
        let factors = RenderScale::ALL.map(RenderScale::factor);
        assert!(factors.is_sorted(), "{factors:?}");
        assert_eq!(RenderScale::ALL.map(RenderScale::word), ["1/4", "1/3", "1/2", "3/4", "1"]);
    }
}
