//! State machine of a session: messages, results and times in, effects out. No socket, no thread, no clock.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use bytes::Bytes;
use rayfarm_protocol::peer::ShareKey;
use rayfarm_protocol::{AssetId, FrameAnnounce, FrameId, Lease, Reconnect, ToMaster, ToWorker};

use super::frames::{FrameTable, LeaseDecision};
use crate::cancel::CancelFlag;
use crate::peer::{PartialAsset, PeerEvent, PeerSource};
use crate::render_pool::ReadyFrame;
use crate::renderer::Renderer;
use crate::scenes::{AssetRequest, SceneLoader, SceneResult, SceneWork, Step};

/// Action for the runner.
pub(super) enum Effect<R: Renderer> {
    /// Send a message to the master.
    Send(ToMaster),
    /// Reply to the ping of this number, with the progress since the last reply.
    Pong(u64),
    /// Run work on a blocking thread, and pass its result to [`SessionState::handle_result`].
    Work(Work<R>),
    /// Write an asset to the disk cache.
    Save(AssetId, Bytes),
    /// Fetch an asset of `size` bytes from another worker, and pass its events to [`SessionState::handle_peer_event`].
    FetchFromPeer { id: AssetId, size: u64, source: PeerSource },
    /// Serve an asset to other workers.
    Serve(AssetId, Arc<PartialAsset>),
    /// Set the next key of the tokens that give access to served assets.
    SetShareKey { generation: u64, key: ShareKey },
    /// Render a lease.
    Render { lease: Lease, rows: Range<u32>, frame: Arc<ReadyFrame<R::Frame>>, arrived: Instant },
    /// Cancel the leases of all frames before this one.
    CancelBefore(FrameId),
    /// Cancel the leases of this frame.
    CancelFrame(FrameId),
    /// End the session when all leases are done.
    Drain,
    /// End the session: the master has disconnected.
    End { reason: String, reconnect: Reconnect },
}

/// Work for a blocking thread.
pub(super) enum Work<R: Renderer> {
    /// A step of loading a scene.
    Scene(SceneWork<R>),
    /// Prepare a frame of a scene.
    Prepare { announce: FrameAnnounce, scene: Arc<R::Scene>, cancel: CancelFlag },
}

/// Result of a [`Work`].
pub(super) enum WorkResult<R: Renderer> {
    /// Result of a step of loading a scene.
    Scene(SceneResult<R>),
    /// The prepared frame.
    Prepared { frame: FrameId, result: Result<ReadyFrame<R::Frame>, String> },
}

/// State of one session. The caller drains [`poll_effect`](Self::poll_effect) after every other call.
pub(super) struct SessionState<'a, R: Renderer> {
    loader: &'a mut SceneLoader<R>,
    frames: FrameTable<ReadyFrame<R::Frame>>,
    effects: VecDeque<Effect<R>>,
}

impl<'a, R: Renderer> SessionState<'a, R> {
    /// Begins a session with the scenes that the loader has kept. `has_disk` says whether there is a disk cache,
    /// `serves_peers` whether assets are served to other workers.
    pub(super) fn new(loader: &'a mut SceneLoader<R>, has_disk: bool, serves_peers: bool) -> Self {
        loader.reset(has_disk, serves_peers);
        Self { loader, frames: FrameTable::new(), effects: VecDeque::new() }
    }

    /// Refuses leases with more than `bytes` of pixels.
    pub(super) fn limit_segments(&mut self, bytes: usize) {
        self.frames.limit_segments(bytes);
    }

    /// Returns the next effect to perform.
    pub(super) fn poll_effect(&mut self) -> Option<Effect<R>> {
        self.effects.pop_front()
    }

    /// Whether leases wait for their frames.
    pub(super) fn has_waiting_leases(&self) -> bool {
        self.frames.has_waiting_leases()
    }

