//! Text of an explanation.

use std::fmt::Write;

use super::{Explanation, MeshFacts, TextureFacts};
use crate::display::numbers::{counted, grouped};

/// Largest number of meshes and of textures in the lists; of more, the largest ones are listed.
const LISTED: usize = 12;

/// The text, with a newline after each line.
pub(super) fn text(explanation: &Explanation) -> String {
    let mut out = String::new();
    // Writing to a string does not fail.
    let _ = write_text(&mut out, explanation);
    out
}

fn write_text(out: &mut String, explanation: &Explanation) -> std::fmt::Result {
    write_head(out, explanation)?;
    write_features(out, explanation)?;
    writeln!(out, "\nStages of its frames:")?;
    for kernel in &explanation.kernels {
        writeln!(out, "  {kernel}")?;
    }
    write_meshes(out, &explanation.meshes)?;
    write_textures(out, &explanation.textures)?;
    write_figures(out, explanation)
}

fn write_head(out: &mut String, explanation: &Explanation) -> std::fmt::Result {
    let Explanation { scene, width, height, samples, simd_level, triangles, things, .. } = explanation;
    writeln!(
        out,
        "{scene}: {width} x {height}, {} per pixel, {simd_level} on this machine",
        counted((*samples).into(), "sample")
    )?;
    let parts = [
        (things.models, "model"),
        (things.spheres, "sphere"),
        (things.disks, "disk"),
        (things.planes, "plane"),
        (things.single_triangles, "single triangle"),
        (things.lights, "light"),
    ];
    let parts =
        parts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| counted(*count as u64, what));
    let parts: Vec<String> = parts.collect();
    writeln!(out, "{}; {} in all", parts.join(", "), counted(*triangles, "triangle"))?;
    match explanation.reductions.join(", ") {
        reductions if reductions.is_empty() => Ok(()),
        reductions => writeln!(out, "not at full quality: {reductions}"),
    }?;
    writeln!(out, "knobs with an effect on it: {}", explanation.knobs_with_effect.join(", "))
}

fn write_features(out: &mut String, explanation: &Explanation) -> std::fmt::Result {
    for (asked_for, title) in [
        (true, "Features in use, with the time that each adds to the scene of the benchmarks:"),
        (false, "Features not in use, at no cost:"),
    ] {
        writeln!(out, "\n{title}")?;
        let mut any = false;
        for feature in explanation.features.iter().filter(|feature| feature.asked_for == asked_for) {
            any = true;
            let memory = match (feature.bytes, asked_for) {
                (0, _) => String::new(),
                (bytes, true) => format!(", {}", size(bytes)),
                (bytes, false) => format!(", saves {}", size(bytes)),
            };
            let percent = feature.measured_percent.map_or("-".to_owned(), |percent| format!("+{percent} %"));
            writeln!(out, "  {:<24} {percent:>7}  {}{memory}", feature.name, feature.why)?;
        }
        if !any {
            writeln!(out, "  none")?;
        }
    }
    writeln!(
        out,
        "\nPercentages are not of this scene. They were measured on {}.",
        explanation.features_measured_on
    )?;
    writeln!(out, "The command tradeoff measures the knobs on this scene.")
}

fn write_meshes(out: &mut String, meshes: &[MeshFacts]) -> std::fmt::Result {
    if meshes.is_empty() {
        return Ok(());
    }
    writeln!(
        out,
        "\n{:<24} {:<9} {:>9} {:>10} {:>8} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10}",
        "mesh",
        "hash",
        "instances",
        "triangles",
        "nodes",
        "tree",
        "corners",
        "normals",
        "uvs",
        "colours",
        "the rest",
        "all"
    )?;
    let mut largest: Vec<&MeshFacts> = meshes.iter().collect();
    largest.sort_by_key(|mesh| std::cmp::Reverse(mesh.bytes));
    for mesh in largest.iter().take(LISTED) {
        writeln!(
            out,
            "{:<24} {:<9} {:>9} {:>10} {:>8} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10}",
            shortened(&mesh.file),
            mesh.id,
            mesh.instances,
            grouped(mesh.triangles as u64),
            grouped(mesh.nodes as u64),
            size(mesh.node_bytes),
            size(mesh.triangle_bytes),
            size(mesh.normal_bytes),
            size(mesh.uv_bytes),
            size(mesh.color_bytes),
            size(mesh.rest_bytes),
            size(mesh.bytes)
        )?;
    }
    write_more(out, meshes.len())
}

/// A file name cut to the width of its column; the end is kept, because it distinguishes files better.
fn shortened(file: &str) -> String {
    let (all, most) = (file.chars().count(), 24);
    // Names are from the scene file: control characters are replaced.
    let plain = file.chars().map(|c| if c.is_control() { '?' } else { c });
    if all <= most { plain.collect() } else { "...".chars().chain(plain.skip(all - most + 3)).collect() }
}

fn write_textures(out: &mut String, textures: &[TextureFacts]) -> std::fmt::Result {
    if textures.is_empty() {
        return Ok(());
    }
    writeln!(out, "\n{:<9} {:>14} {:>10}", "texture", "texels", "all")?;
    for texture in textures.iter().take(LISTED) {
        let texels = format!("{} x {}", texture.width, texture.height);
        let alpha = if texture.alpha { "  with alpha" } else { "" };
        writeln!(out, "{:<9} {texels:>14} {:>10}{alpha}", texture.id, size(texture.bytes))?;
    }
    write_more(out, textures.len())
}

fn write_more(out: &mut String, count: usize) -> std::fmt::Result {
    if count > LISTED { writeln!(out, "and {} more", count - LISTED) } else { Ok(()) }
}

fn write_figures(out: &mut String, explanation: &Explanation) -> std::fmt::Result {
    let Explanation { memory, travel, rays_per_frame_at_most: rays, .. } = explanation;
    writeln!(
        out,
        "\nin memory         {}: meshes {}, textures {}, the scene's own tree {}",
        size(memory.total),
        size(memory.meshes),
        size(memory.textures),
        size(memory.scene_tree)
    )?;
    writeln!(
        out,
        "to a worker once  {}, of which the scene itself is {}",
        size(travel.once),
        size(travel.scene_body)
    )?;
    writeln!(
        out,
        "each frame        {} to each worker; {} of pixels back, before compression",
        size(travel.per_frame),
        size(travel.pixels_per_frame as usize)
    )?;
    writeln!(
        out,
        "rays, at most     {} primary, {} shadow, {} secondary",
        grouped(rays.primary),
        grouped(rays.shadow),
        grouped(rays.secondary)
    )
}

/// A number of bytes with a unit that keeps it short.
fn size(bytes: usize) -> String {
    let bytes = bytes as f64;
    match bytes {
        ..1e4 => format!("{bytes} B"),
        ..1e6 => format!("{:.1} kB", bytes / 1e3),
        ..1e9 => format!("{:.1} MB", bytes / 1e6),
        _ => format!("{:.2} GB", bytes / 1e9),
    }
}
