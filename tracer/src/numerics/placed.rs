//! A scene at another place and size.

use std::collections::BTreeSet;

use glam::DVec3;

use crate::scene::{Attenuation, CameraKind, CheckerSpace, Light, LightKind, Scene};

/// The scene scaled by `factor`, then moved by `offset`. Lengths and lights scale such that the picture stays the
/// same, bit for bit for powers of two without an offset. Absorption per world unit has no exact counterpart at another scale, so it
/// stays; patterns of the world's space do not move.
pub(super) fn placed(scene: &Scene, factor: f64, offset: DVec3) -> Scene {
    let place = |p: DVec3| p * factor + offset;
    let mut scene = scene.clone();
    scene.camera.position = place(scene.camera.position);
    scene.camera.look_at = place(scene.camera.look_at);
    if let CameraKind::Orthographic { view_height } = &mut scene.camera.kind {
        *view_height *= factor;
    }
    scene.lights.iter_mut().for_each(|light| place_light(light, factor, place));
    for model in &mut scene.models {
        model.translate = place(model.translate);
        model.scale *= factor;
    }
    for sphere in &mut scene.spheres {
        sphere.center = place(sphere.center);
        sphere.radius *= factor;
    }
    for disk in &mut scene.disks {
        disk.center = place(disk.center);
        disk.radius *= factor;
    }
    for plane in &mut scene.planes {
        plane.point = place(plane.point);
        plane.size *= factor;
    }
    // Patterns of models are in the units of their files, and scale with these.
    let of_models: BTreeSet<u32> =
        scene.models.iter().flat_map(|model| model.materials.iter().copied()).collect();
    for (index, material) in scene.materials.iter_mut().enumerate() {
        let scales = |space| match space {
            CheckerSpace::World => true,
            CheckerSpace::Object => !of_models.contains(&(index as u32)),
            CheckerSpace::Uv => false,
        };
        if let Some(checker) = material.checker.as_mut().filter(|checker| scales(checker.space)) {
            checker.size *= factor as f32;
        }
    }
    scene.triangles.iter_mut().for_each(|triangle| triangle.vertices = triangle.vertices.map(place));
    scene
}

fn place_light(light: &mut Light, factor: f64, place: impl Fn(DVec3) -> DVec3) {
    light.radius *= factor;
    match &mut light.kind {
        LightKind::Point { position } | LightKind::Spot { position, .. } => *position = place(*position),
        LightKind::Directional { .. } => return,
    }
    match &mut light.attenuation {
        Attenuation::None => {}
        Attenuation::InverseSquare => light.color *= (factor * factor) as f32,
        Attenuation::Polynomial { linear, quadratic, .. } => {
            *linear /= factor;
            *quadratic /= factor * factor;
        }
    }
}
