//! Features that scenes may use, whether a scene uses them, and their costs.

use rayfarm_tracer::CompiledScene;
use rayfarm_tracer::mesh::MeshMemory;
use rayfarm_tracer::scene::knobs::{Knob, word_of};
use rayfarm_tracer::scene::{ColorDepth, Filter, FrameView, Material, RenderScale, SceneFeatures, Shading};
use serde::Serialize;

use super::super::source::Source;
use crate::display::numbers::counted;

/// Origin of [`FeatureFacts::measured_percent`].
pub(super) const MEASURED_ON: &str = "a ring of 100,352 triangles under one light, on one thread with AVX-512 \
                                      (samples: instructions): the table of features of scripts/bench_tracer.sh";
/// Time that features add to a frame of the scene [`MEASURED_ON`], in per cent. Other scenes have other percentages; these give
/// the order of magnitude.
const SHADOWS: f64 = 79.0;
const SPECULAR: f64 = 1.6;
const SMOOTH: f64 = 12.0;
const NEAREST: f64 = 11.0;
const BILINEAR: f64 = 23.0;
/// Instructions that four samples per pixel add to one, in per cent.
const FOUR_SAMPLES: f64 = 146.0;

/// A feature that scenes may use.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct FeatureFacts {
    pub(super) name: &'static str,
    /// Whether the scene uses it. Unused features are not computed.
    pub(super) asked_for: bool,
    /// Objects that use it.
    pub(super) why: String,
    /// Time that it added to a frame of another scene ([`MEASURED_ON`]), in per cent.
    pub(super) measured_percent: Option<f64>,
    /// Bytes in memory and once on the wire; for an unused feature, those that are saved.
    pub(super) bytes: usize,
}

/// All features, used and unused.
pub(super) fn features(source: &Source, compiled: &CompiledScene, view: &FrameView) -> Vec<FeatureFacts> {
    let used = compiled.features().at(&view.quality);
    vec![
        shadows(source, compiled, view),
        specular(source, compiled, view),
        smooth(source, compiled),
        textures(source, compiled, view),
        vertex_colors(source, compiled),
        of_materials(source, "checkers", used.checkered, |material| material.checker.is_some()),
        of_materials(source, "normal maps", used.normal_mapped, |material| material.normal_map.is_some()),
        of_materials(source, "emission", used.emissive, Material::is_emissive),
        of_materials(source, "unlit materials", used.unlit, |material| material.unlit),
        of_materials(source, "cut-outs", used.cut_out, |material| material.cutout.is_some()),
        soft_shadows(source, used.soft_shadows, view),
        bounces(source, used.bounces, view),
        motion(source, used.motion && view.integrator.path().is_some()),
        samples(view),
    ]
}

fn soft_shadows(source: &Source, asked_for: bool, view: &FrameView) -> FeatureFacts {
    let lights = &source.scene.lights;
    let soft = lights.iter().filter(|light| light.shadows && light.radius > 0.0).count();
    FeatureFacts {
        name: "soft shadows",
        asked_for,
        why: format!(
            "{soft} of {} have a radius{}",
            counted(lights.len() as u64, "light"),
            turned_off("shadows", view)
        ),
        measured_percent: None,
        bytes: 0,
    }
}

fn motion(source: &Source, asked_for: bool) -> FeatureFacts {
    FeatureFacts {
        name: "motion blur",
        asked_for,
        why: format!(
            "{} moving while the shutter is open",
            counted(source.scene.motions.len() as u64, "object")
        ),
        measured_percent: None,
        bytes: 0,
    }
}

fn bounces(source: &Source, asked_for: bool, view: &FrameView) -> FeatureFacts {
    let materials = &source.scene.materials;
    let bouncing = materials.iter().filter(|material| material.bounces()).count();
    FeatureFacts {
        name: "reflection, transmission",
        asked_for,
        why: format!(
            "{bouncing} of {} have it, up to depth {}",
            counted(materials.len() as u64, "material"),
            view.quality.max_depth
        ),
        measured_percent: None,
        bytes: 0,
    }
}

fn shadows(source: &Source, compiled: &CompiledScene, view: &FrameView) -> FeatureFacts {
    let lights = &source.scene.lights;
    let casting = lights.iter().filter(|light| light.shadows).count();
    FeatureFacts {
        name: "shadows",
        asked_for: compiled.features().at(&view.quality).shadows,
        why: format!(
            "{casting} of {} cast them{}",
            counted(lights.len() as u64, "light"),
            turned_off("shadows", view)
        ),
        measured_percent: Some(SHADOWS),
        bytes: 0,
    }
}

