//! Objects of a scene file: models, and primitives.

mod model;
mod primitives;
mod triangles;
mod volume;

use super::fault::{Fault, Read, shortened};
use super::table::Table;

pub(crate) use model::ModelText;
pub(super) use model::{MODEL_KEYS, model};
pub(super) use primitives::{DISK_KEYS, MovingSphere, PLANE_KEYS, SPHERE_KEYS, disk, plane, sphere};
pub(super) use triangles::{BOX_KEYS, RECTANGLE_KEYS, TRIANGLE_KEYS, cuboid, rectangle, triangle};
pub(crate) use volume::{BoundaryText, VolumeText};
pub(super) use volume::{VOLUME_KEYS, volume};

/// The name that the file gives an object or a group.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Name {
    pub(super) text: String,
    /// Offset of the name in the text.
    pub(super) at: usize,
}

impl Name {
    /// The fault of this name.
    pub(super) fn fault(&self, message: impl Into<String>) -> Fault {
        Fault::at(self.at, message)
    }

    /// The name for messages.
    pub(super) fn shown(&self) -> String {
        shortened(&self.text)
    }
}

/// The name of a table, if it has one.
pub(super) fn name(table: Table<'_>) -> Read<Option<Name>> {
    table.read("name", |value| {
        let text = value.text()?;
        if text.is_empty() {
            return Err(value.must_be("a name that is not empty"));
        }
        Ok(Name { text: text.to_owned(), at: value.start() })
    })
}
