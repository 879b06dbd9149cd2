//! A renderer made of bytes, and a master at the other end of a pipe.
//!
//! A scene body is `scene`, a free byte, and the names of its meshes; a mesh is `mesh` and anything. The first word of
//! a view says how the frame behaves.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

use bytes::Bytes;
use rayfarm_protocol::session::{self, Receiver, Sender};
use rayfarm_protocol::{AssetId, FrameAnnounce, FrameId, Lease, ToMaster, ToWorker};
use tokio::task::JoinHandle;

use crate::build_pool::BuildPool;
use crate::disk_cache::DiskCache;
use crate::disk_writer::DiskWriter;
use crate::duty::{End, Keep, Sharing, Terms, serve};
use crate::ending::Ending;
use crate::render_pool::RenderPool;
use crate::renderer::{Cancelled, Counts, Renderer};
use crate::scene_loader::SceneLoader;

pub(crate) const WIDTH: u32 = 5;
pub(crate) const HEIGHT: u32 = 40;

/// Closed, it holds the render threads of frames whose view is `wait`.
#[derive(Default)]
pub(crate) struct Gate {
    is_open: Mutex<bool>,
    changed: Condvar,
}

impl Gate {
    pub(crate) fn open(&self) {
        *self.is_open.lock().unwrap() = true;
        self.changed.notify_all();
    }

    fn wait(&self) {
        let is_open = self.is_open.lock().unwrap();
        drop(self.changed.wait_while(is_open, |is_open| !*is_open).unwrap());
    }
}

/// The salt of scenes whose compilation does not end before it is cancelled, and then when the gate is open.
pub(crate) const ENDLESS: u8 = 100;

/// What a fake has been asked to do.
#[derive(Debug, Default)]
pub(crate) struct Seen {
    /// Compilations that have begun.
    pub(crate) compiled: AtomicUsize,
    compiling: AtomicUsize,
    /// Most compilations at a time.
    pub(crate) most_compiling: AtomicUsize,
    /// Compilations and preparations that were cancelled on the way.
    pub(crate) cancelled: AtomicUsize,
    /// Frames whose preparation has begun.
    pub(crate) prepared: AtomicUsize,
    /// Threads of the pools in which scenes were decoded and compiled.
    pub(crate) threads: Mutex<BTreeSet<usize>>,
}

impl Seen {
    fn until_cancelled(&self, cancelled: &(dyn Fn() -> bool + Sync)) {
        while !cancelled() {
            std::thread::sleep(Duration::from_millis(1));
        }
        self.cancelled.fetch_add(1, Relaxed);
    }

    fn pool(&self) {
        self.threads.lock().unwrap().insert(rayon::current_num_threads());
    }
}

