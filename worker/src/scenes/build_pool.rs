//! Threads that decode and compile scenes: as many as render threads. One scene is compiled at a time, across sessions.

use std::io;
use std::sync::Arc;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// A thread pool for the parallel parts of scene work, and the permit to compile. Clones share both.
#[derive(Clone, Debug)]
pub(crate) struct BuildPool {
    threads: Arc<rayon::ThreadPool>,
    compile_permit: Arc<Semaphore>,
}

impl BuildPool {
    /// Starts the threads.
    ///
    /// # Errors
    /// A system that starts no more threads.
    pub(crate) fn new(threads: usize) -> io::Result<Self> {
        let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = builder.thread_name(|index| format!("build-{index}")).build().map_err(io::Error::other)?;
        Ok(Self { threads: Arc::new(pool), compile_permit: Arc::new(Semaphore::new(1)) })
    }

    /// Runs work whose parallel parts run on the pool's threads only.
    pub(crate) fn run<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.threads.install(work)
    }

    /// Waits for the permit to compile, which is held until it is dropped. A cancelled compilation of an earlier session
    /// holds it until the compilation ends. Never returns `None`: the semaphore is not closed.
    pub(crate) async fn compile_permit(&self) -> Option<OwnedSemaphorePermit> {
        Arc::clone(&self.compile_permit).acquire_owned().await.ok()
    }
}
