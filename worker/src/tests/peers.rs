//! Tests of assets between workers over 127.0.0.1, with masters that send every message at a defined time.

use std::net::SocketAddr;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use rayfarm_protocol::limits::MAX_CHUNK_BYTES;
use rayfarm_protocol::peer::{PeerReply, PeerRequest, ShareKey, Token};
use rayfarm_protocol::peer::{receive_reply, receive_request, send_reply, send_request};
use rayfarm_protocol::transport::WorkerSecurity;
use rayfarm_protocol::{AssetId, ToMaster, ToWorker};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinHandle;

use super::{FakeMaster, LARGE_CACHE, expected, lease, persistent, scene};
use crate::peer::{PartialAsset, PeerCache, PeerClient, PeerServer, serve_peers};

pub(super) const KEY: ShareKey = ShareKey([8; 32]);

/// Time limit of each wait, far above what it takes.
const TEST_LIMIT: Duration = Duration::from_secs(60);

pub(super) async fn within_limit<T>(work: impl Future<Output = T>) -> T {
    tokio::time::timeout(TEST_LIMIT, work).await.expect("the test's time limit is over")
}

/// A mesh of several chunks.
pub(super) fn mesh() -> Vec<u8> {
    b"mesh".iter().copied().chain((0..3 * MAX_CHUNK_BYTES + 1234).map(|n| ((n * n) >> 3) as u8)).collect()
}

/// Starts a peer server, which runs until the task is aborted.
pub(super) async fn start_server(security: WorkerSecurity) -> (PeerServer, SocketAddr, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let cache = Arc::new(PeerCache::default());
    let task = tokio::spawn(serve_peers(listener, Arc::clone(&cache), security));
    (PeerServer { port: address.port(), cache }, address, task)
}

/// Starts a worker with a peer server. Its master has sent a key and announced a frame with this mesh.
async fn start_worker(body: &[u8], mesh: &[u8]) -> (FakeMaster, SocketAddr, JoinHandle<()>) {
    let (server, address, task) = start_server(WorkerSecurity::Plain).await;
    let client = PeerClient { security: WorkerSecurity::Plain, within_machine: true };
    let worker = persistent(1, LARGE_CACHE).0;
    let mut master = FakeMaster::start_with_peers(worker, &[body, mesh], Some(server), client);
    let port = address.port();
    assert_eq!(within_limit(master.receive()).await, Some(ToMaster::Sharing { port }));
    master.send(ToWorker::ShareKey { key: KEY, generation: 0 }).await;
    announce_frame(&mut master, body, mesh).await;
    (master, address, task)
}

/// Announces a frame. The worker has requested the mesh when this returns.
async fn announce_frame(master: &mut FakeMaster, body: &[u8], mesh: &[u8]) {
    master.announce(1, body, b"v").await;
    master.send(ToWorker::Segment(lease(1, 0..8))).await;
    let id = AssetId::of(body);
    assert_eq!(within_limit(master.receive_request()).await, (id, 0, false));
    master.send_asset(id, 0).await;
    assert_eq!(within_limit(master.receive_request()).await, (AssetId::of(mesh), 0, false));
}

/// A listener that accepts requests of workers and answers them with keepalives only.
async fn start_stalling_peer() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    tokio::spawn(async move {
        while let Ok((mut stream, _)) = listener.accept().await {
            tokio::spawn(async move {
                let id = receive_request(&mut stream).await.unwrap().id;
                while send_reply(&mut stream, id, PeerReply::Waiting { hops: 1 }).await.is_ok() {
                    tokio::time::sleep(Duration::from_millis(500)).await;
                }
            });
        }
    });
    address
}

async fn send_range(master: &FakeMaster, mesh: &[u8], range: Range<usize>) {
    let id = AssetId::of(mesh);
    let mut offset = range.start;
    for chunk in mesh[range].chunks(100_000) {
        let bytes = Bytes::copy_from_slice(chunk);
        master.send(ToWorker::AssetChunk { id, offset: offset as u64, bytes }).await;
        offset += chunk.len();
    }
}

