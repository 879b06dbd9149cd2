//! Scenes to measure, and their frames on a number of threads.
#![allow(dead_code, reason = "every benchmark uses its own share of this")]

mod ring;
pub(crate) mod variants;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayfarm_tracer::scene::{self, FrameView, LoadedScene};
use rayfarm_tracer::{CompiledScene, PreparedFrame, RayCounts, TILE_SIZE, render_rows};
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Environment variable with the folder of further scenes; `../shared/workloads` next to the repository if not set.
const WORKLOADS: &str = "RAYFARM_WORKLOADS";

/// A scene to measure.
pub(crate) struct Workload {
    pub(crate) name: String,
    path: PathBuf,
}

/// The project's own scenes, and the workloads if available.
pub(crate) fn workloads() -> Vec<Workload> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let others = std::env::var_os(WORKLOADS).map_or_else(|| root.join("../shared/workloads"), PathBuf::from);
    let own = ["room", "product", "instances", "lights", "textured"].map(|name| (root.join("models"), name));
    let others = ["w1", "w2", "w3"].map(|name| (others.clone(), name));
    own.into_iter()
        .chain(others)
        .map(|(folder, name)| Workload { name: name.into(), path: folder.join(name).with_extension("toml") })
        .filter(|workload| workload.path.exists())
        .collect()
}

impl Workload {
    /// Loads and compiles a scene.
    pub(crate) fn load(&self) -> (Arc<CompiledScene>, FrameView) {
        let loaded = match scene::load(&self.path) {
            Ok(loaded) => loaded,
            Err(error) => stop(&error),
        };
        let view = FrameView::of(&loaded.scene);
        (compile(loaded), view)
    }
}

pub(crate) fn compile(loaded: LoadedScene) -> Arc<CompiledScene> {
    match CompiledScene::new(loaded.scene, loaded.meshes, loaded.textures) {
        Ok(scene) => Arc::new(scene),
        Err(error) => stop(&error),
    }
}

pub(crate) fn prepare(scene: &Arc<CompiledScene>, view: &FrameView) -> PreparedFrame {
    match PreparedFrame::new(Arc::clone(scene), view) {
        Ok(frame) => frame,
        Err(error) => stop(&error),
    }
}

/// Ends the benchmark with a message, because nothing can be measured.
pub(crate) fn stop(error: &dyn std::error::Error) -> ! {
    eprintln!("{error}");
    std::process::exit(1);
}

pub(crate) fn pool(threads: usize) -> ThreadPool {
    match ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool,
        Err(error) => stop(&error),
    }
}

/// A buffer for the bytes of a frame.
pub(crate) fn room_for(frame: &PreparedFrame) -> Vec<u8> {
    vec![0; frame.width() as usize * frame.height() as usize * 3]
}

/// Renders a whole frame in bands of rows, on the threads of a pool.
pub(crate) fn render(pool: &ThreadPool, frame: &PreparedFrame, pixels: &mut [u8]) -> RayCounts {
    let row_bytes = frame.width() as usize * 3;
    let render_band = |(band, pixels): (usize, &mut [u8])| {
        let top = band as u32 * TILE_SIZE;
        let rows = top..top + (pixels.len() / row_bytes) as u32;
        // Never cancelled.
        render_rows(frame, rows, pixels, &|| false).unwrap_or_default()
    };
    let bands = pixels.par_chunks_mut(row_bytes * TILE_SIZE as usize).enumerate();
    pool.install(|| bands.map(render_band).reduce(RayCounts::default, sum))
}

fn sum(mut a: RayCounts, b: RayCounts) -> RayCounts {
    a += b;
    a
}

/// Number of all rays of a frame.
pub(crate) fn rays(counts: RayCounts) -> u64 {
    counts.primary + counts.shadow + counts.secondary
}
