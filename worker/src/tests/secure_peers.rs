//! Tests of assets between workers through TLS, of stolen tokens, and of connections that keep others out.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use rayfarm_protocol::limits::{MAX_CHUNK_BYTES, MAX_PEER_CLIENTS};
use rayfarm_protocol::peer::{PeerReply, PeerRequest, ShareKey, Token, receive_reply, send_request};
use rayfarm_protocol::transport::{JoinToken, PrivateKey, WorkerSecurity};
use rayfarm_protocol::{AssetId, KeyHash};
use tokio::io::AsyncReadExt;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;

use super::peers::{KEY, mesh, start_server, within_limit};
use crate::peer::{Fetch, PartialAsset, PeerClient, PeerEvent, PeerServer, PeerSource};

/// Security of a worker with a new key, and the hash of the key.
fn new_worker() -> (WorkerSecurity, KeyHash) {
    let key = Arc::new(PrivateKey::generate().unwrap());
    let hash = key.hash();
    (WorkerSecurity::Tls { key, master: KeyHash([0; 32]), token: JoinToken([0; 16]) }, hash)
}

fn client(security: &WorkerSecurity) -> PeerClient {
    PeerClient { security: security.clone(), within_machine: true }
}

/// Inserts a complete asset, and sets the key of generation 0.
fn fill(server: &PeerServer, bytes: &[u8]) -> AssetId {
    let (id, asset) = (AssetId::of(bytes), PartialAsset::new(bytes.len()).unwrap());
    asset.append(bytes);
    asset.finish().unwrap();
    server.cache.set_key(0, KEY);
    server.cache.insert(id, asset);
    id
}

/// Fetches an asset of the length of [`mesh`].
async fn fetch(client: &PeerClient, id: AssetId, source: PeerSource) -> Result<Vec<u8>, String> {
    let (events, mut received) = mpsc::channel(4);
    let fetch = Fetch { id, size: mesh().len() as u64, source };
    tokio::spawn(client.clone().fetch(fetch, Arc::default(), events));
    let mut fetched = Vec::new();
    while let Some(event) = within_limit(received.recv()).await {
        match event {
            PeerEvent::Chunk { offset, bytes, .. } => {
                assert_eq!(offset, fetched.len() as u64);
                fetched.extend_from_slice(&bytes);
            }
            PeerEvent::Failed { why, .. } => return Err(why),
        }
    }
    Ok(fetched)
}

#[tokio::test]
async fn a_stolen_token_is_useless_with_another_key() {
    let ((server_security, server_key), (owner, owner_key)) = (new_worker(), new_worker());
    let (server, address, _task) = start_server(server_security).await;
    let mesh = mesh();
    let id = fill(&server, &mesh);
    let token = Token::new(&KEY, id, Some(owner_key), 0);
    let source = PeerSource { address, key: Some(server_key), token };
    assert!(fetch(&client(&owner), id, source).await.unwrap() == mesh);

    let (thief, thief_key) = new_worker();
    let why = fetch(&client(&thief), id, source).await.unwrap_err();
    assert!(why.contains("does not have the asset"), "{why}");
    // A worker without TLS, with the token, and with one that names no key.
    for token in [token, Token::new(&KEY, id, None, 0)] {
        let plain = PeerSource { address, key: None, token };
        assert!(fetch(&client(&WorkerSecurity::Plain), id, plain).await.is_err());
        let unbound = PeerSource { token, ..source };
        assert!(fetch(&client(&thief), id, unbound).await.is_err());
    }
    let own = PeerSource { token: Token::new(&KEY, id, Some(thief_key), 0), ..source };
    assert!(fetch(&client(&thief), id, own).await.unwrap() == mesh, "a token of its own is valid");
}

#[tokio::test]
async fn a_token_ends_with_the_second_key_after_its_own() {
    let ((server_security, server_key), (owner, owner_key)) = (new_worker(), new_worker());
    let (server, address, _task) = start_server(server_security).await;
    let mesh = mesh();
    let id = fill(&server, &mesh);
    let key = |generation: u64| if generation == 0 { KEY } else { ShareKey([generation as u8; 32]) };
    let of = |generation| {
        let token = Token::new(&key(generation), id, Some(owner_key), generation);
        PeerSource { address, key: Some(server_key), token }
    };
    for generation in 1..4 {
        server.cache.set_key(generation, key(generation));
        for (token, is_valid) in [(generation, true), (generation - 1, true), (generation + 1, false)] {
            let fetched = fetch(&client(&owner), id, of(token)).await;
            assert_eq!(fetched.is_ok(), is_valid, "token {token} in generation {generation}");
        }
        for old in 0..generation - 1 {
            let why = fetch(&client(&owner), id, of(old)).await.unwrap_err();
            assert!(why.contains("does not have the asset"), "{why}");
        }
    }
}

