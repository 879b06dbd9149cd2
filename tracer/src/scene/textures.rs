//! The textures of a scene that is being loaded: each picture is read once, however many materials name it.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{Filter, Material, TextureMap};
use crate::image;
use crate::mesh::CompiledMesh;
use crate::texture::{Texture, TextureId, check_size};

/// Textures by the real paths of their pictures, and how materials look them up.
#[derive(Default)]
pub(super) struct Textures {
    maps: Vec<TextureMap>,
    loaded: BTreeMap<PathBuf, Arc<Texture>>,
}

impl Textures {
    /// The place in the scene's list of textures of this picture with this filter. The error is a message that names the
    /// picture.
    pub(super) fn add(&mut self, picture: &Path, filter: Filter) -> Result<u32, String> {
        let real =
            picture.canonicalize().map_err(|error| format!("cannot read {}: {error}", picture.display()))?;
        let texture = match self.loaded.entry(real) {
            Entry::Occupied(entry) => entry.get().id(),
            // Messages name the file as the user does.
            Entry::Vacant(entry) => entry.insert(Arc::new(read(picture)?)).id(),
        };
        let map = TextureMap { texture, filter };
        let index = self.maps.iter().position(|known| *known == map).unwrap_or_else(|| {
            self.maps.push(map);
            self.maps.len() - 1
        });
        Ok(index as u32)
    }

    /// A model's own materials with their textures. A picture that cannot be read costs a warning: its material is then
    /// drawn with `Kd` alone.
    pub(super) fn of_model(
        &mut self,
        model: &Path,
        mesh: &CompiledMesh,
        warnings: &mut Vec<String>,
    ) -> Vec<Material> {
        let folder = model.parent().unwrap_or(Path::new(""));
        let with_texture = |slot: crate::mesh::NamedMaterial| {
            let picture = slot.texture.filter(|_| mesh.has_uvs());
            let texture = picture.and_then(|name| match self.add(&folder.join(name), Filter::Bilinear) {
                Ok(texture) => Some(texture),
                Err(reason) => {
                    let (model, material) = (model.display(), slot.name);
                    warnings
                        .push(format!("{model}: material `{material}`: {reason}; drawn without its texture"));
                    None
                }
            });
            Material { texture, ..slot.material }
        };
        mesh.materials().into_iter().map(with_texture).collect()
    }

    /// What the scene lists, and each texture once.
    pub(super) fn into_parts(self) -> (Vec<TextureMap>, Vec<Arc<Texture>>) {
        let by_id: BTreeMap<TextureId, Arc<Texture>> =
            self.loaded.into_values().map(|texture| (texture.id(), texture)).collect();
        (self.maps, by_id.into_values().collect())
    }
}

fn read(picture: &Path) -> Result<Texture, String> {
    let too_large = |error| format!("{}: {error}", picture.display());
    let (width, height) = image::size(picture).map_err(|error| error.to_string())?;
    check_size(width, height).map_err(too_large)?;
    let pixels = image::load(picture).map_err(|error| error.to_string())?;
    Texture::new(&pixels).map_err(too_large)
}
