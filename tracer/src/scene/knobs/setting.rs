//! Operations on whole settings, as loops over the table of knobs.

use std::borrow::Cow;

use super::{ColorDepth, ExponentPrecision, KnobForm};
use super::{KNOBS, Quality, RenderScale, Setting, Shading};
use crate::scene::data::{Integrator, PathSettings, RenderSettings, Sampler, SceneFeatures};
use crate::scene::validate::{MAX_DEPTH, MAX_PATH_SAMPLES, MAX_SHADOW_SAMPLES};

impl Setting {
    /// The best value of every knob: as a limit it changes no setting. It is no setting to render with: the depth, for example, is
    /// the largest that is allowed.
    pub const FULL: Self = Self {
        integrator: Integrator::Direct,
        samples: MAX_PATH_SAMPLES,
        scale: RenderScale::Full,
        quality: Quality {
            shadows: true,
            adaptive: false,
            shading: Shading::Full,
            filter: None,
            exponent: ExponentPrecision::Exact,
            colors: ColorDepth::Exact,
            dither: false,
            max_depth: MAX_DEPTH,
            min_contribution: 0.0,
            shadow_samples: MAX_SHADOW_SAMPLES,
            smooth_terminator: true,
        },
    };

    /// The best value of every knob, as [`Setting::FULL`], for pictures of an integrator: with knobs of the path integrator if it
    /// is the one.
    pub fn full_with(integrator: Integrator) -> Self {
        let best = |settings| PathSettings { sampler: Sampler::Sobol, clamp_indirect: 0.0, ..settings };
        let integrator = match integrator {
            Integrator::Direct => Integrator::Direct,
            Integrator::Path(settings) => Integrator::Path(best(settings)),
        };
        Self { integrator, ..Self::FULL }
    }

    /// The setting with another integrator. Numbers of samples and bounces that are the defaults of the former integrator become
    /// those of the new one. A setting with an integrator of the same kind keeps all.
    #[must_use]
    pub fn changed_to(self, integrator: Integrator) -> Self {
        let changed = self.integrator.changed_to(integrator);
        let usual = |integrator: &Integrator| RenderSettings::with_integrator(*integrator).setting();
        let (before, after) = (usual(&self.integrator), usual(&changed));
        let mut setting = Self { integrator: changed, ..self };
        if self.samples == before.samples {
            setting.samples = after.samples;
        }
        if self.quality.max_depth == before.quality.max_depth {
            setting.quality.max_depth = after.quality.max_depth;
        }
        setting
    }

    /// For each knob the cheaper value of both settings. Knobs that reduce nothing keep their value, and so do values apart from
    /// the order.
    #[must_use]
    pub fn at_most(self, limit: &Self) -> Self {
        let mut setting = self;
        for knob in KNOBS.iter().filter(|knob| knob.reduces) {
            knob.limit(&mut setting, limit);
        }
        setting
    }

    /// Full quality of the same picture: the setting with the best value of every knob that reduces accuracy. Samples are the
    /// largest number of the integrator. Numbers of a range
    /// keep their values, because full quality is the scene's own number, and so do values apart from the order.
    #[must_use]
    pub fn restored(self) -> Self {
        let mut setting = self;
        for knob in KNOBS.iter().filter(|knob| knob.reduces && !matches!(knob.form, KnobForm::Number(_))) {
            if let (Some(_), Some(best)) =
                (knob.rank_of(&setting), knob.values_with(setting.integrator).next_back())
            {
                best.apply(&mut setting);
            }
        }
        setting
    }

    /// The setting, as a limit, with the best value for every knob that makes no difference to a scene with these features.
    #[must_use]
    pub fn without_idle(self, features: &SceneFeatures) -> Self {
        let mut setting = self;
        for knob in KNOBS.iter().filter(|knob| knob.reduces) {
            if !knob.matters(features, &setting) {
                knob.best().apply(&mut setting);
            }
        }
        setting
    }

    /// Short names of all values that reduce the accuracy, in the order of the table.
    pub fn reductions(&self) -> Vec<Cow<'static, str>> {
        let acting = KNOBS.iter().filter(|knob| knob.has_effect_with(&self.integrator) && (knob.acts)(self));
        acting.filter_map(|knob| knob.reduction(self)).collect()
    }
}
