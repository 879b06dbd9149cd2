//! Seams of a mesh: its vertices and edges, with the triangles on each side.

use std::collections::HashMap;
use std::ops::Range;

use glam::{DVec3, Vec3};

use crate::mesh::CompiledMesh;

/// The vertices and edges of a mesh. Corners at one position are one vertex, whatever the file's indices.
pub(super) struct Seams {
    /// Vertices in mesh space.
    pub(super) vertices: Vec<DVec3>,
    pub(super) edges: Vec<Edge>,
    /// The third corners of the triangles at all edges.
    opposite: Vec<u32>,
    /// The edges at all vertices, vertex by vertex.
    spokes: Vec<u32>,
    /// Offset of each vertex's edges in `spokes`, then the length.
    first_spoke: Vec<u32>,
}

/// An edge between two vertices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Edge {
    pub(super) ends: [u32; 2],
    opposite: Range<u32>,
}

impl Seams {
    pub(super) fn of(mesh: &CompiledMesh) -> Self {
        let (vertices, triangles) = welded(mesh);
        let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(triangles.len() * 3);
        for [a, b, c] in triangles {
            sides.extend([(a, b, c), (b, c, a), (c, a, b)].map(|(p, q, r)| ([p.min(q), p.max(q)], r)));
        }
        sides.sort_unstable();
        let mut edges: Vec<Edge> = Vec::new();
        for (at, &(ends, _)) in (0_u32..).zip(&sides) {
            match edges.last_mut() {
                Some(last) if last.ends == ends => last.opposite.end = at + 1,
                _ => edges.push(Edge { ends, opposite: at..at + 1 }),
            }
        }
        let opposite = sides.into_iter().map(|(_, opposite)| opposite).collect();
        let (spokes, first_spoke) = spokes(vertices.len(), &edges);
        Self { vertices, edges, opposite, spokes, first_spoke }
    }

    pub(super) fn opposite(&self, edge: &Edge) -> &[u32] {
        &self.opposite[edge.opposite.start as usize..edge.opposite.end as usize]
    }

    pub(super) fn edges_at(&self, vertex: u32) -> &[u32] {
        let [from, to] = [vertex, vertex + 1].map(|i| self.first_spoke[i as usize] as usize);
        &self.spokes[from..to]
    }
}

/// Distinct positions of corners, and the triangles as indices of them. Triangles with two corners at one position
/// are left out.
fn welded(mesh: &CompiledMesh) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut numbers: HashMap<[u32; 3], u32> = HashMap::new();
    let mut vertices = Vec::new();
    let mut number_of = |corner: Vec3| {
        // Minus zero equals zero.
        let corner = corner + Vec3::ZERO;
        *numbers.entry(corner.to_array().map(f32::to_bits)).or_insert_with(|| {
            vertices.push(corner.as_dvec3());
            vertices.len() as u32 - 1
        })
    };
    let triangles = mesh.triangles().map(|i| mesh.corners(i).map(&mut number_of));
    let triangles = triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    (vertices, triangles)
}

/// The edges at all vertices, and the offset of each vertex's edges.
fn spokes(vertices: usize, edges: &[Edge]) -> (Vec<u32>, Vec<u32>) {
    let mut first = vec![0_u32; vertices + 1];
    for end in edges.iter().flat_map(|edge| edge.ends) {
        first[end as usize + 1] += 1;
    }
    for vertex in 0..vertices {
        first[vertex + 1] += first[vertex];
    }
    let mut next = first.clone();
    let mut spokes = vec![0; edges.len() * 2];
    for (index, edge) in (0_u32..).zip(edges) {
        for end in edge.ends {
            spokes[next[end as usize] as usize] = index;
            next[end as usize] += 1;
        }
    }
    (spokes, first)
}
