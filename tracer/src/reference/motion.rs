//! The scene at a time between the opening and the closing of the shutter.

use std::sync::Arc;

use super::Oracle;
use super::path::half_diagonal;
use crate::mesh::CompiledMesh;
use crate::scene::{FrameView, Motion, Scene};
use crate::texture::Texture;

impl Oracle {
    /// The oracle of a scene at a time from 0, when the shutter opens, to 1, when it closes: positions and angles are interpolated
    /// linearly. The powers of lights are those when the shutter opens. Patterns in world space stay where they are.
    pub fn at_time(
        scene: &Scene,
        meshes: &[Arc<CompiledMesh>],
        textures: &[Arc<Texture>],
        view: &FrameView,
        time: f64,
    ) -> Self {
        let size = half_diagonal(scene, meshes);
        Self { half_diagonal: size, ..Self::new(&at_time(scene, time), meshes, textures, view) }
    }
}

/// A scene in which nothing moves, with all objects where they are at a time.
fn at_time(scene: &Scene, time: f64) -> Scene {
    let mut still = Scene { motions: Vec::new(), ..scene.clone() };
    for motion in &scene.motions {
        match *motion {
            Motion::Sphere { sphere, center } => {
                let sphere = &mut still.spheres[sphere as usize];
                sphere.center = sphere.center.lerp(center, time);
            }
            Motion::Model { model, translate, rotate } => {
                let model = &mut still.models[model as usize];
                model.translate = model.translate.lerp(translate, time);
                model.rotate = model.rotate.lerp(rotate, time);
            }
        }
    }
    still
}
