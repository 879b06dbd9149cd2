//! What a scene may ask for, whether this one does, and what it costs where it is asked for.

use rayfarm_tracer::CompiledScene;
use rayfarm_tracer::mesh::MeshMemory;
use rayfarm_tracer::scene::{ColorDepth, Filter, FrameView, Material, Shading};
use serde::Serialize;

use super::super::source::Source;
use crate::display::numbers::counted;

/// What features add to the time of a frame, in per cent: medians of scenes that differ in the feature alone, one thread with
/// AVX-512. Another scene has other shares; these say what is dear and what is not. `scripts/bench_tracer.sh` measures them.
const SHADOWS: f64 = 79.0;
const SPECULAR: f64 = 1.6;
const SMOOTH: f64 = 12.0;
const NEAREST: f64 = 11.0;
const BILINEAR: f64 = 23.0;
/// Likewise in instructions, of four samples a pixel beside one.
const FOUR_SAMPLES: f64 = 146.0;

/// A part of the work that scenes may do without.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct FeatureFacts {
    pub(super) name: &'static str,
    /// Whether this scene asks for it. What is not asked for is not computed.
    pub(super) asked_for: bool,
    /// Who asks for it, or what would.
    pub(super) why: String,
    /// What it added to the time of a frame where it was measured, in per cent.
    pub(super) measured_percent: Option<f64>,
    /// Bytes that it takes in memory and once on the wire; where it is left out, those that are saved.
    pub(super) bytes: usize,
}

/// All features, those that the scene asks for and those that it does not.
pub(super) fn features(source: &Source, compiled: &CompiledScene, view: &FrameView) -> Vec<FeatureFacts> {
    vec![
        shadows(source, view),
        specular(source, compiled, view),
        smooth(source, compiled),
        textures(source, compiled, view),
        vertex_colors(source, compiled),
        of_materials(source, "emission", compiled.features().emissive, Material::is_emissive),
        of_materials(source, "unlit materials", compiled.features().unlit, |material| material.unlit),
        of_materials(source, "cut-outs", compiled.features().cut_out, |material| material.cutout.is_some()),
        samples(view),
    ]
}

fn shadows(source: &Source, view: &FrameView) -> FeatureFacts {
    let lights = &source.scene.lights;
    let casting = lights.iter().filter(|light| light.shadows).count();
    FeatureFacts {
        name: "shadows",
        asked_for: casting > 0 && view.quality.shadows,
        why: format!(
            "{casting} of {} cast them{}",
            counted(lights.len() as u64, "light"),
            turned_off(!view.quality.shadows)
        ),
        measured_percent: Some(SHADOWS),
        bytes: 0,
    }
}

/// What a knob does to what the scene asks for.
fn turned_off(off: bool) -> &'static str {
    if off { "; turned off" } else { "" }
}

fn specular(source: &Source, compiled: &CompiledScene, view: &FrameView) -> FeatureFacts {
    let materials = &source.scene.materials;
    let specular = materials.iter().filter(|material| material.is_specular()).count();
    FeatureFacts {
        name: "specular term",
        asked_for: compiled.features().at(&view.quality).specular,
        why: format!(
            "{specular} of {} have it{}",
            counted(materials.len() as u64, "material"),
            turned_off(view.quality.shading == Shading::Diffuse)
        ),
        measured_percent: Some(SPECULAR),
        bytes: 0,
    }
}

fn smooth(source: &Source, compiled: &CompiledScene) -> FeatureFacts {
    use rayfarm_tracer::scene::NormalMode::Smooth;
    let models = &source.scene.models;
    let smooth = models.iter().filter(|model| model.normals == Smooth).count();
    let asked_for = compiled.features().smooth;
    FeatureFacts {
        name: "smooth normals",
        asked_for,
        why: format!("{smooth} of {} have them", counted(models.len() as u64, "model")),
        measured_percent: Some(SMOOTH),
        bytes: taken_or_saved(
            source,
            asked_for,
            |memory| memory.normal_bytes,
            MeshMemory::least_normal_bytes,
        ),
    }
}

fn textures(source: &Source, compiled: &CompiledScene, view: &FrameView) -> FeatureFacts {
    let maps = &source.scene.textures;
    let filter = |own: Filter| view.quality.filter.unwrap_or(own);
    let nearest = maps.iter().filter(|map| filter(map.filter) == Filter::Nearest).count();
    let asked_for = compiled.features().textured;
    let pictures: usize = source.textures.iter().map(|texture| texture.bytes().len()).sum();
    let uvs = taken_or_saved(source, asked_for, |memory| memory.uv_bytes, MeshMemory::full_uv_bytes);
    FeatureFacts {
        name: "textures",
        asked_for,
        why: if maps.is_empty() {
            "there are none".to_owned()
        } else {
            format!("{nearest} of {} nearest, the others bilinear", counted(maps.len() as u64, "texture"))
        },
        // Most pixels, perhaps, have the dearer one.
        measured_percent: Some(if asked_for && nearest == maps.len() { NEAREST } else { BILINEAR }),
        bytes: pictures + uvs,
    }
}

