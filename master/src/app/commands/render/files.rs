//! The display that writes frames to files.

use std::collections::VecDeque;
use std::time::Duration;

use rayfarm_farm::{FinishedFrame, ViewRequest};
use rayfarm_tracer::image::RgbImage;
use rayfarm_tracer::scene::{FrameView, RenderScale};
use tokio::runtime::Runtime;
use tokio_util::sync::CancellationToken;

use super::repair::Delivered;
use super::totals::Totals;
use crate::app::output::FrameWriter;
use crate::app::plan::Plan;
use crate::app::progress::Progress;
use crate::display::{Display, DisplayError};
use crate::error::CommandError;
use crate::viewer::{FrameSequence, SequenceFrame, Slot, ViewerHandle};

/// Interval at which the progress display shows the state of the farm.
const STATUS_EVERY: Duration = Duration::from_millis(200);

/// A frame that waits for the writer.
struct Unwritten {
    number: u64,
    frame: FinishedFrame,
    /// Place in the sequence: as long as it is held, the viewer requests fewer frames.
    _slot: Option<Slot>,
}

/// Files of a run and the frames that go to them.
pub(super) struct FrameFiles {
    /// Request that each frame answers, apart from the animation.
    pub(super) request: ViewRequest,
    pub(super) plan: Plan,
    pub(super) delivered: Delivered,
    pub(super) writer: FrameWriter,
    pub(super) totals: Totals,
    unwritten: VecDeque<Unwritten>,
}

impl FrameFiles {
    /// Files of the frames of a plan.
    pub(super) fn new(request: ViewRequest, plan: Plan, writer: FrameWriter, totals: Totals) -> Self {
        let (delivered, unwritten) = (Delivered::default(), VecDeque::new());
        Self { request, plan, delivered, writer, totals, unwritten }
    }

    /// Frames of the plan.
    pub(super) fn count(&self) -> u64 {
        self.plan.frames.len() as u64
    }

    /// Accepts a frame of the plan.
    fn accept(&mut self, frame: SequenceFrame) -> Result<(), CommandError> {
        let SequenceFrame { number, presented, slot } = frame;
        self.totals.add(&presented, number)?;
        self.hand_over(number, presented.frame, slot)
    }

    /// Queues a frame for the writer.
    ///
    /// # Errors
    /// A frame whose bytes do not fit its size.
    pub(super) fn hand_over(
        &mut self,
        number: u64,
        frame: FinishedFrame,
        slot: Option<Slot>,
    ) -> Result<(), CommandError> {
        self.delivered.add(number, frame.frame);
        if self.plan.frames.last() == Some(&number) {
            self.totals.hash = self.hash(&frame)?;
        }
        self.unwritten.push_back(Unwritten { number, frame, _slot: slot });
        Ok(())
    }

    /// Hash of the pixels as they are delivered.
    fn hash(&self, frame: &FinishedFrame) -> Result<blake3::Hash, CommandError> {
        if frame.request.scale == RenderScale::Full {
            return Ok(blake3::hash(&frame.pixels));
        }
        let FrameView { width, height, .. } = frame.view;
        let rendered = RgbImage { width, height, pixels: frame.pixels.to_vec() };
        let delivered = frame.request.delivered(rendered).map_err(CommandError::failed)?;
        Ok(blake3::hash(&delivered.pixels))
    }

    /// Passes the next queued frame to the writer, which must be ready.
    pub(super) fn write_next(&mut self) {
        if let Some(Unwritten { number, frame, _slot }) = self.unwritten.pop_front() {
            // A frame without a file keeps its memory, which serves a later frame.
            let FrameView { width, height, .. } = frame.view;
            let request = frame.request;
            self.writer.write(number, || {
                let rendered = RgbImage { width, height, pixels: frame.pixels.into_vec() };
                move || request.delivered(rendered)
            });
        }
    }
}

/// A display that writes each frame of a sequence to its file, in order and without loss.
pub(super) struct FileDisplay<'a> {
    /// Runtime on which the display waits for frames and the disk.
    pub(super) runtime: &'a Runtime,
    pub(super) files: &'a mut FrameFiles,
    pub(super) sequence: FrameSequence,
    pub(super) progress: &'a mut Progress,
    pub(super) interrupted: &'a CancellationToken,
}

impl Display for FileDisplay<'_> {
    fn run(self, viewer: ViewerHandle) -> Result<(), DisplayError> {
        self.runtime.block_on(self.write_all(&viewer))
    }
}

impl FileDisplay<'_> {
    /// Writes frames until the last one, or until the viewer ends, which then has the reason.
    async fn write_all(self, viewer: &ViewerHandle) -> Result<(), DisplayError> {
        let Self { files, mut sequence, progress, interrupted, .. } = self;
        let mut tick = tokio::time::interval(STATUS_EVERY);
        let mut arrived = 0;
        while arrived < files.count() || !files.unwritten.is_empty() {
            tokio::select! {
                biased;
                () = interrupted.cancelled() => return Err(DisplayError::Interrupted),
                ready = files.writer.ready(), if !files.unwritten.is_empty() => {
                    ready.map_err(failed)?;
                    files.write_next();
                }
                frame = sequence.next(), if arrived < files.count() => {
                    let Some(frame) = frame else { return Ok(()) };
                    files.accept(frame).map_err(failed)?;
                    arrived += 1;
                    progress.completed(arrived, files.totals.fps());
                }
                _ = tick.tick() => progress.update(&viewer.status()),
            }
        }
        Ok(())
    }
}

fn failed(error: CommandError) -> DisplayError {
    DisplayError::Failed(error.to_string())
}
