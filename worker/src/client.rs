//! Connects to the master, serves it, and comes back when the connection fails.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfarm_protocol::{Hello, Welcome, address, handshake, tcp};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinSet;

use crate::build_pool::BuildPool;
use crate::disk_cache::DiskCache;
use crate::disk_writer::DiskWriter;
use crate::duty::{End, Keep, Sharing, Terms, serve};
use crate::ending::Ending;
use crate::error::WorkerError;
use crate::pause::Pauses;
use crate::render_pool::RenderPool;
use crate::renderer::Renderer;
use crate::scene_loader::SceneLoader;
use crate::share::share;
use crate::shelf::Shelf;
use crate::tracer::TracerRenderer;
use crate::waiting::{Absence, Waiting};

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
    /// Whether to end with the first master that ends in order, instead of waiting for the next one.
    pub once: bool,
    /// Bytes of scenes and meshes that are kept.
    pub asset_cache_bytes: u64,
    /// Where assets outlive the worker, if anywhere.
    pub disk_cache: Option<DiskCacheOptions>,
    /// Whether pixels are compressed; `None`: to another machine, and not within this one, where that is quicker.
    pub compress: Option<bool>,
    /// Where scenes and meshes are passed on to other workers, if they are.
    pub share: Share,
}

/// Whether a worker passes on what it gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Share {
    /// At any free port, to a master on another machine; not within this one.
    #[default]
    Auto,
    /// At this address.
    At(SocketAddr),
    /// No.
    Off,
}

/// A folder of assets for the next run, and for the other workers of this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DiskCacheOptions {
    /// The folder.
    pub folder: PathBuf,
    /// Bytes that it may take.
    pub limit_bytes: u64,
    /// Whether it serves a master on this machine as well, whose assets are here already.
    pub within_machine: bool,
}

/// Renders for one master after the other until one sends the worker away or the worker is told to end; both are `Ok`.
///
/// Must run in a tokio runtime with I/O and time. Render threads end by themselves soon after this has returned.
///
/// # Errors
/// The master is of another version or refuses; or, when `reconnect` is off, any failure to connect or stay connected.
pub async fn run(options: WorkerOptions, ending: Ending) -> Result<(), WorkerError> {
    run_with(TracerRenderer, options, ending).await
}

/// As [`run`], with another renderer.
///
/// # Errors
/// As [`run`].
pub async fn run_with<R: Renderer>(
    renderer: R,
    options: WorkerOptions,
    ending: Ending,
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
    let disk = options.disk_cache.as_ref().and_then(open_disk);
    let builders = BuildPool::new(threads).map_err(|source| WorkerError::Threads { threads, source })?;
    let loader = SceneLoader::new(options.asset_cache_bytes);
    let mut keep = Keep { renderer, pool, builders, loader, disk };
    let result = attend(&options, &hello, &mut keep, &ending).await;
    if let Some(disk) = keep.disk {
        disk.finish().await;
    }
    result
}

fn open_disk(options: &DiskCacheOptions) -> Option<DiskWriter> {
    let cache = DiskCache::new(options.folder.clone(), options.limit_bytes);
    match DiskWriter::new(cache) {
        Ok(disk) => Some(disk),
        Err(error) => {
            tracing::warn!("assets are not kept on the disk: {error}");
            None
        }
    }
}

