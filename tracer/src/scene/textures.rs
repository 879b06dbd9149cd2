//! The textures of a scene that is being loaded: each picture is read once, however many materials name it.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::error::shown;
use super::foreign::{Wanted, recognised_file};
use super::lookup::{Lookup, Missing};
use super::printed::{escaped, excerpt};
use super::warnings::Warnings;
use super::{Filter, Material, TextureMap, Tiling};
use crate::image;
use crate::mesh::{CompiledMesh, NamedMaterial, TextureFile};
use crate::texture::{LEAST_ALPHA, Texture, TextureId, check_size};

/// Bytes of all textures of a scene, in the memory of the master and of every worker. A picture of a few kilobytes may take
/// 192 MiB.
const MAX_BYTES: u64 = if cfg!(test) { 4 << 20 } else { 4 << 30 };

/// Textures by the real paths of their pictures, and how materials look them up.
#[derive(Default)]
pub(super) struct Textures {
    maps: Vec<TextureMap>,
    /// What each picture gave: a texture, or why it is none.
    loaded: BTreeMap<(PathBuf, Use), Result<Arc<Texture>, String>>,
    /// What is odd about pictures that are used.
    notes: BTreeSet<String>,
    /// Bytes of those that were read.
    bytes: u64,
}

/// What a picture is read for.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Use {
    /// Its colours, and its alpha if it cuts something out.
    Color,
    /// To cut out: by its alpha, or where it has none that does by its brightness.
    Mask,
}

/// A texture in the scene's list.
#[derive(Clone, Copy)]
pub(super) struct Listed {
    pub(super) index: u32,
    /// Some of it is cut out.
    pub(super) cuts: bool,
}

impl Textures {
    /// The place in the scene's list of textures of this picture, looked up in this way. The error is a message that names the
    /// picture.
    pub(super) fn add(&mut self, picture: &Path, filter: Filter, tiling: Tiling) -> Result<Listed, String> {
        let texture = self.load(picture, Use::Color)?;
        Ok(Listed { index: self.list(&texture, filter, tiling), cuts: texture.has_alpha() })
    }

    fn load(&mut self, picture: &Path, used: Use) -> Result<Arc<Texture>, String> {
        let texture = match self.loaded.entry((real(picture)?, used)) {
            Entry::Occupied(entry) => entry.into_mut(),
            // Messages name the file as the user does.
            Entry::Vacant(entry) => {
                let texture = read(picture, used, MAX_BYTES.saturating_sub(self.bytes));
                self.bytes += texture.as_ref().map_or(0, |texture| texture.bytes().len() as u64);
                if texture.is_ok() && image::ends_early(picture) {
                    let message =
                        "the JPEG picture has no end: what is missing of it is grey; get the file again";
                    self.notes.insert(format!("{}: {message}", shown(picture)));
                }
                entry.insert(texture.map(Arc::new))
            }
        };
        texture.clone()
    }

    fn list(&mut self, texture: &Texture, filter: Filter, tiling: Tiling) -> u32 {
        let map = TextureMap { texture: texture.id(), filter, tiling };
        let index = self.maps.iter().position(|known| *known == map).unwrap_or_else(|| {
            self.maps.push(map);
            self.maps.len() - 1
        });
        index as u32
    }

    /// A model's own materials with their textures. A picture that cannot be read, or that is outside of the model's folder
    /// unless it `may_leave` that, costs a warning: its material is then drawn without it.
    pub(super) fn of_model(
        &mut self,
        model: &Path,
        mesh: &CompiledMesh,
        may_leave: bool,
        warnings: &mut Vec<String>,
    ) -> Vec<Material> {
        let files = Lookup::new(model.parent().unwrap_or(Path::new("")), may_leave);
        let mut about = Warnings::about(model);
        let slots = mesh.materials().into_iter();
        let materials = slots.map(|slot| self.of_slot(&files, &slot, mesh, &mut about)).collect();
        warnings.extend(about.into_messages());
        materials
    }

