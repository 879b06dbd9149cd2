//! Scale of an axis: positions of values, and ticks.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

use super::{Axis, PlotError};

/// Approximate number of ticks of a linear axis.
const TICKS: f64 = 7.0;

/// An axis with its range and ticks.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scale {
    logarithmic: bool,
    /// Lower end.
    pub(super) low: f64,
    /// Upper end, greater than `low`.
    pub(super) high: f64,
    /// Ticks in ascending order.
    pub(super) ticks: Vec<f64>,
}

impl Scale {
    /// Chooses the range and the ticks for the values of an axis.
    ///
    /// # Errors
    /// No value; a value that is not finite; a value that is not positive on a logarithmic axis.
    pub(super) fn of(axis: &Axis, values: impl IntoIterator<Item = f64>) -> Result<Self, PlotError> {
        let (mut low, mut high, mut whole) = (f64::INFINITY, f64::NEG_INFINITY, true);
        for value in values {
            if !value.is_finite() || (axis.logarithmic && value <= 0.0) {
                let kind = if axis.logarithmic { "logarithmic axis" } else { "axis" };
                return Err(PlotError::Chart(format!(
                    "{value} cannot be shown on the {kind} \"{}\"",
                    axis.label
                )));
            }
            (low, high, whole) = (low.min(value), high.max(value), whole && value.fract() == 0.0);
        }
        if low > high {
            return Err(PlotError::Chart("there is nothing to plot: no row has both values".to_owned()));
        }
        let least_step = if whole { 1.0 } else { 0.0 };
        Ok(match (axis.logarithmic, axis.from_zero) {
            (true, _) => Self::logarithmic(low, high),
            (false, true) => Self::from_zero(low.min(0.0), high.max(0.0), least_step),
            (false, false) => Self::linear(low, high, least_step),
        })
    }

    /// A range that ends on the ticks just outside the values.
    fn from_zero(low: f64, high: f64, least_step: f64) -> Self {
        let high = if low == high { 1.0 } else { high };
        let step = round_step((high - low) / TICKS).max(least_step);
        let (first, last) = ((low / step).floor(), (high / step).ceil());
        let ticks = multiples(step, first, last);
        Self { logarithmic: false, low: first * step, high: last * step, ticks }
    }

    /// A range that ends a little outside the values.
    fn linear(low: f64, high: f64, least_step: f64) -> Self {
        let around = if low == high { low.abs().max(1.0) / 2.0 } else { (high - low) * 0.03 };
        let (low, high) = (low - around, high + around);
        let step = round_step((high - low) / TICKS).max(least_step);
        let ticks = multiples(step, (low / step).ceil(), (high / step).floor());
        Self { logarithmic: false, low, high, ticks }
    }

    /// A range that ends a little outside the values.
    fn logarithmic(low: f64, high: f64) -> Self {
        let doublings = (high / low).log2();
        let margin = (doublings * 0.04).max(0.1).exp2();
        let (low, high) = (low / margin, high * margin);
        let ticks = round_ratios(doublings).into_iter().filter(|tick| (low..=high).contains(tick)).collect();
        Self { logarithmic: true, low, high, ticks }
    }

    /// Position of a value along the axis: 0 at `low`, 1 at `high`.
    fn share(&self, value: f64) -> f64 {
        let place = |value: f64| if self.logarithmic { value.log2() } else { value };
        (place(value) - place(self.low)) / (place(self.high) - place(self.low))
    }

    /// Text of a tick.
    pub(super) fn tick_text(&self, tick: f64) -> String {
        let step = if self.logarithmic { tick } else { (self.high - self.low) / TICKS };
        let decimals = (1.0 - step.abs().log10().floor()).clamp(0.0, 9.0) as usize;
        let text = format!("{tick:.decimals$}");
        let text = if decimals > 0 { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        group_thousands(if text == "-0" { "0" } else { text })
    }
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        (f64::from(first) + self.share(*value) * f64::from(last - first)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Scale {
    fn format_ext(&self, value: &f64) -> String {
        self.tick_text(*value)
    }
}

/// Multiples of `step` from `first * step` to `last * step`.
fn multiples(step: f64, first: f64, last: f64) -> Vec<f64> {
    let count = (last - first).max(0.0) as usize;
    (0..=count).map(|index| (first + index as f64) * step).collect()
}

/// The smallest of 1, 2 and 5 times a power of ten that is at least `step`.
fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    let found = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= step);
    found.unwrap_or(10.0) * power
}

/// Candidate ticks of a logarithmic axis that spans this number of doublings.
fn round_ratios(doublings: f64) -> Vec<f64> {
    let tens = || (-12..=15).map(|exponent| 10_f64.powi(exponent));
    if doublings < 4.0 {
        tens().flat_map(|ten| [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0].map(|factor| factor * ten)).collect()
    } else if doublings < 13.0 {
        (-40..=50).map(f64::from).map(f64::exp2).collect()
    } else {
        tens().collect()
    }
}

/// Groups digits: `12345.5` becomes `12,345.5`.
fn group_thousands(text: &str) -> String {
    let (sign, digits) = text.strip_prefix('-').map_or(("", text), |digits| ("-", digits));
    let (whole, fraction) = digits.split_at(digits.find('.').unwrap_or(digits.len()));
    let mut grouped = String::from(sign);
    for (index, digit) in whole.chars().enumerate() {
        if index > 0 && (whole.len() - index).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped + fraction
}
