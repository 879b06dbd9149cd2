//! The displays' end of a viewer: snapshots to read and a channel for input.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Instant;

use rayfarm_farm::{Entrance, FarmStatus, FinishedFrame};
use tokio::sync::{mpsc, watch};

use super::displays::DisplayId;
use super::film::FilmProgress;
use super::input_action::InputAction;
use super::knob_change::KnobChange;
use super::scene_update::SceneUpdate;
use super::statistics::Statistics;

/// Actions that wait for the viewer at most. Further ones are dropped until it has caught up.
const MAX_WAITING_ACTIONS: usize = 256;

/// A finished frame with the input that it answers.
#[derive(Debug)]
pub(crate) struct PresentedFrame {
    /// Pixels, costs, accounts, and the request that the frame answers, after the quality controller.
    pub(crate) frame: FinishedFrame,
    /// Progress of the picture, if it is rendered in passes.
    pub(crate) film: Option<FilmProgress>,
    /// Time of the input that the frame answers.
    pub(crate) input_at: Instant,
    /// Time at which the last row arrived at the viewer.
    pub(crate) completed_at: Instant,
    /// Lines of the quality controller about this frame; empty without a controller.
    pub(crate) quality: Vec<String>,
}

/// A display's access to the viewer.
///
/// Snapshots are shared and the newest one replaces its predecessor, so no display ever waits for the farm and a slow
/// display loses only intermediate frames. A display that needs every frame reads a
/// [`FrameSequence`](super::sequence::FrameSequence) instead.
#[derive(Clone, Debug)]
pub(crate) struct ViewerHandle {
    frames: watch::Receiver<Option<Arc<PresentedFrame>>>,
    status: watch::Receiver<Arc<FarmStatus>>,
    stats: watch::Receiver<Arc<Statistics>>,
    input: mpsc::Sender<(DisplayId, InputAction)>,
    entrance: Entrance,
    display: DisplayId,
    /// Number of the next display.
    next_display: Arc<AtomicU32>,
}

impl ViewerHandle {
    /// A handle for a further display. It has not returned any frame, and its picture is scaled: the first display decides the size.
    pub(crate) fn further_display(&self) -> Self {
        let mut handle = self.clone();
        handle.display = DisplayId(self.next_display.fetch_add(1, Ordering::Relaxed));
        handle.frames.mark_changed();
        handle
    }

    /// The newest frame, if this handle has not returned it before.
    pub(crate) fn new_frame(&mut self) -> Option<Arc<PresentedFrame>> {
        let newest = self.frames.borrow_and_update();
        if newest.has_changed() { newest.clone() } else { None }
    }

    /// The newest frame, whether or not this handle has returned it before.
    #[cfg(feature = "web")]
    pub(crate) fn newest_frame(&mut self) -> Option<Arc<PresentedFrame>> {
        self.frames.borrow_and_update().clone()
    }

    /// Waits for a frame that this handle has not returned. Never returns after the end of the viewer.
    #[cfg(feature = "web")]
    pub(crate) async fn frame_changed(&mut self) {
        if self.frames.changed().await.is_err() {
            std::future::pending().await
        }
    }

    /// Waits for the next change of the statistics. Never returns after the end of the viewer.
    #[cfg(feature = "web")]
    pub(crate) async fn statistics_changed(&mut self) {
        if self.stats.changed().await.is_err() {
            std::future::pending().await
        }
    }

    /// Waits until the viewer takes no more input.
    #[cfg(feature = "web")]
    pub(crate) async fn ended(&self) {
        self.input.closed().await;
    }

    /// The newest snapshot of the farm, at most about 100 ms old.
    pub(crate) fn status(&self) -> Arc<FarmStatus> {
        self.status.borrow().clone()
    }

    /// The newest statistics.
    pub(crate) fn statistics(&self) -> Arc<Statistics> {
        self.stats.borrow().clone()
    }

    /// Statistics beyond the life of this handle: a receiver does not keep the viewer running.
    pub(crate) fn statistics_receiver(&self) -> watch::Receiver<Arc<Statistics>> {
        self.stats.clone()
    }

    /// Where and how workers connect.
    pub(crate) fn entrance(&self) -> &Entrance {
        &self.entrance
    }

    /// Whether the viewer still takes input.
    pub(crate) fn is_running(&self) -> bool {
        !self.input.is_closed()
    }

    /// A sender of changes of knobs and of the denoiser, which does not keep the viewer running.
    pub(crate) fn knob_sender(&self) -> KnobSender {
        KnobSender(self.input.downgrade())
    }

    /// Sends actions of one moment together, without waiting. The size is ignored unless this display is the first. Returns `false` where the viewer has ended or is too far
    /// behind; then none of the actions is sent.
    pub(crate) fn send(&self, actions: Vec<InputAction>) -> bool {
        match self.input.try_reserve_many(actions.len()) {
            Ok(permits) => {
                permits.zip(actions).for_each(|(permit, action)| permit.send((self.display, action)));
                true
            }
            Err(_) => false,
        }
    }
}

/// Sender of changes of knobs, of the denoiser and of the scene to a viewer, which ends regardless of it.
#[derive(Clone, Debug)]
pub(crate) struct KnobSender(mpsc::WeakSender<(DisplayId, InputAction)>);

impl KnobSender {
    /// Sends a change of a knob, without waiting.
    ///
    /// # Errors
    /// A viewer that has ended, or that has too many actions to apply.
    pub(crate) fn send(&self, change: KnobChange) -> Result<(), String> {
        self.send_action(InputAction::Set(change))
    }

