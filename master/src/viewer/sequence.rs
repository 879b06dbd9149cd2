//! Lossless delivery: every frame of a plan, once and in order.

use std::sync::Arc;

use rayfarm_farm::ViewRequest;
use rayfarm_tracer::scene::Shading;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};

use super::handle::PresentedFrame;
use super::open_requests::OPEN_REQUESTS;

/// Complete frames that may wait for the display, for instance for a disk.
const MAX_UNTAKEN: usize = 2;
/// Frames of a sequence that exist at a time: requested, complete, or held by the display.
const MAX_FRAMES: usize = OPEN_REQUESTS + MAX_UNTAKEN;

/// A frame of a sequence.
#[derive(Debug)]
pub(crate) struct SequenceFrame {
    /// Number of the frame in the camera path.
    pub(crate) number: u64,
    /// The frame and its request.
    pub(crate) presented: PresentedFrame,
    /// Place of the frame; a further frame is requested when it is dropped.
    pub(crate) slot: Option<Slot>,
}

/// A place among the frames of a sequence that exist at a time; free again when dropped.
pub(crate) type Slot = OwnedSemaphorePermit;

/// The display's end of a sequence.
///
/// Unlike the frames of a [`ViewerHandle`](super::ViewerHandle), which the newest one replaces, each frame arrives. A
/// display that does not drop its frames stops the viewer from requesting further ones.
#[derive(Debug)]
pub(crate) struct FrameSequence(mpsc::Receiver<SequenceFrame>);

impl FrameSequence {
    /// Waits for the next frame; `None` when the viewer has ended. Cancel safe.
    pub(crate) async fn next(&mut self) -> Option<SequenceFrame> {
        self.0.recv().await
    }
}

/// The viewer's end of a sequence.
#[derive(Debug)]
pub(super) struct SequenceSender(mpsc::Sender<SequenceFrame>);

impl SequenceSender {
    /// Delivers a frame. A display that has ended receives none.
    pub(super) fn deliver(&self, frame: SequenceFrame) {
        // Never full: the channel has a place for each slot.
        let _ = self.0.try_send(frame);
    }
}

/// Frame numbers to render, and the slots that bound how many of them exist at a time.
#[derive(Clone, Debug)]
pub(super) struct SequencePlan {
    numbers: Arc<[u64]>,
    /// Auxiliary pictures that follow each frame.
    auxiliary: Arc<[Shading]>,
    slots: Arc<Semaphore>,
}

impl SequencePlan {
    /// The plan and both ends of its delivery. `numbers` are frames of the camera path, in order; each is followed by its
    /// auxiliary pictures.
    pub(super) fn new(numbers: &[u64], auxiliary: &[Shading]) -> (Self, SequenceSender, FrameSequence) {
        let (sender, receiver) = mpsc::channel(MAX_FRAMES);
        let slots = Arc::new(Semaphore::new(MAX_FRAMES));
        let plan = Self { numbers: numbers.into(), auxiliary: auxiliary.into(), slots };
        (plan, SequenceSender(sender), FrameSequence(receiver))
    }

    /// Pictures of the plan.
    pub(super) fn len(&self) -> u64 {
        self.numbers.len() as u64 * self.per_frame()
    }

    /// Pictures of each frame.
    fn per_frame(&self) -> u64 {
        1 + self.auxiliary.len() as u64
    }

    /// Number of the frame of the picture at an index of the plan.
    pub(super) fn number(&self, index: u64) -> Option<u64> {
        self.numbers.get(usize::try_from(index / self.per_frame()).ok()?).copied()
    }

    /// The request for the picture at an index of the plan: that of its frame, or for an auxiliary picture.
    pub(super) fn request(&self, index: u64, frame: ViewRequest) -> ViewRequest {
        let place = (index % self.per_frame()).checked_sub(1).and_then(|place| usize::try_from(place).ok());
        let shading = place.and_then(|place| self.auxiliary.get(place));
        shading.map_or(frame, |shading| frame.auxiliary(*shading))
    }

    /// A slot for another frame, if one is free.
    pub(super) fn free_slot(&self) -> Option<Slot> {
        self.slots.clone().try_acquire_owned().ok()
    }

    /// Waits until a slot is free, without taking it. Cancel safe.
    pub(super) async fn slot_is_free(&self) {
        // Fails only for a closed semaphore, and this one is never closed.
        let _ = self.slots.acquire().await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayfarm_farm::testing::test_scene;

    #[test]
    fn frames_are_numbered_by_the_plan() {
        let (plan, _, _) = SequencePlan::new(&[3, 5, 9], &[]);
        assert_eq!(plan.len(), 3);
        assert_eq!([0, 1, 2, 3].map(|index| plan.number(index)), [Some(3), Some(5), Some(9), None]);
    }

    #[test]
    fn auxiliary_pictures_follow_their_frame() {
        let (plan, _, _) = SequencePlan::new(&[3, 5], &[Shading::Depth, Shading::Albedo]);
        assert_eq!(plan.len(), 6);
        assert_eq!(
            [0, 2, 3, 5, 6].map(|index| plan.number(index)),
            [Some(3), Some(3), Some(5), Some(5), None]
        );
        let frame = ViewRequest::from(test_scene::view());
        let shadings = [0, 1, 2, 3, 5].map(|index| plan.request(index, frame).view.quality.shading);
        let own = frame.view.quality.shading;
        assert_eq!(shadings, [own, Shading::Depth, Shading::Albedo, own, Shading::Albedo]);
        assert_eq!(plan.request(3, frame), frame);
    }

    #[tokio::test]
    async fn a_slot_is_free_again_when_its_frame_is_dropped() {
        let (plan, _, _) = SequencePlan::new(&[0], &[]);
        let mut slots: Vec<Slot> = std::iter::from_fn(|| plan.free_slot()).collect();
        assert_eq!(slots.len(), MAX_FRAMES);
        slots.pop();
        plan.slot_is_free().await;
        assert!(plan.free_slot().is_some());
    }
}
