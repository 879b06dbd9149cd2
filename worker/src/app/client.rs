//! Connection to the master: connects, runs sessions, and reconnects after a failure.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfarm_protocol::transport::{Connection, WorkerSecurity};
use rayfarm_protocol::{Hello, Welcome, address, handshake, tcp};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinSet;

use super::backoff::Backoff;
use super::options::{DiskCacheOptions, Share, WorkerOptions};
use super::outage_log::{Outage, OutageLog};
use super::target::Target;
use crate::error::WorkerError;
use crate::peer::{PeerCache, PeerClient, PeerServer, serve_peers};
use crate::render_pool::RenderPool;
use crate::renderer::Renderer;
use crate::scenes::{BuildPool, DiskCache, DiskWriter, SceneLoader};
use crate::session::{PersistentState, SessionConfig, SessionEnd, run_session};
use crate::shutdown::ShutdownHandle;
use crate::tracer::TracerRenderer;

/// Time limit to connect to a host.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(10);

/// Duration of a session after which the backoff is reset. A shorter session counts as a failed attempt.
const MIN_SESSION: Duration = Duration::from_secs(10);

/// Renders with `rayfarm_tracer` for one master after another, until a master disconnects the worker for good or
/// `shutdown` ends it.
///
/// Must run in a tokio runtime with I/O and time. Render threads end shortly after the function returns.
///
/// # Errors
/// A master of another version, or one that refuses the worker; with `reconnect` off, every failed connection.
pub async fn run(options: WorkerOptions, shutdown: ShutdownHandle) -> Result<(), WorkerError> {
    run_with(TracerRenderer, options, shutdown).await
}

/// Renders with the given renderer: see [`run`].
///
/// # Errors
/// The errors of [`run`].
pub async fn run_with<R: Renderer>(
    renderer: R,
    options: WorkerOptions,
    shutdown: ShutdownHandle,
) -> Result<(), WorkerError> {
    let target = Target::of(&options);
    run_targets(renderer, options, vec![target], shutdown).await
}

/// Renders for the first of several masters that answers: see [`run`]. Address and security of `options` are not used.
/// A master that refuses the worker for good is not tried again.
///
/// # Errors
/// The errors of [`run`], of the last master that is left.
pub(super) async fn run_targets<R: Renderer>(
    renderer: R,
    options: WorkerOptions,
    targets: Vec<Target>,
    shutdown: ShutdownHandle,
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
        tags: options.tags.clone(),
    };
    let disk = options.disk_cache.as_ref().and_then(open_disk);
    let builders = BuildPool::new(threads).map_err(|source| WorkerError::Threads { threads, source })?;
    let loader = SceneLoader::new(options.asset_cache_bytes);
    let mut persistent = PersistentState { renderer, pool, builders, loader, disk };
    let result = run_sessions(&options, targets, &hello, &mut persistent, &shutdown).await;
    if let Some(disk) = persistent.disk {
        disk.finish().await;
    }
    result
}

fn open_disk(options: &DiskCacheOptions) -> Option<DiskWriter> {
    let cache = DiskCache::new(options.folder.clone(), options.limit_bytes);
    match DiskWriter::new(cache) {
        Ok(disk) => Some(disk),
        Err(error) => {
            tracing::warn!("the disk cache is off: {error}");
            None
        }
    }
}

/// Connects and runs one session after another. After a failure the next master is tried, and after the last one the
/// first again, with a delay.
async fn run_sessions<R: Renderer>(
    options: &WorkerOptions,
    mut targets: Vec<Target>,
    hello: &Hello,
    persistent: &mut PersistentState<R>,
    shutdown: &ShutdownHandle,
) -> Result<(), WorkerError> {
    let (mut backoff, mut outage_log) = (Backoff::new(), OutageLog::default());
    let mut index = 0;
    loop {
        let count = targets.len();
        let Some(target) = targets.get_mut(index) else { return Ok(()) };
        let connected = tokio::select! {
            biased;
            () = shutdown.draining() => return Ok(()),
            connected = connect(target, hello) => connected,
        };
        let outage = match connected {
            Ok(stream) => {
                outage_log.end();
                target.record_join();
                let begun = Instant::now();
                // Aborted when it is dropped, at the end of the session.
                let mut peer_tasks = JoinSet::new();
                let config =
                    session_config(options, &target.security, stream.get_ref(), &mut peer_tasks).await;
                let end = run_session(stream, config, persistent, shutdown).await;
                if begun.elapsed() > MIN_SESSION {
                    backoff.reset();
                }
                match end {
                    SessionEnd::Lost(why) => {
                        Outage::Failed(WorkerError::Lost { master: target.master.clone(), why })
                    }
                    SessionEnd::MasterEnded(reason) if options.reconnect && !options.once => {
                        backoff.reset();
                        Outage::MasterEnded(reason)
                    }
                    end => {
                        log_end(&end);
                        return Ok(());
                    }
                }
            }
            Err(error) => Outage::Failed(error),
        };
        match outage {
            Outage::Failed(error) if shutdown.is_draining() => {
                tracing::info!("{error}; the worker ends as requested");
                return Ok(());
            }
            Outage::Failed(error) if !error.is_transient(target.security.key_hash().is_some()) => {
                if count == 1 {
                    return Err(error);
                }
                tracing::warn!("{error}; this master is not tried again");
                targets.remove(index);
            }
            Outage::Failed(error) if !options.reconnect && index + 1 == count => return Err(error),
            outage => {
                outage_log.log(&target.master, &outage);
                index += 1;
            }
        }
        if index < targets.len() {
            continue;
        }
        index = 0;
        tokio::select! {
            biased;
            () = shutdown.draining() => return Ok(()),
            () = tokio::time::sleep(backoff.next_delay()) => {}
        }
    }
}

