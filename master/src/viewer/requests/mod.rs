//! Frames to request from the farm: the newest view while something moves, each view once at rest, and every frame of a
//! sequence.
//!
//! A view of the path integrator at rest is requested in passes of samples, which the film of the view adds. Passes of a view are requested
//! in their order, and never replace each other. If one is lost all the same, the picture starts again.
//!
//! ```text
//!   policy   what is requested, by which rules, and of whom
//!   next     choice of the next request
//!   open     requests in flight
//!   passes   passes of a view at rest
//! ```

mod next;
mod open;
mod passes;
#[cfg(test)]
mod path_tests;
mod policy;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use rayfarm_farm::accounting::FrameAccount;
use rayfarm_farm::{FrameId, ViewRequest};

use super::film::pass::{Part, Pass};
use super::keyed_scene::KeyedScene;
use super::open_requests::OPEN_REQUESTS;
use super::orbit::Animation;
use super::quality_controller::{QualityController, QualityMode, Stillness};
use super::sequence::SequencePlan;

pub(super) use open::Answered;
use open::{Open, Requested};
use passes::Passes;
pub(super) use policy::Renderer;
pub(crate) use policy::{RequestPolicy, ViewState};

/// Requested frames that have not been completed.
pub(super) struct Requests {
    policy: RequestPolicy,
    /// Frames of a sequence; `None` for an interactive view.
    plan: Option<SequencePlan>,
    /// Scenes and cameras of the frames of a sequence, where the scene has keys.
    keys: Option<KeyedScene>,
    /// Frame of `keys` whose scene was requested last.
    keyed: Option<u64>,
    /// Index, within the animation or the plan, of the next frame to request.
    next: u64,
    open: VecDeque<Open>,
    /// View at the last request, and the number of its scene.
    wanted: Option<(ViewRequest, u64)>,
    /// Last request, unless it was dropped.
    requested: Option<Requested>,
    /// Passes of the view at rest, if it is rendered in passes.
    passes: Option<Passes>,
    /// Number of films so far.
    films: u64,
    /// Time of the last camera movement, until a frame that shows it is finished.
    moved_at: Option<Instant>,
    controller: Option<QualityController>,
    /// Motion of a view that is rendered in passes, without a controller.
    stillness: Stillness,
    started: Instant,
}

impl Requests {
    /// Requests of an interactive view.
    pub(super) fn new(policy: RequestPolicy, controller: Option<QualityController>) -> Self {
        Self {
            policy,
            plan: None,
            keys: None,
            keyed: None,
            next: 0,
            open: VecDeque::new(),
            wanted: None,
            requested: None,
            passes: None,
            films: 0,
            moved_at: None,
            controller,
            stillness: Stillness::new(policy.animation.is_moving()),
            started: Instant::now(),
        }
    }

    /// Requests of a sequence: each frame of the plan once, with its scene and camera where the scene has keys.
    pub(super) fn of_sequence(animation: Animation, plan: SequencePlan, keys: Option<KeyedScene>) -> Self {
        let policy = RequestPolicy { animation, limit: Some(plan.len()), continuous: true };
        Self { plan: Some(plan), keys, ..Self::new(policy, None) }
    }

    /// Number of frames after which the run ends.
    pub(super) fn limit(&self) -> Option<u64> {
        self.policy.limit
    }

    /// Requests frames until [`OPEN_REQUESTS`] are in flight or no further one is needed.
    pub(super) fn fill(&mut self, farm: &impl Renderer, state: &ViewState) {
        while self.open.len() < OPEN_REQUESTS && self.request(farm, state) {}
    }

    /// Records a finished frame. Frames finish in order: earlier requests were replaced and never finish.
    pub(super) fn finished(&mut self, frame: FrameId, elapsed: Duration, account: &FrameAccount) -> Answered {
        let now = Instant::now();
        let mut answer = None;
        while let Some(open) = self.open.pop_front_if(|open| open.frame <= frame) {
            if open.frame != frame && self.is_current(open.answered.pass) {
                tracing::debug!("a pass of the picture was replaced: the picture starts again");
                self.passes = None;
            }
            answer = Some(open).filter(|open| open.frame == frame);
        }
        let Some(Open { mut answered, requested_at, mode, .. }) = answer else {
            self.moved_at = self.moved_at.filter(|&moved_at| moved_at > now);
            return self.unanswered();
        };
        self.moved_at = self.moved_at.filter(|&moved_at| moved_at > answered.input_at);
        let (now, requested_at) = (self.since_start(now), self.since_start(requested_at));
        self.stillness.shown(requested_at);
        if let Some((controller, mode)) = self.controller.as_mut().zip(mode) {
            // The lines come first: afterwards the ladder may no longer have the frame's rung.
            answered.quality = controller.lines(mode);
            match answered.pass.map(|pass| pass.part) {
                None => controller.finished(now, elapsed, mode, requested_at, account),
                Some(Part::Samples { samples, .. }) => {
                    controller.finished_pass(now, elapsed / samples.max(1), requested_at);
                }
                // Its time is no picture's.
                Some(Part::Guide(_)) => {}
            }
        }
        answered
    }

