//! Scene + meshes -> [`CompiledScene`]: what does not change while the camera moves.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use crate::bvh::WIDTH;
use crate::bvh::{self, BuildQuality};
use crate::cancel::{Cancelled, IsCancelled, go_on, never};
use crate::mesh::{CompiledMesh, MeshId};
use crate::scene::{Material, Model, NormalMode, Scene, SceneFeatures, TextureMap, ValidateError, rotation};
use crate::texture::{Texture, TextureId};

/// Why a scene cannot be traced.
#[derive(Debug, thiserror::Error)]
pub enum CompileError {
    /// A mesh that the scene names was not given.
    #[error("model {model} names mesh {id}, which is not at hand")]
    MissingMesh {
        /// Index of the model.
        model: usize,
        /// The mesh.
        id: MeshId,
    },
    /// A texture that the scene names was not given.
    #[error("the scene names texture {id}, which is not at hand")]
    MissingTexture {
        /// The texture.
        id: TextureId,
    },
    /// A model and its mesh do not fit.
    #[error("model {model} does not fit its mesh: {what}")]
    Mismatch {
        /// Index of the model.
        model: usize,
        /// How.
        what: String,
    },
    /// The frame asked for cannot be rendered.
    #[error("cannot render this frame: {0}")]
    Frame(#[from] ValidateError),
    /// The result was not wanted any more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A scene with its meshes and textures, and the shape of the tree over its instances. Immutable; share it between threads.
#[derive(Debug)]
pub struct CompiledScene {
    scene: Scene,
    /// One per model.
    meshes: Vec<Arc<CompiledMesh>>,
    /// One per model.
    coverings: Vec<Covering>,
    /// One per texture of the scene.
    textures: Vec<(Arc<Texture>, TextureMap)>,
    /// Over all finite items; its boxes are those of no frame in particular.
    tree: bvh::WideTree,
    bounds: Option<(DVec3, DVec3)>,
    features: SceneFeatures,
}

/// What the materials of a model want of its mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct Covering {
    /// Texture coordinates.
    pub textured: bool,
    /// Colours of vertices.
    pub colored: bool,
    /// Which triangles can be cut out, a bit each, sixteen by sixteen; empty if none can.
    pub cutouts: Arc<[u16]>,
}

/// Everything with bounds is an *item* of the scene's own tree: models first, then spheres, then triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Item {
    Model(usize),
    Sphere(usize),
    Triangle(usize),
}

/// Which item indices are which.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Items {
    models: usize,
    spheres: usize,
    triangles: usize,
}

impl Items {
    pub(crate) fn of(scene: &Scene) -> Self {
        Self { models: scene.models.len(), spheres: scene.spheres.len(), triangles: scene.triangles.len() }
    }

    pub(crate) fn range(&self) -> Range<u32> {
        0..(self.models + self.spheres + self.triangles) as u32
    }

    /// Index of the first plane: planes have no bounds, and are numbered behind all items.
    pub(crate) fn first_plane(&self) -> u32 {
        self.range().end
    }

    pub(crate) fn get(&self, index: u32) -> Item {
        let index = index as usize;
        if index < self.models {
            Item::Model(index)
        } else if index < self.models + self.spheres {
            Item::Sphere(index - self.models)
        } else {
            Item::Triangle(index - self.models - self.spheres)
        }
    }
}

impl CompiledScene {
    /// Puts a scene, its meshes and its textures together. There may be more of them than the scene names.
    ///
    /// # Errors
    /// A mesh or texture is missing, or a mesh has more material slots than the model assigns, or no normals where smooth ones
    /// are asked for, or no texture coordinates where a material has a texture.
    pub fn new(
        scene: Scene,
        meshes: impl IntoIterator<Item = Arc<CompiledMesh>>,
        textures: impl IntoIterator<Item = Arc<Texture>>,
    ) -> Result<Self, CompileError> {
        Self::new_unless(scene, meshes, textures, &never)
    }

    /// [`CompiledScene::new`], unless it is cancelled: the question is asked between steps of which each is a fraction of
    /// the whole.
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
        let coverings = coverings_of(&scene, &meshes);
        let textures = textures_of(&scene, textures)?;
        let items = Items::of(&scene);
        let boxes: Vec<(DVec3, DVec3)> =
            items.range().map(|index| world_bounds(&scene, &meshes, items.get(index))).collect();
        let bounds = boxes.iter().copied().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let tree = bvh::build_wide(&relative_boxes(&boxes, bounds), 1, BuildQuality::Default, cancelled)?;
        let features = SceneFeatures::of(&scene);
        Ok(Self { scene, meshes, coverings, textures, tree, bounds, features })
    }

    /// What was compiled.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Triangles over all instances, and those of the scene file.
    pub fn triangle_count(&self) -> u64 {
        let in_models: u64 = self.meshes.iter().map(|mesh| mesh.triangle_count() as u64).sum();
        in_models + self.scene.triangles.len() as u64
    }

    /// World bounds of everything finite.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.bounds
    }

    /// Features that the scene uses at full quality.
    pub fn features(&self) -> SceneFeatures {
        self.features
    }

    /// Bytes of the tree over the scene's own items, which every frame copies with its own boxes.
    pub fn tree_bytes(&self) -> usize {
        let items = self.tree.blocks.iter().map(|block| size_of_val(&block[..])).sum::<usize>();
        size_of_val(&self.tree.nodes[..]) + items
    }

    /// One mesh per model.
    pub(crate) fn meshes(&self) -> &[Arc<CompiledMesh>] {
        &self.meshes
    }

    /// One per model.
    pub(crate) fn coverings(&self) -> &[Covering] {
        &self.coverings
    }

    /// The scene's textures, and how they are looked up.
    pub(crate) fn textures(&self) -> &[(Arc<Texture>, TextureMap)] {
        &self.textures
    }

    /// Over the items, one a leaf.
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
    scene.textures.iter().map(|map| Ok((find(map.texture)?, *map))).collect()
}

