//! Rays aimed at the edges and vertices of meshes: none may slip between two triangles.
//!
//! An edge *closes*, seen from a point, when triangles lie on both sides of it: whatever rounding does to a ray that is aimed at
//! it, the ray meets one of them. An outline or a border does not close, and rays aimed at it may pass. A vertex closes when
//! all of its edges do. Nothing else is assumed of a mesh: it may be open, and may intersect itself.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::placed::placed;
use super::random::Random;
use super::seams::{Edge, Seams};
use super::{Check, Effort, Outcome, Subject};
use crate::compile::{CompileError, orientation};
use crate::frame::PreparedFrame;
use crate::trace::Primitive;
use crate::triangle::ShearedRay;

/// Scale of the scene, and how many of its extents it is moved.
const PLACES: [(f64, f64); 7] =
    [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e3), (1.0, 1e6), (1e-6, 1e6), (1e6, 1e6)];

/// Rays that are shot in one go.
const PACK: u64 = 4096;

/// Rays go through points of edges between this share of the edge and the same share before its end.
const FROM_THE_END: f64 = 1.0 / 64.0;

/// Counts rays that slip through the scene's meshes, from inside and outside, at scales of 10^-6 to 10^6 and moved by up to
/// 10^6 extents. Without models there is nothing to count.
///
/// # Errors
/// A scene that cannot be traced.
pub fn leaks(subject: &Subject, effort: &Effort) -> Result<Vec<Outcome>, CompileError> {
    if subject.scene.models.is_empty() {
        return Ok(Vec::new());
    }
    let seams: Vec<Seams> = subject.meshes.iter().map(|mesh| Seams::of(mesh)).collect();
    let extent = subject.extent()?;
    let rays = effort.rays.div_ceil(PLACES.len() as u64);
    let at = |(scale, distance): (f64, f64)| {
        let offset = DVec3::new(1.0, -1.0, 0.5) * (distance * extent * scale);
        let subject = subject.with(placed(&subject.scene, scale, offset));
        let frame = subject.prepared(effort.side)?;
        let pieces = pieces(&subject, &frame, &seams);
        let Tally { at_edges, wrong } = shoot(&frame, &pieces, rays);
        let case = format!("scale {scale:e}, {distance:e} extents away");
        Ok(Outcome {
            check: Check::Leaks,
            case,
            unit: "rays",
            tested: rays,
            at_edges,
            wrong,
            first_wrong: None,
        })
    };
    PLACES.into_iter().map(at).collect()
}

/// A model in the world, with its seams.
pub(super) struct Piece<'a> {
    model: usize,
    seams: &'a Seams,
    /// world = `linear` * mesh + `translation`.
    linear: DMat3,
    translation: DVec3,
    /// About how large it is, in world units.
    size: f64,
    /// How far off a point may be, in world units, after rounding on its way from mesh to world to mesh.
    rounding: f64,
}

/// What became of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Tally {
    pub(super) at_edges: u64,
    pub(super) wrong: u64,
}

/// The models of a scene whose meshes have the given seams.
pub(super) fn pieces<'a>(subject: &Subject, frame: &PreparedFrame, seams: &'a [Seams]) -> Vec<Piece<'a>> {
    let eye = frame.view().camera.position;
    let piece = |(model, description): (usize, &crate::scene::Model)| {
        let index = subject.meshes.iter().position(|mesh| mesh.id() == description.mesh)?;
        let mesh = &subject.meshes[index];
        let turn = orientation(description, 0.0);
        let linear = turn * libm::exp2(f64::from(mesh.exponent()));
        let center = turn * mesh.center();
        let (size, inverse) = (norm(linear), norm(linear.inverse()));
        let farthest = eye.length() + center.length() + description.translate.length() + 200.0 * size;
        Some(Piece {
            model,
            seams: &seams[index],
            linear,
            translation: center + description.translate,
            size,
            // Stretched models lose digits on the way there and back.
            rounding: 16.0 * f64::EPSILON * farthest * size * inverse,
        })
    };
    subject.scene.models.iter().enumerate().filter_map(piece).collect()
}

/// Frobenius norm, one for a rotation.
fn norm(matrix: DMat3) -> f64 {
    let squares =
        matrix.x_axis.length_squared() + matrix.y_axis.length_squared() + matrix.z_axis.length_squared();
    (squares / 3.0).sqrt()
}

