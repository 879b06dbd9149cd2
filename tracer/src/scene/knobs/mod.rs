//! The knobs that trade accuracy for speed: one table for scene files, command lines, ladders, reports and documentation.
//!
//! [`KNOBS`] lists every knob with its names, its values from cheapest to best, how each value is applied to a [`Setting`],
//! and when the knob matters. A new knob is an entry of the table and the code of the tracer that obeys it.
//!
//! Some knobs take any number of a range ([`NumberRange`]); their lists have the numbers that the quality controller and
//! `tradeoff` choose from. Some have values apart from the order, which no program chooses by itself ([`Knob::apart`]).
//!
//! ```
//! use rayfarm_tracer::scene::Setting;
//! use rayfarm_tracer::scene::knobs::Knob;
//!
//! let shading = Knob::named("shading").ok_or("no such knob")?;
//! let mut setting = Setting::FULL;
//! shading.value("diffuse").ok_or("no such value")?.apply(&mut setting);
//! assert_eq!(shading.value_of(&setting).word, Some("diffuse"));
//! assert_eq!(setting.reductions(), ["diffuse only"]);
//! # Ok::<(), &str>(())
//! ```

mod number;
mod setting;
mod table;
#[cfg(test)]
mod tests;

use std::borrow::Cow;

pub use super::data::{ColorDepth, ExponentPrecision, Quality, RenderScale, Setting, Shading, word_of};
pub use number::NumberRange;
pub use table::KNOBS;

use super::data::{Integrator, SceneFeatures};
use super::validate::is_sample_count;

/// A knob: one property of a [`Setting`] with a list of values.
#[derive(Debug)]
pub struct Knob {
    /// Name in reports and in the JSON of `--json`.
    pub name: &'static str,
    /// Key in `[render]` of a scene file.
    pub key: &'static str,
    /// Option of the command line, without the leading `--`.
    pub option: &'static str,
    /// One line for help and documentation.
    pub summary: &'static str,
    /// Notation of a value.
    pub form: KnobForm,
    /// The values in their order, the cheapest first. The last one is the best: as a limit it changes no setting. A knob with a
    /// [`NumberRange`] also has the numbers between them.
    pub values: &'static [KnobValue],
    /// Values that are neither cheaper nor better than others, because they request another kind of picture. No limit changes
    /// them, and no limit has them.
    pub apart: &'static [KnobValue],
    /// Whether a cheaper value reduces the accuracy of a picture. Other knobs are never turned automatically.
    pub reduces: bool,
    /// Integrators whose pictures can depend on the knob.
    pub scope: KnobScope,
    /// Whether the value has an effect next to the other knobs of a setting, whatever the scene.
    acts: fn(&Setting) -> bool,
    /// See [`Knob::matters`].
    matters: fn(&SceneFeatures, &Setting) -> bool,
}

/// Notation of a knob's values in scene files and on command lines.
#[derive(Clone, Copy, Debug)]
pub enum KnobForm {
    /// `true` or `false` in a scene file, `on` or `off` on the command line, where the option alone means `on`.
    Switch,
    /// One of the words of the values.
    Word,
    /// A number of samples, any of a range with the path integrator, and a square number up to [`super::MAX_SAMPLES`] with the
    /// direct one.
    Count(&'static NumberRange),
    /// A number or a fraction: 0.5, or 1/2, which is in quotes in a scene file.
    Fraction,
    /// Any number of a range, whether or not it is one of the values.
    Number(&'static NumberRange),
}

/// Integrators whose pictures can depend on a knob.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KnobScope {
    /// Every integrator.
    All,
    /// The direct integrator only.
    Direct,
    /// The path integrator only, whose settings have the value: other settings have none.
    Paths,
}

/// A value of a knob as a scene file or a command line gives it.
#[derive(Clone, Copy, Debug)]
pub enum GivenValue {
    /// A value of the table.
    Listed(&'static KnobValue),
    /// A number of a range.
    Number(&'static NumberRange, f32),
}

impl GivenValue {
    /// Gives a setting this value.
    pub fn apply(&self, setting: &mut Setting) {
        match self {
            Self::Listed(value) => value.apply(setting),
            Self::Number(range, number) => range.apply(*number, setting),
        }
    }

    /// Whether a setting has this value.
    pub fn is_of(&self, setting: &Setting) -> bool {
        let mut applied = *setting;
        self.apply(&mut applied);
        applied == *setting
    }
}

/// A value of a knob.
#[derive(Debug)]
pub struct KnobValue {
    /// The value as it is written; `None` for the value that only the absence of the key or option selects.
    pub word: Option<&'static str>,
    /// Other spellings on the command line.
    pub aliases: &'static [&'static str],
    /// Short name of a reduction for overlays and logs, such as "no shadows"; `None` where nothing is reduced.
    pub label: Option<&'static str>,
    /// Part of the names of settings in tables and files, such as "no-shadows"; `None` for the usual value.
    pub slug: Option<&'static str>,
    apply: fn(&mut Setting),
}

impl Knob {
    /// The knob with this [`Knob::name`].
    pub fn named(name: &str) -> Option<&'static Self> {
        KNOBS.iter().find(|knob| knob.name == name)
    }

