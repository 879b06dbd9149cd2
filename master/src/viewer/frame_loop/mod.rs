//! The viewer: owns camera, quality controller, requests and statistics, and runs the frame loop over the farm.
//!
//! Input of all displays arrives as actions. Snapshots of frames, farm and statistics go out, and no display is waited for.
//! While something moves, [`OPEN_REQUESTS`](super::open_requests::OPEN_REQUESTS) frames are in flight, and a moved camera
//! replaces the last one as long as it has not begun. At rest the picture is requested once; from then on the loop only
//! looks at the farm ten times a second. A picture of the path integrator at rest is requested in passes instead, and what its
//! [`film`](super::film) shows is published after each.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayfarm_farm::{Farm, FarmError, FinishedFrame, ViewRequest};
use rayfarm_tracer::image::MAX_SIDE;
use rayfarm_tracer::scene::{FrameView, Shading};
use tokio_util::sync::CancellationToken;

use super::camera_control::CameraControl;
use super::displays::{DisplayId, Visibility};
use super::error::ViewerError;
use super::film::FilmProgress;
use super::film::pass::Pass;
use super::film::passes::has_passes;
use super::film::still::{Added, Redeveloped, StillFilm, alone};
use super::frame_log::FrameLogFile;
use super::handle::{Channels, PresentedFrame, ViewerHandle};
use super::input_action::InputAction;
use super::keyed_scene::KeyedScene;
use super::orbit::Animation;
use super::quality_controller::QualityController;
use super::requests::{Answered, RequestPolicy, Requests, ViewState};
use super::sequence::{FrameSequence, SequenceFrame, SequencePlan, SequenceSender};
use super::statistics::ViewerState;

/// Interval at which displays receive the state of the farm.
const STATUS_EVERY: Duration = Duration::from_millis(100);
/// Actions that are applied together at most, before the next request.
const MAX_ACTIONS: usize = 64;

/// Configuration of an interactive viewer.
pub(crate) struct ViewerConfig {
    /// The first view.
    pub(crate) request: ViewRequest,
    /// Camera that input moves; at first, that of `request`.
    pub(crate) camera: CameraControl,
    /// Rules by which frames are requested.
    pub(crate) policy: RequestPolicy,
    /// Log with a line per frame.
    pub(crate) log: Option<FrameLogFile>,
    /// Controller that holds a frame rate.
    pub(crate) controller: Option<QualityController>,
    /// Whether pictures of paths at rest are shown without most of their noise at first.
    pub(crate) denoised: bool,
}

/// The owner of a view over a farm.
///
/// An interactive viewer publishes the newest frame, which replaces its predecessor (latest wins). A viewer of a sequence
/// has a second delivery instead, bounded and lossless: each frame of a plan arrives once and in order, and as long as the
/// display holds too many of them none is requested.
pub(crate) struct Viewer {
    farm: Farm,
    state: ViewState,
    visibility: Visibility,
    camera: CameraControl,
    requests: Requests,
    film: StillFilm,
    /// Request that the next picture of the film answers, which is being developed.
    developing: Option<Answered>,
    figures: ViewerState,
    log: Option<FrameLogFile>,
    channels: Channels,
    sequence: Option<SequenceSender>,
}

impl Viewer {
    /// A viewer of a view that input changes, and the handle for its displays.
    pub(crate) fn interactive(farm: Farm, config: ViewerConfig) -> (Self, ViewerHandle) {
        let ViewerConfig { request, camera, policy, log, controller, denoised } = config;
        let (channels, handle) = Channels::new(farm.entrance(), farm.status());
        let viewer = Self {
            farm,
            state: ViewState { request, scene: 0, hidden: false, denoised },
            visibility: Visibility::default(),
            camera,
            requests: Requests::new(policy, controller),
            film: StillFilm::new(denoised),
            developing: None,
            figures: ViewerState::new(),
            log,
            channels,
            sequence: None,
        };
        (viewer, handle)
    }

    /// A viewer that renders the frames `numbers` of an animation, each followed by its auxiliary pictures, in order. Their display reads them from the sequence.
    pub(crate) fn sequence(
        farm: Farm,
        request: ViewRequest,
        animation: Animation,
        numbers: &[u64],
        auxiliary: &[Shading],
        keys: Option<KeyedScene>,
    ) -> (Self, ViewerHandle, FrameSequence) {
        let (plan, sender, sequence) = SequencePlan::new(numbers, auxiliary);
        let (channels, handle) = Channels::new(farm.entrance(), farm.status());
        let viewer = Self {
            farm,
            state: ViewState { request, scene: 0, hidden: false, denoised: false },
            visibility: Visibility::default(),
            camera: CameraControl::new(request.view.camera, None),
            requests: Requests::of_sequence(animation, plan, keys),
            film: StillFilm::new(false),
            developing: None,
            figures: ViewerState::new(),
            log: None,
            channels,
            sequence: Some(sender),
        };
        (viewer, handle, sequence)
    }

