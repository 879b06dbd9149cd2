//! The knobs that trade accuracy for speed: what a frame may leave out or do more roughly than the scene asks for.
//!
//! Each knob has a word for each of its positions, the same in scene files, on the command line and in reports.

use serde::{Deserialize, Serialize};

use super::Filter;

/// How faithfully a frame is rendered. The default is full quality: all that the scene asks for, exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Quality {
    /// Whether lights that cast shadows do. Without, no shadow ray is traced.
    pub shadows: bool,
    /// Whether pixels without edges get by with few samples.
    pub adaptive: bool,
    /// The terms of the shading equation.
    pub shading: Shading,
    /// How every texture is looked up; `None` leaves it to each texture.
    pub filter: Option<Filter>,
    /// How N.H is raised to its power.
    pub exponent: ExponentPrecision,
    /// The colours that a pixel can have.
    pub colors: ColorDepth,
    /// Whether pixels are dithered where light becomes bytes: a pattern in place of bands.
    pub dither: bool,
}

impl Default for Quality {
    fn default() -> Self {
        Self {
            shadows: true,
            adaptive: false,
            shading: Shading::Full,
            filter: None,
            exponent: ExponentPrecision::Exact,
            colors: ColorDepth::Exact,
            dither: false,
        }
    }
}

/// The terms of the shading equation that are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Shading {
    /// All that the materials ask for.
    Full,
    /// The diffuse and the ambient one: no specular term, and no vectors to the viewer.
    Diffuse,
}

/// How the highlight's power is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ExponentPrecision {
    /// Within the rounding of `f32`, and in `f64` where exponents are large.
    Exact,
    /// By a formula with a known error.
    Fast,
}

/// The colours that a pixel can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ColorDepth {
    /// All of RGB8.
    Exact,
    /// Those of RGB 5-6-5: 16 bits a pixel on the wire.
    Reduced,
}

/// The part of a picture's width and height at which it is rendered, to be enlarged for whoever looks at it.
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

impl Shading {
    /// Each position with its word.
    pub const WORDS: [(&'static str, Self); 2] = [("full", Self::Full), ("diffuse", Self::Diffuse)];
}

impl ExponentPrecision {
    /// Each position with its word.
    pub const WORDS: [(&'static str, Self); 2] = [("exact", Self::Exact), ("fast", Self::Fast)];
}

impl ColorDepth {
    /// Each position with its word.
    pub const WORDS: [(&'static str, Self); 2] = [("exact", Self::Exact), ("reduced", Self::Reduced)];
}

impl Filter {
    /// Each position with its word.
    pub const WORDS: [(&'static str, Self); 2] = [("nearest", Self::Nearest), ("bilinear", Self::Bilinear)];
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

    /// As people write it.
    pub fn word(self) -> &'static str {
        word_of(&Self::WORDS, &self)
    }

    /// Pixels that are rendered along a side of so many, rounded up: at least one.
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

/// The word of a position.
pub fn word_of<T: PartialEq>(words: &[(&'static str, T)], position: &T) -> &'static str {
    words.iter().find(|(_, known)| known == position).map_or("", |(word, _)| word)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_leaves_its_part_of_each_side_rounded_up() {
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
    fn scales_are_in_order_and_each_has_a_word() {
        let factors = RenderScale::ALL.map(RenderScale::factor);
        assert!(factors.is_sorted(), "{factors:?}");
        assert_eq!(RenderScale::ALL.map(RenderScale::word), ["1/4", "1/3", "1/2", "3/4", "1"]);
    }

    #[test]
    fn words_lead_back_to_their_positions() {
        assert_eq!(word_of(&Shading::WORDS, &Shading::Diffuse), "diffuse");
        assert_eq!(word_of(&ExponentPrecision::WORDS, &ExponentPrecision::Exact), "exact");
        assert_eq!(word_of(&ColorDepth::WORDS, &ColorDepth::Reduced), "reduced");
        assert_eq!(word_of(&Filter::WORDS, &Filter::Nearest), "nearest");
    }
}
