//! A master for one worker, at the other end of a pipe.

use std::ops::Range;

use bytes::Bytes;
use rayfarm_protocol::session::{self, Receiver, Sender};
use rayfarm_protocol::transport::WorkerSecurity;
use rayfarm_protocol::{AssetId, FrameAnnounce, FrameId, Lease, PixelFormat, ToMaster, ToWorker};
use tokio::task::JoinHandle;

use super::{FakeRenderer, HEIGHT, WIDTH};
use crate::peer::{PeerClient, PeerServer};
use crate::session::{PersistentState, SessionConfig, SessionEnd, run_session};
use crate::shutdown::ShutdownHandle;

/// A lease of these rows, whose segment has the number of the first row.
pub(super) fn lease(frame: u64, rows: Range<u32>) -> Lease {
    let (first_row, row_count) = (rows.start, rows.end - rows.start);
    Lease { frame: FrameId(frame), segment: first_row, attempt: 0, first_row, row_count }
}

/// A master for one worker. It sends requested assets by itself; the test sends everything else.
pub(super) struct FakeMaster {
    pub(super) out: Sender<ToWorker>,
    pub(super) inbox: Receiver<ToMaster>,
    pub(super) worker: JoinHandle<(SessionEnd, PersistentState<FakeRenderer>)>,
    pub(super) shutdown: ShutdownHandle,
    assets: Vec<(AssetId, Vec<u8>)>,
    /// Requested assets, in order.
    pub(super) requests: Vec<AssetId>,
}

impl FakeMaster {
    /// Starts a session with a worker of this state.
    pub(super) fn start(worker: PersistentState<FakeRenderer>, assets: &[&[u8]]) -> Self {
        let plain = PeerClient { security: WorkerSecurity::Plain, within_machine: true };
        Self::start_with_peers(worker, assets, None, plain)
    }

    /// Starts a session with a worker that serves assets to other workers.
    pub(super) fn start_with_peers(
        mut worker: PersistentState<FakeRenderer>,
        assets: &[&[u8]],
        peer_server: Option<PeerServer>,
        peer_client: PeerClient,
    ) -> Self {
        let (ours, theirs) = tokio::io::duplex(1 << 16);
        let shutdown = ShutdownHandle::new();
        let worker_shutdown = shutdown.clone();
        let worker = tokio::spawn(async move {
            let config = SessionConfig {
                compress: false,
                uses_disk: worker.disk.is_some(),
                peer_server,
                peer_client,
                max_segment_bytes: None,
            };
            let end = run_session(theirs, config, &mut worker, &worker_shutdown).await;
            (end, worker)
        });
        let (out, inbox, _) = session::spawn(ours);
        let assets = assets.iter().map(|bytes| (AssetId::of(bytes), bytes.to_vec())).collect();
        Self { out, inbox, worker, shutdown, assets, requests: Vec::new() }
    }

    /// Replaces the bytes that are sent for an asset.
    pub(super) fn corrupt(&mut self, original: &[u8], bytes: &[u8]) {
        self.assets.retain(|(id, _)| *id != AssetId::of(original));
        self.assets.push((AssetId::of(original), bytes.to_vec()));
    }

    pub(super) async fn send(&self, message: ToWorker) {
        self.out.send(message).await.unwrap();
    }

    /// Announces a frame with this scene body and this view.
    pub(super) async fn announce(&self, frame: u64, scene: &[u8], view: &[u8]) {
        let view = Bytes::copy_from_slice(view);
        let scene = AssetId::of(scene);
        let (frame, width, height) = (FrameId(frame), WIDTH, HEIGHT);
        self.send(ToWorker::Frame(FrameAnnounce {
            frame,
            scene,
            width,
            height,
            format: PixelFormat::Rgb8,
            view,
        }))
        .await;
    }

    /// Receives the next message that is no request for an asset. Serves requests before it.
    pub(super) async fn receive(&mut self) -> Option<ToMaster> {
        loop {
            match self.inbox.recv().await?.unwrap() {
                ToMaster::NeedAsset { id, offset, .. } => self.send_asset(id, offset).await,
                message => return Some(message),
            }
        }
    }

    /// Sends an asset from byte `first` on.
    pub(super) async fn send_asset(&mut self, id: AssetId, first: u64) {
        self.requests.push(id);
        let Some((_, bytes)) = self.assets.iter().find(|(known, _)| *known == id) else {
            self.send(ToWorker::AssetUnknown { id }).await;
            return;
        };
        self.send(ToWorker::AssetBegin { id, size: bytes.len() as u64 }).await;
        let chunk_bytes = if bytes.len() > 1000 { 100_000 } else { 7 };
        let chunks = bytes[first as usize..].chunks(chunk_bytes).enumerate();
        let chunks: Vec<_> = chunks
            .map(|(i, chunk)| (first + (i * chunk_bytes) as u64, Bytes::copy_from_slice(chunk)))
            .collect();
        for (offset, bytes) in chunks {
            self.send(ToWorker::AssetChunk { id, offset, bytes }).await;
        }
    }

    /// Serves the next request for an asset.
    pub(super) async fn serve_request(&mut self) {
        let (id, offset, _) = self.receive_request().await;
        self.send_asset(id, offset).await;
    }

    /// Receives the next request for an asset without serving it: its id, its offset, and whether a transfer from another
    /// worker has failed.
    pub(super) async fn receive_request(&mut self) -> (AssetId, u64, bool) {
        loop {
            match self.inbox.recv().await.unwrap().unwrap() {
                ToMaster::NeedAsset { id, offset, again } => return (id, offset, again),
                ToMaster::Pong { .. } => {}
                other => panic!("expected a request for an asset, not {other:?}"),
            }
        }
    }

    /// Receives the next finished lease with its pixels.
    pub(super) async fn receive_pixels(&mut self) -> (Lease, Bytes) {
        match self.receive().await {
            Some(ToMaster::Pixels { header, bytes }) => (header.lease, bytes),
            other => panic!("expected pixels, not {other:?}"),
        }
    }

    /// Receives the failure of a frame and returns its reason.
    pub(super) async fn receive_failure(&mut self, expected: u64) -> String {
        match self.receive().await {
            Some(ToMaster::Failed { frame, reason }) if frame == FrameId(expected) => reason,
            other => panic!("expected the failure of frame {expected}, not {other:?}"),
        }
    }

    /// Closes the connection and returns the end of the session and the worker's state.
    pub(super) async fn close(self) -> (SessionEnd, PersistentState<FakeRenderer>) {
        drop((self.out, self.inbox));
        self.worker.await.unwrap()
    }
}
