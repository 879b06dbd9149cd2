//! Frames with wrong pixels, rendered again: those with rows of a worker that was found to send wrong pixels.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::{Duration, Instant};

use rayfarm_farm::as_text;
use rayfarm_farm::{Farm, FarmError, FinishedFrame, FrameId};
use tokio_util::sync::CancellationToken;

use super::Run;
use crate::app::reports::VerificationReport;
use crate::viewer::OPEN_REQUESTS;

/// Time for the remaining verification after the last frame is complete.
pub(super) const VERIFICATION_TIMEOUT: Duration = Duration::from_secs(30);
/// Time without any worker after which frames are not rendered again but named.
const WORKER_TIMEOUT: Duration = Duration::from_secs(if cfg!(test) { 1 } else { 10 });
const POLL_EVERY: Duration = Duration::from_millis(50);

/// Frames of a run by the numbers of their files, and as the farm numbers them.
#[derive(Debug, Default)]
pub(super) struct Delivered {
    frames: BTreeMap<u64, Vec<FrameId>>,
    again: BTreeSet<u64>,
}

impl Delivered {
    /// Records the rendering that goes to a file; a later one replaces it and its auxiliary pictures.
    pub(super) fn add(&mut self, number: u64, frame: FrameId) {
        self.frames.insert(number, vec![frame]);
    }

    /// Records an auxiliary picture that goes to a file with the rendering.
    pub(super) fn add_auxiliary(&mut self, number: u64, frame: FrameId) {
        self.frames.entry(number).or_default().push(frame);
    }

    /// Files whose frames may be wrong.
    fn wrong(&self, farm: &Farm) -> Vec<u64> {
        let wrong = farm.wrong_frames();
        let is_wrong = |frames: &[FrameId]| frames.iter().any(|frame| wrong.contains(*frame));
        self.frames.iter().filter(|(_, frames)| is_wrong(frames)).map(|(&number, _)| number).collect()
    }
}

impl Run {
    /// Waits, within a timeout, until the last frames are verified, and renders again those that may be wrong, as long as
    /// workers are connected.
    pub(super) async fn repair(&mut self, farm: &mut Farm, interrupted: &CancellationToken) {
        loop {
            tokio::select! {
                () = interrupted.cancelled() => return,
                _ = tokio::time::timeout(VERIFICATION_TIMEOUT, farm.verified()) => {}
            }
            let wrong = self.files.delivered.wrong(farm);
            if wrong.is_empty() {
                return;
            }
            tracing::warn!("rendering again, because a worker sent wrong pixels: frames {}", named(&wrong));
            let rendered = tokio::select! {
                () = interrupted.cancelled() => return,
                rendered = self.render_again(farm, wrong) => rendered,
            };
            if let Err(error) = rendered {
                tracing::error!("{error}");
                return;
            }
        }
    }

    async fn render_again(&mut self, farm: &mut Farm, wrong: Vec<u64>) -> Result<(), String> {
        let requests = wrong.into_iter().flat_map(|number| {
            let frame = self.request(number);
            let auxiliary = self.files.aov.iter().map(move |aov| frame.auxiliary(aov.shading()));
            std::iter::once(frame).chain(auxiliary).map(move |request| (number, request))
        });
        let mut waiting: VecDeque<_> = requests.collect();
        let mut open = VecDeque::new();
        while !(waiting.is_empty() && open.is_empty()) {
            while open.len() < OPEN_REQUESTS
                && let Some((number, request)) = waiting.pop_front()
            {
                if let Some(scene) = self.keys.as_ref().map(|keys| keys.assets(number)).transpose()?.flatten()
                {
                    farm.replace_scene(scene);
                }
                farm.request(request);
                open.push_back(number);
            }
            let frame = next(farm).await.map_err(|error| error.to_string())?;
            let Some(number) = open.pop_front() else { break };
            self.replace(number, frame).await?;
        }
        self.files.writer.finish().await.map_err(|error| error.to_string())
    }

    async fn replace(&mut self, number: u64, frame: FinishedFrame) -> Result<(), String> {
        let files = &mut self.files;
        files.delivered.again.insert(number);
        files.collect(number, frame, None).map_err(|error| error.to_string())?;
        if files.has_complete() {
            files.writer.ready().await.map_err(|error| error.to_string())?;
            files.write_next();
        }
        Ok(())
    }

    /// Result of verification, where segments are verified.
    pub(super) fn verification(&self, farm: &Farm) -> Option<VerificationReport> {
        let counts = farm.status().verification?;
        let Delivered { again, .. } = &self.files.delivered;
        let wrong_frames = self.files.delivered.wrong(farm);
        let again = again.iter().copied().filter(|number| !wrong_frames.contains(number)).collect();
        Some(VerificationReport::of(counts, wrong_frames, again))
    }
}

/// The next frame.
///
/// # Errors
/// No worker for [`WORKER_TIMEOUT`], or a frame that cannot be rendered.
pub(super) async fn next(farm: &mut Farm) -> Result<FinishedFrame, FarmError> {
    let address = farm.address();
    let mut alone_since = None;
    loop {
        if let Ok(frame) = tokio::time::timeout(POLL_EVERY, farm.finished()).await {
            return frame;
        }
        if !farm.status().workers.is_empty() {
            alone_since = None;
        } else if alone_since.get_or_insert_with(Instant::now).elapsed() > WORKER_TIMEOUT {
            let reason = format!("none has been connected for {} s", WORKER_TIMEOUT.as_secs());
            return Err(FarmError::NoWorkers { reason, address });
        }
    }
}

/// Text of the numbers of files, with runs abbreviated.
pub(super) fn named(frames: &[u64]) -> String {
    let runs = frames.chunk_by(|one, next| one + 1 == *next);
    as_text(runs.filter_map(|run| Some((*run.first()?, *run.last()?))))
}
