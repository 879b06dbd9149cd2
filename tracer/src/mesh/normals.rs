//! Normals at the corners of triangles: those of the file, and averages where it has none.
//!
//! Averages are weighted by area. Around a corner, faces are connected where they share a smooth edge, and a
//! connected set has one normal. So a vertex on a crease has a normal for each side, and each side of a duplicated
//! surface has its own.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::clean::CleanMesh;
use super::fans::{Entry, Fans, around};
use super::{Mesh, Smoothing};
use crate::rotation::sin_cos_degrees;

/// Tolerance of the crease angle, in degrees: a column of nine sides has nine angles of 40 degrees, rounded.
const ROUNDING: f64 = 0.1;

/// Cosine of the angle at which two faces that share an edge are the two sides of one surface: nearly 180 degrees.
const OPPOSITE: f64 = -0.999;

/// Positions per parallel task.
const PLACES: usize = 4096;

/// Gives every corner a normal.
pub(super) fn fill_in(mesh: &Mesh, kept: &mut CleanMesh) {
    let given: Vec<Vec3> =
        mesh.normals.iter().map(|normal| normal.as_dvec3().normalize_or_zero().as_vec3()).collect();
    let is_missing = |vertex: u32| given.get(vertex as usize).is_none_or(|normal| *normal == Vec3::ZERO);
    match &mesh.smoothing {
        _ if !kept.indices.iter().flatten().any(|&vertex| is_missing(vertex)) => kept.normals = given,
        Smoothing::Full if given.is_empty() => kept.normals = averaged(mesh, kept),
        Smoothing::Groups(groups) if given.is_empty() && is_flat(groups, kept) => {}
        _ => fill_in_missing(mesh, given, kept),
    }
}

/// Normals averaged over all faces that share a position's index.
fn averaged(mesh: &Mesh, kept: &CleanMesh) -> Vec<Vec3> {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    for (indices, corners) in kept.indices.iter().zip(&kept.corners) {
        let weighted = weighted(corners);
        for &vertex in indices {
            sums[vertex as usize] += weighted;
        }
    }
    sums.into_iter().map(|sum| sum.normalize_or_zero().as_vec3()).collect()
}

/// The normal of a triangle, with twice its area as its length.
fn weighted(corners: &[Vec3; 3]) -> DVec3 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a)
}

fn is_flat(groups: &[u32], kept: &CleanMesh) -> bool {
    kept.sources.iter().all(|&source| groups[source as usize] == 0)
}

/// Averages the missing normals. Without normals in the file, the first one of each position has the position's
/// index, and all others follow.
fn fill_in_missing(mesh: &Mesh, given: Vec<Vec3>, kept: &mut CleanMesh) {
    let (places, place_count) = places(mesh);
    let faces = Faces::new(mesh, kept, &places);
    let entries = Entries::new(&faces, place_count);
    let blocks: Vec<Vec<Fans>> = (0..place_count)
        .into_par_iter()
        .chunks(PLACES)
        .map(|block| block.into_iter().map(|place| faces.normals_around(entries.at(place))).collect())
        .collect();
    let none_given = given.is_empty();
    let is_missing = |vertex: u32| given.get(vertex as usize).is_none_or(|normal| *normal == Vec3::ZERO);
    let mut indices = kept.indices.clone();
    let mut normals = if none_given { vec![Vec3::ZERO; place_count] } else { given.clone() };
    for (place, fans) in blocks.into_iter().flatten().enumerate() {
        let mut numbers: Vec<Option<u32>> = vec![None; fans.normals.len()];
        if let (true, Some(first)) = (none_given, fans.normals.first()) {
            normals[place] = *first;
            numbers[0] = Some(place as u32);
        }
        for (entry, &fan) in entries.at(place).iter().zip(&fans.of_entries) {
            let corner = &mut indices[entry.triangle as usize][usize::from(entry.corner)];
            if !is_missing(*corner) {
                continue;
            }
            let fan = fan as usize;
            *corner = *numbers[fan].get_or_insert_with(|| {
                normals.push(fans.normals[fan]);
                (normals.len() - 1) as u32
            });
        }
    }
    kept.indices = indices;
    kept.normals = normals;
}

