//! Knobs whose value is any number of a range.

use std::ops::RangeInclusive;

use super::{KnobValue, Setting};
use crate::scene::data::RenderSettings;

/// The numbers of a knob that takes any of a range.
#[derive(Debug)]
pub struct NumberRange {
    /// The smallest number.
    pub least: f32,
    /// The largest number.
    pub most: f32,
    /// Whether only whole numbers are allowed.
    pub whole: bool,
    /// Which numbers are better.
    pub(super) order: Order,
    pub(super) get: fn(&Setting) -> f32,
    pub(super) set: fn(&mut Setting, f32),
    /// Short name of a reduction to a number; `None` for a number that reports have on its own.
    pub(super) label: Option<fn(f32) -> String>,
}

/// The order of the numbers of a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// Larger numbers are better.
    Rises,
    /// Smaller numbers are better.
    Falls,
    /// Larger numbers are better, and 0, which is no limit, is the best.
    RisesToZero,
}

impl NumberRange {
    /// The number of a setting.
    pub fn of(&self, setting: &Setting) -> f32 {
        (self.get)(setting)
    }

    /// Gives a setting a number.
    pub fn apply(&self, number: f32, setting: &mut Setting) {
        (self.set)(setting, number);
    }

    /// Whether a number is allowed.
    pub fn contains(&self, number: f64) -> bool {
        let range = f64::from(self.least)..=f64::from(self.most);
        range.contains(&number) && (!self.whole || number.fract() == 0.0)
    }

    /// The ends of a range of whole numbers.
    pub fn whole_numbers(&self) -> RangeInclusive<u32> {
        self.least as u32..=self.most as u32
    }

    /// Lowers the number of a setting to that of `limit`, where that is cheaper.
    pub(super) fn limit(&self, setting: &mut Setting, limit: &Setting) {
        let most = self.of(limit);
        if self.is_cheaper(most, self.of(setting)) {
            self.apply(most, setting);
        }
    }

    /// Place of the best listed value that is no better than the number of a setting; 0 if all of the list are better.
    pub(super) fn rank_of(&self, setting: &Setting, values: &[KnobValue]) -> usize {
        let number = self.of(setting);
        let is_better = |value: &KnobValue| {
            let mut listed = *setting;
            value.apply(&mut listed);
            self.is_cheaper(number, self.of(&listed))
        };
        values.partition_point(|value| !is_better(value)).saturating_sub(1)
    }

    /// Short name of the number of a setting, where it is cheaper than the default of its integrator.
    pub(super) fn reduction(&self, setting: &Setting) -> Option<String> {
        let label = self.label?;
        let number = self.of(setting);
        let usual = self.of(&RenderSettings::with_integrator(setting.integrator.usual()).setting());
        self.is_cheaper(number, usual).then(|| label(number))
    }

    /// Whether a number is cheaper, and worse, than another one.
    pub(super) fn is_cheaper(&self, number: f32, other: f32) -> bool {
        let limit = |number: f32| if number == 0.0 { f32::INFINITY } else { number };
        match self.order {
            Order::Rises => number < other,
            Order::Falls => number > other,
            Order::RisesToZero => limit(number) < limit(other),
        }
    }
}
