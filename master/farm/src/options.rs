//! How a farm is set up, and what it draws.

use std::net::SocketAddr;
use std::sync::Arc;

use rayfarm_scheduler::SegmentPolicy;
use rayfarm_tracer::mesh::CompiledMesh;
use rayfarm_tracer::scene::Scene;
use rayfarm_tracer::texture::Texture;

use crate::supervisor::LocalWorkerCommand;

/// Where workers connect when nobody says otherwise.
pub const DEFAULT_PORT: u16 = 7117;

/// How a farm is set up.
#[derive(Clone, Debug, Default)]
pub struct FarmOptions {
    /// Where to listen for workers. `None`: 127.0.0.1 at [`DEFAULT_PORT`], or at a free port when that one is
    /// taken. An address that is asked for and taken is an error.
    pub listen: Option<SocketAddr>,
    /// Worker processes to start on this machine, ended with the farm.
    pub local_workers: u32,
    /// The command that runs one of them.
    pub local_worker: LocalWorkerCommand,
    /// Render threads of each local worker; `None` divides the cores among them, at least one each.
    pub threads: Option<usize>,
    /// How frames are cut into segments.
    pub policy: SegmentPolicy,
    /// Whether a frame begins only when the one before it is complete. Otherwise workers that have nothing left to do in
    /// a frame begin the next one: more frames a second, each with an older camera.
    pub sequential: bool,
    /// The share of the segments that a second worker, or the master, renders as well, to find workers that send wrong
    /// pixels; 0 to 100. Which ones is drawn when their pixels have come.
    pub verify_percent: u8,
}

/// What the farm draws.
#[derive(Clone)]
pub struct FarmScene {
    /// The scene as data.
    pub scene: Scene,
    /// The meshes that it names; others are neither kept nor sent.
    pub meshes: Vec<Arc<CompiledMesh>>,
    /// The textures that it names, likewise.
    pub textures: Vec<Arc<Texture>>,
}
