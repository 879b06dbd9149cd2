//! Objects that move while the shutter of the camera is open.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::Scene;

/// An object that moves while the shutter is open. The scene has its pose when the shutter opens, and this is the pose when it closes.
/// Positions and angles change evenly in between.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Motion {
    /// A sphere.
    Sphere {
        /// Index into [`Scene::spheres`].
        sphere: u32,
        /// World position of the centre.
        center: DVec3,
    },
    /// A model.
    Model {
        /// Index into [`Scene::models`].
        model: u32,
        /// World position of the mesh's origin.
        translate: DVec3,
        /// Degrees about x, then y, then z.
        rotate: DVec3,
    },
}

impl Motion {
    /// Whether the object is elsewhere when the shutter closes. An object that the scene does not have does not move.
    pub(crate) fn moves(&self, scene: &Scene) -> bool {
        match *self {
            Self::Sphere { sphere, center } => {
                scene.spheres.get(sphere as usize).is_some_and(|sphere| sphere.center != center)
            }
            Self::Model { model, translate, rotate } => scene
                .models
                .get(model as usize)
                .is_some_and(|model| model.translate != translate || model.rotate != rotate),
        }
    }
}