    fn of_slot(
        &mut self,
        files: &Lookup<'_>,
        slot: &NamedMaterial,
        mesh: &CompiledMesh,
        about: &mut Warnings,
    ) -> Material {
        let mut add = |texture: &Option<TextureFile>, used: Use| {
            let TextureFile { file, tiling } = texture.as_ref().filter(|_| mesh.has_uvs())?;
            let failed = |reason: String| {
                let material = excerpt(&slot.name, 60);
                let message = format!("material `{material}`: {reason}; drawn without its texture");
                about.once_in_file(&reason, message);
            };
            let texture = permitted(files, file).and_then(|()| self.load(&files.path(file), used));
            let texture = texture.map_err(failed).ok()?;
            let cuts = texture.has_alpha();
            // A mask that cuts nothing out is for nothing.
            (used == Use::Color || cuts)
                .then(|| Listed { index: self.list(&texture, Filter::Bilinear, *tiling), cuts })
        };
        let texture = add(&slot.texture, Use::Color);
        let emission_texture = add(&slot.emission_texture, Use::Color);
        // A picture that is named for both has colours, which say nothing about what is cut out.
        let own =
            |named: &TextureFile| slot.texture.as_ref().is_some_and(|texture| texture.file == named.file);
        let cutout = match &slot.cutout {
            Some(named) => add(&slot.cutout, if own(named) { Use::Color } else { Use::Mask }),
            None => texture,
        };
        Material {
            texture: texture.map(|listed| listed.index),
            cutout: cutout.filter(|listed| listed.cuts).map(|listed| listed.index),
            emission_texture: emission_texture.map(|listed| listed.index),
            vertex_colors: mesh.has_colors(),
            ..slot.material
        }
    }

    /// What the scene lists, each texture once, and what is to be reported of the pictures.
    pub(super) fn into_parts(self) -> (Vec<TextureMap>, Vec<Arc<Texture>>, BTreeSet<String>) {
        let loaded = self.loaded.into_values().flatten();
        let by_id: BTreeMap<TextureId, Arc<Texture>> =
            loaded.map(|texture| (texture.id(), texture)).collect();
        let listed = |texture: &Arc<Texture>| self.maps.iter().any(|map| map.texture == texture.id());
        let textures = by_id.into_values().filter(listed).collect();
        (self.maps, textures, self.notes)
    }
}

/// A compiled model may come from elsewhere: what its pictures are called is checked when it is used.
fn permitted(files: &Lookup<'_>, file: &str) -> Result<(), String> {
    match files.find_here(Path::new(""), file) {
        // What is not there is reported when it is opened.
        Ok(_) | Err(Missing::NotThere) => Ok(()),
        Err(Missing::Absolute) => Err(format!(
            "the picture `{}` is named by an absolute path and is not read; put it into the model's folder",
            excerpt(file, 200)
        )),
        Err(Missing::Above | Missing::Link) => Err(format!(
            "the picture `{}` is outside the model's folder and is not read; put it there, \
             or allow it with --allow-parent-textures",
            excerpt(file, 200)
        )),
    }
}

fn real(picture: &Path) -> Result<PathBuf, String> {
    picture.canonicalize().map_err(|error| format!("cannot read {}: {error}", shown(picture)))
}

/// Reads a picture whose texture takes at most `room` bytes.
fn read(picture: &Path, used: Use, room: u64) -> Result<Texture, String> {
    let too_large = |error| format!("{}: {error}", shown(picture));
    let undecoded = |error: image::ImageError| match recognised_file(picture) {
        Some(foreign) if !foreign.is_picture() => {
            format!("cannot read {}: {}", shown(picture), foreign.refusal(Wanted::Picture))
        }
        _ => escaped(&error.to_string()),
    };
    let (width, height) = image::size(picture).map_err(undecoded)?;
    check_size(width, height).map_err(too_large)?;
    if 4 * u64::from(width) * u64::from(height) > room {
        return Err(format!(
            "{}: with it the textures of the scene would take more than {} MiB, the limit; make pictures smaller",
            shown(picture),
            MAX_BYTES >> 20
        ));
    }
    let (mut pixels, alpha) = image::load_with_alpha(picture).map_err(undecoded)?;
    let alpha = match (used, alpha) {
        (Use::Color, alpha) => alpha.unwrap_or_default(),
        (Use::Mask, Some(alpha)) if alpha.iter().any(|&alpha| alpha < LEAST_ALPHA) => alpha,
        (Use::Mask, _) => {
            let brightness = pixels.pixels.chunks_exact(3).map(brightness).collect();
            pixels.pixels.fill(u8::MAX);
            brightness
        }
    };
    Texture::with_alpha(&pixels, &alpha).map_err(too_large)
}

/// Of a pixel in a picture that holds numbers, not colours: the weights are those of Rec. 709.
fn brightness(pixel: &[u8]) -> u8 {
    let sum: u32 =
        pixel.iter().zip([2126, 7152, 722]).map(|(&channel, weight)| u32::from(channel) * weight).sum();
    ((sum + 5000) / 10_000) as u8
}
