//! Assets from worker to worker, over 127.0.0.1, with masters that say exactly what comes when.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use rayfarm_protocol::limits::MAX_CHUNK_BYTES;
use rayfarm_protocol::peer::{Fetch, Passed, ShareKey, ask, next, token};
use rayfarm_protocol::{AssetId, ToMaster, ToWorker};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinHandle;

use crate::duty::Sharing;
use crate::growing::Growing;
use crate::share::share;
use crate::shelf::Shelf;
use crate::testing::{Master, expected, keep, lease, scene};

const KEY: ShareKey = ShareKey([8; 32]);
const PLENTY: u64 = 64 << 20;
/// Far beyond what any of these tests takes.
const PATIENCE: Duration = Duration::from_secs(60);

async fn patiently<T>(what: impl Future<Output = T>) -> T {
    tokio::time::timeout(PATIENCE, what).await.expect("it never comes to pass")
}

/// A mesh of several chunks.
fn mesh() -> Vec<u8> {
    b"mesh".iter().copied().chain((0..3 * MAX_CHUNK_BYTES + 1234).map(|n| ((n * n) >> 3) as u8)).collect()
}

/// A place where a worker passes on what it has, until the task is aborted.
async fn place() -> (Sharing, SocketAddr, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let shelf = Arc::new(Shelf::default());
    let task = tokio::spawn(share(listener, Arc::clone(&shelf)));
    (Sharing { port: address.port(), shelf }, address, task)
}

/// A worker that passes on, connected to its master, which has given it a key and announced a frame with this mesh.
async fn sharer(body: &[u8], mesh: &[u8]) -> (Master, SocketAddr, JoinHandle<()>) {
    let (sharing, address, task) = place().await;
    let mut master = Master::meet_sharing(keep(1, PLENTY).0, &[body, mesh], Some(sharing));
    let port = address.port();
    assert_eq!(patiently(master.hear()).await, Some(ToMaster::Sharing { port }));
    master.say(ToWorker::ShareKey { key: KEY }).await;
    begin(&mut master, body, mesh).await;
    (master, address, task)
}

/// Announces a frame; the worker has asked for the mesh when this returns.
async fn begin(master: &mut Master, body: &[u8], mesh: &[u8]) {
    master.announce(1, body, b"v").await;
    master.say(ToWorker::Segment(lease(1, 0..8))).await;
    let id = AssetId::of(body);
    assert_eq!(patiently(master.wish()).await, (id, 0, false));
    master.send_asset(id, 0).await;
    assert_eq!(patiently(master.wish()).await, (AssetId::of(mesh), 0, false));
}

async fn send(master: &Master, mesh: &[u8], range: std::ops::Range<usize>) {
    let id = AssetId::of(mesh);
    let mut offset = range.start;
    for part in mesh[range].chunks(100_000) {
        let bytes = Bytes::copy_from_slice(part);
        master.say(ToWorker::AssetChunk { id, offset: offset as u64, bytes }).await;
        offset += part.len();
    }
}

/// A second worker, which is told to get the mesh from that address. Where it passes it on itself.
async fn follower(
    body: &[u8],
    mesh: &[u8],
    peer: SocketAddr,
    key: &ShareKey,
) -> (Master, SocketAddr, JoinHandle<()>) {
    let (master, address, task) = sharer(body, mesh).await;
    let (id, size) = (AssetId::of(mesh), mesh.len() as u64);
    master.say(ToWorker::AssetFrom { id, size, peer, token: token(key, id) }).await;
    (master, address, task)
}

/// Asks a worker for an asset until it has begun to get it.
async fn begun(address: SocketAddr, id: AssetId) -> TcpStream {
    loop {
        let mut stream = TcpStream::connect(address).await.unwrap();
        ask(&mut stream, &Fetch { id, token: token(&KEY, id), offset: 0 }).await.unwrap();
        loop {
            match patiently(next(&mut stream, id)).await.unwrap() {
                Passed::Begin { .. } => return stream,
                Passed::Waits => {}
                Passed::Unknown => break,
                other => panic!("{other:?}"),
            }
        }
    }
}

/// Reads on until so many bytes are here.
async fn read(stream: &mut TcpStream, id: AssetId, got: &mut Vec<u8>, count: usize) {
    while got.len() < count {
        match patiently(next(stream, id)).await.unwrap() {
            Passed::Chunk { offset, bytes } => {
                assert_eq!(offset, got.len() as u64);
                got.extend_from_slice(&bytes);
            }
            Passed::Waits => {}
            other => panic!("{other:?}"),
        }
    }
}

async fn renders(master: &mut Master, body: &[u8]) {
    assert_eq!(patiently(master.pixels()).await.1, expected(body, b"v", 0..8));
}

