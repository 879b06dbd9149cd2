//! Keys of animations: `[[camera_key]]`, and the lists `key` of objects, groups and lights.
//!
//! A value that has keys replaces the value of its table. Objects are read as they are at one time, so whatever places them works
//! for every frame.

use glam::DVec3;

use super::Reading;
use super::fault::Read;
use super::table::{Table, tables_of};
use super::value::Value;
use crate::scene::animation::{CameraPath, Curve, Shape};
use crate::scene::data::CameraKind;

pub(super) const CAMERA_KEY_KEYS: &[&str] = &["time", "position", "look_at", "fov", "zoom", "roll"];
/// Keys of `[[model.key]]` and `[[group.key]]`.
pub(super) const POSE_KEYS: &[&str] = &["time", "translate", "rotate", "scale"];
pub(super) const SPHERE_KEY_KEYS: &[&str] = &["time", "center", "radius"];
pub(super) const LIGHT_KEY_KEYS: &[&str] =
    &["time", "position", "direction", "look_at", "color", "intensity"];

/// Largest number of keys of a list.
const MAX_KEYS: usize = 1 << 16;
/// Latest time, in seconds, and the shortest time from one key to the next.
const MAX_TIME: f64 = 1e6;
const MIN_STEP: f64 = 1e-6;

/// The keys of one object, or of the camera, in the order of their times.
pub(super) struct Keys<'t> {
    name: &'static str,
    keys: Vec<(f64, Table<'t>)>,
}

impl<'t> Keys<'t> {
    /// No keys.
    pub(super) const NONE: Self = Keys { name: "", keys: Vec::new() };

    /// Reads the list `key` of a table. `name` is that of the list in messages, such as `[[model.key]]`.
    pub(super) fn of(
        table: Table<'t>,
        name: &'static str,
        known: &[&str],
        reading: &mut Reading,
    ) -> Read<Self> {
        let keys = Self::listed(table.get("key"), name, known, reading)?;
        reading.moves |= !keys.keys.is_empty();
        Ok(keys)
    }

