//! Values of the knobs that trade accuracy for speed.
//!
//! Every value has a word, the same in scene files, on the command line and in reports.

use serde::{Deserialize, Serialize};

use crate::texture::Filter;

/// Accuracy of a frame. The default is full quality: everything that the scene requests, exactly.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// Whether lights that cast shadows do. Without, no shadow ray is traced.
    pub shadows: bool,
    /// Whether pixels without edges are sampled sparsely.
    pub adaptive: bool,
    /// Terms of the shading equation.
    pub shading: Shading,
    /// Filter of all textures; `None` leaves each texture its own.
    pub filter: Option<Filter>,
    /// Precision of (N.H)^p.
    pub exponent: ExponentPrecision,
    /// Colours that a pixel can have.
    pub colors: ColorDepth,
    /// Whether pixels are dithered where light is quantised to bytes, which replaces bands by a pattern.
    pub dither: bool,
    /// Largest number of reflections and transmissions between the camera and a surface; 0 traces none.
    pub max_depth: u8,
    /// A reflection or transmission that can add less than this, in its brightest channel, is not traced.
    pub min_contribution: f32,
    /// Points of a light with a radius that shadow rays go to, where the light itself has no number.
    pub shadow_samples: u16,
    /// Whether shadow rays of points with interpolated normals start on the smooth surface that the normals describe, so that the
    /// edge of a mesh's own shadow does not show its triangles.
    pub smooth_terminator: bool,
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
            max_depth: 5,
            min_contribution: 0.004,
            shadow_samples: 16,
            smooth_terminator: true,
        }
    }
}

/// Content of a picture: light, by all or some terms of the shading equation, or a property of the surfaces. Those pictures have a
/// black background.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Shading {
    /// All terms that the materials have.
    Full,
    /// The diffuse and the ambient term: no specular term, and no vectors to the viewer.
    Diffuse,
    /// Not light but the shading normal, turned to the viewer, in world space: (n + 1) / 2 as a linear colour.
    Normals,
    /// Not light but the distance d from the start of the ray, in greys: 1 / (1 + d / s), where s is the distance from the camera
    /// to the point that it looks at.
    Depth,
    /// Not light but a colour for each model, sphere, disk, plane and single triangle.
    Item,
    /// Not light but the diffuse colour, with textures, vertex colours and checkers.
    Albedo,
}

/// Precision of the power (N.H)^p of a highlight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ExponentPrecision {
    /// Within the rounding of `f32`, and in `f64` where exponents are large.
    Exact,
    /// By an approximation with a known error.
    Fast,
}

/// Colours that a pixel can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ColorDepth {
    /// All of RGB8.
    Exact,
    /// Those of RGB 5-6-5: 16 bits per pixel on the wire.
    Reduced,
}

impl Shading {
    /// Each value with its word.
    pub const WORDS: [(&'static str, Self); 6] = [
        ("full", Self::Full),
        ("diffuse", Self::Diffuse),
        ("normals", Self::Normals),
        ("depth", Self::Depth),
        ("item", Self::Item),
        ("albedo", Self::Albedo),
    ];

    /// Whether pictures show light: else no light is computed, and no ray leaves a surface.
    pub fn is_light(self) -> bool {
        matches!(self, Self::Full | Self::Diffuse)
    }
}

impl ExponentPrecision {
    /// Each value with its word.
    pub const WORDS: [(&'static str, Self); 2] = [("exact", Self::Exact), ("fast", Self::Fast)];
}

impl ColorDepth {
    /// Each value with its word.
    pub const WORDS: [(&'static str, Self); 2] = [("exact", Self::Exact), ("reduced", Self::Reduced)];
}

/// The word of a value; empty for a value that is not in the list.
pub fn word_of<T: PartialEq>(words: &[(&'static str, T)], value: &T) -> &'static str {
    words.iter().find(|(_, known)| known == value).map_or("", |(word, _)| word)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_lead_back_to_their_values() {
        assert_eq!(word_of(&Shading::WORDS, &Shading::Diffuse), "diffuse");
        assert_eq!(word_of(&ExponentPrecision::WORDS, &ExponentPrecision::Exact), "exact");
        assert_eq!(word_of(&ColorDepth::WORDS, &ColorDepth::Reduced), "reduced");
        assert_eq!(word_of(&Filter::WORDS, &Filter::Nearest), "nearest");
    }
}
