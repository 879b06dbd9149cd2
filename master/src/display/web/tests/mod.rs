//! The server over a farm with a scripted worker: requests and WebSockets as bytes.

mod client;
mod requests;
mod sockets;

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use rayfarm_farm::testing::fake_worker::{self, Script};
use rayfarm_farm::testing::test_scene::{scene, view};
use rayfarm_farm::{Farm, FarmOptions, FarmScene, ViewRequest};
use rayfarm_protocol::transport::JoinToken;
use rayfarm_tracer::scene::RenderScale;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use super::access::Access;
use super::commands::Commands;
use super::shared::Shared;
use super::{WebDisplay, WebSecurity, routes, server};
use crate::display::SceneInfo;
use crate::viewer::orbit::Animation;
use crate::viewer::{CameraControl, RequestPolicy, Viewer, ViewerConfig, ViewerHandle};

/// Far beyond what any of these tests takes.
const PATIENCE: Duration = Duration::from_secs(60);
const TOKEN: JoinToken = JoinToken([0x5a; 16]);
const STILL: Animation = Animation { orbit: 0.0, spin: 0.0, frames: 1 };

/// A running server over a viewer.
struct Served {
    address: SocketAddr,
    shared: Arc<Shared>,
    viewer: ViewerHandle,
    stop: CancellationToken,
    tasks: [JoinHandle<()>; 2],
}

impl Served {
    /// A server on loopback whose rules are those of `listening`.
    async fn start(listening: &str) -> Self {
        let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
        let options = FarmOptions { listen, ..FarmOptions::default() };
        let scene = FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() };
        let farm = Farm::start(options, scene).await.unwrap();
        fake_worker::start(farm.address(), Script::Correct).await;
        let config = ViewerConfig {
            request: ViewRequest { view: view(), scale: RenderScale::Full },
            camera: CameraControl::new(view().camera, None),
            policy: RequestPolicy { animation: STILL, limit: None, continuous: false },
            log: None,
            controller: None,
            denoised: false,
        };
        let (viewer, handle) = Viewer::interactive(farm, config);
        let (stop, stopped) = (CancellationToken::new(), CancellationToken::new());
        let (viewer_stop, server_stop) = (stop.clone(), stopped.clone());
        let rendering = tokio::spawn(async move {
            let (farm, result) = viewer.run(&viewer_stop).await;
            result.unwrap();
            farm.shut_down().await;
            server_stop.cancel();
        });
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let access = Access::new(TOKEN, listening.parse().unwrap(), false, &[]);
        let info = SceneInfo { name: "a scene".to_owned(), triangles: 3, local_workers: 0 };
        let execute = |line: &str| match line {
            "wrong" => "{\"ok\":false,\"error\":\"wrong\"}\n".to_owned(),
            line => format!("{{\"ok\":true,\"line\":\"{line}\"}}\n"),
        };
        let shared = Shared::new(handle.clone(), access, Commands::new(Arc::new(execute)), &info);
        let router = routes::router(shared.clone());
        let (state, viewer) = (shared.clone(), handle.clone());
        let serving = tokio::spawn(async move {
            tokio::select! {
                () = server::serve(listener, None, router, stopped.cancelled()) => {}
                () = state.audience.report(&viewer) => {}
                () = state.publish() => {}
            }
        });
        Self { address, shared, viewer: handle, stop, tasks: [rendering, serving] }
    }

    async fn end(self) {
        self.stop.cancel();
        for task in self.tasks {
            tokio::time::timeout(PATIENCE, task).await.expect("a task goes on").unwrap();
        }
    }
}

#[tokio::test]
async fn an_address_in_use_is_reported_with_a_remedy() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let security = || WebSecurity { token: TOKEN, acceptor: None, names: Vec::new() };
    let info = SceneInfo { name: String::new(), triangles: 0, local_workers: 0 };
    let open = |address| WebDisplay::open(address, security(), info.clone());
    let problem = open(taken.local_addr().unwrap()).err().unwrap();
    assert!(problem.contains("--web"), "{problem}");
    let display = open("127.0.0.1:0".parse().unwrap()).unwrap();
    assert_ne!(display.address.port(), 0);
    let url = super::urls(display.address, &display.access()).remove(0);
    assert_eq!(url, format!("http://{}/?token={TOKEN}", display.address));
}
