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

impl Integrator {
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
    /// Largest radiance, in its brightest channel, that a sample has from light that was scattered more than once; 0 is no limit. A
    /// limit darkens the picture.
    pub clamp_indirect: f32,
    /// Relative error at which a pixel has enough samples; 0 is never.
    pub max_noise: f32,
}

impl Default for PathSettings {
    fn default() -> Self {
        Self { seed: 0, sampler: Sampler::Sobol, roulette: true, clamp_indirect: 0.0, max_noise: 0.0 }
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