    /// Handles a message of the master that arrived at time `now`.
    pub(super) fn handle_message(&mut self, now: Instant, message: ToWorker) {
        match message {
            ToWorker::Frame(announce) => self.announce(announce),
            ToWorker::Segment(lease) => self.lease(lease, now),
            ToWorker::Cancel { before } => {
                self.frames.cancel_before(before);
                self.effects.push_back(Effect::CancelBefore(before));
            }
            ToWorker::AssetBegin { id, size } => self.loader.handle_asset_begin(id, size),
            ToWorker::AssetChunk { id, offset, bytes } => self.loader.handle_asset_chunk(id, offset, &bytes),
            ToWorker::AssetUnknown { id } => self.loader.handle_asset_unknown(id),
            ToWorker::AssetFrom { id, size, peer, peer_key, token } => {
                let source = PeerSource { address: peer, key: peer_key, token };
                self.loader.handle_asset_from(id, size, source);
            }
            ToWorker::ShareKey { key, generation } => {
                self.effects.push_back(Effect::SetShareKey { generation, key });
            }
            ToWorker::Ping { nonce } => self.effects.push_back(Effect::Pong(nonce)),
            ToWorker::Drain => self.effects.push_back(Effect::Drain),
            ToWorker::Disconnect { reason, reconnect } => {
                self.effects.push_back(Effect::End { reason, reconnect });
            }
        }
        self.forward_steps();
    }

    /// Handles an event of a transfer from another worker.
    pub(super) fn handle_peer_event(&mut self, event: PeerEvent) {
        self.loader.handle_peer_event(event);
        self.forward_steps();
    }

    /// Handles the result of an [`Effect::Work`].
    pub(super) fn handle_result(&mut self, result: WorkResult<R>) {
        match result {
            WorkResult::Scene(result) => self.loader.handle_result(result),
            WorkResult::Prepared { frame, result: Ok(ready) } => {
                for (lease, arrived) in self.frames.set_ready(frame, ready) {
                    self.lease(lease, arrived);
                }
            }
            WorkResult::Prepared { frame, result: Err(reason) } => self.fail_frame(frame, reason),
        }
        self.forward_steps();
    }

    /// Fails a frame. The master receives one report per announcement of the frame.
    pub(super) fn fail_frame(&mut self, frame: FrameId, reason: String) {
        if self.frames.fail(frame) {
            self.report_failure(frame, reason);
        }
    }

    fn announce(&mut self, announce: FrameAnnounce) {
        let scene = announce.scene;
        let (is_new, dropped) = self.frames.announce(announce);
        self.effects.extend(dropped.map(Effect::CancelFrame));
        if is_new {
            self.loader.set_current(self.frames.scenes());
            self.loader.load(scene);
        }
    }

    fn lease(&mut self, lease: Lease, arrived: Instant) {
        match self.frames.lease(lease, arrived) {
            LeaseDecision::Render(rows, frame) => {
                self.effects.push_back(Effect::Render { lease, rows, frame, arrived });
            }
            LeaseDecision::None => {}
            LeaseDecision::Refuse(reason) => {
                self.frames.fail(lease.frame);
                self.report_failure(lease.frame, reason);
            }
        }
    }

    /// Converts the loader's steps to effects.
    fn forward_steps(&mut self) {
        while let Some(step) = self.loader.poll_step() {
            match step {
                Step::Request(AssetRequest { id, offset, again }) => {
                    self.effects.push_back(Effect::Send(ToMaster::NeedAsset { id, offset, again }));
                }
                Step::FetchFromPeer { id, size, source } => {
                    self.effects.push_back(Effect::FetchFromPeer { id, size, source });
                }
                Step::Serve(id, asset) => self.effects.push_back(Effect::Serve(id, asset)),
                Step::Arrived(id) => self.effects.push_back(Effect::Send(ToMaster::HaveAsset { id })),
                Step::Save(id, bytes) => self.effects.push_back(Effect::Save(id, bytes)),
                Step::Work(work) => self.effects.push_back(Effect::Work(Work::Scene(work))),
                Step::Ready(id, scene) => {
                    let frames = self.frames.scene_ready(id).into_iter();
                    let prepare =
                        |(announce, cancel)| Work::Prepare { announce, scene: Arc::clone(&scene), cancel };
                    self.effects.extend(frames.map(|frame| Effect::Work(prepare(frame))));
                }
                Step::Failed(id, reason) => {
                    for frame in self.frames.scene_failed(id) {
                        self.report_failure(frame, reason.clone());
                    }
                }
            }
        }
    }

    fn report_failure(&mut self, frame: FrameId, reason: String) {
        tracing::error!("cannot render frame {frame}: {reason}");
        self.effects.push_back(Effect::CancelFrame(frame));
        self.effects.push_back(Effect::Send(ToMaster::Failed { frame, reason }));
    }
}
