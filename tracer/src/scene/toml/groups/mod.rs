//! The tables `[[group]]`: objects that are placed together. Groups are resolved here, so that the scene has none.
//!
//! ```text
//! mod         the tables, and the names of objects
//! tree        the group that each child is in; faults of names
//! placement   affine maps, and the objects in them
//! ```

mod placement;
mod tree;

use std::collections::BTreeMap;
use std::ops::Range;

use glam::{DMat3, DVec3};

use super::Reading;
use super::fault::Read;
use super::keys::{Keys, POSE_KEYS};
use super::material::Materials;
use super::objects::{ModelText, MovingSphere, Name, name};
use super::table::Table;
use super::value::Value;
use crate::rotation;
use crate::scene::data::{Disk, Motion, Sphere, Triangle};
use placement::Placement;
use tree::Tree;

pub(super) const GROUP_KEYS: &[&str] = &["name", "translate", "rotate", "scale", "matrix", "children", "key"];

/// Largest number of groups.
pub(super) const MAX_GROUPS: usize = 1 << 16;

/// A group of the file.
pub(super) struct GroupText {
    /// From the group's axes to those that it is in.
    placement: Placement,
    /// Offset of the table in the text.
    at: usize,
    children: Vec<Name>,
}

pub(super) fn group(table: Table<'_>, reading: &mut Reading) -> Read<GroupText> {
    let matrix = table.get("matrix");
    if let Some(matrix) = matrix {
        for key in ["translate", "rotate", "scale"] {
            if let Some(value) = table.get(key) {
                let second = if value.start() > matrix.start() { value } else { matrix };
                return Err(
                    second.fault(format!("`matrix` contradicts `{key}` in [[group]]; keep one of them"))
                );
            }
        }
    }
    let keys = Keys::of(table, "[[group.key]]", POSE_KEYS, reading)?;
    keys.contradict(table, &["matrix"])?;
    let placement = match matrix {
        Some(value) => placement_of(value)?,
        None => {
            let degrees = keys.vector_or(table, "rotate", reading)?.unwrap_or(DVec3::ZERO);
            let factors = keys.scale_or(table, reading)?.unwrap_or(DVec3::ONE);
            let translate = keys.vector_or(table, "translate", reading)?.unwrap_or(DVec3::ZERO);
            let linear = rotation::of_model(degrees) * DMat3::from_diagonal(factors);
            Placement { linear, translate }
        }
    };
    let children = table.required("children")?.items("an array of names of objects and groups")?;
    if children.is_empty() {
        reading.warn(table.start(), "a [[group]] without children has no effect".to_owned());
    }
    let child = |value: Value<'_>| Ok(Name { text: value.text()?.to_owned(), at: value.start() });
    Ok(GroupText {
        placement,
        at: table.start(),
        children: children.into_iter().map(child).collect::<Read<_>>()?,
    })
}

/// The affine map of a matrix of three rows of four.
fn placement_of(value: Value<'_>) -> Read<Placement> {
    let expected = "an array of three rows of four numbers";
    let rows = value.array::<3>(expected)?;
    let mut numbers = [[0.0; 4]; 3];
    for (row, into) in rows.into_iter().zip(&mut numbers) {
        for (item, into) in row.array::<4>(expected)?.into_iter().zip(into) {
            *into = item.coordinate()?;
        }
    }
    let row = |[x, y, z, _]: [f64; 4]| DVec3::new(x, y, z);
    let placement = Placement {
        linear: DMat3::from_cols(row(numbers[0]), row(numbers[1]), row(numbers[2])).transpose(),
        translate: DVec3::from_array(numbers.map(|[.., last]| last)),
    };
    if placement.is_usable() { Ok(placement) } else { Err(value.must_be("a matrix that can be inverted")) }
}

/// Objects that groups may place.
#[derive(Default)]
pub(super) struct Objects {
    pub(super) models: Vec<ModelText>,
    pub(super) spheres: Vec<Sphere>,
    /// Centres of spheres when the shutter closes, of those that move.
    closing: BTreeMap<usize, DVec3>,
    pub(super) disks: Vec<Disk>,
    pub(super) triangles: Vec<Triangle>,
    /// All names with the objects and groups that they mean.
    names: Vec<(Name, Target)>,
}

/// Meaning of a name: an index of a list, or a range of triangles.
#[derive(Clone, Debug)]
enum Target {
    Model(usize),
    Sphere(usize),
    Disk(usize),
    Triangles(Range<usize>),
    Group(usize),
}

impl Objects {
    pub(super) fn add_models(&mut self, models: Vec<(ModelText, Option<Name>)>) {
        self.models = self.named(models, Target::Model);
    }

    /// Adds spheres with their centres when the shutter closes, if these are elsewhere.
    pub(super) fn add_spheres(&mut self, spheres: Vec<(MovingSphere, Option<Name>)>) {
        let (spheres, closing): (Vec<_>, Vec<_>) = self.named(spheres, Target::Sphere).into_iter().unzip();
        self.spheres = spheres;
        let moving = closing.into_iter().enumerate();
        self.closing = moving.filter_map(|(index, center)| Some((index, center?))).collect();
    }

    /// The objects that move while the shutter is open.
    pub(super) fn motions(&self) -> Vec<Motion> {
        let of_models = self.models.iter().enumerate().filter_map(|(index, model)| {
            let [translate, rotate] = model.closing?;
            Some(Motion::Model { model: index as u32, translate, rotate })
        });
        let of_spheres =
            self.closing.iter().map(|(&index, &center)| Motion::Sphere { sphere: index as u32, center });
        of_models.chain(of_spheres).collect()
    }

    pub(super) fn add_disks(&mut self, disks: Vec<(Disk, Option<Name>)>) {
        self.disks = self.named(disks, Target::Disk);
    }

    /// Adds objects of several triangles.
    pub(super) fn add_triangles(&mut self, objects: Vec<(Vec<Triangle>, Option<Name>)>) {
        for (triangles, name) in objects {
            let first = self.triangles.len();
            self.triangles.extend(triangles);
            self.names.extend(name.map(|name| (name, Target::Triangles(first..self.triangles.len()))));
        }
    }

    /// Places all objects that are in groups.
    ///
    /// # Errors
    /// A name that is unknown, given twice or used twice, a circle of groups, an object that its groups cannot place.
    pub(super) fn place(
        &mut self,
        groups: Vec<(GroupText, Option<Name>)>,
        materials: &Materials,
    ) -> Read<()> {
        let groups = self.named(groups, Target::Group);
        let tree = Tree::of(&groups, &self.names)?;
        let placements = tree.placements(&groups)?;
        for (target, group, child) in tree.into_objects() {
            let Some(placement) = placements.get(group) else { continue };
            self.place_object(target, placement, materials).map_err(|message| child.fault(message))?;
        }
        Ok(())
    }

    /// Notes the names of a list of objects.
    fn named<T>(&mut self, items: Vec<(T, Option<Name>)>, target: fn(usize) -> Target) -> Vec<T> {
        let note = |(index, (item, name)): (usize, (T, Option<Name>))| {
            self.names.extend(name.map(|name| (name, target(index))));
            item
        };
        items.into_iter().enumerate().map(note).collect()
    }
}

/// The object or group of a table with its name.
pub(super) fn with_name<T>(table: Table<'_>, item: T) -> Read<(T, Option<Name>)> {
    Ok((item, name(table)?))
}
