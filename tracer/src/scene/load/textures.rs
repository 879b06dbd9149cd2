//! The textures of a scene that is being loaded. Each picture file is read once, whatever the number of its materials.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::loader::PictureCache;
use super::sky;
use crate::files::FileStamp;
use crate::image;
use crate::material::Material;
use crate::mesh::{CompiledMesh, NamedMaterial, TextureFile};
use crate::scene::import::{Lookup, Missing, Wanted, Warnings, escaped, excerpt, recognised_file, shown};
use crate::texture::{Filter, LEAST_ALPHA, Texture, TextureId, TextureMap, Tiling, check_size};

/// Textures by the real paths of their picture files, and how materials look them up.
pub(super) struct Textures {
    maps: Vec<TextureMap>,
    cache: PictureCache,
    /// The texture of each picture file, or the reason why it is none.
    loaded: BTreeMap<(PathBuf, PictureUse), Result<Arc<Texture>, String>>,
    /// Warnings about pictures that are used.
    notes: BTreeSet<String>,
    /// Bytes of all loaded textures.
    bytes: u64,
    /// Largest value of `bytes`.
    max_bytes: u64,
}

/// Purpose for which a picture is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum PictureUse {
    /// Colours, and alpha if it cuts something out.
    Color,
    /// A mask that cuts out: alpha, or brightness where the alpha cuts nothing out.
    Mask,
    /// A sky: colours, or linear light of high dynamic range.
    Sky,
}

/// An entry of the scene's list of textures.
#[derive(Clone, Copy)]
pub(super) struct Listed {
    pub(super) index: u32,
    /// Whether its alpha cuts something out.
    pub(super) cuts: bool,
}

impl Textures {
    /// No textures yet, and at most `max_bytes` of them.
    #[cfg(test)]
    pub(super) fn new(max_bytes: u64) -> Self {
        Self::with_cache(max_bytes, &PictureCache::default())
    }

    /// No textures yet, and at most `max_bytes` of them; pictures of earlier loads are taken from `cache`.
    pub(super) fn with_cache(max_bytes: u64, cache: &PictureCache) -> Self {
        Self {
            maps: Vec::new(),
            cache: cache.clone(),
            loaded: BTreeMap::new(),
            notes: BTreeSet::new(),
            bytes: 0,
            max_bytes,
        }
    }

    /// Adds a picture file with its lookup to the scene's list of textures. The error is a message that names the picture.
    pub(super) fn add(&mut self, picture: &Path, filter: Filter, tiling: Tiling) -> Result<Listed, String> {
        let texture = self.load(picture, PictureUse::Color)?;
        Ok(Listed { index: self.list(&texture, filter, tiling), cuts: texture.has_alpha() })
    }

    /// Adds the picture file of a panorama, or of a face of a cube map, to the scene's list of textures. The error is a message that
    /// names the picture.
    pub(super) fn add_sky(&mut self, picture: &Path) -> Result<u32, String> {
        let texture = self.load(picture, PictureUse::Sky)?;
        Ok(self.list(&texture, Filter::Bilinear, Tiling::default()))
    }

    /// Width and height of a texture in the scene's list; `None` if the index is out of range.
    pub(super) fn size(&self, index: u32) -> Option<(u32, u32)> {
        let id = self.maps.get(index as usize)?.texture;
        let texture = self.loaded.values().flatten().find(|texture| texture.id() == id)?;
        Some((texture.width(), texture.height()))
    }