    /// The value with this word or alias.
    pub fn value(&self, text: &str) -> Option<&'static KnobValue> {
        self.all().find(|value| value.word == Some(text) || value.aliases.contains(&text))
    }

    /// The value that a setting has; the best for a setting without a value. For a number between two of the list it is the cheaper one of them; for a number that is
    /// cheaper than all of the list, the cheapest.
    pub fn value_of(&self, setting: &Setting) -> &'static KnobValue {
        match self.rank_of(setting) {
            Some(rank) => &self.values[rank],
            None => self.apart.iter().find(|value| value.is_of(setting)).unwrap_or(self.best()),
        }
    }

    /// The values that programs choose from for pictures of an integrator, the cheapest first. All integrators have the same,
    /// except for numbers of samples: squares with the direct integrator, powers of two with the path integrator.
    pub fn values_with(
        &self,
        integrator: Integrator,
    ) -> impl DoubleEndedIterator<Item = &'static KnobValue> + use<> {
        let is_count = matches!(self.form, KnobForm::Count(_));
        self.values.iter().filter(move |value| !is_count || has_listed_samples(value, integrator))
    }

    /// Whether pictures of an integrator can depend on the knob.
    pub fn has_effect_with(&self, integrator: &Integrator) -> bool {
        match self.scope {
            KnobScope::All => true,
            KnobScope::Direct => integrator.path().is_none(),
            KnobScope::Paths => integrator.path().is_some(),
        }
    }

    /// The best value.
    pub fn best(&self) -> &'static KnobValue {
        &self.values[self.values.len() - 1]
    }

    /// The words of all values, the best first, and then those apart from the order.
    pub fn words(&self) -> impl Iterator<Item = &'static str> {
        self.values.iter().rev().chain(self.apart).filter_map(|value| value.word)
    }

    /// Short name of the reduction of a setting for overlays and logs, such as "no shadows" or "depth 1"; `None` where nothing is
    /// reduced.
    pub fn reduction(&self, setting: &Setting) -> Option<Cow<'static, str>> {
        match self.range() {
            Some(range) => range.reduction(setting).map(Cow::Owned),
            None => self.value_of(setting).label.map(Cow::Borrowed),
        }
    }

    /// Whether the picture of a scene with these features, at this setting, can depend on the knob.
    pub fn matters(&self, features: &SceneFeatures, setting: &Setting) -> bool {
        self.has_effect_with(&setting.integrator)
            && (self.matters)(&features.shown_by(setting.quality.shading), setting)
    }

    /// Lowers a setting to the value of `limit`, where that is cheaper.
    fn limit(&self, setting: &mut Setting, limit: &Setting) {
        if !self.is_in(setting) || !self.is_in(limit) {
            return;
        }
        if let Some(range) = self.range() {
            return range.limit(setting, limit);
        }
        if let (Some(own), Some(most)) = (self.rank_of(setting), self.rank_of(limit))
            && most < own
        {
            self.values[most].apply(setting);
        }
    }

    /// Place of a setting's value among the ordered values: 0 is the cheapest. `None` for a value apart from the order, and
    /// for a setting without a value.
    fn rank_of(&self, setting: &Setting) -> Option<usize> {
        if !self.is_in(setting) {
            return None;
        }
        if let Some(range) = self.range() {
            return Some(range.rank_of(setting, self.values));
        }
        self.values.iter().position(|value| value.is_of(setting))
    }

    /// Whether a setting has a value of the knob.
    fn is_in(&self, setting: &Setting) -> bool {
        self.scope != KnobScope::Paths || setting.integrator.path().is_some()
    }

    /// The numbers of a knob that is a number.
    fn range(&self) -> Option<&'static NumberRange> {
        match self.form {
            KnobForm::Number(range) | KnobForm::Count(range) => Some(range),
            KnobForm::Switch | KnobForm::Word | KnobForm::Fraction => None,
        }
    }

    /// The ordered values and those apart from the order.
    fn all(&self) -> impl Iterator<Item = &'static KnobValue> {
        self.values.iter().chain(self.apart)
    }
}

/// Whether a number of samples is one that programs choose for pictures of an integrator.
fn has_listed_samples(value: &KnobValue, integrator: Integrator) -> bool {
    let mut setting = Setting { integrator, ..Setting::FULL };
    value.apply(&mut setting);
    match integrator {
        Integrator::Direct => is_sample_count(&integrator, setting.samples),
        Integrator::Path(_) => setting.samples.is_power_of_two(),
    }
}

impl KnobValue {
    /// Gives a setting this value.
    pub fn apply(&self, setting: &mut Setting) {
        (self.apply)(setting);
    }

    /// Whether a setting has this value.
    pub fn is_of(&self, setting: &Setting) -> bool {
        let mut applied = *setting;
        self.apply(&mut applied);
        applied == *setting
    }
}
