//! Options of the knobs, one for each entry of the table of knobs.

use std::sync::LazyLock;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};
use rayfarm_tracer::scene::knobs::{GivenValue, KNOBS, Knob, KnobForm};
use rayfarm_tracer::scene::{Integrator, Setting};

use crate::app::knob_values;

/// Syntax of each knob's value in help, in the order of the table.
static VALUE_NAMES: LazyLock<Vec<String>> = LazyLock::new(|| KNOBS.iter().map(value_name).collect());

/// Values of knobs on the command line; each overrides the scene file.
#[derive(Clone, Debug, Default)]
pub(crate) struct QualityArgs {
    given: Vec<(&'static Knob, GivenValue)>,
}

impl QualityArgs {
    /// The setting of the command line, with that of the scene file as default.
    pub(crate) fn over(&self, scene: Setting) -> Setting {
        let mut setting = scene;
        for (_, value) in &self.given {
            value.apply(&mut setting);
        }
        setting
    }

    /// Options of knobs that have no effect with an integrator.
    pub(crate) fn idle_with(&self, integrator: &Integrator) -> impl Iterator<Item = &'static str> {
        let given = self.given.iter().map(|(knob, _)| *knob);
        given.filter(move |knob| !knob.has_effect_with(integrator)).map(|knob| knob.option)
    }

    /// Whether the command line gives the knob of this name this value.
    pub(crate) fn selects(&self, name: &str, word: &str) -> bool {
        let is_word =
            |value: &GivenValue| matches!(value, GivenValue::Listed(value) if value.word == Some(word));
        self.given.iter().any(|(knob, value)| knob.name == name && is_word(value))
    }
}

impl Args for QualityArgs {
    fn augment_args(command: Command) -> Command {
        KNOBS
            .iter()
            .zip(VALUE_NAMES.iter())
            .map(|(knob, name)| option(knob, name))
            .fold(command, Command::arg)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for QualityArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut args = Self::default();
        args.update_from_arg_matches(matches)?;
        Ok(args)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        for knob in KNOBS {
            if let Some(value) = matches.get_one(knob.option) {
                self.given.retain(|(known, _)| known.name != knob.name);
                self.given.push((knob, *value));
            }
        }
        Ok(())
    }
}

/// The option of a knob.
fn option(knob: &'static Knob, value_name: &'static str) -> Arg {
    let arg = Arg::new(knob.option).long(knob.option).value_name(value_name).help(help(knob.summary));
    let arg = match knob.form {
        KnobForm::Count(_) | KnobForm::Number(_) => {
            arg.value_parser(move |text: &str| knob_values::parse(knob, text))
        }
        KnobForm::Switch | KnobForm::Word | KnobForm::Fraction => {
            let words = PossibleValuesParser::new(knob_values::words(knob));
            let known = move |text: String| knob.value(&text).map(GivenValue::Listed).ok_or("unknown word");
            arg.value_parser(words.try_map(known))
        }
    };
    if matches!(knob.form, KnobForm::Switch) && knob.best().word == Some("off") {
        // A switch that is usually off: the option alone turns it on.
        arg.num_args(0..=1).require_equals(true).default_missing_value("on")
    } else {
        arg
    }
}

fn value_name(knob: &Knob) -> String {
    match knob.form {
        KnobForm::Switch => knob_values::SWITCH.join("|"),
        KnobForm::Count(_) => "N".to_owned(),
        KnobForm::Number(range) => if range.whole { "N" } else { "X" }.to_owned(),
        KnobForm::Word | KnobForm::Fraction => knob.words().collect::<Vec<_>>().join("|"),
    }
}

/// A summary without its full stop, like the other help texts.
fn help(summary: &'static str) -> &'static str {
    if summary.ends_with("..") { summary } else { summary.trim_end_matches('.') }
}