    fn load(&mut self, picture: &Path, used: PictureUse) -> Result<Arc<Texture>, String> {
        self.cache.note(FileStamp::of(picture));
        let key = (real(picture)?, used);
        let texture = match self.loaded.entry(key.clone()) {
            Entry::Occupied(entry) => entry.into_mut(),
            // Messages name the file as the scene or model does.
            Entry::Vacant(entry) => {
                let room = Room { used: self.bytes, limit: self.max_bytes };
                let read = |files: &mut Vec<FileStamp>| {
                    files.push(FileStamp::of(picture));
                    read_noting(picture, used, room)
                };
                let texture = self.cache.get_or_read(key, read).and_then(|(texture, notes)| {
                    room.check(picture, 4 * u64::from(texture.width()) * u64::from(texture.height()))?;
                    self.notes.extend(notes);
                    Ok(texture)
                });
                self.bytes += texture.as_ref().map_or(0, |texture| texture.bytes().len() as u64);
                entry.insert(texture)
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
    /// without `may_leave`, is reported as a warning, and its material has no texture.
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
        let mut add = |texture: &Option<TextureFile>, used: PictureUse| {
            let TextureFile { file, tiling } = texture.as_ref().filter(|_| mesh.has_uvs())?;
            let failed = |reason: String| {
                let material = excerpt(&slot.name, 60);
                let message = format!("material `{material}`: {reason}; drawn without its texture");
                about.once_in_file(&reason, message);
            };
            let texture = permitted(files, file).and_then(|()| self.load(&files.path(file), used));
            let texture = texture.map_err(failed).ok()?;
            let cuts = texture.has_alpha();
            // A mask that cuts nothing out has no effect.
            (used == PictureUse::Color || cuts)
                .then(|| Listed { index: self.list(&texture, Filter::Bilinear, *tiling), cuts })
        };
        let texture = add(&slot.texture, PictureUse::Color);
        let emission_texture = add(&slot.emission_texture, PictureUse::Color);
        // A picture that is named for both has colours; they are no mask.
        let own =
            |named: &TextureFile| slot.texture.as_ref().is_some_and(|texture| texture.file == named.file);
        let cutout = match &slot.cutout {
            Some(named) => add(&slot.cutout, if own(named) { PictureUse::Color } else { PictureUse::Mask }),
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

    /// The scene's list of textures, each texture once, and the warnings about pictures.
    pub(super) fn take_parts(&mut self) -> (Vec<TextureMap>, Vec<Arc<Texture>>, BTreeSet<String>) {
        let maps = std::mem::take(&mut self.maps);
        let loaded = std::mem::take(&mut self.loaded).into_values().flatten();
        let by_id: BTreeMap<TextureId, Arc<Texture>> =
            loaded.map(|texture| (texture.id(), texture)).collect();
        let listed = |texture: &Arc<Texture>| maps.iter().any(|map| map.texture == texture.id());
        let textures = by_id.into_values().filter(listed).collect();
        (maps, textures, std::mem::take(&mut self.notes))
    }
}

/// Checks the name of a picture in a compiled model, which may come from an untrusted source.
fn permitted(files: &Lookup<'_>, file: &str) -> Result<(), String> {
    match files.find_here(Path::new(""), file) {
        // A missing file is reported when it is opened.
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

/// Bytes of textures: those of the loaded ones, and how many all of them may have.
#[derive(Clone, Copy)]
struct Room {
    used: u64,
    limit: u64,
}

impl Room {
    /// Refuses a picture that takes more bytes as a texture than there is room for.
    fn check(self, picture: &Path, bytes: u64) -> Result<(), String> {
        if bytes <= self.limit.saturating_sub(self.used) {
            return Ok(());
        }
        Err(format!(
            "{}: with it the textures of the scene would take more than {} MiB, the limit; make pictures smaller",
            shown(picture),
            self.limit >> 20
        ))
    }
}

/// Reads a picture as a texture, with the notes about it.
fn read_noting(picture: &Path, used: PictureUse, room: Room) -> Result<(Arc<Texture>, Vec<String>), String> {
    let mut notes = BTreeSet::new();
    let texture = read(picture, used, room, &mut notes)?;
    if image::ends_early(picture) {
        let message = "the JPEG picture has no end: what is missing of it is grey; get the file again";
        notes.insert(format!("{}: {message}", shown(picture)));
    }
    Ok((Arc::new(texture), notes.into_iter().collect()))
}

/// Reads a picture as a texture, if there is room for it, and adds warnings about it to `notes`.
fn read(
    picture: &Path,
    used: PictureUse,
    room: Room,
    notes: &mut BTreeSet<String>,
) -> Result<Texture, String> {
    let too_large = |error| format!("{}: {error}", shown(picture));
    let high_range = image::has_high_range(picture);
    let undecoded = |error: image::ImageError| match recognised_file(picture) {
        Some(foreign) if !foreign.is_picture() && !high_range => {
            format!("cannot read {}: {}", shown(picture), foreign.refusal(Wanted::Picture))
        }
        _ => escaped(&error.to_string()),
    };
    let (width, height) = image::size(picture).map_err(undecoded)?;
    check_size(width, height).map_err(too_large)?;
    room.check(picture, 4 * u64::from(width) * u64::from(height))?;
    if used == PictureUse::Sky {
        let sky = image::load_sky(picture).map_err(undecoded)?;
        return sky::texture(picture, &sky, notes).map_err(too_large);
    }
    let (mut pixels, alpha) = image::load_with_alpha(picture).map_err(undecoded)?;
    let alpha = match (used, alpha) {
        (PictureUse::Color | PictureUse::Sky, alpha) => alpha.unwrap_or_default(),
        (PictureUse::Mask, Some(alpha)) if alpha.iter().any(|&alpha| alpha < LEAST_ALPHA) => alpha,
        (PictureUse::Mask, _) => {
            let brightness = pixels.pixels.chunks_exact(3).map(brightness).collect();
            pixels.pixels.fill(u8::MAX);
            brightness
        }
    };
    Texture::with_alpha(&pixels, &alpha).map_err(too_large)
}

/// Brightness of a pixel of a mask, with the weights of Rec. 709 and without gamma: the picture holds numbers, not colours.
fn brightness(pixel: &[u8]) -> u8 {
    let sum: u32 =
        pixel.iter().zip([2126, 7152, 722]).map(|(&channel, weight)| u32::from(channel) * weight).sum();
    ((sum + 5000) / 10_000) as u8
}
