//! Meshes that bound volumes.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::Vec3;

use super::CompileError;
use crate::mesh::{CompiledMesh, MeshId};
use crate::scene::Scene;

/// A closed mesh.
#[derive(Clone, Debug)]
pub(crate) struct Solid {
    pub mesh: Arc<CompiledMesh>,
    /// Whether the fronts of its triangles, from which the corners are in counter-clockwise order, face its inside.
    pub faces_inside: bool,
}

/// The meshes of the volumes that have one, in their order.
pub(super) fn of(
    scene: &Scene,
    meshes: &BTreeMap<MeshId, Arc<CompiledMesh>>,
) -> Result<Vec<Solid>, CompileError> {
    let models = scene.volumes.iter().enumerate();
    let models = models.filter_map(|(index, volume)| Some((index, volume.boundary.model()?)));
    models
        .map(|(volume, model)| {
            let missing = CompileError::MissingSolid { volume, id: model.mesh };
            let mesh = Arc::clone(meshes.get(&model.mesh).ok_or(missing)?);
            let faces_inside = content(&mesh) < 0.0;
            Ok(Solid { mesh, faces_inside })
        })
        .collect()
}

/// What a closed mesh encloses, in units of the mesh: negative if its fronts face its inside. By the divergence theorem the sum over all
/// triangles of a . (b x c) / 6.
fn content(mesh: &CompiledMesh) -> f64 {
    let of_triangle = |triangle: u32| {
        let [a, b, c] = mesh.corners(triangle).map(Vec3::as_dvec3);
        a.dot(b.cross(c)) / 6.0
    };
    mesh.triangles().map(of_triangle).sum()
}
