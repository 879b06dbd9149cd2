//! A farm inside of another program: it listens on 127.0.0.1, a worker of the same process connects, and one frame is
//! rendered and saved.
//!
//! ```sh
//! cargo run --release -p rayfarm-farm --example embed -- models/room.toml room.png
//! ```

use std::error::Error;
use std::net::SocketAddr;
use std::path::PathBuf;

use rayfarm_farm::{Farm, FarmOptions, FarmScene};
use rayfarm_tracer::image::{self, RgbImage};
use rayfarm_tracer::scene::{self, FrameView};
use rayfarm_worker::{Share, ShutdownHandle, WorkerOptions};

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let (Some(input), Some(output)) = (arguments.next(), arguments.next()) else {
        return Err("usage: embed SCENE OUTPUT".into());
    };

    let loaded = scene::load(&input)?;
    let view = FrameView::of(&loaded.scene);
    let scene = FarmScene { scene: loaded.scene, meshes: loaded.meshes, textures: loaded.textures };
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let mut farm = Farm::start(FarmOptions { listen, ..FarmOptions::default() }, scene).await?;
    let worker = tokio::spawn(rayfarm_worker::run(worker_options(farm.address()), ShutdownHandle::new()));

    farm.request(view);
    let frame = farm.finished().await?;
    println!("{} rays in {:?}", frame.counts.primary + frame.counts.shadow, frame.elapsed);
    let picture = RgbImage { width: view.width, height: view.height, pixels: frame.pixels.into_vec() };
    image::save(&output, &picture)?;

    farm.shut_down().await;
    worker.await??;
    Ok(())
}

/// A worker that ends with its master, and keeps no asset on the disk.
fn worker_options(master: SocketAddr) -> WorkerOptions {
    WorkerOptions {
        master: master.to_string(),
        threads: None,
        name: "embedded".to_owned(),
        tags: Vec::new(),
        max_segment_bytes: None,
        reconnect: false,
        once: true,
        asset_cache_bytes: 1 << 30,
        disk_cache: None,
        compress: None,
        share: Share::Off,
        security: Default::default(),
    }
}
