//! A render node of rayfarm: it connects to a master, fetches scenes, and traces the rows of its leases with all cores.
//!
//! From the connection to the pixels:
//!
//! 1. `app` connects, performs the handshake, and reconnects after a failure.
//! 2. `session` has the state machine of a session (`state`: messages in, effects out, no socket, no thread, no clock)
//!    and the runner that performs its effects. `frames` queues the leases of a frame until the frame is ready.
//! 3. `scenes` loads a scene by the hash of its body: assets come from memory, from the disk, from the master or from
//!    another worker, and are decoded and compiled on threads of their own.
//! 4. `peer` transfers assets between workers.
//! 5. `render_pool` cuts leases into bands, renders and encodes them, and sends finished leases as pixels.
//!
//! A [`Renderer`] decodes scenes and renders rows. [`TracerRenderer`] is the one of `rayfarm_tracer`; tests have another.
//! Folders depend on each other in one direction: app, session, scenes and render pool, peer.
//!
//! # Example
//!
//! A worker in the caller's process, which ends with its master:
//!
//! ```
//! use rayfarm_worker::{ShutdownHandle, Share, WorkerOptions, run};
//! # use rayfarm_protocol::{Reconnect, ToMaster, ToWorker, Welcome, handshake, session};
//!
//! # #[tokio::main]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await?;
//! # let address = listener.local_addr()?;
//! # tokio::spawn(async move {
//! #     let (mut stream, _) = listener.accept().await.unwrap();
//! #     handshake::as_master(&mut stream, &rayfarm_protocol::transport::MasterSecurity::Plain, |_, _| Ok(Welcome { worker: 1 })).await.unwrap();
//! #     let (sender, _receiver, _) = session::spawn::<_, ToWorker, ToMaster>(stream);
//! #     let disconnect = ToWorker::Disconnect { reason: "done".into(), reconnect: Reconnect::Never };
//! #     sender.send(disconnect).await.unwrap();
//! #     std::future::pending::<()>().await;
//! # });
//! let options = WorkerOptions {
//!     master: address.to_string(),
//!     threads: None,                // one per core
//!     name: "embedded".to_owned(),
//!     tags: Vec::new(),
//!     max_segment_bytes: None,
//!     reconnect: false,
//!     once: true,
//!     asset_cache_bytes: 1 << 30,
//!     disk_cache: None,
//!     compress: None,
//!     share: Share::Auto,
//!     security: Default::default(),
//! };
//! run(options, ShutdownHandle::new()).await?;
//! # Ok(())
//! # }
//! ```

mod app;
mod cancel;
mod catch_panic;
mod error;
mod peer;
mod progress;
mod render_pool;
mod renderer;
mod scenes;
mod session;
mod shutdown;
#[cfg(test)]
mod tests;
mod tracer;

pub use app::{DiskCacheOptions, Share, WorkerOptions, cli, run, run_with};
pub use error::WorkerError;
pub use renderer::{Cancelled, RayCounts, Renderer};
pub use shutdown::ShutdownHandle;
pub use tracer::TracerRenderer;
