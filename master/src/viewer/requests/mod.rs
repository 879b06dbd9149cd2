//! Frames to request from the farm: the newest view while something moves, each view once at rest, and every frame of a
//! sequence.
//!
//! A view of the path integrator at rest is requested in passes of samples, which the film of the view adds. Passes of a view are requested
//! in their order, and never replace each other. If one is lost all the same, the picture starts again.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use rayfarm_farm::accounting::FrameAccount;
use rayfarm_farm::{Farm, FrameId, ViewRequest};

use super::film::passes as film_passes;
use super::film::still::Pass;
use super::open_requests::OPEN_REQUESTS;
use super::orbit::Animation;
use super::quality_controller::{QualityController, QualityMode};
use super::sequence::{SequencePlan, Slot};

use passes::Passes;

/// Accepts requests for frames.
pub(super) trait Renderer {
    /// Requests the next frame.
    fn request(&self, request: ViewRequest) -> FrameId;
    /// Drops all requested frames.
    fn drop_requests(&self);
}

impl Renderer for Farm {
    fn request(&self, request: ViewRequest) -> FrameId {
        Self::request(self, request)
    }

    fn drop_requests(&self) {
        self.drop_requests();
    }
}

/// The view of the display.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ViewState {
    /// Picture in the size of the display.
    pub(crate) request: ViewRequest,
    /// Whether the display is minimised, unmapped or covered.
    pub(crate) hidden: bool,
}

/// Rules by which frames are requested.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RequestPolicy {
    /// Movement without input.
    pub(crate) animation: Animation,
    /// Number of frames after which the run ends.
    pub(crate) limit: Option<u64>,
    /// Whether frames are requested even if nothing has changed and the display is hidden, for measurements.
    pub(crate) continuous: bool,
}

/// Requested frames that have not been completed.
pub(super) struct Requests {
    policy: RequestPolicy,
    /// Frames of a sequence; `None` for an interactive view.
    plan: Option<SequencePlan>,
    /// Index, within the animation or the plan, of the next frame to request.
    next: u64,
    open: VecDeque<Open>,
    /// View at the last request.
    wanted: Option<ViewRequest>,
    /// Last request, unless it was dropped.
    requested: Option<Requested>,
    /// Passes of the view at rest, if it is rendered in passes.
    passes: Option<Passes>,
    /// Number of films so far.
    films: u64,
    /// Time of the last camera movement, until a frame that shows it is finished.
    moved_at: Option<Instant>,
    controller: Option<QualityController>,
    started: Instant,
}

/// The last request.
struct Requested {
    request: ViewRequest,
    /// Request before the quality controller.
    wanted: ViewRequest,
    mode: Option<QualityMode>,
}

/// A request in flight.
struct Open {
    frame: FrameId,
    answered: Answered,
    requested_at: Instant,
    /// `None` without a quality controller.
    mode: Option<QualityMode>,
}

impl Open {
    fn gives_way_to(&self, next: QualityMode) -> bool {
        self.mode.is_some_and(|mode| mode.gives_way_to(next))
    }
}

/// Properties of a request that the farm does not know.
#[derive(Debug)]
pub(super) struct Answered {
    /// Time of the input that the frame answers.
    pub(super) input_at: Instant,
    /// Number of the frame in the animation.
    pub(super) number: u64,
    /// Place in the sequence, for a frame of one.
    pub(super) slot: Option<Slot>,
    /// Lines of the quality controller about the frame; empty without a controller.
    pub(super) quality: Vec<String>,
    /// The pass that the frame is, if it is one.
    pub(super) pass: Option<Pass>,
}

impl Requests {
    /// Requests of an interactive view.
    pub(super) fn new(policy: RequestPolicy, controller: Option<QualityController>) -> Self {
        Self {
            policy,
            plan: None,
            next: 0,
            open: VecDeque::new(),
            wanted: None,
            requested: None,
            passes: None,
            films: 0,
            moved_at: None,
            controller,
            started: Instant::now(),
        }
    }

    /// Requests of a sequence: each frame of the plan once.
    pub(super) fn of_sequence(animation: Animation, plan: SequencePlan) -> Self {
        let policy = RequestPolicy { animation, limit: Some(plan.len()), continuous: true };
        Self { plan: Some(plan), ..Self::new(policy, None) }
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
            return Answered {
                input_at: now,
                number: self.next,
                slot: None,
                quality: Vec::new(),
                pass: None,
            };
        };
        self.moved_at = self.moved_at.filter(|&moved_at| moved_at > answered.input_at);
        let (now, requested_at) = (self.since_start(now), self.since_start(requested_at));
        if let Some((controller, mode)) = self.controller.as_mut().zip(mode) {
            // The lines come first: afterwards the ladder may no longer have the frame's rung.
            answered.quality = controller.lines(mode);
            match answered.pass {
                None => controller.finished(now, elapsed, mode, requested_at, account),
                Some(pass) => controller.finished_pass(now, elapsed / pass.samples.max(1), requested_at),
            }
        }
        answered
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
        if self.wanted != Some(state.request) {
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
        self.passes.zip(pass).is_some_and(|(passes, pass)| passes.film == pass.film)
    }

