//! Tables and lists of tables of the scene file.

use toml::Spanned;
use toml::de::DeValue;

use super::fault::{Fault, FirstFault, Read};
use super::table::{Table, tables_of};

/// Reads an optional table; the outer `None` means a fault.
pub(super) fn section<'t, T>(
    top: Table<'t>,
    key: &'static str,
    name: &'t str,
    known: &[&str],
    read: impl FnOnce(Table<'t>) -> Read<T>,
    first: &mut FirstFault,
) -> Option<Option<T>> {
    first.keep(top.read(key, |value| read(Table::open(name, value.value, known)?)))
}

/// Reads each table of a list of at most `most` tables; tables with a fault are left out of the result.
pub(super) fn list<'t, T>(
    top: Table<'t>,
    key: &'static str,
    name: &'t str,
    (known, most): (&[&str], usize),
    mut read: impl FnMut(Table<'t>) -> Read<T>,
    first: &mut FirstFault,
) -> Vec<T> {
    let tables =
        first.keep(tables_of(top.get(key)).and_then(|tables| within(tables, name, most))).unwrap_or_default();
    tables
        .into_iter()
        .filter_map(|value| first.keep(Table::open(name, value, known).and_then(&mut read)))
        .collect()
}

/// Refuses a list that is too long, before any entry is built.
fn within<'t>(
    tables: Vec<&'t Spanned<DeValue<'t>>>,
    name: &str,
    most: usize,
) -> Read<Vec<&'t Spanned<DeValue<'t>>>> {
    match tables.get(most) {
        Some(first_beyond) => {
            let count = tables.len();
            Err(Fault::at_value(first_beyond, format!("{count} times {name}, at most {most} are allowed")))
        }
        None => Ok(tables),
    }
}
