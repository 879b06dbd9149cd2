//! The tables of a scene file: objects by name or number, materials, lights.

use rayfarm_text::printable;
use serde_json::{Value as Json, json};
use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::edit::SetKey;

/// The kinds of objects that are items, in the order in which items are numbered, with the number of items of one.
const ITEM_KINDS: [(&str, usize); 7] =
    [("model", 1), ("sphere", 1), ("triangle", 1), ("rectangle", 2), ("box", 12), ("disk", 1), ("plane", 1)];

/// The kinds of objects that may be added.
const KINDS: [&str; 8] = ["model", "sphere", "triangle", "rectangle", "box", "disk", "plane", "group"];

/// An object of a scene file: a table of a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Object {
    /// Name of the list: `sphere`.
    pub(super) kind: &'static str,
    /// Index of the table in the list.
    pub(super) index: usize,
}

/// The text of a scene file as tables that keep comments and order.
#[derive(Clone, Debug)]
pub(super) struct Document(DocumentMut);

impl Document {
    /// Parses a text that the loader has accepted.
    ///
    /// # Errors
    /// A text that is no TOML.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        text.parse().map(Self).map_err(|error| format!("the scene cannot be edited: {error}"))
    }

    /// The text.
    pub(super) fn text(&self) -> String {
        self.0.to_string()
    }

    /// The root table.
    pub(super) fn root_mut(&mut self) -> &mut Table {
        self.0.as_table_mut()
    }

    /// The kind of object of this name.
    ///
    /// # Errors
    /// A name of no kind.
    pub(super) fn kind(name: &str) -> Result<&'static str, String> {
        let known = KINDS.into_iter().find(|kind| *kind == name);
        known.ok_or_else(|| {
            format!(
                "there is no kind of object \"{}\"; expected one of {}",
                printable(name),
                KINDS.join(", ")
            )
        })
    }

    /// The object with a name, or else the object with the item of a number, counted from 1 as in auxiliary pictures.
    ///
    /// # Errors
    /// A name that no object has, a number that no item has.
    pub(super) fn find(&self, text: &str) -> Result<Object, String> {
        for kind in KINDS {
            let names = self.tables(kind).into_iter().map(|table| text_of(table, "name"));
            if let Some(index) = names.into_iter().position(|name| name == Some(text)) {
                return Ok(Object { kind, index });
            }
        }
        let number = text.parse().ok().and_then(|number| self.with_item(number));
        number.ok_or_else(|| {
            format!(
                "no object is called \"{}\", and no item has that number; object list lists all",
                printable(text)
            )
        })
    }

    /// The object with an item of a number, from 1.
    pub(super) fn with_item(&self, number: usize) -> Option<Object> {
        let mut first = 1;
        for (kind, items) in ITEM_KINDS {
            for (index, table) in self.tables(kind).into_iter().enumerate() {
                let items = if is_invisible(kind, table) { 0 } else { items };
                if (first..first + items).contains(&number) {
                    return Some(Object { kind, index });
                }
                first += items;
            }
        }
        None
    }

    /// All objects with their names, materials and items.
    pub(super) fn list(&self) -> Vec<Json> {
        let mut first = 1;
        let mut all = Vec::new();
        for (kind, items) in ITEM_KINDS {
            for table in self.tables(kind) {
                let items = if is_invisible(kind, table) { 0 } else { items };
                all.push(json!({
                    "item": first,
                    "items": items,
                    "kind": kind,
                    "name": text_of(table, "name"),
                    "material": text_of(table, "material"),
                }));
                first += items;
            }
        }
        let groups = self.tables("group").into_iter();
        all.extend(
            groups.map(|table| json!({ "items": 0, "kind": "group", "name": text_of(table, "name") })),
        );
        all
    }

    /// The table of an object.
    pub(super) fn table_mut(&mut self, object: Object) -> Result<&mut Table, String> {
        let tables = self.tables_mut(object.kind)?;
        tables.get_mut(object.index).ok_or_else(|| format!("there is no such {}", object.kind))
    }

    /// A list of tables, which is created if there is none.
    ///
    /// # Errors
    /// A key that is no list of tables.
    pub(super) fn tables_mut(&mut self, name: &str) -> Result<&mut ArrayOfTables, String> {
        let item = self.0.entry(name).or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new()));
        if !item.is_array_of_tables() {
            let tables = match std::mem::take(item) {
                Item::Value(Value::Array(array)) if array.is_empty() => Ok(ArrayOfTables::new()),
                other => other.into_array_of_tables(),
            };
            *item = tables.map_or_else(|other| other, Item::ArrayOfTables);
        }
        item.as_array_of_tables_mut().ok_or_else(|| format!("`{name}` is not a list of tables"))
    }

    /// A table of a name in the root, which is created if there is none.
    pub(super) fn section_mut(&mut self, name: &str) -> Result<&mut dyn TableLike, String> {
        let item = self.0.entry(name).or_insert_with(|| Item::Table(Table::new()));
        item.as_table_like_mut().ok_or_else(|| format!("`{name}` is no table"))
    }

    /// The table of a material.
    ///
    /// # Errors
    /// A material that is not in the file.
    pub(super) fn material_mut(&mut self, name: &str) -> Result<&mut dyn TableLike, String> {
        let materials = self.0.get("material").and_then(Item::as_table_like);
        let known: Vec<String> =
            materials.map_or_else(Vec::new, |all| all.iter().map(|(name, _)| name.to_owned()).collect());
        let found = self.0.get_mut("material").and_then(Item::as_table_like_mut);
        found.and_then(|all| all.get_mut(name)).and_then(Item::as_table_like_mut).ok_or_else(|| {
            let list =
                if known.is_empty() { "none".to_owned() } else { printable(&known.join(", ")).into_owned() };
            format!("there is no [material.{}]; the file has {list}", printable(name))
        })
    }

    /// The tables of a list.
    pub(super) fn tables(&self, name: &str) -> Vec<&dyn TableLike> {
        match self.0.get(name) {
            Some(Item::ArrayOfTables(tables)) => tables.iter().map(|table| table as &dyn TableLike).collect(),
            Some(Item::Value(Value::Array(array))) => {
                let tables = array.iter().filter_map(Value::as_inline_table);
                tables.map(|table| table as &dyn TableLike).collect()
            }
            _ => Vec::new(),
        }
    }
}

