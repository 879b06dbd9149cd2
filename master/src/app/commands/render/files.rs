//! The display that writes frames to files.

use std::collections::VecDeque;
use std::time::Duration;

use rayfarm_farm::{FinishedFrame, ViewRequest};
use rayfarm_tracer::PixelFormat;
use rayfarm_tracer::image::{ImageError, RgbImage};
use rayfarm_tracer::scene::{FrameView, RenderScale, Shading};
use tokio::runtime::Runtime;
use tokio_util::sync::CancellationToken;

use super::denoised::Denoised;
use super::repair::Delivered;
use super::totals::Totals;
use crate::app::cli::Aov;
use crate::app::frame_writer::FrameWriter;
use crate::app::picture::{BEAUTY, Picture};
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
    /// Its auxiliary pictures so far.
    auxiliary: Vec<FinishedFrame>,
    /// Place in the sequence: as long as it is held, the viewer requests fewer frames.
    _slot: Option<Slot>,
}

/// Files of a run and the frames that go to them.
pub(super) struct FrameFiles {
    /// Request that each frame answers, apart from the animation.
    pub(super) request: ViewRequest,
    /// Auxiliary pictures of each frame.
    pub(super) aov: Vec<Aov>,
    /// Conversion of frames whose noise is filtered; the requested frames are sums then, with all guides.
    pub(super) denoised: Option<Denoised>,
    pub(super) plan: Plan,
    pub(super) delivered: Delivered,
    pub(super) writer: FrameWriter,
    pub(super) totals: Totals,
    unwritten: VecDeque<Unwritten>,
}

impl FrameFiles {
    /// Files of the frames of a plan.
    pub(super) fn new(
        request: ViewRequest,
        aov: Vec<Aov>,
        denoised: Option<Denoised>,
        plan: Plan,
        writer: FrameWriter,
        totals: Totals,
    ) -> Self {
        let (delivered, unwritten) = (Delivered::default(), VecDeque::new());
        Self { request, aov, denoised, plan, delivered, writer, totals, unwritten }
    }

    /// Pictures that the auxiliary pictures of the plan's frames are.
    pub(super) fn auxiliary(&self) -> Vec<Shading> {
        self.aov.iter().map(|aov| aov.shading()).collect()
    }

    /// Frames of the plan.
    pub(super) fn count(&self) -> u64 {
        self.plan.frames.len() as u64
    }

    /// Pictures of the plan: frames and their auxiliary pictures.
    pub(super) fn pictures(&self) -> u64 {
        self.count() * (1 + self.aov.len() as u64)
    }

    /// Accepts a picture of the plan: a frame, or the next auxiliary picture of the last one. Returns whether it is a frame.
    fn accept(&mut self, picture: SequenceFrame) -> Result<bool, CommandError> {
        let SequenceFrame { number, presented, slot } = picture;
        let is_frame = !self.lacks_auxiliary();
        if is_frame {
            self.totals.add(&presented, number)?;
        }
        self.collect(number, presented.frame, slot)?;
        Ok(is_frame)
    }

    /// Whether the last queued frame lacks auxiliary pictures.
    fn lacks_auxiliary(&self) -> bool {
        self.unwritten.back().is_some_and(|last| last.auxiliary.len() < self.aov.len())
    }

    /// Whether the first queued frame has all of its auxiliary pictures.
    pub(super) fn has_complete(&self) -> bool {
        self.unwritten.front().is_some_and(|first| first.auxiliary.len() == self.aov.len())
    }

    /// Queues a frame for the writer, or adds an auxiliary picture to the last one, whose slot is free then.
    ///
    /// # Errors
    /// A frame whose bytes do not fit its size.
    pub(super) fn collect(
        &mut self,
        number: u64,
        frame: FinishedFrame,
        slot: Option<Slot>,
    ) -> Result<(), CommandError> {
        let of_last = self.unwritten.back_mut().filter(|last| last.auxiliary.len() < self.aov.len());
        if let Some(last) = of_last {
            self.delivered.add_auxiliary(number, frame.frame);
            last.auxiliary.push(frame);
            return Ok(());
        }
        self.delivered.add(number, frame.frame);
        if self.plan.frames.last() == Some(&number) {
            self.totals.hash = self.hash(&frame)?;
        }
        self.unwritten.push_back(Unwritten { number, frame, auxiliary: Vec::new(), _slot: slot });
        Ok(())
    }

    /// Hash of the pixels as they are delivered, or of the sums where their noise is filtered for the file.
    fn hash(&self, frame: &FinishedFrame) -> Result<blake3::Hash, CommandError> {
        if frame.request.scale == RenderScale::Full || frame.format() == PixelFormat::Sums {
            return Ok(blake3::hash(&frame.pixels));
        }
        let FrameView { width, height, .. } = frame.view;
        let rendered = RgbImage { width, height, pixels: frame.pixels.to_vec() };
        let delivered = frame.request.delivered(rendered).map_err(CommandError::failed)?;
        Ok(blake3::hash(&delivered.pixels))
    }

    /// Passes the next queued frame to the writer, which must be ready.
    pub(super) fn write_next(&mut self) {
        if let Some(Unwritten { number, frame, auxiliary, _slot }) = self.unwritten.pop_front() {
            // A frame without a file keeps its memory, which serves a later frame.
            let (aov, denoised) = (self.aov.clone(), self.denoised);
            self.writer.write(number, || {
                move || {
                    let auxiliary = aov.into_iter().zip(auxiliary);
                    match denoised {
                        None => picture(frame, auxiliary),
                        Some(denoised) => denoised.picture(&frame, auxiliary),
                    }
                }
            });
        }
    }
}

/// The picture of a frame and its auxiliary pictures.
fn picture(
    frame: FinishedFrame,
    auxiliary: impl Iterator<Item = (Aov, FinishedFrame)>,
) -> Result<Picture, ImageError> {
    if let Some(beauty) = frame.linear() {
        let auxiliary = auxiliary.filter_map(|(aov, frame)| Some((aov, frame.linear()?)));
        return Ok(Picture::of_layers(BEAUTY, beauty, auxiliary));
    }
    let FrameView { width, height, .. } = frame.view;
    let request = frame.request;
    request.delivered(RgbImage { width, height, pixels: frame.pixels.into_vec() }).map(Picture::from)
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
        let (mut arrived, mut frames) = (0, 0);
        let pictures = files.pictures();
        while arrived < pictures || !files.unwritten.is_empty() {
            tokio::select! {
                biased;
                () = interrupted.cancelled() => return Err(DisplayError::Interrupted),
                ready = files.writer.ready(), if files.has_complete() => {
                    ready.map_err(failed)?;
                    files.write_next();
                }
                frame = sequence.next(), if arrived < pictures => {
                    let Some(frame) = frame else { return Ok(()) };
                    frames += u64::from(files.accept(frame).map_err(failed)?);
                    arrived += 1;
                    progress.completed(frames, files.totals.fps());
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