/// Session after session.
async fn attend<R: Renderer>(
    options: &WorkerOptions,
    hello: &Hello,
    keep: &mut Keep<R>,
    ending: &Ending,
) -> Result<(), WorkerError> {
    let (mut pauses, mut waiting) = (Pauses::new(), Waiting::default());
    loop {
        let connected = tokio::select! {
            biased;
            () = ending.draining() => return Ok(()),
            connected = connect(&options.master, hello) => connected,
        };
        let absence = match connected {
            Ok(stream) => {
                waiting.over();
                let begun = Instant::now();
                // Ended with the session.
                let mut sharers = JoinSet::new();
                let terms = terms(options, &stream, &mut sharers).await;
                let end = serve(stream, terms, keep, ending).await;
                // One that ends as soon as it has begun is no success.
                if begun.elapsed() > LASTING_SESSION {
                    pauses.reset();
                }
                match end {
                    End::Lost(why) => {
                        Absence::Failed(WorkerError::Lost { master: options.master.clone(), why })
                    }
                    End::MasterEnded(reason) if options.reconnect && !options.once => {
                        pauses.reset();
                        Absence::Ended(reason)
                    }
                    end => {
                        report(&end);
                        return Ok(());
                    }
                }
            }
            Err(error) => Absence::Failed(error),
        };
        match absence {
            Absence::Failed(error) if ending.is_draining() => {
                tracing::info!("{error}; leaving all the same");
                return Ok(());
            }
            Absence::Failed(error) if !options.reconnect || !error.is_passing() => return Err(error),
            absence => waiting.log(&options.master, &absence),
        }
        tokio::select! {
            biased;
            () = ending.draining() => return Ok(()),
            () = tokio::time::sleep(pauses.next()) => {}
        }
    }
}

/// Memory is quicker than LZ4, and than most disks.
async fn terms(options: &WorkerOptions, stream: &TcpStream, sharers: &mut JoinSet<()>) -> Terms {
    let within_machine = tcp::is_within_machine(stream);
    let uses_disk = options.disk_cache.as_ref().is_some_and(|disk| disk.within_machine || !within_machine);
    let ours = stream.local_addr().ok().filter(|_| !within_machine);
    let at = match options.share {
        // With the scope of a link-local address, without which nothing can be bound to it.
        Share::Auto => ours.map(|mut ours| {
            ours.set_port(0);
            ours
        }),
        Share::At(address) => Some(address),
        Share::Off => None,
    };
    let sharing = match at {
        Some(at) => begin_to_share(at, sharers).await,
        None => None,
    };
    Terms { compress: options.compress.unwrap_or(!within_machine), uses_disk, sharing }
}

/// Listens for other workers. Where that cannot be, nothing is passed on, and all is well but slower.
async fn begin_to_share(at: SocketAddr, sharers: &mut JoinSet<()>) -> Option<Sharing> {
    let bound = TcpListener::bind(at).await;
    match bound.and_then(|listener| listener.local_addr().map(|address| (listener, address.port()))) {
        Ok((listener, port)) => {
            let shelf = Arc::new(Shelf::default());
            sharers.spawn(share(listener, Arc::clone(&shelf)));
            Some(Sharing { port, shelf })
        }
        Err(error) => {
            tracing::warn!("nothing is passed on to other workers: cannot listen on {at}: {error}");
            None
        }
    }
}

fn report(end: &End) {
    match end {
        End::Goodbye(reason) | End::MasterEnded(reason) => {
            tracing::info!("the master says goodbye: {reason}");
        }
        End::Drained => tracing::info!("all segments are done, and the master has no more"),
        End::Stopped => tracing::info!("stopped"),
        End::Lost(_) => {}
    }
}

async fn connect(master: &str, hello: &Hello) -> Result<TcpStream, WorkerError> {
    let resolve_error = |source| WorkerError::Resolve { master: master.to_owned(), source };
    let connect_error = |source| WorkerError::Connect { master: master.to_owned(), source };
    let addresses = address::resolve(master).await.map_err(resolve_error)?;
    let connecting = tokio::time::timeout(CONNECT_LIMIT, TcpStream::connect(addresses.as_slice()));
    let mut stream = match connecting.await {
        Ok(result) => result.map_err(connect_error)?,
        Err(_) => return Err(connect_error(io::Error::new(io::ErrorKind::TimedOut, "no answer"))),
    };
    tcp::configure(&stream).map_err(connect_error)?;
    let Welcome { worker } = handshake::as_worker(&mut stream, hello)
        .await
        .map_err(|source| WorkerError::Handshake { master: master.to_owned(), source })?;
    let threads = hello.threads;
    tracing::info!("connected to the master at {master} as worker {worker}, with {threads} render threads");
    Ok(stream)
}