/// Selects the settings of a session. Within one machine, memory is faster than LZ4, and than most disks.
async fn session_config(
    options: &WorkerOptions,
    security: &WorkerSecurity,
    stream: &TcpStream,
    tasks: &mut JoinSet<()>,
) -> SessionConfig {
    let within_machine = tcp::is_within_machine(stream);
    let uses_disk = options.disk_cache.as_ref().is_some_and(|disk| disk.within_machine || !within_machine);
    let ours = stream.local_addr().ok().filter(|_| !within_machine);
    let at = match options.share {
        // The address includes the scope of a link-local address, which a bind needs.
        Share::Auto => ours.map(|mut ours| {
            ours.set_port(0);
            ours
        }),
        Share::At(address) => Some(address),
        Share::Off => None,
    };
    let peer_server = match at {
        Some(at) => start_peer_server(at, security, tasks).await,
        None => None,
    };
    SessionConfig {
        compress: options.compress.unwrap_or(!within_machine),
        uses_disk,
        peer_server,
        peer_client: PeerClient { security: security.clone(), within_machine },
        max_segment_bytes: options.max_segment_bytes,
    }
}

/// Starts to serve assets to other workers. A failure is logged and only makes their transfers slower.
async fn start_peer_server(
    at: SocketAddr,
    security: &WorkerSecurity,
    tasks: &mut JoinSet<()>,
) -> Option<PeerServer> {
    let bound = TcpListener::bind(at).await;
    match bound.and_then(|listener| listener.local_addr().map(|address| (listener, address.port()))) {
        Ok((listener, port)) => {
            let cache = Arc::new(PeerCache::default());
            tasks.spawn(serve_peers(listener, Arc::clone(&cache), security.clone()));
            Some(PeerServer { port, cache })
        }
        Err(error) => {
            tracing::warn!("no assets are served to other workers: cannot listen at {at}: {error}");
            None
        }
    }
}

fn log_end(end: &SessionEnd) {
    match end {
        SessionEnd::Disconnected(reason) | SessionEnd::MasterEnded(reason) => {
            tracing::info!("the master disconnected: {reason}");
        }
        SessionEnd::Drained => {
            tracing::info!("all segments are done, and the master has drained this worker")
        }
        SessionEnd::Stopped => tracing::info!("stopped"),
        SessionEnd::Lost(_) => {}
    }
}

async fn connect(target: &Target, hello: &Hello) -> Result<Connection<TcpStream>, WorkerError> {
    let master = target.master.as_str();
    let resolve_error = |source| WorkerError::Resolve { master: master.to_owned(), source };
    let connect_error = |source| WorkerError::Connect { master: master.to_owned(), source };
    let addresses = address::resolve(master).await.map_err(resolve_error)?;
    let connecting = tokio::time::timeout(CONNECT_TIMEOUT, TcpStream::connect(addresses.as_slice()));
    let stream = match connecting.await {
        Ok(result) => result.map_err(connect_error)?,
        Err(_) => {
            return Err(connect_error(io::Error::new(io::ErrorKind::TimedOut, "no connection in time")));
        }
    };
    tcp::configure(&stream).map_err(connect_error)?;
    let (stream, Welcome { worker }) = handshake::as_worker(stream, &target.security, hello)
        .await
        .map_err(|source| WorkerError::Handshake { master: master.to_owned(), source })?;
    let threads = hello.threads;
    tracing::info!("connected to the master at {master} as worker {worker}, with {threads} render threads");
    Ok(stream)
}
