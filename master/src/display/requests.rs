//! Which frames are asked of the farm, so that it is always busy with what is wanted now.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use crate::dial::{Dial, Shown};
use crate::farm::{Farm, FinishedFrame, FrameId};
use crate::orbit::Animation;
use crate::wanted::WantedPicture;

/// The frame being rendered and the one after it.
const OPEN_REQUESTS: usize = 2;

/// Which frames have been asked for and are not here yet.
pub(super) struct Requests {
    animation: Animation,
    limit: Option<u64>,
    /// The number, within the animation, of the next frame to ask for.
    next: u64,
    open: VecDeque<Open>,
    /// What was wanted last.
    wanted: Option<WantedPicture>,
    /// When the camera moved last, until a frame that shows it is finished.
    moved_at: Option<Instant>,
    dial: Option<Dial>,
    started: Instant,
}

/// A frame that was asked for.
struct Open {
    frame: FrameId,
    /// When what it shows was first wanted.
    asked_at: Instant,
    requested_at: Instant,
    /// `None` without a dial.
    shown: Option<Shown>,
}

/// What is known of a finished frame's request.
#[derive(Clone, Debug)]
pub(crate) struct Answered {
    /// When what it shows was first wanted.
    pub(crate) asked_at: Instant,
    /// What the dial says of it.
    pub(crate) dial: Vec<String>,
}

impl Requests {
    pub(super) fn new(animation: Animation, limit: Option<u64>, dial: Option<Dial>) -> Self {
        Self {
            animation,
            limit,
            next: 0,
            open: VecDeque::new(),
            wanted: None,
            moved_at: None,
            dial,
            started: Instant::now(),
        }
    }

    /// Asks until two are open.
    pub(super) fn fill(&mut self, farm: &Farm, wanted: &WantedPicture) {
        while self.open.len() < OPEN_REQUESTS && self.ask(farm, wanted) {}
    }

    /// Frames come in order: all up to this one are done, or were replaced and will never come.
    pub(super) fn finished(&mut self, frame: &FinishedFrame) -> Answered {
        let now = Instant::now();
        let open = self.open.iter().find(|open| open.frame == frame.frame);
        let (asked_at, requested_at, shown) =
            open.map_or((now, now, None), |open| (open.asked_at, open.requested_at, open.shown));
        self.open.retain(|open| open.frame > frame.frame);
        self.moved_at = self.moved_at.filter(|&moved_at| moved_at > asked_at);
        let (now, requested_at) = (self.since_start(now), self.since_start(requested_at));
        let dial = self.dial.as_mut().zip(shown).map(|(dial, shown)| {
            dial.finished(now, frame.elapsed, shown, requested_at);
            dial.told(shown)
        });
        Answered { asked_at, dial: dial.unwrap_or_default() }
    }

    /// The next one is due. Asking even when two seem open costs nothing: one of them was replaced, or this replaces
    /// a request that has not begun by one for a newer camera.
    pub(super) fn after_finish(&mut self, farm: &Farm, wanted: &WantedPicture) {
        self.ask(farm, wanted);
        self.fill(farm, wanted);
    }

    /// The camera has moved: the last request shall show what it sees now.
    pub(super) fn replace(&mut self, farm: &Farm, wanted: &WantedPicture) {
        self.moved_at = Some(Instant::now());
        self.ask_instead(farm, wanted);
    }

    /// The camera has come to rest: the last request shall be for the full picture.
    pub(super) fn rest(&mut self, farm: &Farm, wanted: &WantedPicture) {
        self.ask_instead(farm, wanted);
    }

    /// When it does, if it does not move any more.
    pub(super) fn rests_at(&self) -> Option<Instant> {
        Some(self.started + self.dial.as_ref()?.rests_at()?)
    }

    fn ask_instead(&mut self, farm: &Farm, wanted: &WantedPicture) {
        self.next = self.next.saturating_sub(1);
        self.ask(farm, wanted);
        self.fill(farm, wanted);
    }

    fn ask(&mut self, farm: &Farm, wanted: &WantedPicture) -> bool {
        let now = Instant::now();
        let since_start = self.since_start(now);
        self.notice(farm, wanted, since_start);
        let shown = self.dial.as_mut().map(|dial| dial.next(since_start));
        if self.limit.is_some_and(|limit| self.next >= limit) && !self.open.is_empty() {
            return false;
        }
        let mut picture = *wanted;
        if let Some((dial, shown)) = self.dial.as_ref().zip(shown) {
            picture = dial.picture(wanted, shown);
            if self.open.iter().any(|open| open.shown.is_some_and(|open| open.gives_way_to(shown))) {
                self.give_up(farm);
            }
        }
        let view = self.animation.view(&picture.rendered(), self.next);
        // A request that is asked for again, because the one before was replaced, is as old as the camera it shows.
        let asked_at = self.moved_at.unwrap_or(now);
        self.open.push_back(Open { frame: farm.request(view), asked_at, requested_at: now, shown });
        self.next += 1;
        true
    }

    /// Something else may be wanted than before.
    fn notice(&mut self, farm: &Farm, wanted: &WantedPicture, now: Duration) {
        let Some(before) = self.wanted.replace(*wanted).filter(|before| before != wanted) else { return };
        if let Some(dial) = &mut self.dial {
            dial.changed(now);
        }
        let size = |picture: &WantedPicture| (picture.view.width, picture.view.height);
        if size(&before) != size(wanted) {
            // The window has another size: what is on the way was for the one before.
            self.give_up(farm);
        }
    }

    fn give_up(&mut self, farm: &Farm) {
        farm.give_up();
        self.open.clear();
    }

    fn since_start(&self, at: Instant) -> Duration {
        at.saturating_duration_since(self.started)
    }
}
