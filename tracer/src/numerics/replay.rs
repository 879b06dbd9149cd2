//! Repetition of one ray of [`super::leaks`], with a report of all its tests.

use std::fmt::Write;

use glam::{DVec3, Vec3};

use super::leaks::{Aimed, Piece, at_place, case, of_number, pieces, shot};
use super::seams::Seams;
use super::{Effort, Subject};
use crate::compile::CompileError;
use crate::frame::PreparedFrame;
use crate::intersect::{Primitive, RayHit};
use crate::mesh::CompiledMesh;
use crate::reference::Oracle;
use crate::scene::{Camera, FrameView};

/// A report, in lines, of the ray of [`super::leaks`] with the number of a failure; `None` where the scene has no
/// models.
///
/// # Errors
/// A scene that cannot be traced.
pub fn replay(subject: &Subject, effort: &Effort, number: u64) -> Result<Option<String>, CompileError> {
    if subject.scene.models.is_empty() {
        return Ok(None);
    }
    let seams: Vec<Seams> = subject.meshes.iter().map(|mesh| Seams::of(mesh)).collect();
    let (ray, place) = of_number(number);
    let subject = at_place(subject, place, subject.extent()?);
    let frame = subject.prepared(effort.side)?;
    let pieces = pieces(&subject, &frame, &seams);
    let shot = shot(&pieces, ray);
    let mut text = format!("ray {number}: {}, ray {ray} there\n", case(place));
    // Writing to a string cannot fail.
    let _ = report(&mut text, &subject, &frame, &pieces[shot.piece], &shot);
    Ok(Some(text))
}

/// A leaking ray in one line.
pub(super) fn leak_message(frame: &PreparedFrame, pieces: &[Piece<'_>], ray: u64, number: u64) -> String {
    let shot = shot(pieces, ray);
    let piece = &pieces[shot.piece];
    let found = frame.closest_hit(shot.origin, shot.direction, f64::INFINITY);
    let hit = found.map_or_else(|| "nothing".to_owned(), |hit| named(frame, &hit));
    format!(
        "ray {number} leaks through {} at {}: it hits {hit}; --ray {number} replays it",
        named_mesh(frame, piece.model),
        target(frame, piece, &shot),
    )
}

/// Writes the report of a ray.
fn report(
    text: &mut String,
    subject: &Subject,
    frame: &PreparedFrame,
    piece: &Piece<'_>,
    shot: &Aimed,
) -> std::fmt::Result {
    let &Aimed { origin, direction, .. } = shot;
    writeln!(text, "  from {origin:?} along {direction:?} in the world; it is there at t = 1")?;
    writeln!(text, "  aimed at {} of {}", target(frame, piece, shot), named_mesh(frame, piece.model))?;
    for corners in piece.around(shot) {
        let met = piece.meets(frame, shot, &corners);
        let met = met.map_or_else(|| "missed".to_owned(), |t| format!("met at t = {t:?}"));
        writeln!(text, "    {}: {met}", with_corners(&frame.instances[piece.model].mesh, &corners))?;
    }
    let found = frame.closest_hit(origin, direction, f64::INFINITY);
    writeln!(text, "  the fast path hits {}", described(frame, found))?;
    writeln!(text, "  the oracle hits    {}", described(frame, by_the_oracle(subject, origin, direction)))?;
    let result = match (shot.closes, piece.stops(frame, shot)) {
        (false, _) => "may pass: seen from its origin, its target has triangles on one side only",
        (true, true) => "is stopped, as required",
        (true, false) => "LEAKS: its target has triangles on all sides",
    };
    writeln!(text, "  it {result}")
}

/// The oracle's closest hit from a point.
fn by_the_oracle(subject: &Subject, origin: DVec3, direction: DVec3) -> Option<RayHit> {
    let look_at = origin + direction;
    let up = if direction.cross(DVec3::Y) == DVec3::ZERO { DVec3::X } else { DVec3::Y };
    let camera = Camera { position: origin, look_at, up, ..subject.scene.camera };
    let view = FrameView { camera, ..FrameView::of(&subject.scene) };
    Oracle::new(&subject.scene, &subject.meshes, &subject.textures, &view).closest_hit(direction)
}

fn described(frame: &PreparedFrame, hit: Option<RayHit>) -> String {
    hit.map_or_else(|| "nothing".to_owned(), |hit| format!("{} at t = {:?}", named(frame, &hit), hit.t))
}

fn target(frame: &PreparedFrame, piece: &Piece<'_>, shot: &Aimed) -> String {
    let ends = piece.seams.edges[shot.edge].ends.map(|end| piece.world(end));
    let mesh = &frame.instances[piece.model].mesh;
    let at: Vec<String> = piece.around(shot).iter().map(|corners| with_corners(mesh, corners)).collect();
    let what = if shot.at_vertex() {
        format!("the vertex {:?}", ends[0])
    } else {
        format!("the edge from {:?} to {:?}, {:.4} of the way,", ends[0], ends[1], shot.share)
    };
    format!("{what} of {}", at.join(", "))
}

/// Name of a model, counted from 1 as in the scene, and its mesh.
fn named_mesh(frame: &PreparedFrame, model: usize) -> String {
    let id: String = frame.instances[model].mesh.id().to_string().chars().take(8).collect();
    format!("model {} (mesh {id})", model + 1)
}

/// The triangle of a mesh that has these corners, in any order.
fn with_corners(mesh: &CompiledMesh, corners: &[DVec3; 3]) -> String {
    let has = |&triangle: &u32| {
        let own = mesh.corners(triangle).map(Vec3::as_dvec3);
        corners.iter().all(|corner| own.contains(corner))
    };
    mesh.triangles()
        .find(has)
        .map_or_else(|| "no triangle".to_owned(), |triangle| named_triangle(mesh, triangle))
}

fn named_triangle(mesh: &CompiledMesh, triangle: u32) -> String {
    format!("triangle {}", u64::from(mesh.source(triangle)) + 1)
}

fn named(frame: &PreparedFrame, hit: &RayHit) -> String {
    match hit.primitive {
        Primitive::Model { model, triangle } => {
            let mesh = &frame.instances[model].mesh;
            format!("{} of {}", named_triangle(mesh, triangle), named_mesh(frame, model))
        }
        Primitive::Sphere(index) => format!("sphere {}", index + 1),
        Primitive::Triangle(index) => format!("triangle {} of the scene", index + 1),
        Primitive::Disk(index) => format!("disk {}", index + 1),
        Primitive::Plane(index) => format!("plane {}", index + 1),
    }
}
