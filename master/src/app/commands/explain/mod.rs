//! `explain`: the features that a scene uses and those that it does not, with their work, memory and bytes.
//!
//! Nothing is rendered: the facts are from the structures of the tracer and the farm.

mod features;
mod text;

use std::borrow::Cow;
use std::io::{self, Write};

use bytes::Bytes;
use rayfarm_farm::{Assets, FarmScene, ViewRequest, wire_format};
use rayfarm_protocol::message::Message;
use rayfarm_protocol::{FrameAnnounce, FrameId, ToWorker, codec};
use rayfarm_tracer::scene::knobs::KNOBS;
use rayfarm_tracer::scene::{ColorDepth, FrameView, Setting};
use rayfarm_tracer::{CompiledScene, TILE_SIZE, simd_level};
use serde::Serialize;

use self::features::{FeatureFacts, MEASURED_ON, features, kernels};
use super::source::Source;
use crate::app::cli::ExplainArgs;
use crate::app::reports::{Knobs, print_json};
use crate::error::CommandError;
use crate::measure::ray_bounds::RayBounds;

/// Explanation of a scene; `--json` prints it as one line.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Explanation {
    scene: String,
    width: u32,
    height: u32,
    samples: u32,
    /// Values of the knobs.
    quality: Knobs,
    /// Labels of all knobs that are not at full quality.
    #[serde(skip)]
    reductions: Vec<Cow<'static, str>>,
    /// Names of the knobs whose values can change the picture.
    knobs_with_effect: Vec<&'static str>,
    /// SIMD level of this machine.
    simd_level: &'static str,
    /// Triangles over all instances.
    triangles: u64,
    things: Things,
    features: Vec<FeatureFacts>,
    /// Scene and machine of the features' percentages.
    features_measured_on: &'static str,
    kernels: Vec<String>,
    meshes: Vec<MeshFacts>,
    textures: Vec<TextureFacts>,
    memory: Memory,
    travel: Travel,
    rays_per_frame_at_most: Rays,
}

/// Counts of the objects of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Things {
    models: usize,
    spheres: usize,
    planes: usize,
    single_triangles: usize,
    materials: usize,
    lights: usize,
    /// Lights that cast shadows.
    lights_with_shadows: usize,
    disks: usize,
}

/// A mesh and its instances.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct MeshFacts {
    /// File of the mesh, as the scene names it.
    file: String,
    /// First eight digits of the hash.
    id: String,
    instances: usize,
    triangles: usize,
    nodes: usize,
    node_bytes: usize,
    triangle_bytes: usize,
    normal_bytes: usize,
    uv_bytes: usize,
    color_bytes: usize,
    rest_bytes: usize,
    bytes: usize,
}

/// A texture.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct TextureFacts {
    /// First eight digits of the hash.
    id: String,
    width: u32,
    height: u32,
    /// Whether some texels are transparent.
    alpha: bool,
    bytes: usize,
}

/// Memory of a process that traces the scene, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Memory {
    meshes: usize,
    textures: usize,
    /// Hierarchy over models, spheres and single triangles.
    scene_tree: usize,
    total: usize,
}

/// Transfers to and from one worker, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Travel {
    /// Scene without its meshes and textures, once.
    scene_body: usize,
    /// Scene with its meshes and textures, once: a worker requests those that it lacks.
    once: usize,
    /// Announcement of a frame, to each worker.
    per_frame: usize,
    /// Pixels of a whole frame from all workers, before compression.
    pixels_per_frame: u64,
}

/// Upper bounds of rays: not every ray hits a surface, not every surface bounces, and not every surface faces every light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Rays {
    primary: u64,
    shadow: u64,
    secondary: u64,
}

/// Prints the explanation of a scene on standard output.
///
/// # Errors
/// A wrong scene.
pub(super) fn run(args: &ExplainArgs) -> Result<(), CommandError> {
    let source = Source::load(&args.scene, args.models, args.size)?;
    let wanted = source.still_request(args.size, &args.light, &args.quality)?;
    let explanation = explain(&source, &wanted)?;
    if args.json {
        return print_json(&explanation);
    }
    io::stdout()
        .lock()
        .write_all(text::text(&explanation).as_bytes())
        .map_err(|error| CommandError::Failed(format!("standard output: {error}")))
}

fn explain(source: &Source, wanted: &ViewRequest) -> Result<Explanation, CommandError> {
    let view = &wanted.rendered();
    let compiled = source.compiled()?;
    let things = things(source);
    let meshes = mesh_facts(source);
    let textures = texture_facts(source);
    let memory = memory(&compiled, &meshes, &textures);
    Ok(Explanation {
        scene: source.name.clone(),
        width: wanted.view.width,
        height: wanted.view.height,
        samples: view.samples,
        quality: Knobs::of(wanted.setting()),
        reductions: wanted.setting().reductions(),
        knobs_with_effect: knobs_with_effect(&compiled, &wanted.setting()),
        simd_level: simd_level(),
        triangles: compiled.triangle_count(),
        things,
        features: features(source, &compiled, view),
        features_measured_on: MEASURED_ON,
        kernels: kernels(source, &compiled, view),
        meshes,
        textures,
        memory,
        travel: travel(source, view)?,
        rays_per_frame_at_most: rays(&compiled, view),
    })
}

