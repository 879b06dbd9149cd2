//! Rays aimed at the edges and vertices of meshes: none may pass between two adjacent triangles.
//!
//! An edge *closes*, seen from a point, when it has triangles on both sides: a ray that is aimed at it meets one of
//! them, whatever the rounding. An outline or a border does not close, and rays aimed at it may pass. A vertex closes
//! when all of its edges do. Nothing else is assumed: a mesh may be open, and may intersect itself.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::placed::placed;
use super::random::Random;
use super::replay::leak_message;
use super::seams::{Edge, Seams};
use super::{Check, Effort, Outcome, Subject};
use crate::compile::Item;
use crate::compile::{CompileError, orientation};
use crate::frame::PreparedFrame;
use crate::intersect::Hit;
use crate::rays::PrimitiveId;
use crate::shape::ShearedRay;

/// Scales of the scene, and distances by which it is moved, in extents.
pub(super) const PLACES: [(f64, f64); 7] =
    [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e3), (1.0, 1e6), (1e-6, 1e6), (1e6, 1e6)];

/// Rays per parallel task.
const PACK: u64 = 4096;

/// Leaking rays that are described, per case.
const NAMED: usize = 8;

/// Smallest distance of the target on an edge from the edge's ends, as a share of the edge.
const FROM_THE_END: f64 = 1.0 / 64.0;

/// Counts rays that leak through the scene's meshes, from inside and outside, at scales of 10^-6 to 10^6 and moved by
/// up to 10^6 extents. A scene without models has no cases.
///
/// # Errors
/// A scene that cannot be traced.
pub fn leaks(subject: &Subject, effort: &Effort) -> Result<Vec<Outcome>, CompileError> {
    if subject.scene.models.is_empty() {
        return Ok(Vec::new());
    }
    // Rays pass cut-outs, which is no leak.
    let mut whole = subject.clone();
    whole.scene.materials.iter_mut().for_each(|material| material.cutout = None);
    let subject = &whole;
    let seams: Vec<Seams> = subject.meshes.iter().map(|mesh| Seams::of(mesh)).collect();
    let extent = subject.extent()?;
    let rays = effort.rays.div_ceil(PLACES.len() as u64);
    let at = |place: usize| {
        let subject = at_place(subject, place, extent);
        let frame = subject.prepared(effort.side)?;
        let pieces = pieces(&subject, &frame, &seams);
        let Tally { at_edges, wrong, leaked } = shoot(&frame, &pieces, rays);
        let name = |&ray: &u64| leak_message(&frame, &pieces, ray, number(ray, place));
        Ok(Outcome {
            check: Check::Leaks,
            case: case(place),
            unit: "rays",
            tested: rays,
            at_edges,
            wrong,
            failures: leaked.iter().map(name).collect(),
        })
    };
    (0..PLACES.len()).map(at).collect()
}

/// The scene at one of [`PLACES`].
pub(super) fn at_place(subject: &Subject, place: usize, extent: f64) -> Subject {
    let (scale, distance) = PLACES[place % PLACES.len()];
    let offset = DVec3::new(1.0, -1.0, 0.5) * (distance * extent * scale);
    subject.with(placed(&subject.scene, scale, offset))
}

/// Description of a place.
pub(super) fn case(place: usize) -> String {
    let (scale, distance) = PLACES[place % PLACES.len()];
    format!("scale {scale:e}, {distance:e} extents away")
}

/// Number of a ray for `--ray`: it means the same ray at the same place for every total of rays.
fn number(ray: u64, place: usize) -> u64 {
    ray * PLACES.len() as u64 + place as u64
}

/// The ray within its case, and the place: the inverse of [`number`].
pub(super) fn of_number(number: u64) -> (u64, usize) {
    (number / PLACES.len() as u64, (number % PLACES.len() as u64) as usize)
}

/// A model in world space, with its seams.
pub(super) struct Piece<'a> {
    pub(super) model: usize,
    pub(super) seams: &'a Seams,
    /// world = `linear` * mesh + `translation`.
    linear: DMat3,
    translation: DVec3,
    /// Approximate size, in world units.
    size: f64,
    /// Error bound of a point after rounding from mesh to world to mesh space, in world units.
    rounding: f64,
}

/// Counts of rays.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Tally {
    pub(super) at_edges: u64,
    pub(super) wrong: u64,
    /// The first rays that leaked.
    pub(super) leaked: Vec<u64>,
}

impl Tally {
    fn and(mut self, mut other: Self) -> Self {
        self.leaked.append(&mut other.leaked);
        self.leaked.sort_unstable();
        self.leaked.truncate(NAMED);
        let (at_edges, wrong) = (self.at_edges + other.at_edges, self.wrong + other.wrong);
        Self { at_edges, wrong, ..self }
    }
}

/// The models of a scene, with the seams of their meshes.
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
            // Stretched models lose digits on the way to world space and back.
            rounding: 16.0 * f64::EPSILON * farthest * size * inverse,
        })
    };
    subject.scene.models.iter().enumerate().filter_map(piece).collect()
}

