//! Tests of the disk cache: later runs of a worker find the assets of earlier ones.

use std::path::Path;

use rayfarm_protocol::{AssetId, ToWorker};

use super::{FakeMaster, LARGE_CACHE, expected, lease, persistent_with_disk, scene};

const MESHES: [&[u8]; 2] = [b"mesh of a teapot", b"mesh of a cup"];

/// Runs a worker for one frame, and returns the assets that it requested from its master.
async fn run_worker(folder: &Path, limit_bytes: u64) -> Vec<AssetId> {
    let body = scene(1, &MESHES);
    let assets = [&body, MESHES[0], MESHES[1]];
    let mut master = FakeMaster::start(persistent_with_disk(folder, limit_bytes), &assets);
    master.announce(0, &body, b"v").await;
    master.send(ToWorker::Segment(lease(0, 0..8))).await;
    assert_eq!(master.receive_pixels().await.1, expected(&body, b"v", 0..8));
    let requests = std::mem::take(&mut master.requests);
    let (_, worker) = master.close().await;
    worker.disk.unwrap().finish().await;
    requests
}

#[tokio::test]
async fn no_asset_is_requested_twice() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(run_worker(folder.path(), LARGE_CACHE).await.len(), 3);
    for _ in 0..2 {
        assert_eq!(run_worker(folder.path(), LARGE_CACHE).await, []);
    }
}

#[tokio::test]
async fn a_damaged_file_is_fetched_again() {
    let folder = tempfile::tempdir().unwrap();
    run_worker(folder.path(), LARGE_CACHE).await;
    let mesh = AssetId::of(MESHES[1]);
    for damage in [b"mesh of a cap".as_slice(), b"", &[b'm'; 100_000]] {
        std::fs::write(folder.path().join(mesh.to_string()), damage).unwrap();
        assert_eq!(run_worker(folder.path(), LARGE_CACHE).await, [mesh]);
        assert_eq!(run_worker(folder.path(), LARGE_CACHE).await, []);
    }
    // A file larger than the memory cache does not make the worker refuse the scene.
    let file = std::fs::File::create(folder.path().join(mesh.to_string())).unwrap();
    file.set_len(1 << 40).unwrap();
    assert_eq!(run_worker(folder.path(), LARGE_CACHE).await, [mesh]);
    assert_eq!(run_worker(folder.path(), LARGE_CACHE).await, []);
}

#[tokio::test]
async fn a_full_disk_and_an_impossible_folder_are_no_errors() {
    let folder = tempfile::tempdir().unwrap();
    for _ in 0..2 {
        assert_eq!(run_worker(folder.path(), 0).await.len(), 3);
    }
    let file = folder.path().join("file");
    std::fs::write(&file, "no folder").unwrap();
    assert_eq!(run_worker(&file, LARGE_CACHE).await.len(), 3);
}

#[tokio::test]
async fn concurrent_workers_share_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    tokio::join!(
        run_worker(folder.path(), LARGE_CACHE),
        run_worker(folder.path(), LARGE_CACHE),
        run_worker(folder.path(), LARGE_CACHE)
    );
    assert_eq!(run_worker(folder.path(), LARGE_CACHE).await, []);
}