/// Whether an object has no items: a triangle without an area is left out.
fn is_invisible(kind: &str, table: &dyn TableLike) -> bool {
    let point = |value: &Value| value.as_array().map(super::transform::numbers_of);
    let corners = || -> Option<Vec<_>> { table.get("vertices")?.as_array()?.iter().map(point).collect() };
    kind == "triangle" && matches!(corners().as_deref(), Some([a, b, c]) if a == b || b == c || c == a)
}

fn text_of<'t>(table: &'t dyn TableLike, key: &str) -> Option<&'t str> {
    table.get(key)?.as_str()
}

/// Gives a key another value. A comment behind the former value remains.
///
/// # Errors
/// A text that is no value of TOML.
pub(super) fn set(table: &mut dyn TableLike, set: &SetKey) -> Result<(), String> {
    match &set.value {
        None => {
            table.remove(&set.key);
        }
        Some(text) => put(table, &set.key, value_of(text)?),
    }
    Ok(())
}

/// Gives a key another value. A comment behind the former value remains.
pub(super) fn put(table: &mut dyn TableLike, key: &str, mut value: Value) {
    match table.get_mut(key) {
        Some(Item::Value(former)) => {
            *value.decor_mut() = former.decor().clone();
            *former = value;
        }
        _ => {
            table.insert(key, Item::Value(value));
        }
    }
}

/// A value of TOML. A single word that is none is a string.
fn value_of(text: &str) -> Result<Value, String> {
    let is_word = text.chars().all(|c| c.is_alphanumeric() || "_-./".contains(c));
    match text.parse::<Value>() {
        Ok(value) => Ok(value),
        Err(_) if is_word => Ok(Value::from(text)),
        Err(_) => Err(format!(
            "\"{}\" is no value: expected a number, true, false, an array such as [1, 0, 0], a \"text\", \
             or a table such as {{ texture = \"wood.png\" }}",
            printable(text)
        )),
    }
}

/// The table of keys and values on one line, with or without braces.
///
/// # Errors
/// A text that is no table of TOML.
pub(super) fn table_of(keys: &str) -> Result<Table, String> {
    let text = if keys.starts_with('{') { keys.to_owned() } else { format!("{{ {keys} }}") };
    let table: Result<Value, _> = text.parse();
    let table: Option<InlineTable> = table.ok().and_then(|value| value.as_inline_table().cloned());
    let expected = || format!("\"{}\" has no keys with values: expected KEY = VALUE, ...", printable(keys));
    Ok(table.ok_or_else(expected)?.into_table())
}
