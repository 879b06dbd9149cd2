//! Edits of a scene, as data.

use std::path::PathBuf;

use glam::DVec3;

/// A command to the editor of a scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum EditCommand {
    /// Changes the scene.
    Change(Edit),
    /// Undoes the last change.
    Undo,
    /// Repeats the change that was undone last.
    Redo,
    /// Writes the scene to a file.
    Save(PathBuf),
    /// Lists the objects.
    ListObjects,
}

/// A change of a scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Edit {
    /// Adds an object with the keys of its table.
    AddObject {
        /// Name of the table: `sphere`.
        kind: String,
        /// Keys and values: `center = [0, 1, 0], radius = 0.5`.
        keys: String,
    },
    /// Changes an object, which is given by its name, or else by the number of an item.
    Object(String, ObjectEdit),
    /// Gives a key of a material another value.
    Material {
        /// Name of the material.
        name: String,
        /// The key and its value.
        set: SetKey,
    },
    /// Adds a light with the keys of its table.
    AddLight(String),
    /// Removes a light, counted from 1.
    RemoveLight(usize),
    /// Gives a key of a light another value.
    Light {
        /// Number of the light in the file, from 1.
        number: usize,
        /// The key and its value.
        set: SetKey,
    },
    /// Gives a key of `[background]` or `[render]` another value.
    Section {
        /// Name of the table.
        name: &'static str,
        /// The key and its value.
        set: SetKey,
    },
    /// Replaces all keys of `[background]`.
    ReplaceBackground(String),
    /// Gives a key at the top of the file another value.
    Top(SetKey),
}

/// A change of one object.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ObjectEdit {
    /// Moves it along the axes of its group, or of the world, in world units.
    Move(DVec3),
    /// Adds to its rotation, in degrees about x, y and z.
    Rotate(DVec3),
    /// Multiplies its size along the axes.
    Scale(DVec3),
    /// Removes it, also from its group.
    Remove,
    /// Gives a key another value.
    Set(SetKey),
}

/// A key of a table and the text of its value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SetKey {
    /// Key of the table.
    pub(crate) key: String,
    /// TOML, or a single word for a string; `None` removes the key, which then has its default.
    pub(crate) value: Option<String>,
}
