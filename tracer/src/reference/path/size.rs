//! Size of a scene.

use std::sync::Arc;

use glam::DVec3;

use super::super::flatten::linear;
use crate::mesh::CompiledMesh;
use crate::scene::Scene;

/// Half of the diagonal of the box around the boxes of all finite objects, in world units; `None` if there are none. The box of a model
/// is that around its turned box.
pub(in crate::reference) fn half_diagonal(scene: &Scene, meshes: &[Arc<CompiledMesh>]) -> Option<f64> {
    let mut points = Vec::new();
    for model in &scene.models {
        let Some(mesh) = meshes.iter().find(|mesh| mesh.id() == model.mesh) else { continue };
        let (lo, hi) = mesh.bounds();
        let placed = |corner: DVec3| linear(model, 0.0) * corner + model.translate;
        points.extend((0..8).map(|corner| {
            let side = |axis: usize| if corner >> axis & 1 == 0 { lo[axis] } else { hi[axis] };
            placed(DVec3::new(side(0), side(1), side(2)))
        }));
    }
    for sphere in &scene.spheres {
        points.extend([sphere.center - sphere.radius, sphere.center + sphere.radius]);
    }
    points.extend(scene.triangles.iter().flat_map(|triangle| triangle.vertices));
    for disk in &scene.disks {
        let n = disk.normal.normalize();
        let reach = (DVec3::ONE - n * n).max(DVec3::ZERO).to_array().map(f64::sqrt);
        let reach = DVec3::from_array(reach) * disk.radius;
        points.extend([disk.center - reach, disk.center + reach]);
    }
    let lo = points.iter().copied().reduce(DVec3::min)?;
    let hi = points.iter().copied().reduce(DVec3::max)?;
    Some((hi - lo).length() / 2.0)
}