    /// Properties of a picture that answers no request, such as one that is developed again.
    pub(super) fn unanswered(&self) -> Answered {
        let input_at = Instant::now();
        Answered { input_at, number: self.next, slot: None, quality: Vec::new(), pass: None }
    }

    /// Requests the next frame after one has finished. A request beyond [`OPEN_REQUESTS`] costs nothing: either an open one
    /// was replaced, or this one replaces a request that has not begun by one for a newer camera.
    pub(super) fn after_finish(&mut self, farm: &impl Renderer, state: &ViewState) {
        if self.plan.is_none() {
            self.request(farm, state);
        }
        self.fill(farm, state);
    }

    /// Replaces the last request after a change of the view or of the display's visibility.
    pub(super) fn replace(&mut self, farm: &impl Renderer, state: &ViewState) {
        if self.wanted != Some((state.request, state.scene)) {
            self.moved_at = Some(Instant::now());
        }
        self.request_instead(farm, state);
    }

    /// Replaces the last request by one for the full picture, when the camera has come to rest.
    pub(super) fn rest(&mut self, farm: &impl Renderer, state: &ViewState) {
        self.request_instead(farm, state);
    }

    /// Whether a pass is of the picture that is being rendered.
    pub(super) fn is_current(&self, pass: Option<Pass>) -> bool {
        pass.is_some_and(|pass| self.is_film(pass.film))
    }

    /// Whether a film is of the picture that is being rendered, or was rendered last and is still the requested one.
    pub(super) fn is_film(&self, number: u64) -> bool {
        self.passes.is_some_and(|passes| passes.film == number)
    }

    /// Requests no further pass of the picture, and drops those in flight.
    pub(super) fn complete_picture(&mut self, farm: &impl Renderer) {
        let Some(passes) = &mut self.passes else { return };
        passes.complete(self.open.iter().filter(|open| open.is_guide()).count());
        if !self.open.is_empty() {
            let (passes, requested) = (self.passes, self.requested.take());
            self.drop_all(farm);
            (self.passes, self.requested) = (passes, requested);
        }
    }

    /// Starts the picture at rest again from its first pass.
    pub(super) fn restart_picture(&mut self, farm: &impl Renderer, state: &ViewState) {
        self.drop_all(farm);
        self.fill(farm, state);
    }

    /// Time at which the camera comes to rest if it does not move any more.
    pub(super) fn rests_at(&self) -> Option<Instant> {
        let at = match &self.controller {
            Some(controller) => controller.rests_at(),
            None => self.stillness.rests_at(),
        };
        Some(self.started + at?)
    }

    /// Lines of the quality controller about the picture at rest, if no frame is in flight and none will be requested
    /// before something changes. Empty lines without a controller.
    pub(super) fn at_rest(&self) -> Option<Vec<String>> {
        let rests = self.open.is_empty() && self.rests_at().is_none();
        rests.then(|| {
            self.controller
                .as_ref()
                .map_or_else(Vec::new, |controller| controller.lines(QualityMode::Resting))
        })
    }

    /// Waits until the next frame of a sequence has a slot. Never returns where none is missing. Cancel safe.
    pub(super) async fn slot_is_free(&self) {
        match &self.plan {
            Some(plan) if self.open.len() < OPEN_REQUESTS && self.next < plan.len() => {
                plan.slot_is_free().await
            }
            _ => std::future::pending().await,
        }
    }

    fn request_instead(&mut self, farm: &impl Renderer, state: &ViewState) {
        let next = self.next;
        self.next = next.saturating_sub(1);
        if !self.request(farm, state) {
            self.next = next;
        }
        self.fill(farm, state);
    }

    fn drop_all(&mut self, farm: &impl Renderer) {
        farm.drop_requests();
        self.open.clear();
        self.requested = None;
        self.passes = None;
    }

    fn since_start(&self, at: Instant) -> Duration {
        at.saturating_duration_since(self.started)
    }
}
