//! Names of files in a scene that is saved in another folder.

use std::path::Path;

use toml_edit::{Item, TableLike, Value};

use super::document::{Document, put};

/// Keys whose values name files.
const FILE_KEYS: [&str; 5] = ["file", "texture", "panorama", "cubemap", "model"];

/// The text of a scene file in `from`, to be written into the folder `to`: the files that it names are named by absolute
/// paths where the folders differ.
///
/// # Errors
/// A text that is no TOML.
pub(super) fn moved(text: &str, from: &Path, to: &Path) -> Result<String, String> {
    let absolute = |folder: &Path| {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        folder.canonicalize().unwrap_or_else(|_| folder.to_owned())
    };
    let from = absolute(from);
    if from == absolute(to) {
        return Ok(text.to_owned());
    }
    let mut document = Document::parse(text)?;
    rename(document.root_mut(), &from);
    Ok(document.text())
}

fn rename(table: &mut dyn TableLike, from: &Path) {
    let keys: Vec<String> = table.iter().map(|(key, _)| key.to_owned()).collect();
    for key in keys {
        let is_file = FILE_KEYS.contains(&key.as_str());
        let Some(item) = table.get_mut(&key) else { continue };
        match item {
            Item::Value(Value::String(name)) if is_file => {
                let named = super::files::named(from, name.value());
                put(table, &key, Value::from(named));
            }
            Item::Value(value) => rename_in(value, from, is_file),
            Item::Table(inner) => rename(inner, from),
            Item::ArrayOfTables(tables) => tables.iter_mut().for_each(|inner| rename(inner, from)),
            Item::None => {}
        }
    }
}

fn rename_in(value: &mut Value, from: &Path, is_file: bool) {
    match value {
        Value::InlineTable(inner) => rename(inner, from),
        Value::Array(items) => {
            for item in items.iter_mut() {
                match item {
                    Value::String(name) if is_file => {
                        let decor = item.decor().clone();
                        let mut renamed = Value::from(named(from, item.as_str().unwrap_or_default()));
                        *renamed.decor_mut() = decor;
                        *item = renamed;
                    }
                    inner => rename_in(inner, from, is_file),
                }
            }
        }
        _ => {}
    }
}

/// The absolute path of a file that a scene in the folder `from` names. Back slashes are separators unless a file with
/// exactly this name exists, as for the loader.
fn named(from: &Path, name: &str) -> String {
    let path = from.join(name);
    let path = if path.exists() { path } else { from.join(name.replace('\\', "/")) };
    path.to_string_lossy().into_owned()
}
