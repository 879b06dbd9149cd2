//! The material slots of a compiled mesh as bytes.
//!
//! Per slot: diffuse, specular, exponent, emission (ten `f32`), flags (`u8`: 1 is unlit, 2 bounces, 4 thin, 8 Fresnel
//! shares), with bounces reflect, transmit and index of refraction (seven `f32`), the length of the name in bytes
//! (`u8`), the name, and three textures: diffuse, cut-out, emission. A texture is the length of its file name
//! in bytes (`u16`, 0 for none), the name, its wrap (`u8`), scale and offset (four `f32`). Version 3 has neither
//! emission nor flags, and one texture without wrap, scale and offset.

use glam::{Vec2, Vec3};

use super::{MAX_MATERIALS, MAX_TEXTURE_NAME, MeshError, NamedMaterial, OLDEST_FORMAT_VERSION, TextureFile};
use crate::material::Material;
use crate::texture::{Tiling, Wrap};

/// Longest name of a material slot, in bytes; longer ones are truncated.
const MAX_NAME: usize = 255;

const UNLIT: u8 = 1;
/// Reflection and transmission follow. Materials without them keep the bytes that they had before.
const BOUNCES: u8 = 2;
const THIN: u8 = 4;
const FRESNEL: u8 = 8;

pub(super) fn encode_materials(materials: &[NamedMaterial]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for NamedMaterial { name, material, texture, cutout, emission_texture } in materials {
        let colors = [material.diffuse, material.specular].map(|color| color.to_array()).concat();
        let numbers = colors.into_iter().chain([material.exponent]).chain(material.emission.to_array());
        numbers.for_each(|number| bytes.extend_from_slice(&number.to_le_bytes()));
        encode_flags(material, &mut bytes);
        let name = &name[..name.floor_char_boundary(MAX_NAME)];
        bytes.push(name.len() as u8);
        bytes.extend_from_slice(name.as_bytes());
        [texture, cutout, emission_texture]
            .into_iter()
            .for_each(|texture| encode_texture(texture.as_ref(), &mut bytes));
    }
    bytes
}

fn encode_flags(material: &Material, bytes: &mut Vec<u8>) {
    let bounces = material.bounces();
    let flags = [
        (material.unlit, UNLIT),
        (bounces, BOUNCES),
        (bounces && material.thin, THIN),
        (bounces && material.fresnel, FRESNEL),
    ];
    bytes.push(flags.into_iter().filter(|(set, _)| *set).map(|(_, flag)| flag).sum());
    if bounces {
        let shares = [material.reflect, material.transmit].map(|share| share.to_array()).concat();
        let numbers = shares.into_iter().chain([material.ior]);
        numbers.for_each(|number| bytes.extend_from_slice(&number.to_le_bytes()));
    }
}

fn encode_texture(texture: Option<&TextureFile>, bytes: &mut Vec<u8>) {
    // A truncated path would name no file, so it is dropped.
    let Some(TextureFile { file, tiling }) = texture.filter(|texture| texture.file.len() <= MAX_TEXTURE_NAME)
    else {
        return bytes.extend_from_slice(&[0; 2]);
    };
    bytes.extend_from_slice(&(file.len() as u16).to_le_bytes());
    bytes.extend_from_slice(file.as_bytes());
    if !file.is_empty() {
        bytes.push(WRAPS.iter().position(|wrap| *wrap == tiling.wrap).unwrap_or_default() as u8);
        let numbers = tiling.scale.to_array().into_iter().chain(tiling.offset.to_array());
        numbers.for_each(|number| bytes.extend_from_slice(&number.to_le_bytes()));
    }
}

/// Wraps by their number in the bytes.
const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];

/// Decodes material slots in the layout of a version.
pub(super) fn decode_materials(
    bytes: &[u8],
    count: u32,
    version: u16,
) -> Result<Vec<NamedMaterial>, MeshError> {
    if count as usize > MAX_MATERIALS {
        return Err(MeshError::Format(format!("it announces {count} materials")));
    }
    let mut reader = Reader(bytes);
    let mut materials = Vec::new();
    for _ in 0..count {
        materials.push(if version == OLDEST_FORMAT_VERSION { reader.old_slot()? } else { reader.slot()? });
    }
    match reader.0.len() {
        0 => Ok(materials),
        rest => Err(MeshError::Format(format!("{rest} bytes follow its material slots"))),
    }
}

struct Reader<'b>(&'b [u8]);

