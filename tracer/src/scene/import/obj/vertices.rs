//! Vertices of the mesh: one for each pair of position and normal.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use glam::{DVec3, Vec3};

use super::corner::NONE;
use super::geometry::Geometry;
use crate::mesh::Mesh;

/// The mesh without its materials. Vertices are in the order of their first use; a normal is zero where it is to be
/// averaged.
pub(super) fn mesh(geometry: &Geometry) -> Mesh {
    let mut vertices =
        Vertices { with_normals: geometry.corners.iter().any(|c| c.normal != NONE), ..Vertices::default() };
    if !vertices.with_normals {
        vertices.numbers = vec![NONE; geometry.positions.len()];
    }
    let triangles = geometry
        .triangles
        .iter()
        .map(|corners| corners.map(|corner| vertices.number(geometry, corner)))
        .collect();
    let smoothing = geometry.smoothing.clone();
    Mesh { positions: vertices.positions, normals: vertices.normals, triangles, smoothing, ..Mesh::default() }
}

#[derive(Default)]
struct Vertices {
    with_normals: bool,
    positions: Vec<DVec3>,
    normals: Vec<Vec3>,
    /// Without normals: the vertex of each position of the file, or [`NONE`].
    numbers: Vec<u32>,
    /// With normals: the vertex of each pair of position and normal.
    pairs: HashMap<(u32, u32), u32>,
}

impl Vertices {
    fn number(&mut self, geometry: &Geometry, corner: u32) -> u32 {
        let corner = geometry.corners[corner as usize];
        let next = self.positions.len() as u32;
        if self.with_normals {
            match self.pairs.entry((corner.vertex, corner.normal)) {
                Entry::Occupied(known) => return *known.get(),
                Entry::Vacant(new) => new.insert(next),
            };
            self.normals.push(geometry.normals.get(corner.normal as usize).copied().unwrap_or(Vec3::ZERO));
        } else {
            let known = &mut self.numbers[corner.vertex as usize];
            if *known != NONE {
                return *known;
            }
            *known = next;
        }
        self.positions.push(geometry.positions[corner.vertex as usize]);
        next
    }
}