    /// The farm that renders the view.
    pub(crate) fn farm(&self) -> &Farm {
        &self.farm
    }

    /// Renders until `stop` is cancelled, a display quits, no display is left, or the last frame is complete. Returns the
    /// farm, still running.
    ///
    /// # Errors
    /// A farm that cannot go on, or a frame log that cannot be written.
    pub(crate) async fn run(mut self, stop: &CancellationToken) -> (Farm, Result<(), ViewerError>) {
        let result = self.render(stop).await;
        self.channels.publish_statistics(self.figures.snapshot());
        (self.farm, result)
    }

    async fn render(&mut self, stop: &CancellationToken) -> Result<(), ViewerError> {
        let mut tick = tokio::time::interval(STATUS_EVERY);
        let mut actions = Vec::new();
        self.requests.fill(&self.farm, &self.state);
        loop {
            self.figures.set_resting(self.requests.at_rest());
            tokio::select! {
                biased;
                () = stop.cancelled() => return Ok(()),
                frame = self.farm.finished() => {
                    if self.finish(frame).await?.is_break() {
                        return Ok(());
                    }
                }
                count = self.channels.input.recv_many(&mut actions, MAX_ACTIONS) => {
                    if count == 0 || self.apply_all(actions.drain(..)).is_break() {
                        return Ok(());
                    }
                }
                picture = self.film.developed() => self.deliver_developed(picture),
                () = until(self.requests.rests_at()) => self.requests.rest(&self.farm, &self.state),
                () = self.requests.slot_is_free() => self.requests.fill(&self.farm, &self.state),
                _ = tick.tick() => self.publish(),
            }
        }
    }

    fn publish(&mut self) {
        self.check_film();
        self.figures.refresh_accounts();
        self.figures.set_setting(self.state.request.setting());
        self.channels.publish_status(self.farm.status());
        self.channels.publish_statistics(self.figures.snapshot());
    }

    /// Delivers a finished frame and requests the next one. Breaks after the last frame.
    async fn finish(
        &mut self,
        frame: Result<FinishedFrame, FarmError>,
    ) -> Result<ControlFlow<()>, ViewerError> {
        let frame = match frame {
            Ok(frame) => frame,
            // A worker may connect later; until then the displays show the reason.
            Err(FarmError::NoWorkers { reason, .. }) if self.sequence.is_none() => {
                self.figures.set_problem(Some(reason));
                return Ok(ControlFlow::Continue(()));
            }
            Err(error) => return Err(error.into()),
        };
        let answered = self.requests.finished(frame.frame, frame.elapsed, &frame.account);
        let line = self.figures.add(&frame);
        match answered.pass {
            None => self.deliver(frame, None, answered),
            Some(pass) => self.develop(pass, frame, answered).await,
        }
        if let Some(log) = &mut self.log {
            log.add(&line)?;
        }
        if self.requests.limit() == Some(self.figures.completed()) {
            return Ok(ControlFlow::Break(()));
        }
        self.requests.after_finish(&self.farm, &self.state);
        Ok(ControlFlow::Continue(()))
    }

    /// Adds a pass to its film, and delivers the picture that the film shows. Of a former view only the first pass is shown, alone: a
    /// camera that moves has no other pictures, and later passes would show less than the film did.
    async fn develop(&mut self, pass: Pass, frame: FinishedFrame, answered: Answered) {
        if !self.requests.is_current(Some(pass)) {
            if let Ok(frame) = alone(&pass, frame) {
                self.deliver(frame, None, answered);
            }
            return;
        }
        match self.film.add(pass, frame).await {
            Ok(Added::Samples { frame, progress }) => {
                if progress.is_complete() {
                    self.requests.complete_picture(&self.farm);
                }
                match frame {
                    Some(frame) => self.deliver(*frame, Some(progress), answered),
                    None => self.developing = Some(answered),
                }
                self.check_film();
            }
            Ok(Added::Guide) => self.check_film(),
            Err(error) => {
                tracing::error!("the picture starts again: {error}");
                self.restart_film();
            }
        }
    }

    /// Delivers a picture of the film that was developed next to the frame loop, unless the view has changed.
    fn deliver_developed(&mut self, picture: Redeveloped) {
        let Redeveloped { film, frame, progress } = picture;
        let answered = self.developing.take();
        if self.requests.is_film(film) {
            let answered = answered.unwrap_or_else(|| self.requests.unanswered());
            self.deliver(frame, Some(progress), answered);
        }
    }