/// Note on a feature that the knob of this name turns off.
fn turned_off(knob: &str, view: &FrameView) -> &'static str {
    let setting = view.setting(RenderScale::Full);
    let is_off = Knob::named(knob).is_some_and(|knob| knob.reduction(&setting).is_some());
    if is_off { "; turned off" } else { "" }
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
            turned_off("shading", view)
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
    let count = |counted: Filter| maps.iter().filter(|map| filter(map.filter) == counted).count();
    let nearest = count(Filter::Nearest);
    let asked_for = compiled.features().textured;
    let pictures: usize = source.textures.iter().map(|texture| texture.bytes().len()).sum();
    let uvs = taken_or_saved(source, asked_for, |memory| memory.uv_bytes, MeshMemory::full_uv_bytes);
    FeatureFacts {
        name: "textures",
        asked_for,
        why: if maps.is_empty() {
            "none".to_owned()
        } else {
            let trilinear = count(Filter::Trilinear);
            let textures = counted(maps.len() as u64, "texture");
            format!("{nearest} nearest and {trilinear} trilinear of {textures}, the others bilinear")
        },
        // The more expensive filter, unless all textures have the other one.
        measured_percent: Some(if asked_for && nearest == maps.len() { NEAREST } else { BILINEAR }),
        bytes: pictures + uvs,
    }
}

fn vertex_colors(source: &Source, compiled: &CompiledScene) -> FeatureFacts {
    let colored = source.meshes.iter().filter(|mesh| mesh.has_colors()).count();
    let asked_for = compiled.features().vertex_colors;
    let saved = MeshMemory::full_color_bytes;
    FeatureFacts {
        name: "vertex colours",
        asked_for,
        why: format!("{colored} of {} have them", counted(source.meshes.len() as u64, "mesh")),
        measured_percent: None,
        bytes: taken_or_saved(source, asked_for, |memory| memory.color_bytes, saved),
    }
}

/// A feature of materials that takes no memory.
fn of_materials(
    source: &Source,
    name: &'static str,
    asked_for: bool,
    is_used: impl Fn(&Material) -> bool,
) -> FeatureFacts {
    let materials = &source.scene.materials;
    let using = materials.iter().filter(|material| is_used(material)).count();
    FeatureFacts {
        name,
        asked_for,
        why: format!("{using} of {} have it", counted(materials.len() as u64, "material")),
        measured_percent: None,
        bytes: 0,
    }
}

fn samples(view: &FrameView) -> FeatureFacts {
    let rays = counted(view.samples.into(), "ray");
    let pixels = if view.is_adaptive() { "per pixel with an edge, about one elsewhere" } else { "per pixel" };
    FeatureFacts {
        name: "several samples per pixel",
        asked_for: view.samples > 1,
        why: format!("{rays} {pixels}; measured with 4 per pixel"),
        measured_percent: Some(FOUR_SAMPLES),
        bytes: 0,
    }
}

/// Sum of a part of the memory of all meshes: of a used feature, the bytes taken; of an unused one, the bytes saved.
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

/// The shading of a surface point.
fn shading(source: &Source, features: SceneFeatures, view: &FrameView) -> String {
    if !view.quality.shading.is_light() {
        return format!(
            "shading: none, {} in place of light",
            word_of(&Shading::WORDS, &view.quality.shading)
        );
    }
    let terms = if features.specular {
        "diffuse and specular"
    } else {
        "diffuse only: no directions to the viewer, no exponents"
    };
    format!("shading: {terms}, {}", counted(source.scene.lights.len() as u64, "light"))
}

/// Stages of the tracer for frames of this scene, in order.
pub(super) fn kernels(source: &Source, compiled: &CompiledScene, view: &FrameView) -> Vec<String> {
    let (scene, features) = (&source.scene, compiled.features().at(&view.quality));
    let mut kernels =
        vec!["camera rays: tiles of 16 x 16 rays, through hierarchies of 16 children per node".to_owned()];
    if !scene.spheres.is_empty() {
        kernels.push("spheres: one by one where rays hit their boxes, in double precision".to_owned());
    }
    if !scene.disks.is_empty() {
        kernels.push("disks: one by one where rays hit their boxes, in double precision".to_owned());
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
        "one per facet, none interpolated"
    };
    kernels.push(format!("normals: {normals}"));
    if features.textured {
        kernels.push("texels: once per point, independent of the number of lights".to_owned());
    }
    if features.cut_out {
        kernels.push("cut-outs: the alpha of each hit on a textured cut-out, in double precision".to_owned());
    }
    kernels.push(shading(source, features, view));
    if features.shadows {
        kernels.push(
            "shadows: the points of each tile as a tile of rays from each light that reaches one of them"
                .to_owned(),
        );
    }
    if features.soft_shadows {
        let samples = view.quality.shadow_samples;
        kernels.push(format!(
            "soft shadows: {} of each light with a radius, if it has no number of its own",
            counted(samples.into(), "point")
        ));
    }
    if features.bounces {
        kernels.push(format!(
            "bounces: reflected and transmitted rays of each tile, generation by generation, up to depth {}",
            view.quality.max_depth
        ));
    }
    if features.motion && view.integrator.path().is_some() {
        kernels.push(
            "motion: each ray at its own time, against a hierarchy of all poses of what moves".to_owned(),
        );
    }
    if view.is_adaptive() {
        kernels.push(format!(
            "samples: one at each corner of a pixel, one at the centre where these differ, all {} where they differ much",
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