/// Indices of distinct positions, in the order of their first vertices, and their number: patches and parts repeat
/// the vertices of their seams, over which normals are averaged.
fn places(mesh: &Mesh) -> (Vec<u32>, usize) {
    let mut known: HashMap<[u64; 3], u32> = HashMap::with_capacity(mesh.positions.len());
    let places = mesh.positions.iter().map(|position| {
        // Adding zero turns -0.0 into 0.0.
        let place = position.to_array().map(|coordinate| (coordinate + 0.0).to_bits());
        let next = known.len() as u32;
        *known.entry(place).or_insert(next)
    });
    let places = places.collect();
    (places, known.len())
}

/// The kept triangles and their connections.
struct Faces<'m> {
    /// Corners as indices of positions.
    places: Vec<[u32; 3]>,
    /// Normals with twice the area as their length.
    weighted: Vec<DVec3>,
    /// Unit normals.
    normals: Vec<DVec3>,
    smoothing: &'m Smoothing,
    sources: Vec<u32>,
    /// Cosine of the largest angle at which faces are smooth.
    least_cosine: f64,
}

impl<'m> Faces<'m> {
    fn new(mesh: &'m Mesh, kept: &CleanMesh, places: &[u32]) -> Self {
        let weighted: Vec<DVec3> = kept.corners.par_iter().map(weighted).collect();
        let least_cosine = match mesh.smoothing {
            Smoothing::CreaseAngle(degrees) => sin_cos_degrees((degrees + ROUNDING).clamp(0.0, 180.0)).1,
            Smoothing::Full | Smoothing::Groups(_) => -1.0,
        };
        Self {
            places: kept
                .indices
                .iter()
                .map(|corners| corners.map(|vertex| places[vertex as usize]))
                .collect(),
            normals: weighted.par_iter().map(|normal| normal.normalize_or_zero()).collect(),
            weighted,
            smoothing: &mesh.smoothing,
            sources: kept.sources.clone(),
            least_cosine: least_cosine.max(OPPOSITE),
        }
    }

    /// The averaged normals at one position.
    fn normals_around(&self, entries: &[Entry]) -> Fans {
        let neighbours = |entry: &Entry| {
            let corners = self.places[entry.triangle as usize];
            let corner = usize::from(entry.corner);
            [corners[(corner + 1) % 3], corners[(corner + 2) % 3]]
        };
        let is_smooth = |a: &Entry, b: &Entry, turned: bool| self.is_smooth(a.triangle, b.triangle, turned);
        let weight = |entry: &Entry| self.weighted[entry.triangle as usize];
        around(entries, neighbours, is_smooth, weight)
    }

    /// Whether two faces that share an edge are smooth over it; `turned` if they have opposite windings there.
    fn is_smooth(&self, a: u32, b: u32, turned: bool) -> bool {
        let cosine = self.normals[a as usize].dot(self.normals[b as usize]);
        let cosine = if turned { -cosine } else { cosine };
        let one_group = match self.smoothing {
            Smoothing::Groups(groups) => {
                let group = |triangle: u32| groups[self.sources[triangle as usize] as usize];
                group(a) == group(b) && group(a) != 0
            }
            Smoothing::Full | Smoothing::CreaseAngle(_) => true,
        };
        one_group && cosine >= self.least_cosine
    }
}

/// The corners of all faces by position, in the order of the faces.
struct Entries {
    starts: Vec<usize>,
    entries: Vec<Entry>,
}

impl Entries {
    fn new(faces: &Faces<'_>, place_count: usize) -> Self {
        let mut starts = vec![0; place_count + 1];
        for &place in faces.places.iter().flatten() {
            starts[place as usize + 1] += 1;
        }
        for place in 0..place_count {
            starts[place + 1] += starts[place];
        }
        let mut next = starts.clone();
        let mut entries = vec![Entry::default(); 3 * faces.places.len()];
        for (triangle, places) in (0_u32..).zip(&faces.places) {
            for (corner, &place) in (0_u8..).zip(places) {
                let at = &mut next[place as usize];
                entries[*at] = Entry { triangle, corner };
                *at += 1;
            }
        }
        Self { starts, entries }
    }

    fn at(&self, place: usize) -> &[Entry] {
        &self.entries[self.starts[place]..self.starts[place + 1]]
    }
}