    /// Starts the picture again if it has pixels of a worker that sent wrong ones.
    fn check_film(&mut self) {
        if self.film.frames().next().is_none() {
            return;
        }
        let wrong = self.farm.wrong_frames();
        if self.film.frames().any(|frame| wrong.contains(frame)) {
            tracing::warn!("the picture starts again, because a worker sent wrong pixels");
            self.restart_film();
        }
    }

    fn restart_film(&mut self) {
        self.film.clear();
        self.figures.set_film(None);
        self.requests.restart_picture(&self.farm, &self.state);
    }

    fn deliver(&mut self, frame: FinishedFrame, film: Option<FilmProgress>, answered: Answered) {
        let Answered { input_at, number, slot, quality, .. } = answered;
        self.figures.set_film(film);
        let presented = PresentedFrame { frame, film, input_at, completed_at: Instant::now(), quality };
        // Statistics come first, so that a display which draws the frame has those that include it.
        self.channels.publish_statistics(self.figures.snapshot());
        match &self.sequence {
            Some(sequence) => sequence.deliver(SequenceFrame { number, presented, slot }),
            None => self.channels.publish_frame(presented),
        }
    }

    /// Applies actions in order, then replaces the last request if they changed the view. Breaks at [`InputAction::Quit`].
    fn apply_all(&mut self, actions: impl Iterator<Item = (DisplayId, InputAction)>) -> ControlFlow<()> {
        let mut state = self.state;
        for (display, action) in actions {
            match action {
                InputAction::SetVisible(visible) => self.visibility.report(display, visible),
                InputAction::Resize { .. } if display != DisplayId::FIRST => continue,
                _ => {}
            }
            if apply(action, &mut self.camera, &mut state, &mut self.figures, &self.farm).is_break() {
                return ControlFlow::Break(());
            }
        }
        state.hidden = self.visibility.is_hidden();
        state.request.view = FrameView { camera: self.camera.camera(), ..state.request.view };
        if self.state != state {
            self.state = state;
            self.film.set_denoised(state.denoised);
            self.requests.replace(&self.farm, &self.state);
        }
        ControlFlow::Continue(())
    }
}

/// Applies one action to camera, view, statistics or workers.
fn apply(
    action: InputAction,
    camera: &mut CameraControl,
    state: &mut ViewState,
    figures: &mut ViewerState,
    farm: &Farm,
) -> ControlFlow<()> {
    match action {
        InputAction::Move { direction, seconds } => camera.fly(direction, seconds),
        InputAction::Look { right, up, seconds } => camera.look(right, up, seconds),
        InputAction::Orbit { right, down } => camera.orbit(right, down),
        InputAction::Roll { right, seconds } => camera.roll(right, seconds),
        InputAction::Magnify { inwards, seconds } => camera.magnify(inwards, seconds),
        InputAction::Zoom { notches } => camera.zoom(notches),
        InputAction::ResetCamera => camera.reset(),
        InputAction::Resize { width, height } => {
            let side = |pixels: u32| pixels.clamp(1, MAX_SIDE);
            let view = state.request.view;
            state.request.view = FrameView { width: side(width), height: side(height), ..view };
        }
        // Applied before, with the visibility of the other displays.
        InputAction::SetVisible(_) => {}
        InputAction::Presented { latency } => figures.presented(latency),
        InputAction::Set(change) => {
            let request = change.applied(state.request);
            match request.view.validate() {
                Ok(()) => state.request = request,
                Err(problem) => tracing::warn!("{} is not changed: {problem}", change.knob.name),
            }
        }
        InputAction::Denoise(on) => {
            if on && !has_passes(&state.request.view) {
                tracing::warn!("the direct integrator has no noise: only pictures of paths are denoised");
            }
            state.denoised = on;
        }
        InputAction::ShowScene(update) => {
            farm.replace_scene(Arc::clone(&update.assets));
            state.scene += 1;
            state.request = update.applied(state.request);
            if let Some(home) = update.camera() {
                camera.set_home(home);
            }
            figures.set_scene_fault(None);
        }
        InputAction::SceneFault(fault) => figures.set_scene_fault(Some(fault)),
        InputAction::Worker(command) => command.perform(&farm.control()),
        InputAction::Quit => return ControlFlow::Break(()),
    }
    ControlFlow::Continue(())
}

/// Waits until a time. Never returns where there is none.
async fn until(at: Option<Instant>) {
    match at {
        Some(at) => tokio::time::sleep_until(at.into()).await,
        None => std::future::pending().await,
    }
}

#[cfg(test)]
mod edit_tests;
#[cfg(test)]
mod film_tests;
#[cfg(test)]
mod tests;
