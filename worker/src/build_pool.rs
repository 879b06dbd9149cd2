//! Where scenes are decoded and compiled: on as many threads as frames are rendered on, and one scene at a time, across
//! sessions. Work of a session that has ended has its turn until it notices.

use std::io;
use std::sync::Arc;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Threads for the parallel parts of scene work, and the turn to compile. Copies share both.
#[derive(Clone, Debug)]
pub(crate) struct BuildPool {
    threads: Arc<rayon::ThreadPool>,
    turn: Arc<Semaphore>,
}

/// The right to compile, until it is dropped.
pub(crate) type Turn = OwnedSemaphorePermit;

impl BuildPool {
    /// Starts the threads.
    ///
    /// # Errors
    /// The system has no more of them.
    pub(crate) fn new(threads: usize) -> io::Result<Self> {
        let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = builder.thread_name(|index| format!("build-{index}")).build().map_err(io::Error::other)?;
        Ok(Self { threads: Arc::new(pool), turn: Arc::new(Semaphore::new(1)) })
    }

    /// Does work whose parallel parts run on the pool's threads, and no others.
    pub(crate) fn run<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.threads.install(work)
    }

    /// Waits for the turn to compile. `None` never comes: the semaphore is not closed.
    pub(crate) async fn turn(&self) -> Option<Turn> {
        Arc::clone(&self.turn).acquire_owned().await.ok()
    }
}