    /// Requests no further pass of the picture, and drops those in flight.
    pub(super) fn complete_picture(&mut self, farm: &impl Renderer) {
        let Some(passes) = &mut self.passes else { return };
        passes.complete();
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
        Some(self.started + self.controller.as_ref()?.rests_at()?)
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

    /// Requests a frame, if one is needed. Returns whether it was.
    fn request(&mut self, farm: &impl Renderer, state: &ViewState) -> bool {
        let now = Instant::now();
        let since_start = self.since_start(now);
        let wanted = &state.request;
        self.note_change(farm, wanted, since_start);
        let mode = self.controller.as_mut().map(|controller| controller.next(since_start));
        let RequestPolicy { animation, limit, continuous } = self.policy;
        if limit.is_some_and(|limit| self.next >= limit) && !self.open.is_empty() {
            return false;
        }
        if state.hidden && !continuous {
            return false;
        }
        let request = match self.controller.as_ref().zip(mode) {
            Some((controller, mode)) => controller.apply(wanted, mode),
            None => *wanted,
        };
        let (number, slot) = match &self.plan {
            None => (self.next, None),
            Some(plan) => match plan.number(self.next).zip(plan.free_slot()) {
                Some((number, slot)) => (number, Some(slot)),
                None => return false,
            },
        };
        let request = animation.request(&request, number);
        let request = self.plan.as_ref().map_or(request, |plan| plan.request(self.next, request));
        let is_moving = animation.is_moving() || is_moving(mode);
        let (request, passes) = match self.plan.is_none() && film_passes::has_passes(&request.view) {
            false => (request, None),
            true if is_moving => (film_passes::while_moving(&request), None),
            true => (request, Some(self.passes_of(&request))),
        };
        let pass = match passes.map(|passes| passes.pass()) {
            None if !continuous && self.is_requested(&request, wanted, mode) => return false,
            None => None,
            // All passes have been requested.
            Some(None) => return false,
            // A third request may replace the second one, which is a pass of the same picture.
            Some(Some(pass)) if pass.first > 0 && self.open.len() >= OPEN_REQUESTS => return false,
            Some(pass) => pass,
        };
        let request = pass.map_or(request, |Pass { first, samples, .. }| ViewRequest {
            view: film_passes::pass(&request.view, first..first.saturating_add(samples)),
            ..request
        });
        if mode.is_some_and(|next| self.open.iter().any(|open| open.gives_way_to(next))) {
            self.drop_all(farm);
        }
        self.passes = passes.zip(pass).map(|(passes, pass)| passes.after(&pass));
        self.films = self.passes.map_or(self.films, |passes| passes.film);
        // A request that replaces another one is as old as the camera that it shows.
        let input_at = self.moved_at.unwrap_or(now);
        let answered = Answered { input_at, number, slot, quality: Vec::new(), pass };
        self.open.push_back(Open { frame: farm.request(request), answered, requested_at: now, mode });
        self.requested = Some(Requested { request, wanted: *wanted, mode });
        self.next += 1;
        true
    }

    /// Passes of a picture: those that are being rendered, or those of a new film.
    fn passes_of(&self, whole: &ViewRequest) -> Passes {
        let first = Passes::new(whole, self.films + 1);
        match self.passes.filter(|passes| passes.whole == *whole) {
            // A measurement renders the picture again and again, each time to its end.
            Some(passes) if self.policy.continuous && passes.pass().is_none() && self.open.is_empty() => {
                first
            }
            Some(passes) => passes,
            None => first,
        }
    }

    /// Whether the last request serves for this one: it is the same, or only the quality controller's rung has changed
    /// since then and nothing moves any more.
    fn is_requested(&self, request: &ViewRequest, wanted: &ViewRequest, mode: Option<QualityMode>) -> bool {
        self.requested.as_ref().is_some_and(|last| {
            let is_still = !self.policy.animation.is_moving() && last.wanted == *wanted;
            last.request == *request || is_still && is_moving(last.mode) && is_moving(mode)
        })
    }

    /// Records the view, which may have changed.
    fn note_change(&mut self, farm: &impl Renderer, wanted: &ViewRequest, now: Duration) {
        let Some(before) = self.wanted.replace(*wanted).filter(|before| before != wanted) else { return };
        if let Some(controller) = &mut self.controller {
            controller.changed(now);
        }
        let size = |request: &ViewRequest| (request.view.width, request.view.height);
        if size(&before) != size(wanted) {
            // Frames in flight are of the display's former size.
            self.drop_all(farm);
        } else if self.open.iter().any(|open| open.answered.pass.is_some_and(|pass| pass.first > 0)) {
            // Nothing shows a later pass of a former view.
            self.drop_all(farm);
        }
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

/// Whether a mode is of a moving picture; without a quality controller there is none.
fn is_moving(mode: Option<QualityMode>) -> bool {
    mode.is_some_and(|mode| mode != QualityMode::Resting)
}

mod passes;
#[cfg(test)]
mod tests;
