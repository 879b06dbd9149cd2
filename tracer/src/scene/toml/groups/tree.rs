//! The tree of groups: each object and each group is a child of one group at most.

use std::collections::BTreeMap;

use super::placement::Placement;
use super::{GroupText, Target};
use crate::scene::toml::fault::{Fault, Read, suggestion};
use crate::scene::toml::objects::Name;

/// The groups and objects of a file by the group that they are in.
pub(super) struct Tree {
    /// By the index of a group: the group that it is in, and the offset of its name there.
    parents: Vec<Option<(usize, usize)>>,
    /// Objects in groups: what they are, the index of the group, and the name there.
    objects: Vec<(Target, usize, Name)>,
}

impl Tree {
    /// The tree of these groups.
    ///
    /// # Errors
    /// A name that is given twice, a child that is unknown or in two groups.
    pub(super) fn of(groups: &[GroupText], names: &[(Name, Target)]) -> Read<Self> {
        let known = known_names(names)?;
        let mut tree = Self { parents: vec![None; groups.len()], objects: Vec::new() };
        let mut used: BTreeMap<&str, usize> = BTreeMap::new();
        for (index, group) in groups.iter().enumerate() {
            for child in &group.children {
                let target = known.get(child.text.as_str()).ok_or_else(|| unknown(child, &known))?;
                if let Some(other) = used.insert(&child.text, index) {
                    let whose = if other == index { "twice in this group" } else { "in another group, too" };
                    let name = child.shown();
                    return Err(child.fault(format!(
                        "`{name}` is {whose}: an object is in one group at most; add a second object"
                    )));
                }
                tree.add(target, index, child);
            }
        }
        Ok(tree)
    }

    fn add(&mut self, target: &Target, group: usize, child: &Name) {
        match target {
            Target::Group(inner) => {
                if let Some(parent) = self.parents.get_mut(*inner) {
                    *parent = Some((group, child.at));
                }
            }
            target => self.objects.push((target.clone(), group, child.clone())),
        }
    }

    /// For each group the map from its own axes to the world.
    ///
    /// # Errors
    /// Groups in a circle, or whose transforms together cannot be inverted.
    pub(super) fn placements(&self, groups: &[GroupText]) -> Read<Vec<Placement>> {
        let mut found: Vec<Option<Placement>> = vec![None; groups.len()];
        for start in 0..groups.len() {
            let outwards = self.way_outwards(start, &found)?;
            // From the outermost group to this one.
            for index in outwards.into_iter().rev() {
                let Some(group) = groups.get(index) else { continue };
                let outer = self.parent(index).and_then(|(parent, _)| *found.get(parent)?);
                let placement = outer.map_or(group.placement, |outer| outer.of(&group.placement));
                if !placement.is_usable() {
                    let message = "the transforms of this group and of those that it is in are too large, or too small, \
                                   to be inverted";
                    return Err(Fault::at(group.at, message));
                }
                if let Some(slot) = found.get_mut(index) {
                    *slot = Some(placement);
                }
            }
        }
        Ok(found.into_iter().map(Option::unwrap_or_default).collect())
    }

    /// A group and those around it, up to the first one whose placement is found.
    fn way_outwards(&self, start: usize, found: &[Option<Placement>]) -> Read<Vec<usize>> {
        let is_found = |index: usize| found.get(index).is_some_and(Option::is_some);
        let mut way = Vec::new();
        let mut next = Some(start).filter(|start| !is_found(*start));
        while let Some(index) = next {
            way.push(index);
            if way.len() > self.parents.len() {
                return Err(self.circle(index));
            }
            next = self.parent(index).map(|(parent, _)| parent).filter(|parent| !is_found(*parent));
        }
        Ok(way)
    }

    /// The fault of a circle of groups that this one is in.
    fn circle(&self, start: usize) -> Fault {
        let mut at = usize::MAX;
        let mut index = start;
        while let Some((parent, child_at)) = self.parent(index) {
            at = at.min(child_at);
            index = parent;
            if index == start {
                break;
            }
        }
        Fault::at(
            at,
            "the groups are in a circle: this child contains, directly or through others, its own group",
        )
    }

    fn parent(&self, index: usize) -> Option<(usize, usize)> {
        *self.parents.get(index)?
    }

    /// The objects in groups.
    pub(super) fn into_objects(self) -> Vec<(Target, usize, Name)> {
        self.objects
    }
}

/// The targets by their names, each given once.
fn known_names(names: &[(Name, Target)]) -> Read<BTreeMap<&str, &Target>> {
    let mut in_text: Vec<&(Name, Target)> = names.iter().collect();
    in_text.sort_by_key(|(name, _)| name.at);
    let mut known = BTreeMap::new();
    for (name, target) in in_text {
        if known.insert(name.text.as_str(), target).is_some() {
            let shown = name.shown();
            return Err(
                name.fault(format!("the name `{shown}` is given twice; names of objects and groups differ"))
            );
        }
    }
    Ok(known)
}

fn unknown(child: &Name, known: &BTreeMap<&str, &Target>) -> Fault {
    let hint = suggestion(&child.text, known.keys().copied(), |list| {
        let list = if list.is_empty() { "none".into() } else { list };
        format!("; the file names {list}. Give the object a `name`")
    });
    child.fault(format!("unknown child `{}` of [[group]]{hint}", child.shown()))
}
