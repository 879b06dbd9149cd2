//! A generated mesh: rings around the Y axis with waves in both directions.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use rayfarm_tracer::mesh::{Mesh, NamedMaterial};
use rayfarm_tracer::scene::Material;
use rayfarm_tracer::texture::without_repeats;

/// Number of waves around the ring, and of repeats of its texture.
pub(crate) const WAVES: u32 = 9;

/// Rings of 2 * `steps`^2 triangles each, with an outer radius of about one.
pub(crate) fn mesh(steps: u32, centers: &[DVec3]) -> Mesh {
    let mut mesh = Mesh::default();
    for &center in centers {
        let first = mesh.positions.len() as u32;
        for (i, j) in pairs(steps) {
            mesh.positions.push(center + point(TAU * share(i, steps), TAU * share(j, steps)));
        }
        let at = |i: u32, j: u32| first + (i % steps) * steps + j % steps;
        let uv = |i: u32, j: u32| DVec2::new(share(i, steps) * f64::from(WAVES), share(j, steps) * 3.0);
        for (i, j) in pairs(steps) {
            let [a, b, c, d] = [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)];
            for corners in [[a, b, c], [a, c, d]] {
                mesh.triangles.push(corners.map(|(i, j)| at(i, j)));
                mesh.uvs.push(without_repeats(corners.map(|(i, j)| uv(i, j))).unwrap_or_default());
            }
        }
    }
    mesh.triangle_materials = vec![0; mesh.triangles.len()];
    mesh.materials = vec![NamedMaterial::plain("skin", Material::NEUTRAL)];
    mesh
}

fn pairs(steps: u32) -> impl Iterator<Item = (u32, u32)> {
    (0..steps).flat_map(move |i| (0..steps).map(move |j| (i, j)))
}

fn share(index: u32, steps: u32) -> f64 {
    f64::from(index) / f64::from(steps)
}

/// Position on the surface, `around` the axis and `across` the ring, in radians.
fn point(around: f64, across: f64) -> DVec3 {
    let waves = libm::sin(f64::from(WAVES) * around + 2.0 * across) + libm::sin(7.0 * across);
    let thickness = 0.3 + 0.02 * waves;
    let radius = 0.7 + thickness * libm::cos(across);
    DVec3::new(radius * libm::cos(around), thickness * libm::sin(across), radius * libm::sin(around))
}
