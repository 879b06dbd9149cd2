//! Vertex attributes that the materials of a model use.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::bvh::WIDTH;
use crate::mesh::{CompiledMesh, MeshId};
use crate::scene::{Checker, CheckerSpace, Material, Model, Scene};

/// Vertex attributes that the materials of a model use.
#[derive(Clone, Debug, Default)]
pub(crate) struct AttributeUse {
    /// Whether a material has a texture, and so uses texture coordinates.
    pub textured: bool,
    /// Whether a material uses vertex colours, and the mesh has them.
    pub colored: bool,
    /// Bits of the triangles that alpha cuts out, in blocks of sixteen; empty if there are none.
    pub cutouts: Arc<[u16]>,
}

/// Whether a material of the model has a texture.
fn has_texture(scene: &Scene, model: &Model) -> bool {
    model.materials.iter().any(|&index| scene.materials[index as usize].textures().next().is_some())
}

/// Whether a material of the model has a texture, or a pattern in texture coordinates.
pub(super) fn uses_uvs(scene: &Scene, model: &Model) -> bool {
    let in_uvs = |pattern: &Checker| pattern.space == CheckerSpace::Uv;
    let has_pattern = |&index: &u32| scene.materials[index as usize].checker.as_ref().is_some_and(in_uvs);
    has_texture(scene, model) || model.materials.iter().any(has_pattern)
}

/// The attributes of each model. Models with the same mesh and materials share their cut-outs.
pub(super) fn attribute_uses(scene: &Scene, meshes: &[Arc<CompiledMesh>]) -> Vec<AttributeUse> {
    let mut known: BTreeMap<(MeshId, &[u32]), AttributeUse> = BTreeMap::new();
    let of_model = |(model, mesh): (&'_ Model, &Arc<CompiledMesh>)| -> AttributeUse {
        let uses = |property: fn(&Material) -> bool| {
            model.materials.iter().any(|&index| property(&scene.materials[index as usize]))
        };
        let cuts = uses(|material| material.cutout.is_some());
        AttributeUse {
            textured: has_texture(scene, model),
            colored: mesh.has_colors() && uses(|material| material.vertex_colors),
            cutouts: if cuts { cutouts_of(scene, model, mesh) } else { Arc::default() },
        }
    };
    let pairs = scene.models.iter().zip(meshes);
    pairs
        .map(|(model, mesh)| {
            let same = known.entry((mesh.id(), &model.materials));
            same.or_insert_with(|| of_model((model, mesh))).clone()
        })
        .collect()
}

fn cutouts_of(scene: &Scene, model: &Model, mesh: &CompiledMesh) -> Arc<[u16]> {
    let mut cutouts = vec![0; mesh.blocks().len()];
    for triangle in mesh.triangles() {
        let material = model.materials[usize::from(mesh.slot(triangle))];
        if scene.materials[material as usize].cutout.is_some() {
            cutouts[triangle as usize / WIDTH] |= 1 << (triangle as usize % WIDTH);
        }
    }
    cutouts.into()
}
