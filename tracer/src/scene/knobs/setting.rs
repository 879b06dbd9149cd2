//! Operations on whole settings, as loops over the table of knobs.

use super::{ColorDepth, ExponentPrecision};
use super::{KNOBS, Quality, RenderScale, Setting, Shading};
use crate::scene::data::SceneFeatures;
use crate::scene::validate::MAX_SAMPLES;

impl Setting {
    /// The best value of every knob, and the largest sample count: as a limit it changes no setting.
    pub const FULL: Self = Self {
        samples: MAX_SAMPLES,
        scale: RenderScale::Full,
        quality: Quality {
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
        },
    };

    /// For each knob the cheaper value of both settings. Knobs that reduce nothing keep their value.
    #[must_use]
    pub fn at_most(self, limit: &Self) -> Self {
        let mut setting = self;
        for knob in KNOBS.iter().filter(|knob| knob.reduces) {
            let rank = knob.rank_of(limit);
            if rank < knob.rank_of(&self) {
                knob.values[rank].apply(&mut setting);
            }
        }
        setting
    }

    /// The setting with the best value for every knob that makes no difference to a scene with these features.
    #[must_use]
    pub fn without_idle(self, features: &SceneFeatures) -> Self {
        let mut setting = self;
        for knob in KNOBS.iter().filter(|knob| knob.reduces) {
            if !(knob.matters)(features, &setting) {
                knob.best().apply(&mut setting);
            }
        }
        setting
    }

    /// Labels of all values that reduce the accuracy, in the order of the table.
    pub fn reductions(&self) -> Vec<&'static str> {
        let acting = KNOBS.iter().filter(|knob| (knob.acts)(self));
        acting.filter_map(|knob| knob.value_of(self).label).collect()
    }
}
