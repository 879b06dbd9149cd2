//! Frames that are wrong, rendered again: those with rows of a worker that was found to send wrong pixels.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::{Duration, Instant};

use tokio_util::sync::CancellationToken;

use super::{OPEN_REQUESTS, Run};
use crate::app::reports::VerificationReport;
use crate::delivered::as_text;
use crate::farm::{Farm, FarmError, FinishedFrame, FrameId};

/// How long what is left to verify may take when the last frame is complete.
const VERIFICATION: Duration = Duration::from_secs(30);
/// How long no worker may be there before frames are not rendered again but named.
const PATIENCE: Duration = Duration::from_secs(if cfg!(test) { 1 } else { 10 });
const LOOK_EVERY: Duration = Duration::from_millis(50);

/// The frames of a run as the farm knows them.
#[derive(Debug, Default)]
pub(super) struct Taken {
    /// By the number of the file.
    frames: BTreeMap<u64, FrameId>,
    again: BTreeSet<u64>,
}

impl Taken {
    pub(super) fn add(&mut self, index: u64, frame: FrameId) {
        self.frames.insert(index, frame);
    }

    /// Those that may be wrong.
    fn wrong(&self, farm: &Farm) -> Vec<u64> {
        let wrong = farm.wrong_frames();
        self.frames.iter().filter(|(_, frame)| wrong.contains(**frame)).map(|(&index, _)| index).collect()
    }
}

impl Run {
    /// Waits, not for ever, until the last frames are verified, and renders again those that may be wrong, for as long as
    /// there are workers.
    pub(super) async fn repair(&mut self, farm: &mut Farm, interrupted: &CancellationToken) {
        loop {
            tokio::select! {
                () = interrupted.cancelled() => return,
                _ = tokio::time::timeout(VERIFICATION, farm.verified()) => {}
            }
            let wrong = self.taken.wrong(farm);
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
        let mut waiting = VecDeque::from(wrong);
        let mut open = VecDeque::new();
        while !(waiting.is_empty() && open.is_empty()) {
            while open.len() < OPEN_REQUESTS as usize
                && let Some(index) = waiting.pop_front()
            {
                farm.request(self.animation.view(&self.wanted.rendered(), index));
                open.push_back(index);
            }
            let frame = next(farm).await.map_err(|error| error.to_string())?;
            let Some(index) = open.pop_front() else { break };
            self.replace(index, frame).await?;
        }
        self.writer.finish().await.map_err(|error| error.to_string())
    }

    async fn replace(&mut self, index: u64, frame: FinishedFrame) -> Result<(), String> {
        self.writer.ready().await.map_err(|error| error.to_string())?;
        self.taken.add(index, frame.frame);
        self.taken.again.insert(index);
        if self.plan.frames.last() == Some(&index) {
            self.totals.hash = self.hash(&frame).map_err(|error| error.to_string())?;
        }
        self.unwritten.push_back((index, frame));
        self.write_next();
        Ok(())
    }

    /// What verification has shown, where there is any; frames that are still wrong are named in the log.
    pub(super) fn verification(&self, farm: &Farm) -> Option<VerificationReport> {
        let counts = farm.status().verification?;
        let wrong_frames = self.taken.wrong(farm);
        let again = self.taken.again.iter().copied().filter(|index| !wrong_frames.contains(index)).collect();
        Some(VerificationReport::of(counts, wrong_frames, again))
    }
}

/// The next frame, unless no worker is there for long.
async fn next(farm: &mut Farm) -> Result<FinishedFrame, FarmError> {
    let address = farm.address();
    let mut alone_since = None;
    loop {
        if let Ok(frame) = tokio::time::timeout(LOOK_EVERY, farm.finished()).await {
            return frame;
        }
        if !farm.status().workers.is_empty() {
            alone_since = None;
        } else if alone_since.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
            let reason = format!("none has been connected for {} s", PATIENCE.as_secs());
            return Err(FarmError::NoWorkers { reason, address });
        }
    }
}

/// Frames by the numbers of their files.
pub(super) fn named(frames: &[u64]) -> String {
    let runs = frames.chunk_by(|one, next| one + 1 == *next);
    as_text(runs.filter_map(|run| Some((*run.first()?, *run.last()?))))
}