#[tokio::test]
async fn a_server_with_another_key_gets_no_request() {
    let ((server_security, server_key), (owner, owner_key), (_, expected)) =
        (new_worker(), new_worker(), new_worker());
    let (server, address, _task) = start_server(server_security).await;
    let id = fill(&server, &mesh());
    let token = Token::new(&KEY, id, Some(owner_key), 0);
    let other = PeerSource { address, key: Some(expected), token };
    let why = fetch(&client(&owner), id, other).await.unwrap_err();
    assert!(why.contains(&server_key.short()) && why.contains(&expected.short()), "{why}");
    // Neither side falls back to a connection without TLS.
    let unnamed = PeerSource { key: None, ..other };
    let why = fetch(&client(&owner), id, unnamed).await.unwrap_err();
    assert!(why.contains("names no key"), "{why}");
    let named = PeerSource { key: Some(server_key), ..other };
    assert!(fetch(&client(&WorkerSecurity::Plain), id, named).await.is_err());
}

#[tokio::test]
async fn a_master_of_another_machine_names_no_service_of_this_one() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let remote = PeerClient { security: WorkerSecurity::Plain, within_machine: false };
    let source = PeerSource { address, key: None, token: Token([0; 32]) };
    let why = fetch(&remote, AssetId([1; 32]), source).await.unwrap_err();
    assert!(why.contains("on this machine"), "{why}");
    assert!(tokio::time::timeout(Duration::from_millis(50), listener.accept()).await.is_err());
}

#[tokio::test]
async fn idle_connections_keep_no_worker_out() {
    let ((server_security, server_key), (owner, owner_key)) = (new_worker(), new_worker());
    let (server, address, _task) = start_server(server_security).await;
    let mesh = mesh();
    let id = fill(&server, &mesh);
    let mut idle = Vec::new();
    for _ in 0..200 {
        idle.push(TcpStream::connect(address).await.unwrap());
    }
    let begun = std::time::Instant::now();
    let source =
        PeerSource { address, key: Some(server_key), token: Token::new(&KEY, id, Some(owner_key), 0) };
    assert!(fetch(&client(&owner), id, source).await.unwrap() == mesh);
    // Without places that newer connections take over, it would wait for the deadline of the idle ones.
    assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed());
    // All idle connections are closed after a second, without a byte.
    for mut stream in idle {
        assert_eq!(within_limit(stream.read(&mut [0; 8])).await.unwrap_or(0), 0);
    }
}

async fn request(address: SocketAddr, id: AssetId) -> TcpStream {
    let mut stream = TcpStream::connect(address).await.unwrap();
    let request = PeerRequest { id, token: Token::new(&KEY, id, None, 0), offset: 0 };
    send_request(&mut stream, &request).await.unwrap();
    stream
}

#[tokio::test]
async fn transfers_above_the_limit_wait_with_keepalives() {
    let (server, address, _task) = start_server(WorkerSecurity::Plain).await;
    let id = AssetId([7; 32]);
    let asset = PartialAsset::new(MAX_CHUNK_BYTES).unwrap();
    server.cache.set_key(0, KEY);
    server.cache.insert(id, Arc::clone(&asset));
    let mut served = Vec::new();
    for _ in 0..MAX_PEER_CLIENTS {
        let mut stream = request(address, id).await;
        let first = within_limit(receive_reply(&mut stream, id)).await.unwrap();
        assert_eq!(first, PeerReply::Begin { size: MAX_CHUNK_BYTES as u64 });
        served.push(stream);
    }
    let mut waiting = request(address, id).await;
    assert_eq!(within_limit(receive_reply(&mut waiting, id)).await.unwrap(), PeerReply::Waiting { hops: 1 });
    asset.append(&vec![1; MAX_CHUNK_BYTES]);
    asset.finish().unwrap();
    served.push(waiting);
    for mut stream in served {
        loop {
            match within_limit(receive_reply(&mut stream, id)).await.unwrap() {
                PeerReply::Waiting { .. } | PeerReply::Begin { .. } => {}
                PeerReply::Chunk { offset, bytes } => {
                    assert_eq!((offset, bytes.len()), (0, MAX_CHUNK_BYTES));
                    break;
                }
                PeerReply::Unknown => panic!("the asset is there"),
            }
        }
    }
}
