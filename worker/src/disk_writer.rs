//! Writes to the disk cache in the background: nobody waits for a disk, until the worker ends.

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{self, SyncSender};
use std::time::Duration;

use bytes::Bytes;
use rayfarm_protocol::AssetId;
use tokio::sync::oneshot;

use crate::disk_cache::DiskCache;

/// Assets that wait to be written. Beyond that a slow disk goes without.
const MAX_WAITING: usize = 8;

/// How long the end of a worker waits for what is being written.
const LAST_WRITES: Duration = Duration::from_secs(2);

/// A disk cache, and the thread that writes to it.
#[derive(Debug)]
pub(crate) struct DiskWriter {
    cache: Arc<DiskCache>,
    queue: SyncSender<(AssetId, Bytes)>,
    /// Closed when the thread has ended.
    ended: oneshot::Receiver<()>,
}

impl DiskWriter {
    pub(crate) fn new(cache: DiskCache) -> io::Result<Self> {
        let cache = Arc::new(cache);
        let (queue, waiting) = mpsc::sync_channel::<(AssetId, Bytes)>(MAX_WAITING);
        let (ending, ended) = oneshot::channel();
        let target = Arc::clone(&cache);
        std::thread::Builder::new().name("disk-cache".to_owned()).spawn(move || {
            let _ending: oneshot::Sender<()> = ending;
            waiting.iter().for_each(|(id, bytes)| target.write(id, &bytes));
        })?;
        Ok(Self { cache, queue, ended })
    }

    /// The cache, to be read on blocking threads.
    pub(crate) fn cache(&self) -> &Arc<DiskCache> {
        &self.cache
    }

    /// Writes an asset as soon as the disk has time.
    pub(crate) fn save(&self, id: AssetId, bytes: Bytes) {
        if self.queue.try_send((id, bytes)).is_err() {
            tracing::debug!("the disk is too slow to keep asset {id}");
        }
    }

    /// Waits, not for long, until everything is written.
    pub(crate) async fn finish(self) {
        drop(self.queue);
        // Nothing is ever sent: it ends with the thread, or in time.
        let _ = tokio::time::timeout(LAST_WRITES, self.ended).await;
    }
}
