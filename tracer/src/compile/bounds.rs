//! Placements of models, and bounds of items.

use std::sync::Arc;

use glam::{DMat3, DVec3, Vec3};

use super::Item;
use crate::mesh::CompiledMesh;
use crate::scene::{Model, Scene, rotation};

/// The linear part of a model's placement: its scale, then its rotation, then its groups, then `spin` degrees about y.
pub(crate) fn orientation(model: &Model, spin: f64) -> DMat3 {
    let own = rotation::of_model(model.rotate) * DMat3::from_diagonal(model.scale);
    let grouped = if model.group == DMat3::IDENTITY { own } else { model.group * own };
    rotation::about_y(spin) * grouped
}

/// Half the size on each axis of the box around a disk.
pub(crate) fn disk_reach(normal: DVec3, radius: f64) -> DVec3 {
    let along = normal * normal;
    DVec3::from_array((DVec3::ONE - along).max(DVec3::ZERO).to_array().map(f64::sqrt)) * radius
}

/// Bounds of a box after a linear map and a translation.
pub(crate) fn transformed_bounds(
    (lo, hi): (DVec3, DVec3),
    linear: DMat3,
    translation: DVec3,
) -> (DVec3, DVec3) {
    let center = linear * (lo * 0.5 + hi * 0.5) + translation;
    let half = (hi - lo) * 0.5;
    let reach = linear.x_axis.abs() * half.x + linear.y_axis.abs() * half.y + linear.z_axis.abs() * half.z;
    (center - reach, center + reach)
}

/// Bounds of an item in world space.
pub(super) fn world_bounds(scene: &Scene, meshes: &[Arc<CompiledMesh>], item: Item) -> (DVec3, DVec3) {
    match item {
        Item::Model(i) => {
            let model = &scene.models[i];
            transformed_bounds(meshes[i].bounds(), orientation(model, 0.0), model.translate)
        }
        Item::Sphere(i) => {
            let sphere = &scene.spheres[i];
            (sphere.center - sphere.radius, sphere.center + sphere.radius)
        }
        Item::Triangle(i) => {
            let [a, b, c] = scene.triangles[i].vertices;
            (a.min(b).min(c), a.max(b).max(c))
        }
        Item::Disk(i) => {
            let disk = &scene.disks[i];
            let reach = disk_reach(disk.normal, disk.radius);
            (disk.center - reach, disk.center + reach)
        }
    }
}

/// Boxes relative to the scene's centre, in units of its half extent: within the range of a builder in `f32` at any place
/// and scale of the scene.
pub(super) fn relative_boxes(boxes: &[(DVec3, DVec3)], bounds: Option<(DVec3, DVec3)>) -> Vec<(Vec3, Vec3)> {
    let Some((lo, hi)) = bounds else { return Vec::new() };
    let center = lo * 0.5 + hi * 0.5;
    let half_extent = (hi - center).max_element();
    let unit = if half_extent > 0.0 && half_extent.is_finite() { half_extent } else { 1.0 };
    let place = |corner: DVec3| ((corner - center) / unit).as_vec3();
    boxes.iter().map(|&(lo, hi)| (place(lo), place(hi))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::MeshId;
    use crate::scene::NormalMode;

    #[test]
    fn rotations_follow_the_right_hand_and_the_order_x_y_z() {
        let model = |rotate| Model {
            mesh: MeshId([0; 32]),
            materials: vec![],
            normals: NormalMode::Flat,
            translate: DVec3::ZERO,
            rotate,
            scale: DVec3::ONE,
            group: DMat3::IDENTITY,
        };
        assert_eq!(orientation(&model(DVec3::new(90.0, 0.0, 0.0)), 0.0) * DVec3::Y, DVec3::Z);
        assert_eq!(orientation(&model(DVec3::new(0.0, 90.0, 0.0)), 0.0) * DVec3::Z, DVec3::X);
        assert_eq!(orientation(&model(DVec3::new(0.0, 0.0, 90.0)), 0.0) * DVec3::X, DVec3::Y);
        // y -> z by x, z -> x by y, x -> y by z.
        assert_eq!(orientation(&model(DVec3::splat(90.0)), 0.0) * DVec3::Y, DVec3::Y);
        assert_eq!(orientation(&model(DVec3::new(90.0, 0.0, 0.0)), 90.0) * DVec3::Y, DVec3::X);
    }

    #[test]
    fn a_transformed_box_holds_all_its_corners() {
        let linear = rotation::about_x(20.0)
            * rotation::about_y(40.0)
            * DMat3::from_diagonal(DVec3::new(1.0, -2.0, 3.0));
        let (lo, hi) = (DVec3::new(-1.0, 0.0, 2.0), DVec3::new(2.0, 5.0, 3.0));
        let (tlo, thi) = transformed_bounds((lo, hi), linear, DVec3::ONE);
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { lo[axis] } else { hi[axis] };
            let moved = linear * DVec3::new(pick(0), pick(1), pick(2)) + DVec3::ONE;
            assert!((moved - tlo).min_element() > -1e-12 && (thi - moved).min_element() > -1e-12);
        }
    }
}
