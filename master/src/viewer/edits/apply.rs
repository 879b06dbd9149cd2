//! Application of edits to the text of a scene file.

use toml_edit::{Item, Value};

use super::document::{Document, Object, put, set, table_of};
use super::edit::{Edit, ObjectEdit};
use super::transform;

/// Applies an edit to the text of a scene file. The loader decides whether the result is a scene.
///
/// # Errors
/// An edit that names an item which is not in the file, or that is impossible for the object.
pub(super) fn applied(text: &str, edit: &Edit) -> Result<String, String> {
    let mut document = Document::parse(text)?;
    apply(&mut document, edit)?;
    Ok(document.text())
}

fn apply(document: &mut Document, edit: &Edit) -> Result<(), String> {
    match edit {
        Edit::AddObject { kind, keys } => {
            let kind = Document::kind(kind)?;
            document.tables_mut(kind)?.push(table_of(keys)?);
        }
        Edit::Object(name, edit) => {
            let object = document.find(name)?;
            apply_to_object(document, object, edit)?;
        }
        Edit::Material { name, set: key } => set(document.material_mut(name)?, key)?,
        Edit::AddLight(keys) => document.tables_mut("light")?.push(table_of(keys)?),
        Edit::RemoveLight(number) => {
            let index = light(document, *number)?;
            remove(document, Object { kind: "light", index })?;
        }
        Edit::Light { number, set: key } => {
            let index = light(document, *number)?;
            set(document.table_mut(Object { kind: "light", index })?, key)?;
        }
        Edit::Section { name, set: key } => set(document.section_mut(name)?, key)?,
        Edit::ReplaceBackground(keys) => {
            let table = table_of(keys)?;
            let section = document.section_mut("background")?;
            let former: Vec<String> = section.iter().map(|(key, _)| key.to_owned()).collect();
            for key in former.iter().filter(|key| !table.contains_key(key)) {
                section.remove(key);
            }
            for (key, item) in table.iter() {
                put(section, key, item.as_value().cloned().unwrap_or_else(|| Value::from("")));
            }
        }
        Edit::Top(key) => set(document.root_mut(), key)?,
    }
    Ok(())
}

fn apply_to_object(document: &mut Document, object: Object, edit: &ObjectEdit) -> Result<(), String> {
    let kind = object.kind;
    match edit {
        ObjectEdit::Move(by) => transform::translate(kind, document.table_mut(object)?, *by),
        ObjectEdit::Rotate(degrees) => transform::rotate(kind, document.table_mut(object)?, *degrees),
        ObjectEdit::Scale(factors) => transform::scale(kind, document.table_mut(object)?, *factors),
        ObjectEdit::Set(key) => set(document.table_mut(object)?, key),
        ObjectEdit::Remove => remove_object(document, object),
    }
}

/// Removes an object, and its name from the children of its group. A group without children is removed as well.
fn remove_object(document: &mut Document, object: Object) -> Result<(), String> {
    let name = document.table_mut(object)?.get("name").and_then(Item::as_str).map(str::to_owned);
    remove(document, object)?;
    let Some(name) = name else { return Ok(()) };
    if document.tables("group").is_empty() {
        return Ok(());
    }
    let mut emptied = None;
    for (index, group) in document.tables_mut("group")?.iter_mut().enumerate() {
        let Some(children) = group.get_mut("children").and_then(Item::as_array_mut) else { continue };
        let before = children.len();
        children.retain(|child| child.as_str() != Some(&name));
        if children.is_empty() && before > 0 {
            emptied = Some(Object { kind: "group", index });
        }
    }
    // The group of an emptied group may become empty as well.
    emptied.map_or(Ok(()), |group| remove_object(document, group))
}

/// Removes a table of a list, and the list with its last table.
fn remove(document: &mut Document, Object { kind, index }: Object) -> Result<(), String> {
    let tables = document.tables_mut(kind)?;
    tables.remove(index);
    if tables.is_empty() {
        document.root_mut().remove(kind);
    }
    Ok(())
}

/// The index of a light by its number from 1.
fn light(document: &Document, number: usize) -> Result<usize, String> {
    match document.tables("light").len() {
        0 => Err("the scene has no [[light]]: its default light cannot be changed; add one with \
                  light add position = [0, 5, 5]"
            .to_owned()),
        count if number > count => Err(format!("there is no light {number}; the scene has {count}")),
        _ => Ok(number - 1),
    }
}
