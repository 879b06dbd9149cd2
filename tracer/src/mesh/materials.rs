//! The material slots of a compiled mesh, as bytes.
//!
//! Per slot: diffuse, specular, exponent (seven `f32`), the length of the name in bytes (`u8`), the name, the length of the
//! texture's file name in bytes (`u16`, 0 for none), that name.

use glam::Vec3;

use super::{MAX_MATERIALS, MAX_TEXTURE_NAME, MeshError, NamedMaterial};
use crate::scene::Material;

/// Longest name of a material slot, in bytes; longer ones are cut.
const MAX_NAME: usize = 255;

pub(super) fn encode_materials(materials: &[NamedMaterial]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for NamedMaterial { name, material, texture } in materials {
        let numbers = material.diffuse.to_array().into_iter().chain(material.specular.to_array());
        for number in numbers.chain([material.exponent]) {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
        let name = &name[..name.floor_char_boundary(MAX_NAME)];
        bytes.push(name.len() as u8);
        bytes.extend_from_slice(name.as_bytes());
        // Half a path is none.
        let texture = texture.as_deref().filter(|name| name.len() <= MAX_TEXTURE_NAME).unwrap_or_default();
        bytes.extend_from_slice(&(texture.len() as u16).to_le_bytes());
        bytes.extend_from_slice(texture.as_bytes());
    }
    bytes
}

pub(super) fn decode_materials(bytes: &[u8], count: u32) -> Result<Vec<NamedMaterial>, MeshError> {
    if count as usize > MAX_MATERIALS {
        return Err(MeshError::Format(format!("it announces {count} materials")));
    }
    let mut reader = Reader(bytes);
    let mut materials = Vec::new();
    for _ in 0..count {
        let numbers: [f32; 7] = bytemuck::pod_read_unaligned(reader.take(7 * 4)?);
        if numbers.iter().any(|number| !(0.0..=1e9).contains(number)) {
            return Err(MeshError::Format("a material has a number that is not in 0..1e9".into()));
        }
        let [dr, dg, db, sr, sg, sb, exponent] = numbers;
        let length = reader.take(1)?[0];
        let name = reader.text(length.into())?;
        let length: u16 = bytemuck::pod_read_unaligned(reader.take(2)?);
        if usize::from(length) > MAX_TEXTURE_NAME {
            return Err(MeshError::Format(format!("a texture's file name has {length} bytes")));
        }
        let texture = Some(reader.text(length.into())?).filter(|name| !name.is_empty());
        let (diffuse, specular) = (Vec3::new(dr, dg, db), Vec3::new(sr, sg, sb));
        let material = Material { diffuse, specular, exponent, texture: None };
        materials.push(NamedMaterial { name, material, texture });
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
}
