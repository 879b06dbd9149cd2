//! The key `shutter` of `[camera]`, and the poses of objects that move.
//!
//! Time 0 is the pose that `center`, `translate` and `rotate` describe, time 1 the one of `center_end`, `translate_end` and `rotate_end`.
//! Both ends of the shutter are resolved here: the scene has the poses when the shutter opens and when it closes.

use glam::DVec3;

use super::Reading;
use super::fault::Read;
use super::table::Table;
use super::value::Value;
use crate::scene::data::Integrator;

/// When the shutter is open.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Shutter {
    opens: f64,
    closes: f64,
    /// Offset of the key in the text, if there is one.
    at: Option<usize>,
}

/// The poses of a position or of angles when the shutter opens, and when it closes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ends {
    pub(super) opening: DVec3,
    pub(super) closing: DVec3,
}

/// Reads the shutter of `[camera]`.
pub(super) fn shutter(table: Table<'_>) -> Read<Shutter> {
    let Some(value) = table.get("shutter") else { return Ok(Shutter::default()) };
    let expected = "two times from 0 to 1, the second not before the first";
    let [opens, closes] = value.array::<2>(expected)?;
    let time = |value: Value<'_>| value.number("from 0 to 1", |n| (0.0..=1.0).contains(&n));
    let (opens, closes) = (time(opens)?, time(closes)?);
    let shutter = Shutter { opens, closes, at: Some(value.start()) };
    if opens <= closes { Ok(shutter) } else { Err(value.must_be(expected)) }
}

impl Shutter {
    /// The value of a key at both ends; `end` is its value at time 1, `start` that at time 0.
    pub(super) fn ends(&self, start: DVec3, end: Option<DVec3>) -> Ends {
        let Some(end) = end else { return Ends { opening: start, closing: start } };
        let at = |time: f64| if time == 1.0 { end } else { start + (end - start) * time };
        Ends { opening: at(self.opens), closing: at(self.closes) }
    }
}

impl Reading {
    /// Notes a key of the pose at time 1, and warns about it where the shutter never leaves time 0.
    pub(super) fn note_end(&mut self, table: Table<'_>, key: &'static str) {
        if table.get(key).is_none() {
            return;
        }
        self.has_ends = true;
        if self.shutter.closes == 0.0 {
            self.idle(table, key, "without a `shutter` in [camera] that closes after time 0");
        }
    }

    /// Warns about a shutter without an effect, and about objects that move where the integrator does not show that. `moves` is whether
    /// an object moves while the shutter is open.
    pub(super) fn check_shutter(&mut self, integrator: &Integrator, moves: bool) {
        let Some(at) = self.shutter.at else { return };
        if !self.has_ends {
            let message = "`shutter` in [camera] has no effect where nothing has a `center_end`, `translate_end` or `rotate_end`";
            self.warn(at, message.to_owned());
        } else if moves && *integrator == Integrator::Direct {
            let message = "the direct integrator shows no motion: objects are as they are when the `shutter` in [camera] opens";
            self.warn(at, message.to_owned());
        }
    }
}