/// Waits until one of the counts of [`Seen`] is reached.
pub(crate) async fn until(count: &AtomicUsize, reached: usize) {
    while count.load(Relaxed) < reached {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

#[derive(Default)]
pub(crate) struct Fake {
    pub(crate) gate: Arc<Gate>,
    pub(crate) seen: Arc<Seen>,
}

pub(crate) struct FakeFrame {
    view: Bytes,
    salt: u8,
}

/// What a pixel's three bytes are.
fn shade(salt: u8, view: &[u8], y: u32) -> u8 {
    view.iter().fold(salt, |sum, byte| sum.wrapping_mul(3).wrapping_add(*byte)).wrapping_add(y as u8)
}

/// The rows that the fake renders of a frame with this view of this scene.
pub(crate) fn expected(scene: &[u8], view: &[u8], rows: Range<u32>) -> Vec<u8> {
    rows.flat_map(|y| vec![shade(scene[5], view, y); WIDTH as usize * 3]).collect()
}

impl Renderer for Fake {
    type Draft = u8;
    type Part = ();
    type Scene = u8;
    type Frame = FakeFrame;

    fn simd(&self) -> String {
        "fake".to_owned()
    }

    fn band_rows(&self, _frame: &FakeFrame) -> u32 {
        8
    }

    fn decode_scene(&self, body: &[u8]) -> Result<(u8, Vec<AssetId>), String> {
        self.seen.pool();
        let rest = body.strip_prefix(b"scene").ok_or("this is no scene")?;
        let (salt, meshes) = rest.split_first().ok_or("this scene has no salt")?;
        Ok((*salt, meshes.chunks_exact(32).map(|id| AssetId(id.try_into().unwrap())).collect()))
    }

    fn decode_part(&self, bytes: &[u8]) -> Result<(), String> {
        self.seen.pool();
        assert!(bytes != b"mesh that panics", "this mesh is a trap");
        if bytes.starts_with(b"mesh") { Ok(()) } else { Err("this is no mesh".to_owned()) }
    }

    fn compile(
        &self,
        draft: u8,
        _parts: Vec<Arc<()>>,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<u8, String> {
        self.seen.pool();
        let compiling = self.seen.compiling.fetch_add(1, Relaxed) + 1;
        self.seen.most_compiling.fetch_max(compiling, Relaxed);
        self.seen.compiled.fetch_add(1, Relaxed);
        if draft == ENDLESS {
            self.seen.until_cancelled(cancelled);
            self.gate.wait();
        }
        self.seen.compiling.fetch_sub(1, Relaxed);
        Ok(draft)
    }

    fn prepare(
        &self,
        scene: Arc<u8>,
        announce: &FrameAnnounce,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<FakeFrame, String> {
        self.seen.prepared.fetch_add(1, Relaxed);
        match announce.view.as_ref() {
            b"endless" => {
                self.seen.until_cancelled(cancelled);
                Err("it was cancelled".to_owned())
            }
            b"unpreparable" => Err("this view cannot be".to_owned()),
            _ => Ok(FakeFrame { view: announce.view.clone(), salt: *scene }),
        }
    }

    /// With a shade that is seldom such a colour, this is a promise that it breaks.
    fn is_narrow(&self, frame: &FakeFrame) -> bool {
        frame.view.as_ref() == b"narrow"
    }

    fn render(
        &self,
        frame: &FakeFrame,
        rows: Range<u32>,
        out: &mut [u8],
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Counts, Cancelled> {
        match frame.view.as_ref() {
            b"wait" => self.gate.wait(),
            b"panic" => panic!("row {} is unlucky", rows.start),
            _ => {}
        }
        if cancelled() {
            return Err(Cancelled);
        }
        for (y, row) in rows.clone().zip(out.chunks_exact_mut(WIDTH as usize * 3)) {
            row.fill(shade(frame.salt, &frame.view, y));
        }
        Ok(Counts { primary: u64::from(WIDTH) * rows.len() as u64, shadow: 1, secondary: 0 })
    }
}

pub(crate) fn keep(threads: usize, cache_bytes: u64) -> (Keep<Fake>, Arc<Gate>) {
    let renderer = Arc::new(Fake::default());
    let gate = Arc::clone(&renderer.gate);
    let pool = RenderPool::new(Arc::clone(&renderer), threads).unwrap();
    let builders = BuildPool::new(threads).unwrap();
    (Keep { renderer, pool, builders, loader: SceneLoader::new(cache_bytes), disk: None }, gate)
}

/// A worker that has just been started, with a disk cache in that folder.
pub(crate) fn keep_with_disk(folder: &Path, limit_bytes: u64) -> Keep<Fake> {
    let disk = DiskWriter::new(DiskCache::new(folder.to_owned(), limit_bytes)).unwrap();
    Keep { disk: Some(disk), ..keep(1, 1 << 20).0 }
}

pub(crate) fn scene(salt: u8, meshes: &[&[u8]]) -> Vec<u8> {
    let names = meshes.iter().flat_map(|mesh| AssetId::of(mesh).0);
    b"scene".iter().copied().chain([salt]).chain(names).collect()
}

pub(crate) fn lease(frame: u64, rows: Range<u32>) -> Lease {
    let (first_row, row_count) = (rows.start, rows.end - rows.start);
    Lease { frame: FrameId(frame), segment: first_row, attempt: 0, first_row, row_count }
}

/// A master for one worker. What the worker says is answered by the test, except that assets are sent as asked for.
pub(crate) struct Master {
    pub(crate) out: Sender<ToWorker>,
    pub(crate) inbox: Receiver<ToMaster>,
    pub(crate) worker: JoinHandle<(End, Keep<Fake>)>,
    pub(crate) ending: Ending,
    assets: Vec<(AssetId, Vec<u8>)>,
    /// What the worker asked for, in order.
    pub(crate) asked: Vec<AssetId>,
}

impl Master {
    /// Starts a session with a worker that keeps what it has.
    pub(crate) fn meet(keep: Keep<Fake>, assets: &[&[u8]]) -> Self {
        Self::meet_sharing(keep, assets, None)
    }

    /// The same with a worker that passes assets on.
    pub(crate) fn meet_sharing(mut keep: Keep<Fake>, assets: &[&[u8]], sharing: Option<Sharing>) -> Self {
        let (ours, theirs) = tokio::io::duplex(1 << 16);
        let ending = Ending::new();
        let told = ending.clone();
        let worker = tokio::spawn(async move {
            let terms = Terms { compress: false, uses_disk: keep.disk.is_some(), sharing };
            let end = serve(theirs, terms, &mut keep, &told).await;
            (end, keep)
        });
        let (out, inbox, _) = session::spawn(ours);
        let assets = assets.iter().map(|bytes| (AssetId::of(bytes), bytes.to_vec())).collect();
        Self { out, inbox, worker, ending, assets, asked: Vec::new() }
    }

    /// Sends other bytes under the name of an asset.
    pub(crate) fn corrupt(&mut self, honest: &[u8], bytes: &[u8]) {
        self.assets.retain(|(id, _)| *id != AssetId::of(honest));
        self.assets.push((AssetId::of(honest), bytes.to_vec()));
    }

    pub(crate) async fn say(&self, message: ToWorker) {
        self.out.send(message).await.unwrap();
    }

    pub(crate) async fn announce(&self, frame: u64, scene: &[u8], view: &[u8]) {
        let view = Bytes::copy_from_slice(view);
        let scene = AssetId::of(scene);
        let (frame, width, height) = (FrameId(frame), WIDTH, HEIGHT);
        self.say(ToWorker::Frame(FrameAnnounce { frame, scene, width, height, view })).await;
    }

    /// The worker's next message that is no wish for an asset. Wishes are fulfilled.
    pub(crate) async fn hear(&mut self) -> Option<ToMaster> {
        loop {
            match self.inbox.recv().await?.unwrap() {
                ToMaster::NeedAsset { id, offset, .. } => self.send_asset(id, offset).await,
                message => return Some(message),
            }
        }
    }

    /// Sends an asset from some byte on.
    pub(crate) async fn send_asset(&mut self, id: AssetId, first: u64) {
        self.asked.push(id);
        let Some((_, bytes)) = self.assets.iter().find(|(known, _)| *known == id) else {
            self.say(ToWorker::AssetUnknown { id }).await;
            return;
        };
        self.say(ToWorker::AssetBegin { id, size: bytes.len() as u64 }).await;
        let piece = if bytes.len() > 1000 { 100_000 } else { 7 };
        let parts = bytes[first as usize..].chunks(piece).enumerate();
        let parts = parts.map(|(i, part)| (first + (i * piece) as u64, Bytes::copy_from_slice(part)));
        let parts: Vec<_> = parts.collect();
        for (offset, bytes) in parts {
            self.say(ToWorker::AssetChunk { id, offset, bytes }).await;
        }
    }

    /// Fulfils the next wish for an asset.
    pub(crate) async fn send_wished(&mut self) {
        let (id, offset, _) = self.wish().await;
        self.send_asset(id, offset).await;
    }

    /// The next wish for an asset, which is not fulfilled: which one, from where on, and whether it was let down.
    pub(crate) async fn wish(&mut self) -> (AssetId, u64, bool) {
        loop {
            match self.inbox.recv().await.unwrap().unwrap() {
                ToMaster::NeedAsset { id, offset, again } => return (id, offset, again),
                ToMaster::Pong { .. } => {}
                other => panic!("a wish was expected, not {other:?}"),
            }
        }
    }

    /// The pixels of the next finished lease.
    pub(crate) async fn pixels(&mut self) -> (Lease, Bytes) {
        match self.hear().await {
            Some(ToMaster::Pixels { header, bytes }) => (header.lease, bytes),
            other => panic!("pixels were expected, not {other:?}"),
        }
    }

    /// The reason why a frame has failed.
    pub(crate) async fn failure(&mut self, expected: u64) -> String {
        match self.hear().await {
            Some(ToMaster::Failed { frame, reason }) if frame == FrameId(expected) => reason,
            other => panic!("the failure of frame {expected} was expected, not {other:?}"),
        }
    }

    /// Lets the session end, and gives the worker back.
    pub(crate) async fn part(self) -> (End, Keep<Fake>) {
        drop((self.out, self.inbox));
        self.worker.await.unwrap()
    }
}
