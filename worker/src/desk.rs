//! What a worker does about what its master says. Pure: messages, results and the time go in, effects come out.

use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use bytes::Bytes;
use rayfarm_protocol::peer::ShareKey;
use rayfarm_protocol::{AssetId, FrameAnnounce, FrameId, Lease, Reconnect, ToMaster, ToWorker};

use crate::fetch::{FromPeer, Peer};
use crate::frames::{Frames, Verdict};
use crate::growing::Growing;
use crate::render_pool::ReadyFrame;
use crate::renderer::Renderer;
use crate::scene_loader::{SceneDone, SceneLoader, SceneWork, Step, Wish};
use crate::wanted::Wanted;

/// Something to be done by whoever owns the connection and the threads.
pub(crate) enum Effect<R: Renderer> {
    /// Send it.
    Say(ToMaster),
    /// Do it on a blocking thread, and bring the result to [`Desk::done`].
    Work(Work<R>),
    /// Keep an asset on the disk.
    Save(AssetId, Bytes),
    /// Get an asset of that size from another worker, and bring what comes of it to [`Desk::passed`].
    Fetch { id: AssetId, size: u64, peer: Peer },
    /// Pass this asset on to whoever the master sends.
    Shelve(AssetId, Arc<Growing>),
    /// What the master's tokens are made of.
    Key(ShareKey),
    /// Render a lease.
    Render { lease: Lease, rows: Range<u32>, frame: Arc<ReadyFrame<R::Frame>>, arrived: Instant },
    /// Forget leases of earlier frames.
    CancelBefore(FrameId),
    /// Forget leases of this frame.
    CancelFrame(FrameId),
    /// Leave when everything that was leased is done.
    Drain,
    /// The master has said goodbye.
    End { reason: String, reconnect: Reconnect },
}

/// Work that takes its time.
pub(crate) enum Work<R: Renderer> {
    Scene(SceneWork<R>),
    Prepare { announce: FrameAnnounce, scene: Arc<R::Scene>, wanted: Wanted },
}

/// What became of it.
pub(crate) enum Done<R: Renderer> {
    Scene(SceneDone<R>),
    Prepared { frame: FrameId, result: Result<ReadyFrame<R::Frame>, String> },
}

/// The state of one session. Drain [`poll_effect`](Self::poll_effect) after every call.
pub(crate) struct Desk<'a, R: Renderer> {
    loader: &'a mut SceneLoader<R>,
    frames: Frames<ReadyFrame<R::Frame>>,
    effects: std::collections::VecDeque<Effect<R>>,
}

impl<'a, R: Renderer> Desk<'a, R> {
    /// Begins a session with what earlier ones have left in the store, and on the disk if there is one.
    /// `shares`: what comes in may be passed on.
    pub(crate) fn new(loader: &'a mut SceneLoader<R>, has_disk: bool, shares: bool) -> Self {
        loader.reset(has_disk, shares);
        Self { loader, frames: Frames::new(), effects: Default::default() }
    }

    pub(crate) fn poll_effect(&mut self) -> Option<Effect<R>> {
        self.effects.pop_front()
    }

    /// Whether leases wait for their frames.
    pub(crate) fn has_waiting(&self) -> bool {
        self.frames.has_waiting()
    }

    /// The master says something, now.
    pub(crate) fn handle(&mut self, now: Instant, message: ToWorker) {
        match message {
            ToWorker::Frame(announce) => self.announced(announce),
            ToWorker::Segment(lease) => self.leased(lease, now),
            ToWorker::Cancel { before } => {
                self.frames.cancel(before);
                self.effects.push_back(Effect::CancelBefore(before));
            }
            ToWorker::AssetBegin { id, size } => self.loader.begin(id, size),
            ToWorker::AssetChunk { id, offset, bytes } => self.loader.chunk(id, offset, &bytes),
            ToWorker::AssetUnknown { id } => self.loader.unknown(id),
            ToWorker::AssetFrom { id, size, peer, token } => {
                self.loader.begin_from(id, size, Peer { address: peer, token });
            }
            ToWorker::ShareKey { key } => self.effects.push_back(Effect::Key(key)),
            ToWorker::Ping { nonce } => self.effects.push_back(Effect::Say(ToMaster::Pong { nonce })),
            ToWorker::Drain => self.effects.push_back(Effect::Drain),
            ToWorker::Disconnect { reason, reconnect } => {
                self.effects.push_back(Effect::End { reason, reconnect });
            }
        }
        self.take_steps();
    }

