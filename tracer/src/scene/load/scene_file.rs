//! Loading of scene files: parsing, models, textures, and defaults for what the file leaves open.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use glam::Vec3;

use super::LoadedScene;
use super::animated::SceneAnimation;
use super::background::background;
use super::framing;
use super::instances::{MaterialsText, Models, named};
use super::limits::LoadLimits;
use super::loader::Caches;
use super::textures::Textures;
use crate::mesh::CompiledMesh;
use crate::scene::data::{Background, Camera, Lens, Scene, Volume, VolumeBoundary};
use crate::scene::import::{LoadOptions, MAX_SCENE_BYTES, SceneError, bytes};
use crate::scene::toml::{
    self, Aim, BoundaryText, CameraText, Fault, SceneText, TextureText, TexturesText, VolumeText,
};
use crate::scene::{MetallicRoughness, NormalMap};

/// Loads a scene file and everything that it names.
pub(super) fn load(
    path: &Path,
    options: LoadOptions,
    limits: LoadLimits,
    caches: &Caches,
) -> Result<LoadedScene, SceneError> {
    refuse_for_scene(path, options)?;
    let content = bytes(path, MAX_SCENE_BYTES)?;
    load_text(path, text_of(path, &content)?, options, limits, caches)
}

/// Loads the text of a scene file and everything that it names.
pub(super) fn load_text(
    path: &Path,
    text: &str,
    options: LoadOptions,
    limits: LoadLimits,
    caches: &Caches,
) -> Result<LoadedScene, SceneError> {
    refuse_for_scene(path, options)?;
    let locate = |fault: Fault| located(path, text, fault);
    let mut read = toml::read(text, 0.0).map_err(locate)?;
    read.camera_path.keeps_direction = matches!(read.camera, Some(CameraText { aim: Aim::Direction(_), .. }));
    let animation = SceneAnimation::of(path, text, &read);
    let mut warnings: Vec<String> = read.warnings.iter().cloned().map(|w| locate(w).to_string()).collect();
    let materials = MaterialsText { materials: &read.materials, textures: &read.textures };
    let bounding = read.volumes.iter().filter_map(VolumeText::model);
    let of_file = read.models.iter().chain(bounding);
    let mut models = Models::open(path, of_file, materials, (options, limits), caches).map_err(locate)?;
    let mut loaded = assemble(path, read, &mut models, &locate)?;
    warnings.append(&mut models.warnings);
    loaded.warnings = warnings;
    loaded.animation = animation;
    Ok(loaded)
}

/// A fault with its place in the text of a scene file.
pub(super) fn located(path: &Path, text: &str, fault: Fault) -> SceneError {
    let (line, column) = toml::place(text, fault.at);
    SceneError::InScene { path: path.to_owned(), line, column, message: fault.message }
}

/// Refuses options for which a scene file has keys of its own.
fn refuse_for_scene(path: &Path, options: LoadOptions) -> Result<(), SceneError> {
    let refused = |option: &str, key: &str| {
        let message =
            format!("{option} is for a model by itself: write {key} in [[model]] of the scene file");
        Err(SceneError::in_file(path, message))
    };
    if options.up.is_some() {
        return refused("--up", "`up = \"z\"`");
    }
    if options.crease_angle.is_some() {
        return refused("--crease-angle", "`crease_angle`");
    }
    Ok(())
}

/// The text of a scene file, which is UTF-8.
fn text_of<'b>(path: &Path, content: &'b [u8]) -> Result<&'b str, SceneError> {
    std::str::from_utf8(content).map_err(|e| {
        let before = String::from_utf8_lossy(content.get(..e.valid_up_to()).unwrap_or_default());
        let (line, column) = toml::place(&before, before.len());
        let message = "not valid UTF-8: save the scene file in that encoding".to_owned();
        SceneError::InScene { path: path.to_owned(), line, column, message }
    })
}

