//! A table of the scene file with its list of known keys.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::fault::{Fault, Read, shortened, suggestion};
use super::value::Value;

/// Table of a scene file whose keys are all known.
#[derive(Clone, Copy)]
pub(super) struct Table<'t> {
    /// Name for messages: `[camera]`.
    name: &'t str,
    /// Offset of the table in the text.
    at: usize,
    entries: &'t DeTable<'t>,
}

impl<'t> Table<'t> {
    /// Opens the table in a value.
    pub(super) fn open(name: &'t str, value: &'t Spanned<DeValue<'t>>, known: &[&str]) -> Read<Self> {
        match value.get_ref() {
            DeValue::Table(entries) => Self::of(name, value.span().start, entries, known),
            other => {
                let message = format!("{name} must be a table, but is {}", other.type_str());
                Err(Fault::at_value(value, message))
            }
        }
    }

    /// Wraps entries, and refuses the first unknown key.
    pub(super) fn of(name: &'t str, at: usize, entries: &'t DeTable<'t>, known: &[&str]) -> Read<Self> {
        let unknown = entries.keys().filter(|key| !known.contains(&key.get_ref().as_ref()));
        match unknown.min_by_key(|key| key.span().start) {
            None => Ok(Self { name, at, entries }),
            Some(key) => Err(Fault::at(key.span().start, unknown_key(name, key.get_ref(), known))),
        }
    }

    pub(super) fn get(&self, key: &'static str) -> Option<Value<'t>> {
        let value = self.entries.get(key)?;
        Some(Value { name: key, owner: self.name, value })
    }

    pub(super) fn required(&self, key: &'static str) -> Read<Value<'t>> {
        self.get(key).ok_or_else(|| self.fault(format!("`{key}` is missing in {}", self.name)))
    }

    /// Offset of the table in the text.
    pub(super) fn start(&self) -> usize {
        self.at
    }

    /// A fault of the table as a whole.
    pub(super) fn fault(&self, message: impl Into<String>) -> Fault {
        Fault::at(self.at, message)
    }

    /// Reads an optional key.
    pub(super) fn read<T>(
        &self,
        key: &'static str,
        read: impl FnOnce(Value<'t>) -> Read<T>,
    ) -> Read<Option<T>> {
        self.get(key).map(read).transpose()
    }

    /// The only given one of several exclusive keys.
    pub(super) fn one_of(&self, keys: &[&'static str]) -> Read<Option<Value<'t>>> {
        let mut given: Vec<Value<'t>> = keys.iter().filter_map(|key| self.get(key)).collect();
        given.sort_by_key(Value::start);
        match given.as_slice() {
            [first, second, ..] => Err(second.fault(format!(
                "`{}` contradicts `{}` in {}; keep one of them",
                second.name, first.name, self.name
            ))),
            rest => Ok(rest.first().copied()),
        }
    }
}

fn unknown_key(owner: &str, key: &str, known: &[&str]) -> String {
    let key = shortened(key);
    if key == "ambient" {
        return format!("`ambient` does not belong into {owner}; move it to the top, before the first table");
    }
    let hint = suggestion(&key, known.iter().copied(), |list| format!("; known here: {list}"));
    format!("unknown key `{key}` in {owner}{hint}")
}

/// The tables of `[[name]]`; none if the key is absent.
pub(super) fn tables_of<'t>(value: Option<Value<'t>>) -> Read<Vec<&'t Spanned<DeValue<'t>>>> {
    let Some(value) = value else { return Ok(Vec::new()) };
    match value.value.get_ref() {
        DeValue::Array(items) => Ok(items.iter().collect()),
        _ => Err(value.fault(format!("`{0}` is a list of tables: write `[[{0}]]`", value.name))),
    }
}