#[tokio::test]
async fn chunks_are_passed_on_while_more_are_still_to_come() {
    let mesh = mesh();
    let body = scene(1, &[&mesh]);
    let id = AssetId::of(&mesh);
    let (mut first, address, _first) = sharer(&body, &mesh).await;
    first.say(ToWorker::AssetBegin { id, size: mesh.len() as u64 }).await;
    send(&first, &mesh, 0..2 * MAX_CHUNK_BYTES + 5).await;
    begun(address, id).await;
    // The second gets it from the first, and whoever asks the second gets it from there, before any has all of it.
    let (mut second, address, _second) = follower(&body, &mesh, address, &KEY).await;
    let (mut stream, mut got) = (begun(address, id).await, Vec::new());
    read(&mut stream, id, &mut got, 2 * MAX_CHUNK_BYTES).await;
    send(&first, &mesh, 2 * MAX_CHUNK_BYTES + 5..mesh.len()).await;
    read(&mut stream, id, &mut got, mesh.len()).await;
    assert!(got == mesh);
    for master in [&mut first, &mut second] {
        assert_eq!(patiently(master.hear()).await, Some(ToMaster::HaveAsset { id }));
        renders(master, &body).await;
    }
}

#[tokio::test]
async fn who_comes_before_the_first_byte_waits_for_it() {
    let mesh = mesh();
    let body = scene(1, &[&mesh]);
    let id = AssetId::of(&mesh);
    let (mut first, address, _first) = sharer(&body, &mesh).await;
    let mut stream = TcpStream::connect(address).await.unwrap();
    ask(&mut stream, &Fetch { id, token: token(&KEY, id), offset: 0 }).await.unwrap();
    assert_eq!(patiently(next(&mut stream, id)).await.unwrap(), Passed::Waits);
    let (mut second, ..) = follower(&body, &mesh, address, &KEY).await;
    first.send_asset(id, 0).await;
    for master in [&mut first, &mut second] {
        assert_eq!(patiently(master.hear()).await, Some(ToMaster::HaveAsset { id }));
        renders(master, &body).await;
    }
}

#[tokio::test]
async fn who_loses_its_source_gets_the_rest_from_the_master_and_so_do_those_behind_it() {
    let mesh = mesh();
    let body = scene(1, &[&mesh]);
    let id = AssetId::of(&mesh);
    let (first, address, task) = sharer(&body, &mesh).await;
    first.say(ToWorker::AssetBegin { id, size: mesh.len() as u64 }).await;
    send(&first, &mesh, 0..MAX_CHUNK_BYTES + 7).await;
    begun(address, id).await;
    let (mut second, address, _second) = follower(&body, &mesh, address, &KEY).await;
    let (mut third, address, _third) = follower(&body, &mesh, address, &KEY).await;
    let (mut stream, mut got) = (begun(address, id).await, Vec::new());
    read(&mut stream, id, &mut got, MAX_CHUNK_BYTES).await;
    // It dies in the middle. Its master hears from the second how much that has; the third notices nothing.
    task.abort();
    drop(first);
    assert_eq!(patiently(second.wish()).await, (id, MAX_CHUNK_BYTES as u64, true));
    second.send_asset(id, MAX_CHUNK_BYTES as u64).await;
    read(&mut stream, id, &mut got, mesh.len()).await;
    assert!(got == mesh);
    for master in [&mut second, &mut third] {
        assert_eq!(patiently(master.hear()).await, Some(ToMaster::HaveAsset { id }));
        renders(master, &body).await;
    }
}

#[tokio::test]
async fn lies_wrong_tokens_and_closed_doors_cost_a_transfer_from_the_master() {
    let mesh = mesh();
    let body = scene(1, &[&mesh]);
    let id = AssetId::of(&mesh);
    let (sharing, address, _task) = place().await;
    sharing.shelf.set_key(KEY);
    // Other bytes under that name.
    let lie = Growing::new(mesh.len()).unwrap();
    lie.push(&vec![1; mesh.len()]);
    lie.finish().unwrap();
    sharing.shelf.put(id, lie);
    let closed = TcpListener::bind("127.0.0.1:0").await.unwrap().local_addr().unwrap();
    for (peer, key) in [(address, KEY), (address, ShareKey([9; 32])), (closed, KEY)] {
        let (mut master, ..) = follower(&body, &mesh, peer, &key).await;
        assert_eq!(patiently(master.wish()).await, (id, 0, true), "{peer} {key:?}");
        master.send_asset(id, 0).await;
        assert_eq!(patiently(master.hear()).await, Some(ToMaster::HaveAsset { id }));
        renders(&mut master, &body).await;
    }
}
