//! The scene that a farm draws.

use std::sync::Arc;

use rayfarm_tracer::mesh::CompiledMesh;
use rayfarm_tracer::scene::Scene;
use rayfarm_tracer::texture::Texture;

/// A scene with its meshes and textures.
#[derive(Clone, Debug)]
pub struct FarmScene {
    /// The scene as data.
    pub scene: Scene,
    /// The meshes that the scene refers to; others are neither kept nor sent.
    pub meshes: Vec<Arc<CompiledMesh>>,
    /// The textures that the scene refers to; others are neither kept nor sent.
    pub textures: Vec<Arc<Texture>>,
}
