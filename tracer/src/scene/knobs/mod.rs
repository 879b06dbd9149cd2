//! The knobs that trade accuracy for speed: one table for scene files, command lines, ladders, reports and documentation.
//!
//! [`KNOBS`] lists every knob with its names, its values from cheapest to best, how each value is applied to a [`Setting`],
//! and when the knob matters. A new knob is an entry of the table and the code of the tracer that obeys it.
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

mod setting;
mod table;
#[cfg(test)]
mod tests;

pub use super::data::{ColorDepth, ExponentPrecision, Quality, RenderScale, Setting, Shading, word_of};
pub use table::KNOBS;

use super::data::SceneFeatures;

/// A knob: one property of a [`Setting`] with a fixed list of values.
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
    /// How a value is written.
    pub form: KnobForm,
    /// All values, the cheapest first. The last one is the best: it leaves the picture as the scene requests it.
    pub values: &'static [KnobValue],
    /// Whether a cheaper value reduces the accuracy of a picture. Other knobs are never turned automatically.
    pub reduces: bool,
    /// Whether the value has an effect next to the other knobs of a setting, whatever the scene.
    pub acts: fn(&Setting) -> bool,
    /// Whether the picture of a scene with these features can depend on the knob.
    pub matters: fn(&SceneFeatures, &Setting) -> bool,
}

/// How the values of a knob are written in scene files and on command lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KnobForm {
    /// `true` or `false` in a scene file, `on` or `off` on the command line, where the option alone means `on`.
    Switch,
    /// One of the words of the values.
    Word,
    /// A whole number, one of the words of the values.
    Count,
    /// A number or a fraction: 0.5, or 1/2, which is in quotes in a scene file.
    Fraction,
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
        self.values.iter().find(|value| value.word == Some(text) || value.aliases.contains(&text))
    }

    /// The value that a setting has; the best one for a sample count beyond the list.
    pub fn value_of(&self, setting: &Setting) -> &'static KnobValue {
        &self.values[self.rank_of(setting)]
    }

    /// The best value.
    pub fn best(&self) -> &'static KnobValue {
        &self.values[self.values.len() - 1]
    }

    /// The words of all values, the best first.
    pub fn words(&self) -> impl Iterator<Item = &'static str> {
        self.values.iter().rev().filter_map(|value| value.word)
    }

    /// Place of a setting's value among the values: 0 is the cheapest.
    fn rank_of(&self, setting: &Setting) -> usize {
        let last = self.values.len() - 1;
        self.values.iter().position(|value| value.is_of(setting)).unwrap_or(last)
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