    /// Switches the denoiser on or off, without waiting.
    ///
    /// # Errors
    /// As [`Self::send`].
    pub(crate) fn denoise(&self, on: bool) -> Result<(), String> {
        self.send_action(InputAction::Denoise(on))
    }

    /// Shows another scene, without waiting.
    ///
    /// # Errors
    /// As [`Self::send`].
    pub(super) fn show_scene(&self, update: SceneUpdate) -> Result<(), String> {
        self.send_action(InputAction::ShowScene(Box::new(update)))
    }

    /// Reports a fault in the files of the scene, without waiting.
    ///
    /// # Errors
    /// As [`Self::send`].
    pub(super) fn report_fault(&self, fault: String) -> Result<(), String> {
        self.send_action(InputAction::SceneFault(fault))
    }

    /// Whether the viewer still takes input.
    pub(super) fn is_running(&self) -> bool {
        self.0.upgrade().is_some_and(|input| !input.is_closed())
    }

    fn send_action(&self, action: InputAction) -> Result<(), String> {
        let input = self.0.upgrade().ok_or("the view has ended")?;
        input.try_send((DisplayId::FIRST, action)).map_err(|error| match error {
            mpsc::error::TrySendError::Full(_) => {
                "the view has too many actions to apply; try again".to_owned()
            }
            mpsc::error::TrySendError::Closed(_) => "the view has ended".to_owned(),
        })
    }
}

/// The viewer's end: publishes snapshots and receives input.
#[derive(Debug)]
pub(super) struct Channels {
    /// Input of all displays; closed when the last handle is dropped.
    pub(super) input: mpsc::Receiver<(DisplayId, InputAction)>,
    frames: watch::Sender<Option<Arc<PresentedFrame>>>,
    status: watch::Sender<Arc<FarmStatus>>,
    stats: watch::Sender<Arc<Statistics>>,
}

impl Channels {
    /// Both ends, for a farm of this status whose workers connect at `entrance`.
    pub(super) fn new(entrance: Entrance, status: FarmStatus) -> (Self, ViewerHandle) {
        let (frames, frames_out) = watch::channel(None);
        let (status, status_out) = watch::channel(Arc::new(status));
        let (stats, stats_out) = watch::channel(Arc::default());
        let (input_in, input) = mpsc::channel(MAX_WAITING_ACTIONS);
        let handle = ViewerHandle {
            frames: frames_out,
            status: status_out,
            stats: stats_out,
            input: input_in,
            entrance,
            display: DisplayId::FIRST,
            next_display: Arc::new(AtomicU32::new(DisplayId::FIRST.0 + 1)),
        };
        (Self { input, frames, status, stats }, handle)
    }

    /// Replaces the newest frame.
    pub(super) fn publish_frame(&self, frame: PresentedFrame) {
        self.frames.send_replace(Some(Arc::new(frame)));
    }

    /// Replaces the snapshot of the farm.
    pub(super) fn publish_status(&self, status: FarmStatus) {
        self.status.send_replace(Arc::new(status));
    }

    /// Replaces the statistics, unless the picture rests and they say the same.
    pub(super) fn publish_statistics(&self, statistics: Statistics) {
        self.stats.send_if_modified(|newest| {
            let differs = statistics.differs_from(newest);
            if differs {
                *newest = Arc::new(statistics);
            }
            differs
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channels() -> (Channels, ViewerHandle) {
        let entrance = Entrance { address: ([127, 0, 0, 1], 9).into(), security: Default::default() };
        Channels::new(entrance, FarmStatus::default())
    }

    #[test]
    fn actions_arrive_together_and_in_order() {
        let (mut channels, handle) = channels();
        assert!(handle.send(vec![InputAction::ResetCamera, InputAction::Quit]));
        assert!(handle.send(Vec::new()));
        assert_eq!(channels.input.try_recv(), Ok((DisplayId::FIRST, InputAction::ResetCamera)));
        assert_eq!(channels.input.try_recv(), Ok((DisplayId::FIRST, InputAction::Quit)));
        assert!(channels.input.try_recv().is_err());
    }

    #[test]
    fn a_viewer_that_is_behind_receives_all_actions_of_a_moment_or_none() {
        let (mut channels, handle) = channels();
        assert!(handle.send(vec![InputAction::ResetCamera; MAX_WAITING_ACTIONS - 1]));
        assert!(!handle.send(vec![InputAction::Quit; 2]));
        assert!(handle.send(vec![InputAction::Quit]));
        let mut actions = Vec::new();
        while let Ok((_, action)) = channels.input.try_recv() {
            actions.push(action);
        }
        assert_eq!(actions.len(), MAX_WAITING_ACTIONS);
        assert_eq!(actions.last(), Some(&InputAction::Quit));
    }

    #[test]
    fn a_handle_outlives_its_viewer() {
        let (channels, mut handle) = channels();
        assert!(handle.is_running());
        channels.publish_statistics(Statistics { completed: 3, ..Statistics::default() });
        drop(channels);
        assert!(!handle.is_running() && !handle.send(vec![InputAction::Quit]));
        assert!(handle.new_frame().is_none());
        assert_eq!(handle.statistics().completed, 3);
    }

    #[test]
    fn equal_statistics_at_rest_wake_no_display() {
        let (channels, handle) = channels();
        let mut stats = handle.statistics_receiver();
        let rest = Statistics { completed: 1, resting: true, ..Statistics::default() };
        channels.publish_statistics(rest.clone());
        assert!(stats.borrow_and_update().resting);
        channels.publish_statistics(rest.clone());
        assert!(!stats.has_changed().unwrap());
        channels.publish_statistics(Statistics { completed: 2, ..rest });
        assert!(stats.has_changed().unwrap());
    }
}