impl<'b> Reader<'b> {
    fn take(&mut self, count: usize) -> Result<&'b [u8], MeshError> {
        let cut = || MeshError::Format("its material slots are cut short".into());
        let (taken, rest) = self.0.split_at_checked(count).ok_or_else(cut)?;
        self.0 = rest;
        Ok(taken)
    }

    fn text(&mut self, length: usize) -> Result<String, MeshError> {
        Ok(String::from_utf8_lossy(self.take(length)?).into_owned())
    }

    fn slot(&mut self) -> Result<NamedMaterial, MeshError> {
        let material = self.blinn_phong()?;
        let emission = Vec3::from_array(self.numbers()?);
        let flags = self.byte()?;
        let material = Material { emission, unlit: flags & UNLIT != 0, ..material };
        let material = if flags & BOUNCES == 0 { material } else { self.bounces(material, flags)? };
        let length = self.byte()?;
        let name = self.text(length.into())?;
        let [texture, cutout, emission_texture] = [self.texture()?, self.texture()?, self.texture()?];
        Ok(NamedMaterial { name, material, texture, cutout, emission_texture })
    }

    fn old_slot(&mut self) -> Result<NamedMaterial, MeshError> {
        let material = self.blinn_phong()?;
        let length = self.byte()?;
        let name = self.text(length.into())?;
        let texture = Some(self.file_name()?).filter(|name| !name.is_empty()).map(TextureFile::new);
        Ok(NamedMaterial { texture, ..NamedMaterial::plain(name, material) })
    }

    fn blinn_phong(&mut self) -> Result<Material, MeshError> {
        let [dr, dg, db, sr, sg, sb, exponent] = self.numbers()?;
        let (diffuse, specular) = (Vec3::new(dr, dg, db), Vec3::new(sr, sg, sb));
        Ok(Material { diffuse, specular, exponent, ..Material::NEUTRAL })
    }

    fn bounces(&mut self, material: Material, flags: u8) -> Result<Material, MeshError> {
        let shares: [f32; 6] = self.numbers()?;
        let [ior] = self.numbers()?;
        if shares.iter().any(|share| *share > 1.0) || ior == 0.0 {
            let message =
                "a material reflects or transmits more than all light, or has the index of refraction 0";
            return Err(MeshError::Format(message.into()));
        }
        let [rr, rg, rb, tr, tg, tb] = shares;
        let (reflect, transmit) = (Vec3::new(rr, rg, rb), Vec3::new(tr, tg, tb));
        let (thin, fresnel) = (flags & THIN != 0, flags & FRESNEL != 0);
        Ok(Material { reflect, transmit, ior, thin, fresnel, ..material })
    }

    fn texture(&mut self) -> Result<Option<TextureFile>, MeshError> {
        let file = self.file_name()?;
        if file.is_empty() {
            return Ok(None);
        }
        let broken =
            || MeshError::Format("a texture has an unknown wrap, or scale and offset out of range".into());
        let wrap = *WRAPS.get(usize::from(self.byte()?)).ok_or_else(broken)?;
        let [u, v, right, up] = self.floats()?;
        let tiling = Tiling { wrap, scale: Vec2::new(u, v), offset: Vec2::new(right, up) };
        if tiling.is_usable() { Ok(Some(TextureFile { file, tiling })) } else { Err(broken()) }
    }

    fn file_name(&mut self) -> Result<String, MeshError> {
        let length: u16 = bytemuck::pod_read_unaligned(self.take(2)?);
        if usize::from(length) > MAX_TEXTURE_NAME {
            return Err(MeshError::Format(format!("a texture's file name has {length} bytes")));
        }
        self.text(length.into())
    }

    fn byte(&mut self) -> Result<u8, MeshError> {
        Ok(self.take(1)?[0])
    }

    fn floats<const N: usize>(&mut self) -> Result<[f32; N], MeshError> {
        let bytes = self.take(N * size_of::<f32>())?;
        let mut numbers = [0.0; N];
        for (number, bytes) in numbers.iter_mut().zip(bytes.chunks_exact(size_of::<f32>())) {
            *number = bytemuck::pod_read_unaligned(bytes);
        }
        Ok(numbers)
    }

    /// Non-negative numbers: colours and exponents.
    fn numbers<const N: usize>(&mut self) -> Result<[f32; N], MeshError> {
        let numbers = self.floats()?;
        if numbers.iter().any(|number| !(0.0..=1e9).contains(number)) {
            return Err(MeshError::Format("a material has a number that is not in 0..1e9".into()));
        }
        Ok(numbers)
    }
}