/// Builds the scene of a parsed file, and decides what the file leaves open.
fn assemble(
    path: &Path,
    text: SceneText,
    models: &mut Models,
    locate: &impl Fn(Fault) -> SceneError,
) -> Result<LoadedScene, SceneError> {
    let size = (text.render.width, text.render.height);
    let mut scene = Scene {
        ambient: text.ambient,
        render: text.render,
        camera: framing::camera_showing(None, models.options.size.unwrap_or(size)),
        background: Background::Color(Vec3::ZERO),
        lights: text.lights,
        materials: text.materials,
        textures: Vec::new(),
        models: Vec::new(),
        spheres: text.spheres,
        planes: text.planes,
        triangles: text.triangles,
        disks: text.disks,
        background_visible: text.background.visible,
        motions: text.motions,
        ..Scene::default()
    };
    for model in &text.models {
        let instance = models.instance(model, &mut scene.materials, &text.textures, locate)?;
        scene.models.push(instance);
    }
    for volume in &text.volumes {
        scene.volumes.push(loaded_volume(volume, models, locate)?);
    }
    load_textures(&models.folder, &text.textures, &mut scene, &mut models.textures).map_err(locate)?;
    scene.background =
        background(&models.folder, &text.background.radiance, &mut models.textures).map_err(locate)?;
    let (maps, textures, notes) = models.textures.take_parts();
    scene.textures = maps;
    models.warnings.extend(notes);
    models.warnings.extend(uncut(&scene));
    let meshes = models.take_meshes();
    let file_of = |mesh: &Arc<CompiledMesh>| {
        let of_volumes = scene.volumes.iter().zip(&text.volumes);
        let of_volumes = of_volumes.filter_map(|(volume, text)| volume.boundary.model().zip(text.model()));
        let mut files = scene.models.iter().zip(&text.models).chain(of_volumes);
        files.find(|(model, _)| model.mesh == mesh.id()).map(|(_, text)| text.file.clone())
    };
    let mesh_files = meshes.iter().map(|mesh| file_of(mesh).unwrap_or_default()).collect();
    let bounds = framing::bounds(&scene, &meshes);
    scene.lens = text.camera.map_or(Lens::default(), |camera| camera.lens);
    scene.camera = match text.camera {
        Some(camera) => aimed(camera, bounds),
        None if bounds.is_none() => {
            let message = "[camera] is missing, and the scene has nothing finite to frame; add one with `position` and `look_at`";
            return Err(SceneError::in_file(path, message));
        }
        None => framing::camera_showing(bounds, models.options.size.unwrap_or(size)),
    };
    if scene.lights.is_empty() {
        scene.lights.push(framing::default_light(&scene.camera));
        scene.has_default_light = true;
    }
    Ok(LoadedScene { scene, meshes, mesh_files, textures, warnings: Vec::new(), animation: None })
}

/// A volume with its model.
fn loaded_volume(
    text: &VolumeText,
    models: &mut Models,
    locate: &impl Fn(Fault) -> SceneError,
) -> Result<Volume, SceneError> {
    let boundary = match &text.boundary {
        BoundaryText::Whole(boundary) => boundary.clone(),
        BoundaryText::Model(model) => VolumeBoundary::Model(models.boundary(model, locate)?),
    };
    Ok(Volume { boundary, density: text.density, color: text.color })
}

/// A warning if alpha cuts out a material of a sphere or a plane, which have no holes.
fn uncut(scene: &Scene) -> Option<String> {
    let of_spheres = scene.spheres.iter().map(|sphere| sphere.material);
    let of_planes = scene.planes.iter().map(|plane| plane.material);
    let is_cut = |index: u32| scene.materials.get(index as usize).is_some_and(|m| m.cutout.is_some());
    let count = of_spheres.chain(of_planes).filter(|&index| is_cut(index)).count();
    (count > 0).then(|| {
        format!(
            "{count} spheres and planes have a texture with transparent texels, which cut out triangles only"
        )
    })
}

/// Loads the textures of the scene file's own materials, as far as these are assigned to geometry.
fn load_textures(
    folder: &Path,
    texts: &BTreeMap<u32, TexturesText>,
    scene: &mut Scene,
    textures: &mut Textures,
) -> Result<(), Fault> {
    let of_models = scene.models.iter().flat_map(|model| model.materials.iter().copied());
    let used: BTreeSet<u32> = of_models
        .chain(scene.triangles.iter().map(|triangle| triangle.material))
        .chain(scene.spheres.iter().map(|sphere| sphere.material))
        .chain(scene.planes.iter().map(|plane| plane.material))
        .collect();
    let mut list = |text: &TextureText| {
        let listed = textures.add(&named(folder, &text.file), text.filter, text.tiling);
        listed.map_err(|reason| Fault {
            at: text.at,
            message: format!("the texture: {reason} (paths are relative to the scene file)"),
        })
    };
    for (index, text) in texts.iter().filter(|(index, _)| used.contains(index)) {
        let Some(material) = scene.materials.get_mut(*index as usize) else { continue };
        let texture = text.diffuse.as_ref().map(&mut list).transpose()?;
        material.texture = texture.map(|listed| listed.index);
        material.cutout = texture.filter(|listed| listed.cuts).map(|listed| listed.index);
        material.emission_texture =
            text.emission.as_ref().map(&mut list).transpose()?.map(|listed| listed.index);
        if let Some(map) = &text.normal_map {
            let texture = list(&map.texture)?.index;
            material.normal_map = Some(NormalMap { texture, strength: map.strength });
        }
        if let (Some(model), Some(text)) = (material.metallic_roughness, &text.metallic_roughness) {
            let texture = Some(list(text)?.index);
            *material = material.with_metallic_roughness(MetallicRoughness { texture, ..model });
        }
    }
    Ok(())
}

/// The camera of the file with its look-at point.
fn aimed(text: CameraText, bounds: Option<framing::Bounds>) -> Camera {
    let CameraText { kind, position, aim, up, fov, zoom, .. } = text;
    let look_at = match aim {
        Aim::Point(point) => point,
        Aim::Direction(direction) => framing::point_on_axis(position, direction, bounds),
    };
    Camera { kind, position, look_at, up, fov, zoom }
}
