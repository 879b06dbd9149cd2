//! A render node: connects to a master, fetches what it lacks, and traces the rows it is told to with all its cores.
//!
//! The way of a frame through this crate:
//!
//! 1. `client` connects, introduces itself, and comes back when the connection fails.
//! 2. `desk` takes the master's messages and decides what they lead to. It is pure: no socket, no thread, no clock.
//! 3. `scene_loader` fetches a scene by hash (`transfer`), keeps it (`asset_store`), and leaves its assets to later runs (`disk_cache`); `frames` holds the leases of a
//!    frame until it is ready.
//! 4. What comes in may be passed on: `fetch` gets an asset from another worker, `share` gives what is on the `shelf`.
//! 5. `duty` performs what the desk decided: sends, decodes and compiles on blocking threads and the `build_pool`, as long as the
//!    result is `wanted`, and hands out leases.
//! 6. `render_pool` cuts leases into bands (`job_queue`) and renders them; finished leases go back as pixels.
//!
//! What is drawn, and how, is behind [`Renderer`]; the real one is [`TracerRenderer`].
//!
//! # Example
//!
//! A worker in the caller's process, which ends with its master:
//!
//! ```
//! use rayfarm_worker::{Ending, Share, WorkerOptions, run};
//! # use rayfarm_protocol::{Reconnect, ToMaster, ToWorker, Welcome, handshake, session};
//!
//! # #[tokio::main]
//! # async fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await?;
//! # let address = listener.local_addr()?;
//! # tokio::spawn(async move {
//! #     let (mut stream, _) = listener.accept().await.unwrap();
//! #     handshake::as_master(&mut stream, |_| Ok(Welcome { worker: 1 })).await.unwrap();
//! #     let (sender, _receiver, _) = session::spawn::<_, ToWorker, ToMaster>(stream);
//! #     let goodbye = ToWorker::Goodbye { reason: "done".into(), reconnect: Reconnect::Never };
//! #     sender.send(goodbye).await.unwrap();
//! #     std::future::pending::<()>().await;
//! # });
//! let options = WorkerOptions {
//!     master: address.to_string(),
//!     threads: None,                // one per core
//!     name: "embedded".to_owned(),
//!     reconnect: false,
//!     once: true,
//!     asset_cache_bytes: 1 << 30,
//!     disk_cache: None,
//!     compress: None,
//!     share: Share::Auto,
//! };
//! run(options, Ending::new()).await?;
//! # Ok(())
//! # }
//! ```

mod asset_store;
mod buffers;
mod build_pool;
pub mod cli;
mod client;
mod desk;
mod disk_cache;
#[cfg(test)]
mod disk_tests;
mod disk_writer;
mod duty;
#[cfg(test)]
mod duty_tests;
mod ending;
mod error;
mod fetch;
mod frames;
mod growing;
mod guard;
mod job_queue;
mod pause;
mod render_pool;
mod renderer;
mod scene_loader;
mod share;
#[cfg(test)]
mod share_tests;
mod shelf;
mod silence;
#[cfg(test)]
mod testing;
mod tracer;
mod transfer;
mod waiting;
mod wanted;
#[cfg(test)]
mod wanted_tests;

pub use client::{DiskCacheOptions, Share, WorkerOptions, run, run_with};
pub use ending::Ending;
pub use error::WorkerError;
pub use renderer::{Cancelled, Counts, Renderer};
pub use tracer::TracerRenderer;