fn knobs_with_effect(scene: &CompiledScene, setting: &Setting) -> Vec<&'static str> {
    let features = scene.features();
    KNOBS.iter().filter(|knob| knob.matters(&features, setting)).map(|knob| knob.name).collect()
}

fn things(source: &Source) -> Things {
    let scene = &source.scene;
    Things {
        models: scene.models.len(),
        spheres: scene.spheres.len(),
        planes: scene.planes.len(),
        single_triangles: scene.triangles.len(),
        materials: scene.materials.len(),
        lights: scene.lights.len(),
        lights_with_shadows: scene.lights.iter().filter(|light| light.shadows).count(),
        disks: scene.disks.len(),
    }
}

fn mesh_facts(source: &Source) -> Vec<MeshFacts> {
    type Mesh = std::sync::Arc<rayfarm_tracer::mesh::CompiledMesh>;
    let facts = |(mesh, file): (&Mesh, &std::path::PathBuf)| {
        let memory = mesh.memory();
        MeshFacts {
            file: file.display().to_string(),
            id: short(&mesh.id()),
            instances: source.scene.models.iter().filter(|model| model.mesh == mesh.id()).count(),
            triangles: mesh.triangle_count(),
            nodes: memory.nodes,
            node_bytes: memory.node_bytes,
            triangle_bytes: memory.triangle_bytes,
            normal_bytes: memory.normal_bytes,
            uv_bytes: memory.uv_bytes,
            color_bytes: memory.color_bytes,
            rest_bytes: memory.rest_bytes,
            bytes: memory.total_bytes(),
        }
    };
    source.meshes.iter().zip(&source.mesh_files).map(facts).collect()
}

fn texture_facts(source: &Source) -> Vec<TextureFacts> {
    let facts = |texture: &std::sync::Arc<rayfarm_tracer::texture::Texture>| TextureFacts {
        id: short(&texture.id()),
        width: texture.width(),
        height: texture.height(),
        alpha: texture.has_alpha(),
        bytes: texture.bytes().len(),
    };
    source.textures.iter().map(facts).collect()
}

fn short(id: &impl ToString) -> String {
    id.to_string().chars().take(8).collect()
}

fn memory(compiled: &CompiledScene, meshes: &[MeshFacts], textures: &[TextureFacts]) -> Memory {
    let meshes = meshes.iter().map(|mesh| mesh.bytes).sum();
    let textures = textures.iter().map(|texture| texture.bytes).sum();
    let scene_tree = compiled.tree_bytes();
    Memory { meshes, textures, scene_tree, total: meshes + textures + scene_tree }
}

/// Number of bytes that a worker receives, from the code that sends them.
fn travel(source: &Source, view: &FrameView) -> Result<Travel, CommandError> {
    let drawn = FarmScene {
        scene: source.scene.clone(),
        meshes: source.meshes.clone(),
        textures: source.textures.clone(),
    };
    let assets = Assets::new(drawn).map_err(CommandError::wrong_input)?;
    let scene_body = assets.get(assets.scene()).map_or(0, |body| body.len());
    let bytes = codec::encode(view).map_err(CommandError::failed)?;
    let announcement = ToWorker::Frame(FrameAnnounce {
        frame: FrameId(0),
        scene: assets.scene(),
        width: view.width,
        height: view.height,
        format: wire_format(view.format),
        view: Bytes::from(bytes),
    });
    let envelope = announcement.to_envelope().map_err(CommandError::failed)?;
    Ok(Travel {
        scene_body,
        once: assets.total_bytes(),
        per_frame: envelope.wire_bytes(),
        pixels_per_frame: pixel_bytes(view) * u64::from(view.width) * u64::from(view.height),
    })
}

/// Bytes of one pixel on the wire, before compression.
fn pixel_bytes(view: &FrameView) -> u64 {
    match view.quality.colors {
        ColorDepth::Exact => 3,
        ColorDepth::Reduced => 2,
    }
}

fn rays(scene: &CompiledScene, view: &FrameView) -> Rays {
    let [width, height, samples] = [view.width, view.height, view.samples].map(u64::from);
    let primary = if view.is_adaptive() {
        // Corners of each band of rows, centres, and all samples; where segments divide bands, some corners twice.
        (width + 1) * (height + height.div_ceil(u64::from(TILE_SIZE))) + width * height * (1 + samples)
    } else {
        width * height * samples
    };
    let of_one = RayBounds::of(scene, &view.quality);
    let [shadow, secondary] = [of_one.shadow, of_one.secondary].map(|rays| primary.saturating_mul(rays));
    Rays { primary, shadow, secondary }
}

#[cfg(test)]
mod tests;
