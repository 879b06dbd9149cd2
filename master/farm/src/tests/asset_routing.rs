//! Real workers in this process, over 127.0.0.1, that pass a large asset on to each other, without TLS and with it.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use rayfarm_protocol::transport::{JoinToken, MasterSecurity, MasterTrust, PrivateKey, WorkerSecurity};
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::scene::{Filter, Scene, TextureMap};
use rayfarm_tracer::texture::Texture;
use rayfarm_worker::{Share, ShutdownHandle, WorkerOptions};

use crate::farm::Farm;
use crate::farm_scene::FarmScene;
use crate::options::FarmOptions;
use crate::testing::test_scene::{scene, view};
use rayfarm_scheduler::SegmentPolicy;

/// Time limit of the test.
const TIMEOUT: Duration = Duration::from_secs(120);
const WORKERS: usize = 4;

/// A texture of several chunks that does not compress.
fn texture() -> Arc<Texture> {
    let (width, height) = (1400, 1000);
    let noise = (0..width * height * 3).map(|n: u32| (n.wrapping_mul(2_654_435_761) >> 13) as u8);
    Arc::new(Texture::new(&RgbImage { width, height, pixels: noise.collect() }).unwrap())
}

fn options(master: SocketAddr, share: Share, security: WorkerSecurity) -> WorkerOptions {
    WorkerOptions {
        master: master.to_string(),
        threads: Some(1),
        name: "worker".to_owned(),
        once: false,
        tags: Vec::new(),
        max_segment_bytes: None,
        reconnect: false,
        asset_cache_bytes: 1 << 28,
        disk_cache: None,
        compress: None,
        share,
        security,
    }
}

/// Bytes of scene that the master sends until each worker has rendered a segment. `trust`: with TLS.
async fn sent_until_all_render(share: Share, trust: Option<Arc<MasterTrust>>) -> u64 {
    let texture = texture();
    let maps = vec![TextureMap::new(texture.id(), Filter::Nearest)];
    let scene = Scene { textures: maps, ..scene() };
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let security = trust.clone().map(MasterSecurity::Tls).unwrap_or_default();
    let policy = SegmentPolicy::Static(4);
    let farm = FarmOptions { listen, policy, security, ..FarmOptions::default() };
    let drawn = FarmScene { scene, meshes: Vec::new(), textures: vec![texture] };
    let mut farm = Farm::start(farm, drawn).await.unwrap();
    let ending = ShutdownHandle::new();
    let security = || match &trust {
        Some(trust) => {
            let key = Arc::new(PrivateKey::generate().unwrap());
            WorkerSecurity::join(key, &trust.join_line(farm.address().to_string()))
        }
        None => WorkerSecurity::Plain,
    };
    let workers: Vec<_> = (0..WORKERS)
        .map(|_| {
            let options = options(farm.address(), share, security());
            tokio::spawn(rayfarm_worker::run(options, ending.clone()))
        })
        .collect();
    while farm.status().workers.len() < WORKERS {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    // Workers that serve assets already get two more keys.
    farm.renew_share_keys();
    farm.renew_share_keys();
    let mut sent = 0;
    while farm.status().workers.iter().any(|worker| worker.segments_done == 0) {
        farm.request(view());
        sent += farm.finished().await.unwrap().scene_bytes;
    }
    ending.stop();
    for worker in workers {
        worker.await.unwrap().unwrap();
    }
    farm.shut_down().await;
    sent
}

fn trust() -> Arc<MasterTrust> {
    Arc::new(MasterTrust::new(PrivateKey::generate().unwrap(), JoinToken::random().unwrap()))
}

#[tokio::test]
async fn the_master_sends_a_large_asset_about_once() {
    let size = texture().bytes().len() as u64;
    assert!(size > 4_000_000);
    let place = Share::At(SocketAddr::from(([127, 0, 0, 1], 0)));
    for trust in [None, Some(trust())] {
        let sent = sent_until_all_render(place, trust.clone());
        let passed_on = tokio::time::timeout(TIMEOUT, sent).await.unwrap();
        assert!((size..2 * size).contains(&passed_on), "{passed_on} bytes of {size}, {trust:?}");
    }
    let alone = tokio::time::timeout(TIMEOUT, sent_until_all_render(Share::Off, None)).await.unwrap();
    assert!(alone >= WORKERS as u64 * size, "{alone} bytes of {size}");
}
