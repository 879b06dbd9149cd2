//! A change of one knob of a view.

use rayfarm_farm::ViewRequest;
use rayfarm_tracer::scene::knobs::{GivenValue, Knob};

/// A knob and the value that it is to have.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KnobChange {
    /// Knob that changes.
    pub(crate) knob: &'static Knob,
    /// New value of the knob.
    pub(crate) value: GivenValue,
}

impl KnobChange {
    /// The request with the new value.
    pub(super) fn applied(&self, request: ViewRequest) -> ViewRequest {
        let mut setting = request.setting();
        self.value.apply(&mut setting);
        ViewRequest { view: request.view.with_setting(&setting), scale: setting.scale }
    }
}

impl PartialEq for KnobChange {
    fn eq(&self, other: &Self) -> bool {
        let is_same_value = match (self.value, other.value) {
            (GivenValue::Listed(a), GivenValue::Listed(b)) => a.word == b.word,
            (GivenValue::Number(_, a), GivenValue::Number(_, b)) => a == b,
            _ => false,
        };
        self.knob.name == other.knob.name && is_same_value
    }
}