fn vertex_colors(source: &Source, compiled: &CompiledScene) -> FeatureFacts {
    let colored = source.meshes.iter().filter(|mesh| mesh.has_colors()).count();
    let asked_for = compiled.features().vertex_colors;
    let saved = MeshMemory::full_color_bytes;
    FeatureFacts {
        name: "colours of vertices",
        asked_for,
        why: format!("{colored} of {} have them", counted(source.meshes.len() as u64, "mesh")),
        measured_percent: None,
        bytes: taken_or_saved(source, asked_for, |memory| memory.color_bytes, saved),
    }
}

/// A feature that materials ask for, and that takes no memory.
fn of_materials(
    source: &Source,
    name: &'static str,
    asked_for: bool,
    asks: impl Fn(&Material) -> bool,
) -> FeatureFacts {
    let materials = &source.scene.materials;
    let asking = materials.iter().filter(|material| asks(material)).count();
    FeatureFacts {
        name,
        asked_for,
        why: format!("{asking} of {} ask for it", counted(materials.len() as u64, "material")),
        measured_percent: None,
        bytes: 0,
    }
}

fn samples(view: &FrameView) -> FeatureFacts {
    let rays = counted(view.samples.into(), "ray");
    let pixels = if view.is_adaptive() { "a pixel with an edge, about one elsewhere" } else { "a pixel" };
    FeatureFacts {
        name: "several samples a pixel",
        asked_for: view.samples > 1,
        why: format!("{rays} {pixels}; measured with 4 a pixel"),
        measured_percent: Some(FOUR_SAMPLES),
        bytes: 0,
    }
}

/// Sums a part of all meshes: what it takes where the scene asks for it, else what it would take where it is not there.
fn taken_or_saved(
    source: &Source,
    asked_for: bool,
    taken: impl Fn(&MeshMemory) -> usize,
    saved: impl Fn(&MeshMemory) -> usize,
) -> usize {
    let memories = source.meshes.iter().map(|mesh| mesh.memory());
    if asked_for {
        memories.map(|memory| taken(&memory)).sum()
    } else {
        memories.filter(|memory| taken(memory) == 0).map(|memory| saved(&memory)).sum()
    }
}

/// The parts of the tracer that frames of this scene go through, in the order of the data.
pub(super) fn kernels(source: &Source, compiled: &CompiledScene, view: &FrameView) -> Vec<String> {
    let (scene, features) = (&source.scene, compiled.features().at(&view.quality));
    let mut kernels =
        vec!["what the eye sees: tiles of 16 x 16 rays, down trees of 16 children a node".to_owned()];
    if !scene.spheres.is_empty() {
        kernels.push("spheres: one by one where their boxes are touched, in double precision".to_owned());
    }
    if !scene.planes.is_empty() {
        kernels.push(format!(
            "{}: against every ray, in double precision",
            counted(scene.planes.len() as u64, "plane")
        ));
    }
    let normals = if features.smooth {
        "interpolated where models are smooth"
    } else {
        "one a facet, none interpolated"
    };
    kernels.push(format!("normals: {normals}"));
    if features.textured {
        kernels.push("texels: once a point, whatever the number of lights".to_owned());
    }
    if features.cut_out {
        kernels.push("cut-outs: the alpha of each hit that may be one, in double precision".to_owned());
    }
    let terms = if features.specular {
        "diffuse and specular"
    } else {
        "diffuse alone: no vectors to the eye, no powers"
    };
    kernels.push(format!("shading: {terms}, {}", counted(scene.lights.len() as u64, "light")));
    if view.quality.shadows && scene.lights.iter().any(|light| light.shadows) {
        kernels.push(
            "shadows: the tile's points again, seen from each light that reaches one of them".to_owned(),
        );
    }
    if view.is_adaptive() {
        kernels.push(format!(
            "samples: one at each corner of a pixel, one at the centre where those differ, all {} where they differ much",
            view.samples
        ));
    }
    let averaged = if view.samples > 1 { "means in linear light, then " } else { "" };
    let rounded = match view.quality.colors {
        ColorDepth::Exact => "",
        ColorDepth::Reduced => ", rounded to 5, 6 and 5 bits",
    };
    kernels.push(format!("encoding: {averaged}8-bit sRGB{rounded}"));
    kernels
}
