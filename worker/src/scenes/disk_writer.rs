//! Background writes to the disk cache. Only the end of the worker waits for them.

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{self, SyncSender};
use std::time::Duration;

use bytes::Bytes;
use rayfarm_protocol::AssetId;
use tokio::sync::oneshot;

use super::DiskCache;

/// Most queued assets. Further assets are not cached.
const MAX_QUEUED: usize = 8;

/// Time limit of the last writes at the end of a worker.
const FINISH_LIMIT: Duration = Duration::from_secs(2);

/// A disk cache with a thread that writes to it.
#[derive(Debug)]
pub(crate) struct DiskWriter {
    cache: Arc<DiskCache>,
    queue: SyncSender<(AssetId, Bytes)>,
    /// Closed at the end of the thread.
    ended: oneshot::Receiver<()>,
}

impl DiskWriter {
    /// Starts the thread.
    ///
    /// # Errors
    /// A system that starts no more threads.
    pub(crate) fn new(cache: DiskCache) -> io::Result<Self> {
        let cache = Arc::new(cache);
        let (queue, queued) = mpsc::sync_channel::<(AssetId, Bytes)>(MAX_QUEUED);
        let (end_guard, ended) = oneshot::channel();
        let target = Arc::clone(&cache);
        std::thread::Builder::new().name("disk-cache".to_owned()).spawn(move || {
            let _end_guard: oneshot::Sender<()> = end_guard;
            queued.iter().for_each(|(id, bytes)| target.write(id, &bytes));
        })?;
        Ok(Self { cache, queue, ended })
    }

    /// The cache, for reads on blocking threads.
    pub(crate) fn cache(&self) -> &Arc<DiskCache> {
        &self.cache
    }

    /// Queues an asset to be written. Drops it where the queue is full.
    pub(crate) fn save(&self, id: AssetId, bytes: Bytes) {
        if self.queue.try_send((id, bytes)).is_err() {
            tracing::debug!("the disk is too slow: asset {id} is not cached");
        }
    }

    /// Waits up to [`FINISH_LIMIT`] until everything is written.
    pub(crate) async fn finish(self) {
        drop(self.queue);
        // Nothing is sent: the channel closes at the end of the thread.
        let _ = tokio::time::timeout(FINISH_LIMIT, self.ended).await;
    }
}
