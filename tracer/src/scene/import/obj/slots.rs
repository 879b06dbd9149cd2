//! Assignment of material slots to triangles.

use std::collections::BTreeMap;
use std::path::Path;

use super::super::SceneError;
use super::geometry::MaterialRun;
use super::materials::{Library, plain_name};
use super::uvs::TriangleUvs;
use crate::mesh::{Mesh, NamedMaterial};

/// The material with a name; some programs write a comment behind names.
pub(super) fn find<'l>(library: &'l Library, name: &str) -> Option<&'l NamedMaterial> {
    let name = plain_name(name);
    let bare = || name.split_once(" #").and_then(|(bare, _)| library.get(&*plain_name(bare)));
    library.get(&*name).or_else(bare)
}

/// Assigns a slot to every triangle: one slot per used material, in the order of first use. A material with textures
/// has a second slot, without them, for triangles without texture coordinates.
pub(super) fn assign_materials(
    path: &Path,
    mesh: &mut Mesh,
    runs: &[MaterialRun],
    library: &Library,
    neutral: &NamedMaterial,
    uvs: Option<&[TriangleUvs]>,
) -> Result<(), SceneError> {
    let mut slots = Slots { path, known: BTreeMap::new(), materials: Vec::new() };
    let mut triangle = 0;
    for run in runs.iter().filter(|run| run.triangles > 0) {
        let name = run.material.as_deref();
        let material = name.and_then(|name| find(library, name)).unwrap_or(neutral);
        // Slots without and with the texture, looked up once per run.
        let mut found = [None; 2];
        for _ in 0..run.triangles {
            let has_uvs = uvs.is_some_and(|uvs| uvs.get(triangle).is_some_and(Option::is_some));
            let textured = has_uvs && material.textures().next().is_some();
            let slot = match found[usize::from(textured)] {
                Some(slot) => slot,
                None => *found[usize::from(textured)].insert(slots.slot(name, material, textured)?),
            };
            mesh.triangle_materials.push(slot);
            triangle += 1;
        }
    }
    mesh.materials = slots.materials;
    Ok(())
}

/// Slots by the name of their material (`None` before the first `usemtl`) and whether they have its textures.
struct Slots<'r> {
    path: &'r Path,
    known: BTreeMap<(Option<&'r str>, bool), u16>,
    materials: Vec<NamedMaterial>,
}

impl<'r> Slots<'r> {
    fn slot(
        &mut self,
        name: Option<&'r str>,
        material: &NamedMaterial,
        textured: bool,
    ) -> Result<u16, SceneError> {
        if let Some(slot) = self.known.get(&(name, textured)) {
            return Ok(*slot);
        }
        let slot = u16::try_from(self.materials.len()).map_err(|_| {
            SceneError::in_file(self.path, "more than 65536 materials are used; merge some of them")
        })?;
        let plain = NamedMaterial::plain(name.unwrap_or(&material.name), material.material);
        let NamedMaterial { texture, cutout, emission_texture, .. } = material.clone();
        self.materials.push(if textured {
            NamedMaterial { texture, cutout, emission_texture, ..plain }
        } else {
            plain
        });
        self.known.insert((name, textured), slot);
        Ok(slot)
    }
}
