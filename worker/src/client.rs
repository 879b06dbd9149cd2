//! Connects to the master, serves it, and comes back when the connection fails.

use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfarm_protocol::{Hello, Welcome, handshake};
use tokio::net::TcpStream;
use tokio_util::sync::CancellationToken;

use crate::duty::{End, Keep, serve};
use crate::error::WorkerError;
use crate::pause::Pauses;
use crate::render_pool::RenderPool;
use crate::renderer::Renderer;
use crate::scene_loader::SceneLoader;
use crate::tracer::TracerRenderer;

/// How long a host may take to accept a connection.
const CONNECT_LIMIT: Duration = Duration::from_secs(10);

/// A session that lasts longer was a good one: after it, the pauses begin anew.
const LASTING_SESSION: Duration = Duration::from_secs(10);

/// What a worker is to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkerOptions {
    /// The master's HOST:PORT.
    pub master: String,
    /// Render threads; `None` means one per core.
    pub threads: Option<usize>,
    /// What the master calls this worker.
    pub name: String,
    /// Whether to connect again, with growing pauses, when the connection fails.
    pub reconnect: bool,
    /// Bytes of scenes and meshes that are kept.
    pub asset_cache_bytes: u64,
}

/// Renders for a master until it says goodbye or `stop` is cancelled; both are `Ok`.
///
/// Must run in a tokio runtime with I/O and time. Render threads end by themselves soon after this has returned.
///
/// # Errors
/// The master is of another version or refuses; or, when `reconnect` is off, any failure to connect or stay connected.
pub async fn run(options: WorkerOptions, stop: CancellationToken) -> Result<(), WorkerError> {
    run_with(TracerRenderer, options, stop).await
}

/// As [`run`], with another renderer.
///
/// # Errors
/// As [`run`].
pub async fn run_with<R: Renderer>(
    renderer: R,
    options: WorkerOptions,
    stop: CancellationToken,
) -> Result<(), WorkerError> {
    let renderer = Arc::new(renderer);
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    let threads = options.threads.unwrap_or_else(cores).max(1);
    let pool = RenderPool::new(Arc::clone(&renderer), threads)
        .map_err(|source| WorkerError::Threads { threads, source })?;
    let hello = Hello {
        name: options.name.clone(),
        threads: u32::try_from(threads).unwrap_or(u32::MAX),
        simd: renderer.simd(),
        software: env!("CARGO_PKG_VERSION").to_owned(),
    };
    let mut keep = Keep { renderer, pool, loader: SceneLoader::new(options.asset_cache_bytes) };
    let mut pauses = Pauses::new();
    loop {
        let connected = tokio::select! {
            biased;
            () = stop.cancelled() => return Ok(()),
            connected = connect(&options.master, &hello) => connected,
        };
        let error = match connected {
            Ok(stream) => {
                let begun = Instant::now();
                let end = serve(stream, &mut keep, &stop).await;
                // One that ends as soon as it has begun is no success.
                if begun.elapsed() > LASTING_SESSION {
                    pauses.reset();
                }
                match end {
                    End::Lost(why) => WorkerError::Lost { master: options.master.clone(), why },
                    end => {
                        report(&end);
                        return Ok(());
                    }
                }
            }
            Err(error) => error,
        };
        if !options.reconnect || !error.is_passing() {
            return Err(error);
        }
        let pause = pauses.next();
        tracing::warn!("{error}; trying again in {} s", pause.as_secs());
        tokio::select! {
            biased;
            () = stop.cancelled() => return Ok(()),
            () = tokio::time::sleep(pause) => {}
        }
    }
}

fn report(end: &End) {
    match end {
        End::Goodbye(reason) => tracing::info!("the master says goodbye: {reason}"),
        End::Drained => tracing::info!("all segments are done, and the master has no more"),
        End::Stopped => tracing::info!("stopped"),
        End::Lost(_) => {}
    }
}

async fn connect(master: &str, hello: &Hello) -> Result<TcpStream, WorkerError> {
    let resolve_error = |source| WorkerError::Resolve { master: master.to_owned(), source };
    let connect_error = |source| WorkerError::Connect { master: master.to_owned(), source };
    let addresses: Vec<_> = tokio::net::lookup_host(master).await.map_err(resolve_error)?.collect();
    let connecting = tokio::time::timeout(CONNECT_LIMIT, TcpStream::connect(addresses.as_slice()));
    let mut stream = match connecting.await {
        Ok(result) => result.map_err(connect_error)?,
        Err(_) => return Err(connect_error(io::Error::new(io::ErrorKind::TimedOut, "no answer"))),
    };
    // Leases and pings are small and must not wait for company.
    stream.set_nodelay(true).map_err(connect_error)?;
    let Welcome { worker } = handshake::as_worker(&mut stream, hello)
        .await
        .map_err(|source| WorkerError::Handshake { master: master.to_owned(), source })?;
    let threads = hello.threads;
    tracing::info!("connected to the master at {master} as worker {worker}, with {threads} render threads");
    Ok(stream)
}
