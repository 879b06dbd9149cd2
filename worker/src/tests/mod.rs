//! Tests of whole sessions, with a renderer whose scenes are short byte strings and a master at the other end of a pipe.

mod cancellation;
mod disk;
mod fake_master;
mod fake_renderer;
mod peers;
mod secure_peers;
mod sessions;

use std::path::Path;
use std::sync::Arc;

use crate::render_pool::RenderPool;
use crate::scenes::{BuildPool, DiskCache, DiskWriter, SceneLoader};
use crate::session::PersistentState;

use fake_master::{FakeMaster, lease};
use fake_renderer::{FakeRenderer, Gate, HEIGHT, SLOW_SCENE, WIDTH, expected, scene, until};

/// Size of a cache that holds all assets of a test, in bytes.
const LARGE_CACHE: u64 = 64 << 20;

/// A worker's state with a fake renderer, and the renderer's gate.
fn persistent(threads: usize, cache_bytes: u64) -> (PersistentState<FakeRenderer>, Arc<Gate>) {
    let renderer = Arc::new(FakeRenderer::default());
    let gate = Arc::clone(&renderer.gate);
    let pool = RenderPool::new(Arc::clone(&renderer), threads).unwrap();
    let builders = BuildPool::new(threads).unwrap();
    (PersistentState { renderer, pool, builders, loader: SceneLoader::new(cache_bytes), disk: None }, gate)
}

/// The state of a worker that has just started, with a disk cache in `folder`.
fn persistent_with_disk(folder: &Path, limit_bytes: u64) -> PersistentState<FakeRenderer> {
    let disk = DiskWriter::new(DiskCache::new(folder.to_owned(), limit_bytes)).unwrap();
    PersistentState { disk: Some(disk), ..persistent(1, 1 << 20).0 }
}