    /// Another worker passes on an asset, or does not.
    pub(crate) fn passed(&mut self, from: FromPeer) {
        self.loader.passed(from);
        self.take_steps();
    }

    /// Work is done.
    pub(crate) fn done(&mut self, done: Done<R>) {
        match done {
            Done::Scene(done) => self.loader.done(done),
            Done::Prepared { frame, result: Ok(ready) } => {
                for (lease, arrived) in self.frames.ready(frame, ready) {
                    self.leased(lease, arrived);
                }
            }
            Done::Prepared { frame, result: Err(reason) } => self.frame_failed(frame, reason),
        }
        self.take_steps();
    }

    /// A frame cannot be rendered, now or any more: the master is told once.
    pub(crate) fn frame_failed(&mut self, frame: FrameId, reason: String) {
        if self.frames.failed(frame) {
            self.tell_failure(frame, reason);
        }
    }

    fn announced(&mut self, announce: FrameAnnounce) {
        let scene = announce.scene;
        let (is_new, dropped) = self.frames.announce(announce);
        self.effects.extend(dropped.map(Effect::CancelFrame));
        if is_new {
            self.loader.set_current(self.frames.scenes());
            self.loader.want(scene);
        }
    }

    fn leased(&mut self, lease: Lease, arrived: Instant) {
        match self.frames.lease(lease, arrived) {
            Verdict::Render(rows, frame) => {
                self.effects.push_back(Effect::Render { lease, rows, frame, arrived });
            }
            Verdict::Nothing => {}
            Verdict::Refuse(reason) => {
                self.frames.failed(lease.frame);
                self.tell_failure(lease.frame, reason);
            }
        }
    }

    fn take_steps(&mut self) {
        while let Some(step) = self.loader.poll_step() {
            match step {
                Step::Ask(Wish { id, offset, again }) => {
                    self.effects.push_back(Effect::Say(ToMaster::NeedAsset { id, offset, again }));
                }
                Step::Fetch { id, size, peer } => self.effects.push_back(Effect::Fetch { id, size, peer }),
                Step::Shelve(id, bytes) => self.effects.push_back(Effect::Shelve(id, bytes)),
                Step::Taken(id) => self.effects.push_back(Effect::Say(ToMaster::HaveAsset { id })),
                Step::Save(id, bytes) => self.effects.push_back(Effect::Save(id, bytes)),
                Step::Work(work) => self.effects.push_back(Effect::Work(Work::Scene(work))),
                Step::Ready(id, scene) => {
                    let frames = self.frames.scene_ready(id).into_iter();
                    let prepare =
                        |(announce, wanted)| Work::Prepare { announce, scene: Arc::clone(&scene), wanted };
                    self.effects.extend(frames.map(|frame| Effect::Work(prepare(frame))));
                }
                Step::Failed(id, reason) => {
                    for frame in self.frames.scene_failed(id) {
                        self.tell_failure(frame, reason.clone());
                    }
                }
            }
        }
    }

    fn tell_failure(&mut self, frame: FrameId, reason: String) {
        tracing::error!("cannot render frame {frame}: {reason}");
        self.effects.push_back(Effect::CancelFrame(frame));
        self.effects.push_back(Effect::Say(ToMaster::Failed { frame, reason }));
    }
}
