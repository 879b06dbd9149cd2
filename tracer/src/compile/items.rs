//! The items of a scene: its primitives with bounds, numbered through.

use std::ops::Range;

use crate::scene::Scene;

/// An *item*: a primitive with bounds, a leaf of the scene's own tree. Models come first, then spheres, then triangles, then
/// disks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Item {
    /// Index of a model.
    Model(usize),
    /// Index of a sphere.
    Sphere(usize),
    /// Index of a triangle of the scene file.
    Triangle(usize),
    /// Index of a disk.
    Disk(usize),
}

/// The numbering of the items of a scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Items {
    models: usize,
    spheres: usize,
    triangles: usize,
    disks: usize,
}

impl Items {
    /// The numbering of a scene.
    pub(crate) fn of(scene: &Scene) -> Self {
        Self {
            models: scene.models.len(),
            spheres: scene.spheres.len(),
            triangles: scene.triangles.len(),
            disks: scene.disks.len(),
        }
    }

    /// Indices of all items.
    pub(crate) fn range(&self) -> Range<u32> {
        0..(self.models + self.spheres + self.triangles + self.disks) as u32
    }

    /// Index of the first plane: planes have no bounds, and their indices follow those of all items.
    pub(crate) fn first_plane(&self) -> u32 {
        self.range().end
    }

    /// The item with an index below [`Items::first_plane`].
    pub(crate) fn get(&self, index: u32) -> Item {
        let index = index as usize;
        if index < self.models {
            Item::Model(index)
        } else if index < self.models + self.spheres {
            Item::Sphere(index - self.models)
        } else if index < self.models + self.spheres + self.triangles {
            Item::Triangle(index - self.models - self.spheres)
        } else {
            Item::Disk(index - self.models - self.spheres - self.triangles)
        }
    }

    /// The index of an item.
    pub(crate) fn index_of(&self, item: Item) -> u32 {
        let index = match item {
            Item::Model(index) => index,
            Item::Sphere(index) => self.models + index,
            Item::Triangle(index) => self.models + self.spheres + index,
            Item::Disk(index) => self.models + self.spheres + self.triangles + index,
        };
        index as u32
    }
}
