//! Geometry without colour ([`Shape`]) and coloured geometry ([`Model`]).

use std::collections::BTreeMap;

use glam::DVec3;

use super::angle;

/// A Blinn-Phong material, linear colours.
#[derive(Debug)]
pub(crate) struct Material {
    /// Name in the MTL file.
    pub(crate) name: &'static str,
    /// c_d.
    pub(crate) diffuse: [f64; 3],
    /// c_s.
    pub(crate) specular: [f64; 3],
    /// Blinn-Phong exponent.
    pub(crate) exponent: f64,
}

impl Material {
    /// Without highlights.
    pub(crate) const fn matt(name: &'static str, diffuse: [f64; 3]) -> Self {
        Self { name, diffuse, specular: [0.0; 3], exponent: 1.0 }
    }

    /// With white highlights.
    pub(crate) const fn glossy(name: &'static str, diffuse: [f64; 3], gloss: f64, exponent: f64) -> Self {
        Self { name, diffuse, specular: [gloss; 3], exponent }
    }

    /// With highlights of its own colour.
    pub(crate) const fn metal(
        name: &'static str,
        diffuse: [f64; 3],
        specular: [f64; 3],
        exponent: f64,
    ) -> Self {
        Self { name, diffuse, specular, exponent }
    }
}

/// A mesh of quads, counter-clockwise from outside. A triangle repeats its last corner. Faces that share a vertex
/// are smoothed over it unless they meet at a crease.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shape {
    /// Corners of the faces, metres.
    pub(crate) positions: Vec<DVec3>,
    /// Indices into `positions`.
    pub(crate) faces: Vec<[u32; 4]>,
}

impl Shape {
    /// Adds a vertex and returns its index.
    pub(crate) fn vertex(&mut self, position: DVec3) -> u32 {
        self.positions.push(position);
        (self.positions.len() - 1) as u32
    }

    /// Adds a quad of four new vertices.
    pub(crate) fn quad(&mut self, corners: [DVec3; 4]) {
        let corners = corners.map(|corner| self.vertex(corner));
        self.faces.push(corners);
    }

    /// Adds another shape; the two share no vertices.
    pub(crate) fn add(&mut self, other: Shape) {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.faces.extend(other.faces.into_iter().map(|face| face.map(|corner| corner + first)));
    }

    /// Several shapes as one.
    pub(crate) fn union(shapes: impl IntoIterator<Item = Shape>) -> Shape {
        shapes.into_iter().fold(Shape::default(), |mut all, shape| {
            all.add(shape);
            all
        })
    }

    /// Every vertex moved by `to`.
    pub(crate) fn mapped(mut self, to: impl Fn(DVec3) -> DVec3) -> Self {
        self.positions.iter_mut().for_each(|position| *position = to(*position));
        self
    }

    /// Moved by an offset.
    pub(crate) fn at(self, x: f64, y: f64, z: f64) -> Self {
        self.mapped(|p| p + DVec3::new(x, y, z))
    }

    /// Turned about +X.
    pub(crate) fn turned_x(self, degrees: f64) -> Self {
        self.mapped(|p| angle::turn_x(p, degrees))
    }

    /// Turned about +Y.
    pub(crate) fn turned_y(self, degrees: f64) -> Self {
        self.mapped(|p| angle::turn_y(p, degrees))
    }

    /// Turned about +Z.
    pub(crate) fn turned_z(self, degrees: f64) -> Self {
        self.mapped(|p| angle::turn_z(p, degrees))
    }

    /// The same surface with its inside outside: the wall of a cavity.
    pub(crate) fn inside_out(mut self) -> Self {
        for [a, b, c, d] in &mut self.faces {
            // A triangle repeats its last corner, before and after.
            [*a, *b, *c, *d] = if *c == *d { [*b, *a, *c, *c] } else { [*d, *c, *b, *a] };
        }
        self
    }

    /// Merges vertices that lie within a tenth of a micrometre, and drops faces that lose their area by it.
    pub(crate) fn welded(self) -> Self {
        let mut known = BTreeMap::new();
        let mut welded = Shape::default();
        let merged: Vec<u32> = self
            .positions
            .iter()
            .map(|&p| *known.entry(weld_key(p)).or_insert_with(|| welded.vertex(p)))
            .collect();
        welded.faces =
            self.faces.iter().filter_map(|face| proper(face.map(|c| merged[c as usize]))).collect();
        welded
    }
}

fn weld_key(p: DVec3) -> [i64; 3] {
    (p * 1e7).to_array().map(|coordinate| coordinate.round() as i64)
}

/// The face without repeated corners: a quad, a triangle with its last corner repeated, or nothing.
fn proper(face: [u32; 4]) -> Option<[u32; 4]> {
    let mut corners: Vec<u32> = Vec::with_capacity(4);
    for corner in face {
        if !corners.contains(&corner) {
            corners.push(corner);
        }
    }
    match corners[..] {
        [a, b, c, d] => Some([a, b, c, d]),
        [a, b, c] => Some([a, b, c, c]),
        _ => None,
    }
}

/// Shapes with their materials.
#[derive(Clone, Debug, Default)]
pub(crate) struct Model {
    /// One group per material, in the order of first use.
    pub(crate) groups: Vec<(&'static Material, Shape)>,
}

impl Model {
    /// Adds a shape of one material.
    pub(crate) fn add(&mut self, material: &'static Material, shape: Shape) {
        match self.groups.iter_mut().find(|(known, _)| known.name == material.name) {
            Some((_, group)) => group.add(shape),
            None => self.groups.push((material, shape)),
        }
    }

    /// Adds another model.
    pub(crate) fn include(&mut self, other: Model) {
        for (material, shape) in other.groups {
            self.add(material, shape);
        }
    }

    /// Every vertex moved by `to`.
    pub(crate) fn mapped(self, to: impl Fn(DVec3) -> DVec3 + Copy) -> Self {
        let groups = self.groups.into_iter().map(|(material, shape)| (material, shape.mapped(to))).collect();
        Self { groups }
    }

    /// Moved by an offset.
    pub(crate) fn at(self, x: f64, y: f64, z: f64) -> Self {
        self.mapped(|p| p + DVec3::new(x, y, z))
    }

    /// Turned about +Y.
    pub(crate) fn turned_y(self, degrees: f64) -> Self {
        self.mapped(|p| angle::turn_y(p, degrees))
    }

    /// Turned about +Z.
    pub(crate) fn turned_z(self, degrees: f64) -> Self {
        self.mapped(|p| angle::turn_z(p, degrees))
    }
}
