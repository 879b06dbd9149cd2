//! A [`CompiledScene`]: scene, meshes, textures and the shape of the scene's tree, all independent of the camera.
//!
//! ```text
//!   items        primitives with bounds, numbered through
//!   bounds       placements of models, bounds of items
//!   attributes   vertex attributes that the materials of a model use
//!   solids       meshes that bound volumes
//!   motion       objects that move while the shutter is open
//! ```

mod attributes;
mod bounds;
mod items;
mod motion;
mod solids;

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use crate::bvh::{self, BuildQuality};
use crate::cancel::{Cancelled, IsCancelled, go_on, never};
use crate::mesh::{CompiledMesh, MeshId};
use crate::scene::{FrameView, Material, Model, NormalMode, Scene, SceneFeatures, TextureMap, ValidateError};
use crate::texture::{Texture, TextureId};
pub(crate) use attributes::AttributeUse;
use attributes::{attribute_uses, uses_uvs};
pub(crate) use bounds::{disk_reach, orientation, transformed_bounds};
use bounds::{relative_boxes, world_bounds};
pub(crate) use items::{Item, Items};
pub(crate) use motion::moving_item;
pub(crate) use solids::Solid;

/// Reasons why a scene cannot be traced.
#[derive(Debug, thiserror::Error)]
pub enum CompileError {
    /// A mesh that the scene names is missing.
    #[error("model {model} names mesh {id}, which is missing")]
    MissingMesh {
        /// Index of the model.
        model: usize,
        /// The mesh.
        id: MeshId,
    },
    /// A mesh that bounds a volume is missing.
    #[error("volume {volume} names mesh {id}, which is missing")]
    MissingSolid {
        /// Index of the volume.
        volume: usize,
        /// The mesh.
        id: MeshId,
    },
    /// A texture that the scene names is missing.
    #[error("the scene names texture {id}, which is missing")]
    MissingTexture {
        /// The texture.
        id: TextureId,
    },
    /// A material names a texture of linear light.
    #[error("a material has texture {id}, which is of linear light and for skies only")]
    LinearTexture {
        /// The texture.
        id: TextureId,
    },
    /// A model does not fit its mesh.
    #[error("model {model} does not fit its mesh: {what}")]
    Mismatch {
        /// Index of the model.
        model: usize,
        /// The mismatch.
        what: String,
    },
    /// The requested frame cannot be rendered.
    #[error("cannot render this frame: {0}")]
    Frame(#[from] ValidateError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A scene with its meshes, its textures and the shape of the tree over its items: immutable, shared between threads.
#[derive(Clone, Debug)]
pub struct CompiledScene {
    scene: Scene,
    /// One per model.
    meshes: Vec<Arc<CompiledMesh>>,
    /// One per model.
    attributes: Vec<AttributeUse>,
    /// One per volume that a mesh bounds, in their order.
    solids: Vec<Solid>,
    /// One per texture of the scene.
    textures: Vec<(Arc<Texture>, TextureMap)>,
    /// The tree over all items, one item a leaf. Its boxes are in world space; a frame replaces them.
    tree: bvh::WideTree,
    bounds: Option<(DVec3, DVec3)>,
    features: SceneFeatures,
    /// The scene as the direct integrator shows it, where that differs; made by its first frame.
    shown_directly: OnceLock<Option<Arc<CompiledScene>>>,
    /// The same with a tree without the items that move, if any do.
    without_moving: Option<Arc<CompiledScene>>,
}

impl CompiledScene {
    /// Combines a scene with its meshes and textures. Those that the scene does not name are ignored.
    ///
    /// # Errors
    /// A mesh or texture is missing, or a mesh has more material slots than the model assigns, or no normals where the
    /// model interpolates them, or no texture coordinates where a material has a texture.
    pub fn new(
        scene: Scene,
        meshes: impl IntoIterator<Item = Arc<CompiledMesh>>,
        textures: impl IntoIterator<Item = Arc<Texture>>,
    ) -> Result<Self, CompileError> {
        Self::new_unless(scene, meshes, textures, &never)
    }

    /// [`CompiledScene::new`] with cancellation. `cancelled` is polled between steps, each a fraction of the work.
    ///
    /// # Errors
    /// As [`CompiledScene::new`], and [`CompileError::Cancelled`].
    pub fn new_unless(
        scene: Scene,
        meshes: impl IntoIterator<Item = Arc<CompiledMesh>>,
        textures: impl IntoIterator<Item = Arc<Texture>>,
        cancelled: &IsCancelled<'_>,
    ) -> Result<Self, CompileError> {
        go_on(cancelled)?;
        let by_id: BTreeMap<MeshId, Arc<CompiledMesh>> =
            meshes.into_iter().map(|mesh| (mesh.id(), mesh)).collect();
        let meshes: Vec<Arc<CompiledMesh>> = scene
            .models
            .iter()
            .enumerate()
            .map(|(model, description)| fitting_mesh(&scene, &by_id, model, description))
            .collect::<Result<_, _>>()?;
        let solids = solids::of(&scene, &by_id)?;
        let attributes = attribute_uses(&scene, &meshes);
        let textures = textures_of(&scene, textures)?;
        let items = Items::of(&scene);
        let boxes: Vec<(DVec3, DVec3)> =
            items.range().map(|index| world_bounds(&scene, &meshes, items.get(index))).collect();
        let bounds = boxes.iter().copied().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let tree = bvh::build_wide(&relative_boxes(&boxes, bounds), 1, BuildQuality::Default, cancelled)?;
        let features = SceneFeatures::of(&scene);
        let shown_directly = OnceLock::new();
        let without_moving = None;
        let mut compiled = Self {
            scene,
            meshes,
            attributes,
            solids,
            textures,
            tree,
            bounds,
            features,
            shown_directly,
            without_moving,
        };
        compiled.without_moving = motion::without_moving(&compiled, &boxes, cancelled)?;
        Ok(compiled)
    }

    /// The scene for the frames of a view: with its materials as the direct integrator shows them, if it is the one; with a tree without
    /// the items that move, if the view shows their motion.
    pub(crate) fn for_view(self: Arc<Self>, view: &FrameView) -> Arc<Self> {
        if let Some(still) = self.without_moving.as_ref().filter(|_| view.shows_motion()) {
            return Arc::clone(still);
        }
        if !self.features.metallic_roughness || !view.shows_materials_directly() {
            return self;
        }
        let with_materials = |scene: Scene| {
            let features = SceneFeatures::of(&scene);
            Arc::new(Self { scene, features, shown_directly: OnceLock::new(), ..Self::clone(&self) })
        };
        let shown = self.shown_directly.get_or_init(|| self.scene.shown_directly().map(with_materials));
        shown.clone().unwrap_or(self)
    }

    /// The scene as plain data.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Number of triangles of all instances and of the scene file.
    pub fn triangle_count(&self) -> u64 {
        let in_models: u64 = self.meshes.iter().map(|mesh| mesh.triangle_count() as u64).sum();
        in_models + self.scene.triangles.len() as u64
    }

    /// World bounds of all items; `None` if there are none.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.bounds
    }

    /// Features that the scene uses at full quality.
    pub fn features(&self) -> SceneFeatures {
        self.features
    }

    /// Size in bytes of the tree over the scene's items, which every frame copies with its own boxes.
    pub fn tree_bytes(&self) -> usize {
        let items = self.tree.blocks.iter().map(|block| size_of_val(&block[..])).sum::<usize>();
        size_of_val(&self.tree.nodes[..]) + items
    }

    /// The mesh of each model.
    pub(crate) fn meshes(&self) -> &[Arc<CompiledMesh>] {
        &self.meshes
    }

    /// The vertex attributes that each model uses.
    pub(crate) fn attributes(&self) -> &[AttributeUse] {
        &self.attributes
    }

    /// The meshes of the volumes that have one, in their order.
    pub(crate) fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// The scene's textures with their maps.
    pub(crate) fn textures(&self) -> &[(Arc<Texture>, TextureMap)] {
        &self.textures
    }

    /// The tree over the items, one item a leaf.
    pub(crate) fn tree(&self) -> &bvh::WideTree {
        &self.tree
    }
}

fn textures_of(
    scene: &Scene,
    textures: impl IntoIterator<Item = Arc<Texture>>,
) -> Result<Vec<(Arc<Texture>, TextureMap)>, CompileError> {
    let by_id: BTreeMap<TextureId, Arc<Texture>> =
        textures.into_iter().map(|texture| (texture.id(), texture)).collect();
    let find = |id: TextureId| by_id.get(&id).cloned().ok_or(CompileError::MissingTexture { id });
    let textures = scene.textures.iter().map(|map| Ok((find(map.texture)?, *map)));
    let textures: Vec<(Arc<Texture>, TextureMap)> = textures.collect::<Result<_, CompileError>>()?;
    let of_materials = scene.materials.iter().flat_map(Material::textures);
    let mut linear = of_materials.filter_map(|index| textures.get(index as usize));
    match linear.find(|(texture, _)| texture.is_linear()) {
        Some((texture, _)) => Err(CompileError::LinearTexture { id: texture.id() }),
        None => Ok(textures),
    }
}

fn fitting_mesh(
    scene: &Scene,
    meshes: &BTreeMap<MeshId, Arc<CompiledMesh>>,
    model: usize,
    description: &Model,
) -> Result<Arc<CompiledMesh>, CompileError> {
    let mesh =
        meshes.get(&description.mesh).ok_or(CompileError::MissingMesh { model, id: description.mesh })?;
    let mismatch = |what: String| Err(CompileError::Mismatch { model, what });
    if description.materials.len() != mesh.material_count() {
        return mismatch(format!(
            "{} materials for {} slots",
            description.materials.len(),
            mesh.material_count()
        ));
    }
    if description.normals == NormalMode::Smooth && !mesh.has_normals() {
        return mismatch(
            "it interpolates normals, the mesh was compiled without; compile the mesh with normals, or set flat ones"
                .into(),
        );
    }
    if uses_uvs(scene, description) && !mesh.has_uvs() {
        return mismatch(
            "one of its materials has a texture or a pattern in texture coordinates, the mesh was compiled without texture coordinates; compile the mesh with them".into(),
        );
    }
    Ok(Arc::clone(mesh))
}