fn has_texture(scene: &Scene, model: &Model) -> bool {
    model.materials.iter().any(|&index| scene.materials[index as usize].textures().next().is_some())
}

/// One per model; those that wear the same on the same mesh share theirs.
fn coverings_of(scene: &Scene, meshes: &[Arc<CompiledMesh>]) -> Vec<Covering> {
    let mut known: BTreeMap<(MeshId, &[u32]), Covering> = BTreeMap::new();
    let of_model = |(model, mesh): (&'_ Model, &Arc<CompiledMesh>)| -> Covering {
        let wears = |asks: fn(&Material) -> bool| {
            model.materials.iter().any(|&index| asks(&scene.materials[index as usize]))
        };
        let cuts = wears(|material| material.cutout.is_some());
        Covering {
            textured: has_texture(scene, model),
            colored: mesh.has_colors() && wears(|material| material.vertex_colors),
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
            "it asks for smooth normals, the mesh was compiled without; compile it again, or ask for flat ones"
                .into(),
        );
    }
    if has_texture(scene, description) && !mesh.has_uvs() {
        return mismatch(
            "a material of it has a texture, the mesh was compiled without texture coordinates; compile it again".into(),
        );
    }
    Ok(Arc::clone(mesh))
}

/// Scale, then the model's rotation, then `spin` degrees about y: the linear part of a model's placement.
pub(crate) fn orientation(model: &Model, spin: f64) -> DMat3 {
    rotation::about_y(spin) * rotation::of_model(model.rotate) * DMat3::from_diagonal(model.scale)
}

/// Bounds of a box after a linear map and a translation.
pub(crate) fn transformed_bounds(
    (lo, hi): (DVec3, DVec3),
    linear: DMat3,
    translation: DVec3,
) -> (DVec3, DVec3) {
    let center = linear * (lo * 0.5 + hi * 0.5) + translation;
    let half = (hi - lo) * 0.5;
    let reach = linear.x_axis.abs() * half.x + linear.y_axis.abs() * half.y + linear.z_axis.abs() * half.z;
    (center - reach, center + reach)
}

fn world_bounds(scene: &Scene, meshes: &[Arc<CompiledMesh>], item: Item) -> (DVec3, DVec3) {
    match item {
        Item::Model(i) => {
            let model = &scene.models[i];
            transformed_bounds(meshes[i].bounds(), orientation(model, 0.0), model.translate)
        }
        Item::Sphere(i) => {
            let sphere = &scene.spheres[i];
            (sphere.center - sphere.radius, sphere.center + sphere.radius)
        }
        Item::Triangle(i) => {
            let [a, b, c] = scene.triangles[i].vertices;
            (a.min(b).min(c), a.max(b).max(c))
        }
    }
}

/// Boxes about the scene's centre, in its half extents: what a builder in `f32` can bear, wherever the scene stands.
fn relative_boxes(boxes: &[(DVec3, DVec3)], bounds: Option<(DVec3, DVec3)>) -> Vec<(Vec3, Vec3)> {
    let Some((lo, hi)) = bounds else { return Vec::new() };
    let center = lo * 0.5 + hi * 0.5;
    let half_extent = (hi - center).max_element();
    let unit = if half_extent > 0.0 && half_extent.is_finite() { half_extent } else { 1.0 };
    let place = |corner: DVec3| ((corner - center) / unit).as_vec3();
    boxes.iter().map(|&(lo, hi)| (place(lo), place(hi))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_follow_the_right_hand_and_the_order_x_y_z() {
        let model = |rotate| Model {
            mesh: MeshId([0; 32]),
            materials: vec![],
            normals: NormalMode::Flat,
            translate: DVec3::ZERO,
            rotate,
            scale: DVec3::ONE,
        };
        assert_eq!(orientation(&model(DVec3::new(90.0, 0.0, 0.0)), 0.0) * DVec3::Y, DVec3::Z);
        assert_eq!(orientation(&model(DVec3::new(0.0, 90.0, 0.0)), 0.0) * DVec3::Z, DVec3::X);
        assert_eq!(orientation(&model(DVec3::new(0.0, 0.0, 90.0)), 0.0) * DVec3::X, DVec3::Y);
        // y -> z by x, z -> x by y, x -> y by z.
        assert_eq!(orientation(&model(DVec3::splat(90.0)), 0.0) * DVec3::Y, DVec3::Y);
        assert_eq!(orientation(&model(DVec3::new(90.0, 0.0, 0.0)), 90.0) * DVec3::Y, DVec3::X);
    }

    #[test]
    fn a_transformed_box_holds_all_its_corners() {
        let linear = rotation::about_x(20.0)
            * rotation::about_y(40.0)
            * DMat3::from_diagonal(DVec3::new(1.0, -2.0, 3.0));
        let (lo, hi) = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(2.0, 5.0, 3.0));
        let (tlo, thi) = transformed_bounds((lo, hi), linear, DVec3::ONE);
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { lo[axis] } else { hi[axis] };
            let moved = linear * DVec3::new(pick(0), pick(1), pick(2)) + DVec3::ONE;
            assert!((moved - tlo).min_element() > -1e-12 && (thi - moved).min_element() > -1e-12);
        }
    }
}