/// Starts a worker whose master refers it to the worker at `peer` for the mesh.
async fn start_client(
    body: &[u8],
    mesh: &[u8],
    peer: SocketAddr,
    key: &ShareKey,
) -> (FakeMaster, SocketAddr, JoinHandle<()>) {
    let (master, address, task) = start_worker(body, mesh).await;
    let (id, size) = (AssetId::of(mesh), mesh.len() as u64);
    let token = Token::new(key, id, None, 0);
    master.send(ToWorker::AssetFrom { id, size, peer, peer_key: None, token }).await;
    (master, address, task)
}

/// Requests an asset from a worker, repeatedly until the transfer begins.
async fn begin_transfer(address: SocketAddr, id: AssetId) -> TcpStream {
    loop {
        let mut stream = TcpStream::connect(address).await.unwrap();
        let request = PeerRequest { id, token: Token::new(&KEY, id, None, 0), offset: 0 };
        send_request(&mut stream, &request).await.unwrap();
        loop {
            match within_limit(receive_reply(&mut stream, id)).await.unwrap() {
                PeerReply::Begin { .. } => return stream,
                PeerReply::Waiting { .. } => {}
                PeerReply::Unknown => break,
                other => panic!("{other:?}"),
            }
        }
    }
}

/// Receives chunks until `count` bytes have arrived.
async fn receive_bytes(stream: &mut TcpStream, id: AssetId, received: &mut Vec<u8>, count: usize) {
    while received.len() < count {
        match within_limit(receive_reply(stream, id)).await.unwrap() {
            PeerReply::Chunk { offset, bytes } => {
                assert_eq!(offset, received.len() as u64);
                received.extend_from_slice(&bytes);
            }
            PeerReply::Waiting { .. } => {}
            other => panic!("{other:?}"),
        }
    }
}

async fn expect_arrival_and_pixels(master: &mut FakeMaster, body: &[u8], id: AssetId) {
    assert_eq!(within_limit(master.receive()).await, Some(ToMaster::HaveAsset { id }));
    assert_eq!(within_limit(master.receive_pixels()).await.1, expected(body, b"v", 0..8));
}

#[tokio::test]
async fn chunks_are_served_while_more_arrive() {
    let mesh = mesh();
    let body = scene(1, &[&mesh]);
    let id = AssetId::of(&mesh);
    let (mut first, address, _first) = start_worker(&body, &mesh).await;
    first.send(ToWorker::AssetBegin { id, size: mesh.len() as u64 }).await;
    send_range(&first, &mesh, 0..2 * MAX_CHUNK_BYTES + 5).await;
    begin_transfer(address, id).await;
    // The second worker receives from the first, and this test from the second, before either has the whole mesh.
    let (mut second, address, _second) = start_client(&body, &mesh, address, &KEY).await;
    let (mut stream, mut received) = (begin_transfer(address, id).await, Vec::new());
    receive_bytes(&mut stream, id, &mut received, 2 * MAX_CHUNK_BYTES).await;
    send_range(&first, &mesh, 2 * MAX_CHUNK_BYTES + 5..mesh.len()).await;
    receive_bytes(&mut stream, id, &mut received, mesh.len()).await;
    assert!(received == mesh);
    for master in [&mut first, &mut second] {
        expect_arrival_and_pixels(master, &body, id).await;
    }
}

#[tokio::test]
async fn a_request_before_the_first_byte_waits_for_it() {
    let mesh = mesh();
    let body = scene(1, &[&mesh]);
    let id = AssetId::of(&mesh);
    let (mut first, address, _first) = start_worker(&body, &mesh).await;
    let mut stream = TcpStream::connect(address).await.unwrap();
    let request = PeerRequest { id, token: Token::new(&KEY, id, None, 0), offset: 0 };
    send_request(&mut stream, &request).await.unwrap();
    assert_eq!(within_limit(receive_reply(&mut stream, id)).await.unwrap(), PeerReply::Waiting { hops: 1 });
    let (mut second, ..) = start_client(&body, &mesh, address, &KEY).await;
    first.send_asset(id, 0).await;
    for master in [&mut first, &mut second] {
        expect_arrival_and_pixels(master, &body, id).await;
    }
}

