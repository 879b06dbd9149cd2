//! Which frames are requested from the farm: while something moves, always the newest view; at rest each view once.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use rayfarm_tracer::scene::FrameView;

use crate::accounting::FrameAccount;
use crate::farm::{Farm, FrameId};
use crate::viewer::orbit::Animation;
use crate::viewer::quality_controller::{QualityController, QualityMode};
use crate::viewer::view_request::ViewRequest;

/// The frame being rendered and the one after it.
const OPEN_REQUESTS: usize = 2;

/// Takes requests for frames.
pub(super) trait Renderer {
    /// The frame to render next.
    fn request(&self, view: FrameView) -> FrameId;
    /// Drops all requested frames.
    fn give_up(&self);
}

impl Renderer for Farm {
    fn request(&self, view: FrameView) -> FrameId {
        Self::request(self, view)
    }

    fn give_up(&self) {
        Self::give_up(self);
    }
}

/// What a window wants to show, and whether anything of it can be seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WindowState {
    /// The picture in the window's size.
    pub(crate) picture: ViewRequest,
    /// Whether the window is minimised, unmapped or covered.
    pub(crate) hidden: bool,
}

/// How frames are requested.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// What moves by itself.
    pub(crate) animation: Animation,
    /// The number of frames after which the run ends.
    pub(crate) limit: Option<u64>,
    /// Whether frames are requested although nothing has changed and the window is hidden, as measurements need it.
    pub(crate) continuous: bool,
}

/// Which frames have been asked for and are not here yet.
pub(super) struct Requests {
    pace: Pace,
    /// The number, within the animation, of the next frame to ask for.
    next: u64,
    open: VecDeque<Open>,
    /// The picture that was wanted last.
    wanted: Option<ViewRequest>,
    /// What was requested last, unless it was given up.
    requested: Option<Requested>,
    /// When the camera moved last, until a frame that shows it is finished.
    moved_at: Option<Instant>,
    controller: Option<QualityController>,
    started: Instant,
}

/// The last request.
struct Requested {
    view: FrameView,
    /// The picture that it was for, and how it was asked for.
    wanted: ViewRequest,
    mode: Option<QualityMode>,
}

/// A frame that was asked for.
struct Open {
    frame: FrameId,
    /// When what it shows was first wanted.
    asked_at: Instant,
    requested_at: Instant,
    /// `None` without a quality controller.
    mode: Option<QualityMode>,
}

impl Open {
    fn gives_way_to(&self, next: QualityMode) -> bool {
        self.mode.is_some_and(|mode| mode.gives_way_to(next))
    }
}

/// What is known of a finished frame's request.
#[derive(Clone, Debug)]
pub(crate) struct Answered {
    /// When what it shows was first wanted.
    pub(crate) asked_at: Instant,
    /// What the quality controller says of it.
    pub(crate) quality: Vec<String>,
}

impl Requests {
    pub(super) fn new(pace: Pace, controller: Option<QualityController>) -> Self {
        Self {
            pace,
            next: 0,
            open: VecDeque::new(),
            wanted: None,
            requested: None,
            moved_at: None,
            controller,
            started: Instant::now(),
        }
    }

    /// Asks until two are open, or nothing is left to be asked for.
    pub(super) fn fill(&mut self, farm: &impl Renderer, window: &WindowState) {
        while self.open.len() < OPEN_REQUESTS && self.ask(farm, window) {}
    }

    /// Frames come in order: all up to this one are done, or were replaced and will never come.
    pub(super) fn finished(&mut self, frame: FrameId, elapsed: Duration, account: &FrameAccount) -> Answered {
        let now = Instant::now();
        let open = self.open.iter().find(|open| open.frame == frame);
        let (asked_at, requested_at, mode) =
            open.map_or((now, now, None), |open| (open.asked_at, open.requested_at, open.mode));
        self.open.retain(|open| open.frame > frame);
        self.moved_at = self.moved_at.filter(|&moved_at| moved_at > asked_at);
        let (now, requested_at) = (self.since_start(now), self.since_start(requested_at));
        let quality = self.controller.as_mut().zip(mode).map(|(controller, mode)| {
            // Afterwards the frame's rung may be gone.
            let told = controller.told(mode);
            controller.finished(now, elapsed, mode, requested_at, account);
            told
        });
        Answered { asked_at, quality: quality.unwrap_or_default() }
    }

