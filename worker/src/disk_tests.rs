//! Workers that are started anew find on the disk what earlier ones have fetched.

use std::path::Path;

use rayfarm_protocol::{AssetId, ToWorker};

use crate::testing::{Master, expected, keep_with_disk, lease, scene};

const MESHES: [&[u8]; 2] = [b"mesh of a teapot", b"mesh of a cup"];
const PLENTY: u64 = 1 << 20;

/// A worker's life: it renders a frame and ends. What it asked its master for.
async fn live(folder: &Path, limit_bytes: u64) -> Vec<AssetId> {
    let body = scene(1, &MESHES);
    let assets = [&body, MESHES[0], MESHES[1]];
    let mut master = Master::meet(keep_with_disk(folder, limit_bytes), &assets);
    master.announce(0, &body, b"v").await;
    master.say(ToWorker::Segment(lease(0, 0..8))).await;
    assert_eq!(master.pixels().await.1, expected(&body, b"v", 0..8));
    let asked = std::mem::take(&mut master.asked);
    let (_, kept) = master.part().await;
    kept.disk.unwrap().finish().await;
    asked
}

#[tokio::test]
async fn no_asset_travels_twice() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(live(folder.path(), PLENTY).await.len(), 3);
    for _ in 0..2 {
        assert_eq!(live(folder.path(), PLENTY).await, []);
    }
}

#[tokio::test]
async fn what_is_damaged_on_the_disk_is_fetched_again() {
    let folder = tempfile::tempdir().unwrap();
    live(folder.path(), PLENTY).await;
    let victim = AssetId::of(MESHES[1]);
    for damage in [b"mesh of a cap".as_slice(), b"", &[b'm'; 100_000]] {
        std::fs::write(folder.path().join(victim.to_string()), damage).unwrap();
        assert_eq!(live(folder.path(), PLENTY).await, [victim]);
        assert_eq!(live(folder.path(), PLENTY).await, []);
    }
    // A file that claims more than this worker keeps is no reason to refuse the scene.
    let file = std::fs::File::create(folder.path().join(victim.to_string())).unwrap();
    file.set_len(1 << 40).unwrap();
    assert_eq!(live(folder.path(), PLENTY).await, [victim]);
    assert_eq!(live(folder.path(), PLENTY).await, []);
}

#[tokio::test]
async fn a_disk_without_room_or_without_a_folder_harms_nobody() {
    let folder = tempfile::tempdir().unwrap();
    for _ in 0..2 {
        assert_eq!(live(folder.path(), 0).await.len(), 3);
    }
    let file = folder.path().join("file");
    std::fs::write(&file, "in the way").unwrap();
    assert_eq!(live(&file, PLENTY).await.len(), 3);
}

#[tokio::test]
async fn workers_may_share_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    tokio::join!(live(folder.path(), PLENTY), live(folder.path(), PLENTY), live(folder.path(), PLENTY));
    assert_eq!(live(folder.path(), PLENTY).await, []);
}