/// Frobenius norm of a linear map, divided such that a rotation has norm one.
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
        for ray in index * PACK..rays.min((index + 1) * PACK) {
            let shot = aim(pieces, &mut random);
            let leaks = shot.closes && !pieces[shot.piece].stops(frame, &shot);
            tally.at_edges += u64::from(!shot.closes);
            tally.wrong += u64::from(leaks);
            tally.leaked.extend((leaks && tally.leaked.len() < NAMED).then_some(ray));
        }
        tally
    };
    (0..rays.div_ceil(PACK)).into_par_iter().map(pack).reduce(Tally::default, Tally::and)
}

/// The ray of [`shoot`] with an index.
pub(super) fn shot(pieces: &[Piece<'_>], ray: u64) -> Aimed {
    let mut random = Random::new(ray / PACK);
    for _ in 0..ray % PACK {
        aim(pieces, &mut random);
    }
    aim(pieces, &mut random)
}

fn aim(pieces: &[Piece<'_>], random: &mut Random) -> Aimed {
    let piece = random.below(pieces.len());
    pieces[piece].shot(piece, random)
}

/// A ray aimed at an edge, or at its first end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Aimed {
    pub(super) origin: DVec3,
    pub(super) direction: DVec3,
    /// Index of the piece.
    pub(super) piece: usize,
    pub(super) edge: usize,
    /// Position of the target on the edge, from 0 at its first end to 1.
    pub(super) share: f64,
    /// Whether the ray must be stopped.
    pub(super) closes: bool,
}

impl Aimed {
    pub(super) fn at_vertex(&self) -> bool {
        self.share == 0.0
    }
}

impl Piece<'_> {
    fn shot(&self, piece: usize, random: &mut Random) -> Aimed {
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
        Aimed { origin, direction, piece, edge, share, closes }
    }

    /// A random origin: just below or above a triangle, inside the model's box, or around it.
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

    pub(super) fn world(&self, vertex: u32) -> DVec3 {
        self.linear * self.seams.vertices[vertex as usize] + self.translation
    }

    /// Whether an edge has triangles on both sides for certain, seen from a point: so far from the plane through the
    /// point and the edge that rounding cannot move them across it, including near the ends of the edge.
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

    /// Whether the scene stops a ray: by a triangle with a corner in common with the target, by a primitive in front
    /// of it, or by another primitive that coincides with it.
    pub(super) fn stops(&self, frame: &PreparedFrame, shot: &Aimed) -> bool {
        let Some(ray) = frame.to_eye(shot.origin, shot.direction) else { return false };
        let Some(Hit { t, primitive }) = frame.closest(&ray, f64::INFINITY, None) else { return false };
        t < 1.0
            || self.touches(frame, shot, primitive)
            || t <= self.exactly(frame, shot) + frame.slack(&ray, primitive, t)
    }

    fn touches(&self, frame: &PreparedFrame, shot: &Aimed, primitive: PrimitiveId) -> bool {
        let PrimitiveId { item, triangle } = primitive;
        if item >= frame.items.first_plane() {
            return false;
        }
        let Item::Model(model) = frame.items.get(item) else { return false };
        let corners = frame.instances[model].mesh.corners(triangle).map(|corner| corner.as_dvec3());
        let ends = &self.seams.edges[shot.edge].ends[..if shot.at_vertex() { 1 } else { 2 }];
        model == self.model && ends.iter().any(|&end| corners.contains(&self.seams.vertices[end as usize]))
    }

    /// Distance at which the ray meets the triangles around its target, without a tree; minus infinity where it
    /// misses them.
    fn exactly(&self, frame: &PreparedFrame, shot: &Aimed) -> f64 {
        self.around(shot)
            .into_iter()
            .filter_map(|corners| self.meets(frame, shot, &corners))
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// Distance at which the ray meets one triangle.
    pub(super) fn meets(&self, frame: &PreparedFrame, shot: &Aimed, corners: &[DVec3; 3]) -> Option<f64> {
        let ray = frame.to_eye(shot.origin, shot.direction)?;
        let local = frame.instances[self.model].to_mesh(&ray);
        ShearedRay::new(local.origin, local.direction).intersect(corners)
    }

    /// The triangles around the target of a ray, in mesh space.
    pub(super) fn around(&self, shot: &Aimed) -> Vec<[DVec3; 3]> {
        let seams = self.seams;
        let first = seams.edges[shot.edge].ends[0];
        let edges = if shot.at_vertex() { seams.edges_at(first).to_vec() } else { vec![shot.edge as u32] };
        let mut triangles: Vec<[u32; 3]> = Vec::new();
        for &edge in &edges {
            let edge = &seams.edges[edge as usize];
            let [a, b] = edge.ends;
            triangles.extend(seams.opposite(edge).iter().map(|&opposite| sorted([a, b, opposite])));
        }
        // Each triangle is at two edges of a vertex.
        triangles.sort_unstable();
        triangles.dedup();
        triangles.into_iter().map(|corners| corners.map(|vertex| seams.vertices[vertex as usize])).collect()
    }
}

fn sorted(mut corners: [u32; 3]) -> [u32; 3] {
    corners.sort_unstable();
    corners
}