    fn listed(
        list: Option<Value<'t>>,
        name: &'static str,
        known: &[&str],
        reading: &mut Reading,
    ) -> Read<Self> {
        let Some(list) = list else { return Ok(Self::NONE) };
        let tables = tables_of(Some(list))?;
        if tables.len() < 2 || tables.len() > MAX_KEYS {
            let count = tables.len();
            return Err(list.fault(format!(
                "{count} times {name}: a movement needs 2 to {MAX_KEYS} keys, each with another time"
            )));
        }
        let mut keys: Vec<(f64, Table<'t>)> = Vec::with_capacity(tables.len());
        for table in tables {
            let table = Table::open(name, table, known)?;
            let value = table.required("time")?;
            let time = value.number("of seconds from 0 to 1e6", |n| (0.0..=MAX_TIME).contains(&n))?;
            if let Some((before, _)) = keys.last()
                && time - before < MIN_STEP
            {
                let order = format!("{value} must be later than that of the key before it ({before} s)");
                return Err(value.fault(order + ": write keys in the order of their times"));
            }
            keys.push((time, table));
        }
        let last = keys.last().map_or(0.0, |(time, _)| *time);
        reading.last_key = reading.last_key.max(last);
        Ok(Self { name, keys })
    }

    /// The curve of a value; `None` if no key has it.
    fn curve(
        &self,
        key: &'static str,
        shape: Shape,
        read: impl Fn(Value<'t>) -> Read<DVec3>,
    ) -> Read<Option<Curve>> {
        let mut values = Vec::new();
        let mut only = None;
        for (time, table) in &self.keys {
            if let Some(value) = table.get(key) {
                values.push((*time, read(value)?));
                only = Some(value);
            }
        }
        match only {
            Some(value) if values.len() == 1 => Err(value
                .fault(format!("only one {} has `{key}`: a movement needs it in two or more", self.name))),
            _ => Ok(Curve::new(shape, &values)),
        }
    }

    /// A value of a table at the time that is read: that of its keys, or else the table's own.
    pub(super) fn value_or(
        &self,
        table: Table<'t>,
        key: &'static str,
        shape: Shape,
        read: impl Fn(Value<'t>) -> Read<DVec3>,
        reading: &mut Reading,
    ) -> Read<Option<DVec3>> {
        let own = table.read(key, &read)?;
        let Some(curve) = self.curve(key, shape, read)? else { return Ok(own) };
        reading.idle(table, key, &format!("where {} has it", self.name));
        Ok(Some(curve.at(reading.time)))
    }

    /// As [`Self::value_or`], for a position or angles.
    pub(super) fn vector_or(
        &self,
        table: Table<'t>,
        key: &'static str,
        reading: &mut Reading,
    ) -> Read<Option<DVec3>> {
        self.value_or(table, key, Shape::Round, |value| value.vector(), reading)
    }

    /// As [`Self::value_or`], for one number.
    pub(super) fn number_or(
        &self,
        table: Table<'t>,
        key: &'static str,
        read: impl Fn(Value<'t>) -> Read<f64>,
        reading: &mut Reading,
    ) -> Read<Option<f64>> {
        let read = |value: Value<'t>| read(value).map(|number| DVec3::X * number);
        Ok(self.value_or(table, key, Shape::Within, read, reading)?.map(|number| number.x))
    }

    /// As [`Self::value_or`], for factors along three axes.
    pub(super) fn scale_or(&self, table: Table<'t>, reading: &mut Reading) -> Read<Option<DVec3>> {
        let mut signs = None;
        for value in self.keys.iter().filter_map(|(_, table)| table.get("scale")) {
            let sign = value.scale()?.signum();
            if *signs.get_or_insert(sign) != sign {
                return Err(value.must_be("of the same sign as in the other keys: it would pass through 0"));
            }
        }
        self.value_or(table, "scale", Shape::Within, |value| value.scale(), reading)
    }

    /// Refuses keys next to a key of the table that they contradict.
    pub(super) fn contradict(&self, table: Table<'t>, keys: &[&'static str]) -> Read<()> {
        if self.keys.is_empty() {
            return Ok(());
        }
        match keys.iter().find_map(|key| table.get(key)) {
            Some(value) => Err(value.fault(format!("{value} contradicts {}; keep one of them", self.name))),
            None => Ok(()),
        }
    }
}

/// Reads `[[camera_key]]`. The camera of the scene, if it has one, is of `kind`.
pub(super) fn camera_path(
    top: Table<'_>,
    kind: Option<CameraKind>,
    reading: &mut Reading,
) -> Read<CameraPath> {
    let keys = Keys::listed(top.get("camera_key"), "[[camera_key]]", CAMERA_KEY_KEYS, reading)?;
    let (expected, most) = match kind {
        Some(CameraKind::Fisheye) => ("above 0 and at most 360 degrees", 360.0),
        _ => ("above 0 and below 180 degrees", 180.0_f64.next_down()),
    };
    let (idle, name): (&[&'static str], _) = match kind {
        Some(CameraKind::Fisheye) => (&["zoom"], "on a fisheye camera"),
        Some(CameraKind::Orthographic { .. }) => (&["fov"], "on an orthographic camera"),
        _ => (&[], ""),
    };
    for (_, table) in &keys.keys {
        idle.iter().for_each(|key| reading.idle(*table, key, name));
    }
    let along_x = |number: f64| DVec3::X * number;
    let fov = |value: Value<'_>| value.number(expected, |n| n > 0.0 && n <= most).map(along_x);
    Ok(CameraPath {
        position: keys.curve("position", Shape::Round, |value| value.vector())?,
        look_at: keys.curve("look_at", Shape::Round, |value| value.vector())?,
        fov: keys.curve("fov", Shape::Within, fov)?,
        zoom: keys.curve("zoom", Shape::Within, |value| value.positive().map(along_x))?,
        roll: keys.curve("roll", Shape::Round, |value| value.coordinate().map(along_x))?,
        keeps_direction: false,
    })
}