/// Shoots `rays` rays at the pieces.
pub(super) fn shoot(frame: &PreparedFrame, pieces: &[Piece<'_>], rays: u64) -> Tally {
    let pack = |index: u64| {
        let mut random = Random::new(index);
        let mut tally = Tally::default();
        for _ in 0..PACK.min(rays - index * PACK) {
            let piece = &pieces[random.below(pieces.len())];
            let shot = piece.shot(&mut random);
            tally.at_edges += u64::from(shot == Shot::MayPass);
            tally.wrong += u64::from(matches!(shot, Shot::MustStop(shot) if !piece.stops(frame, &shot)));
        }
        tally
    };
    (0..rays.div_ceil(PACK))
        .into_par_iter()
        .map(pack)
        .reduce(Tally::default, |a, b| Tally { at_edges: a.at_edges + b.at_edges, wrong: a.wrong + b.wrong })
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shot {
    /// At something that does not close.
    MayPass,
    MustStop(Aimed),
}

/// A ray at an edge, or at its first end.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Aimed {
    origin: DVec3,
    direction: DVec3,
    edge: usize,
    at_vertex: bool,
}

impl Piece<'_> {
    fn shot(&self, random: &mut Random) -> Shot {
        let origin = self.origin(random);
        let edge = random.below(self.seams.edges.len());
        let at_vertex = random.below(4) == 0;
        let [first, last] = self.seams.edges[edge].ends;
        let (share, closes) = if at_vertex {
            (0.0, self.seams.edges_at(first).iter().all(|&spoke| self.closes(origin, spoke as usize)))
        } else {
            (FROM_THE_END + (1.0 - 2.0 * FROM_THE_END) * random.unit(), self.closes(origin, edge))
        };
        let direction = self.world(first).lerp(self.world(last), share) - origin;
        if closes { Shot::MustStop(Aimed { origin, direction, edge, at_vertex }) } else { Shot::MayPass }
    }

    /// Just below or above a triangle, within the model's box, or around it.
    fn origin(&self, random: &mut Random) -> DVec3 {
        let edge = &self.seams.edges[random.below(self.seams.edges.len())];
        let [a, b] = edge.ends.map(|end| self.world(end));
        let c = self.world(self.seams.opposite(edge)[0]);
        let normal = (b - a).cross(c - a).normalize_or_zero() * self.size;
        let near = libm::exp2(-1.0 - 11.0 * random.unit());
        match random.below(4) {
            0 => (a + b + c) / 3.0 - normal * near,
            1 => (a + b + c) / 3.0 + normal * near,
            2 => self.linear * random.in_cube() + self.translation,
            _ => self.translation + random.in_cube() * self.size * libm::exp2(1.0 + 6.0 * random.unit()),
        }
    }

    fn world(&self, vertex: u32) -> DVec3 {
        self.linear * self.seams.vertices[vertex as usize] + self.translation
    }

    /// Whether triangles lie on both sides of an edge, seen from a point, for certain: so far from the plane through the
    /// point and the edge that rounding cannot bring them over, not even next to the edge's ends.
    fn closes(&self, origin: DVec3, edge: usize) -> bool {
        let edge: &Edge = &self.seams.edges[edge];
        let [a, b] = edge.ends.map(|end| self.world(end) - origin);
        let across = a.cross(b);
        let (mut left, mut right) = (false, false);
        for &opposite in self.seams.opposite(edge) {
            let c = self.world(opposite) - origin;
            let volume = across.dot(c);
            let [la, lb, lc] = [a, b, c].map(DVec3::length);
            let bound = self.rounding * (la * lb + lb * lc + lc * la) / FROM_THE_END;
            left |= volume > bound;
            right |= volume < -bound;
        }
        left && right
    }

    /// Whether something stops a ray: a triangle that has a corner in common with what is aimed at, something before it, or
    /// something else at the very place.
    fn stops(&self, frame: &PreparedFrame, shot: &Aimed) -> bool {
        let Some(hit) = frame.closest_hit(shot.origin, shot.direction, f64::INFINITY) else { return false };
        hit.t < 1.0 || self.touches(frame, shot, hit.primitive) || hit.t <= self.exactly(frame, shot)
    }

    fn touches(&self, frame: &PreparedFrame, shot: &Aimed, primitive: Primitive) -> bool {
        let Primitive::Model { model, triangle } = primitive else { return false };
        let corners = frame.instances[model].mesh.corners(triangle).map(|corner| corner.as_dvec3());
        let ends = &self.seams.edges[shot.edge].ends[..if shot.at_vertex { 1 } else { 2 }];
        model == self.model && ends.iter().any(|&end| corners.contains(&self.seams.vertices[end as usize]))
    }

    /// Where the ray meets the triangles at which it is aimed, without a tree; minus infinity where it meets none.
    fn exactly(&self, frame: &PreparedFrame, shot: &Aimed) -> f64 {
        let seams = self.seams;
        let Some(ray) = frame.to_eye(shot.origin, shot.direction) else { return f64::NEG_INFINITY };
        let local = frame.instances[self.model].to_mesh(&ray);
        let exact = ShearedRay::new(local.origin, local.direction);
        let first = seams.edges[shot.edge].ends[0];
        let edges = if shot.at_vertex { seams.edges_at(first).to_vec() } else { vec![shot.edge as u32] };
        let triangles = edges.iter().flat_map(|&edge| {
            let edge = &seams.edges[edge as usize];
            let corner = |vertex: u32| seams.vertices[vertex as usize];
            let [a, b] = edge.ends.map(corner);
            seams.opposite(edge).iter().map(move |&opposite| [a, b, corner(opposite)])
        });
        triangles.filter_map(|corners| exact.intersect(&corners)).fold(f64::NEG_INFINITY, f64::max)
    }
}
