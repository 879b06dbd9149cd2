//! How the light of a picture is computed.

use serde::{Deserialize, Serialize};

/// The integrator of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Integrator {
    /// Direct Blinn-Phong light in Hall's form, with mirrors and glass: no randomness.
    #[default]
    Direct,
    /// Monte-Carlo paths, which converge to the solution of the rendering equation (Kajiya 1986).
    Path(PathSettings),
}

/// Default depths: see [`super::Quality::max_depth`].
const DIRECT_DEPTH: u8 = 5;
const PATH_DEPTH: u8 = 8;
/// Default numbers of rays per pixel.
const DIRECT_SAMPLES: u32 = 1;
const PATH_SAMPLES: u32 = 64;

impl Integrator {
    /// Each value with its word, the path integrator with its default settings.
    pub const WORDS: [(&'static str, Self); 2] =
        [("direct", Self::Direct), ("path", Self::Path(PathSettings::DEFAULT))];

    /// The integrator with its default settings.
    #[must_use]
    pub fn usual(&self) -> Self {
        match self {
            Self::Direct => Self::Direct,
            Self::Path(_) => Self::Path(PathSettings::DEFAULT),
        }
    }

    /// The default of [`super::Quality::max_depth`] with this integrator.
    pub fn usual_depth(&self) -> u8 {
        match self {
            Self::Direct => DIRECT_DEPTH,
            Self::Path(_) => PATH_DEPTH,
        }
    }

    /// The default number of rays per pixel with this integrator.
    pub fn usual_samples(&self) -> u32 {
        match self {
            Self::Direct => DIRECT_SAMPLES,
            Self::Path(_) => PATH_SAMPLES,
        }
    }

    /// The other integrator; itself, with its settings, if the other one is of the same kind.
    #[must_use]
    pub fn changed_to(self, other: Self) -> Self {
        match (self, other) {
            (Self::Path(_), Self::Path(_)) => self,
            _ => other,
        }
    }

    /// The settings of the path integrator, if it is the one.
    pub fn path(&self) -> Option<&PathSettings> {
        match self {
            Self::Direct => None,
            Self::Path(settings) => Some(settings),
        }
    }
}

/// Settings of the path integrator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathSettings {
    /// Selects the random numbers: another seed gives another noise.
    pub seed: u32,
    /// Numbers of the samples.
    pub sampler: Sampler,
    /// Whether paths of little weight end early, by Russian roulette: the mean of the picture does not change.
    pub roulette: bool,
    /// Largest radiance, in its brightest channel, that one contribution adds to a sample, of light that was scattered more than once; 0 is
    /// no limit. A limit darkens the picture.
    pub clamp_indirect: f32,
    /// Relative error at which a pixel has enough samples; 0 is never.
    pub max_noise: f32,
}

impl PathSettings {
    /// The default settings.
    pub const DEFAULT: Self =
        Self { seed: 0, sampler: Sampler::Sobol, roulette: true, clamp_indirect: 0.0, max_noise: 0.0 };
}

impl Default for PathSettings {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Random numbers of the samples of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sampler {
    /// Owen-scrambled Sobol points: the samples of a pixel are spread evenly (Burley 2020).
    Sobol,
    /// Independent numbers.
    Independent,
}

impl Sampler {
    /// Each value with its word.
    pub const WORDS: [(&'static str, Self); 2] = [("sobol", Self::Sobol), ("independent", Self::Independent)];
}