    /// The next one is due. Asking even when two seem open costs nothing: one of them was replaced, or this replaces
    /// a request that has not begun by one for a newer camera.
    pub(super) fn after_finish(&mut self, farm: &impl Renderer, window: &WindowState) {
        self.ask(farm, window);
        self.fill(farm, window);
    }

    /// The window wants something else, or has been hidden or uncovered: the last request shall show what it shows now.
    pub(super) fn replace(&mut self, farm: &impl Renderer, window: &WindowState) {
        if self.wanted != Some(window.picture) {
            self.moved_at = Some(Instant::now());
        }
        self.ask_instead(farm, window);
    }

    /// The camera has come to rest: the last request shall be for the full picture.
    pub(super) fn rest(&mut self, farm: &impl Renderer, window: &WindowState) {
        self.ask_instead(farm, window);
    }

    /// When it does, if it does not move any more.
    pub(super) fn rests_at(&self) -> Option<Instant> {
        Some(self.started + self.controller.as_ref()?.rests_at()?)
    }

    /// Whether no frame is on the way and none will be requested before something changes. With a quality controller, what it says
    /// of the picture that is there: at rest that is the full one.
    pub(super) fn at_rest(&self) -> Option<Vec<String>> {
        let rests = self.open.is_empty() && self.rests_at().is_none();
        rests.then(|| {
            self.controller.as_ref().map_or_else(Vec::new, |controller| controller.told(QualityMode::Resting))
        })
    }

    fn ask_instead(&mut self, farm: &impl Renderer, window: &WindowState) {
        let next = self.next;
        self.next = next.saturating_sub(1);
        if !self.ask(farm, window) {
            self.next = next;
        }
        self.fill(farm, window);
    }

    /// Whether there was something to ask for.
    fn ask(&mut self, farm: &impl Renderer, window: &WindowState) -> bool {
        let now = Instant::now();
        let since_start = self.since_start(now);
        let wanted = &window.picture;
        self.notice(farm, wanted, since_start);
        let mode = self.controller.as_mut().map(|controller| controller.next(since_start));
        let Pace { animation, limit, continuous } = self.pace;
        if limit.is_some_and(|limit| self.next >= limit) && !self.open.is_empty() {
            return false;
        }
        if window.hidden && !continuous {
            return false;
        }
        let mut picture = *wanted;
        if let Some((controller, mode)) = self.controller.as_ref().zip(mode) {
            picture = controller.picture(wanted, mode);
        }
        let view = animation.view(&picture.rendered(), self.next);
        if !continuous && self.is_requested(&view, wanted, mode) {
            return false;
        }
        if mode.is_some_and(|next| self.open.iter().any(|open| open.gives_way_to(next))) {
            self.give_up(farm);
        }
        // A request that is asked for again, because the one before was replaced, is as old as the camera it shows.
        let asked_at = self.moved_at.unwrap_or(now);
        self.open.push_back(Open { frame: farm.request(view), asked_at, requested_at: now, mode });
        self.requested = Some(Requested { view, wanted: *wanted, mode });
        self.next += 1;
        true
    }

    /// Whether the last request does for this view: it is the same, or only the quality controller's rung differs since then and
    /// nothing moves any more.
    fn is_requested(&self, view: &FrameView, wanted: &ViewRequest, mode: Option<QualityMode>) -> bool {
        let is_moving = |mode: Option<QualityMode>| mode.is_some_and(|mode| mode != QualityMode::Resting);
        self.requested.as_ref().is_some_and(|last| {
            let stands = !self.pace.animation.is_moving() && last.wanted == *wanted;
            last.view == *view || stands && is_moving(last.mode) && is_moving(mode)
        })
    }

    /// Something else may be wanted than before.
    fn notice(&mut self, farm: &impl Renderer, wanted: &ViewRequest, now: Duration) {
        let Some(before) = self.wanted.replace(*wanted).filter(|before| before != wanted) else { return };
        if let Some(controller) = &mut self.controller {
            controller.changed(now);
        }
        let size = |picture: &ViewRequest| (picture.view.width, picture.view.height);
        if size(&before) != size(wanted) {
            // The window has another size: what is on the way was for the one before.
            self.give_up(farm);
        }
    }

    fn give_up(&mut self, farm: &impl Renderer) {
        farm.give_up();
        self.open.clear();
        self.requested = None;
    }

    fn since_start(&self, at: Instant) -> Duration {
        at.saturating_duration_since(self.started)
    }
}

#[cfg(test)]
mod tests;