#[tokio::test]
async fn after_the_loss_of_a_peer_the_master_sends_the_rest() {
    let mesh = mesh();
    let body = scene(1, &[&mesh]);
    let id = AssetId::of(&mesh);
    let (first, address, task) = start_worker(&body, &mesh).await;
    first.send(ToWorker::AssetBegin { id, size: mesh.len() as u64 }).await;
    send_range(&first, &mesh, 0..MAX_CHUNK_BYTES + 7).await;
    begin_transfer(address, id).await;
    let (mut second, address, _second) = start_client(&body, &mesh, address, &KEY).await;
    let (mut third, address, _third) = start_client(&body, &mesh, address, &KEY).await;
    let (mut stream, mut received) = (begin_transfer(address, id).await, Vec::new());
    receive_bytes(&mut stream, id, &mut received, MAX_CHUNK_BYTES).await;
    // The first worker ends in the middle. The second requests the rest; the third keeps receiving from the second.
    task.abort();
    drop(first);
    assert_eq!(within_limit(second.receive_request()).await, (id, MAX_CHUNK_BYTES as u64, true));
    second.send_asset(id, MAX_CHUNK_BYTES as u64).await;
    receive_bytes(&mut stream, id, &mut received, mesh.len()).await;
    assert!(received == mesh);
    for master in [&mut second, &mut third] {
        expect_arrival_and_pixels(master, &body, id).await;
    }
}

#[tokio::test]
async fn wrong_bytes_tokens_and_addresses_lead_to_a_transfer_from_the_master() {
    let mesh = mesh();
    let body = scene(1, &[&mesh]);
    let id = AssetId::of(&mesh);
    let (server, address, _task) = start_server(WorkerSecurity::Plain).await;
    server.cache.set_key(0, KEY);
    let wrong_bytes = PartialAsset::new(mesh.len()).unwrap();
    wrong_bytes.append(&vec![1; mesh.len()]);
    wrong_bytes.finish().unwrap();
    server.cache.insert(id, wrong_bytes);
    let closed = TcpListener::bind("127.0.0.1:0").await.unwrap().local_addr().unwrap();
    let (service, group) = ([127, 0, 0, 1], [224, 0, 0, 251]);
    for (peer, key) in [
        (address, KEY),
        (address, ShareKey([9; 32])),
        (closed, KEY),
        ((service, 80).into(), KEY),
        ((group, 7200).into(), KEY),
    ] {
        let (mut master, ..) = start_client(&body, &mesh, peer, &key).await;
        assert_eq!(within_limit(master.receive_request()).await, (id, 0, true), "{peer} {key:?}");
        master.send_asset(id, 0).await;
        expect_arrival_and_pixels(&mut master, &body, id).await;
    }
}

#[tokio::test]
async fn a_peer_that_only_sends_keepalives_delays_an_asset_by_seconds() {
    let mesh = mesh();
    let body = scene(1, &[&mesh]);
    let id = AssetId::of(&mesh);
    let peer = start_stalling_peer().await;
    let begun = std::time::Instant::now();
    let (mut master, ..) = start_client(&body, &mesh, peer, &KEY).await;
    assert_eq!(within_limit(master.receive_request()).await, (id, 0, true));
    assert!(begun.elapsed() < Duration::from_secs(10), "{:?}", begun.elapsed());
    master.send_asset(id, 0).await;
    expect_arrival_and_pixels(&mut master, &body, id).await;
}

#[tokio::test]
async fn idle_connections_to_a_peer_server_keep_no_worker_out() {
    let (server, address, _task) = start_server(WorkerSecurity::Plain).await;
    server.cache.set_key(0, KEY);
    let mesh = mesh();
    let (id, asset) = (AssetId::of(&mesh), PartialAsset::new(mesh.len()).unwrap());
    asset.append(&mesh);
    asset.finish().unwrap();
    server.cache.insert(id, asset);
    let mut idle = Vec::new();
    for _ in 0..200 {
        idle.push(TcpStream::connect(address).await.unwrap());
    }
    // Wrong tokens take no place of a transfer either.
    let wrong = PeerRequest { id, token: Token::new(&ShareKey([1; 32]), id, None, 0), offset: 0 };
    for stream in idle.iter_mut().rev().take(10) {
        let _ = send_request(stream, &wrong).await;
    }
    let begun = std::time::Instant::now();
    let (mut stream, mut received) = (begin_transfer(address, id).await, Vec::new());
    receive_bytes(&mut stream, id, &mut received, mesh.len()).await;
    assert!(received == mesh);
    // Without places that new connections take over, it waits for a deadline of one second for each eight connections.
    assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed());
}
