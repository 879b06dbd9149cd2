//! Choice of the next request.

use std::time::{Duration, Instant};

use rayfarm_farm::ViewRequest;

use super::open::{Answered, Open, Requested};
use super::passes::Passes;
use super::policy::{Renderer, RequestPolicy, ViewState};
use super::{OPEN_REQUESTS, Requests};
use crate::viewer::film::pass::Pass;
use crate::viewer::film::passes as film_passes;
use crate::viewer::quality_controller::{Motion, QualityMode};
use crate::viewer::sequence::Slot;

/// A frame to request.
struct Next {
    request: ViewRequest,
    number: u64,
    slot: Option<Slot>,
    /// Passes after the frame, and the pass that the frame is, if it is one.
    pass: Option<(Passes, Pass)>,
}

impl Requests {
    /// Requests a frame, if one is needed. Returns whether it was.
    pub(super) fn request(&mut self, farm: &impl Renderer, state: &ViewState) -> bool {
        let now = Instant::now();
        let since_start = self.since_start(now);
        let wanted = &state.request;
        self.note_change(farm, state, since_start);
        let mode = self.controller.as_mut().map(|controller| controller.next(since_start));
        let moves_alone = self.controller.is_none() && self.stillness.motion(since_start) == Motion::Moving;
        let is_moving = self.policy.animation.is_moving() || is_moving(mode) || moves_alone;
        let Some(next) = self.next(state, mode, is_moving) else { return false };
        if mode.is_some_and(|next| self.open.iter().any(|open| open.gives_way_to(next))) {
            self.drop_all(farm);
        }
        let Next { mut request, number, slot, pass } = next;
        if let Err(fault) = self.replace_scene(farm, number) {
            // Frames are checked before the run. A frame of another scene would be wrong: a view without pixels ends the run.
            tracing::error!("frame {number}: {fault}");
            request.view.width = 0;
        }
        self.passes = pass.map(|(passes, _)| passes);
        self.films = self.passes.map_or(self.films, |passes| passes.film);
        // A request that replaces another one is as old as the camera that it shows.
        let input_at = self.moved_at.unwrap_or(now);
        let pass = pass.map(|(_, pass)| pass);
        let answered = Answered { input_at, number, slot, quality: Vec::new(), pass };
        self.open.push_back(Open { frame: farm.request(request), answered, requested_at: now, mode });
        self.requested = Some(Requested { request, wanted: *wanted, mode });
        self.next += 1;
        true
    }

    /// Replaces the scene by that of a frame, where the frames have different ones.
    fn replace_scene(&mut self, farm: &impl Renderer, number: u64) -> Result<(), String> {
        let Some(keys) = self.keys.as_ref().filter(|_| self.keyed != Some(number)) else { return Ok(()) };
        if let Some(scene) = keys.assets(number)? {
            farm.replace_scene(scene);
        }
        self.keyed = Some(number);
        Ok(())
    }

    /// The next frame, if one is needed.
    fn next(&self, state: &ViewState, mode: Option<QualityMode>, is_moving: bool) -> Option<Next> {
        let wanted = &state.request;
        let RequestPolicy { animation, limit, continuous } = self.policy;
        if limit.is_some_and(|limit| self.next >= limit) && !self.open.is_empty() {
            return None;
        }
        if state.hidden && !continuous {
            return None;
        }
        let request = match self.controller.as_ref().zip(mode) {
            Some((controller, mode)) => controller.apply(wanted, mode),
            None => *wanted,
        };
        let (number, slot) = match &self.plan {
            None => (self.next, None),
            Some(plan) => {
                let (number, slot) = plan.number(self.next).zip(plan.free_slot())?;
                (number, Some(slot))
            }
        };
        let request = self.keys.as_ref().map_or(request, |keys| keys.request(&request, number));
        let request = animation.request(&request, number);
        let request = self.plan.as_ref().map_or(request, |plan| plan.request(self.next, request));
        let has_passes = self.plan.is_none() && film_passes::has_passes(&request.view);
        if has_passes && !is_moving {
            let (passes, pass) = self.next_pass(&request, state.denoised)?;
            return Some(Next { request: pass.request(), number, slot, pass: Some((passes, pass)) });
        }
        let request = if has_passes { film_passes::while_moving(&request) } else { request };
        let is_needed = continuous || !self.is_requested(&request, wanted, mode);
        is_needed.then_some(Next { request, number, slot, pass: None })
    }

    /// The next pass of a picture at rest, and the passes after it. `None` if all have been requested, or if a third request would replace
    /// the second one, which is a pass of the same picture.
    fn next_pass(&self, whole: &ViewRequest, denoised: bool) -> Option<(Passes, Pass)> {
        let passes = self.passes_of(whole, denoised);
        let pass = passes.pass(denoised)?;
        let replaces = !pass.is_first() && self.open.len() >= OPEN_REQUESTS;
        (!replaces).then(|| (passes.after(&pass), pass))
    }

    /// Passes of a picture: those that are being rendered, or those of a new film.
    fn passes_of(&self, whole: &ViewRequest, denoised: bool) -> Passes {
        let first = Passes::new(whole, self.films + 1);
        match self.passes.filter(|passes| passes.whole == *whole) {
            // A measurement renders the picture again and again, each time to its end.
            Some(passes)
                if self.policy.continuous && passes.pass(denoised).is_none() && self.open.is_empty() =>
            {
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

    /// Records view and scene, which may have changed.
    fn note_change(&mut self, farm: &impl Renderer, state: &ViewState, now: Duration) {
        let (wanted, scene) = (&state.request, state.scene);
        let before = self.wanted.replace((*wanted, scene)).filter(|before| *before != (*wanted, scene));
        let Some((before, former_scene)) = before else { return };
        if scene != former_scene {
            // Another scene is another picture, even of the same view.
            self.passes = None;
        }
        // Another view may need the same frame, which is then requested again: the view rests only after a frame of its own.
        self.requested = None;
        match &mut self.controller {
            Some(controller) => controller.changed(now),
            // A picture in passes has far fewer bytes while it moves; another one is the same.
            None if film_passes::has_passes(&wanted.view) => self.stillness.changed(now),
            None => {}
        }
        let size = |request: &ViewRequest| (request.view.width, request.view.height);
        let is_other_size = size(&before) != size(wanted);
        // Frames in flight are of the display's former size, or later passes of a former view, which nothing shows.
        if is_other_size || self.open.iter().any(|open| !open.is_shown_alone()) {
            self.drop_all(farm);
        }
    }
}

/// Whether a mode is of a moving picture; without a quality controller there is none.
fn is_moving(mode: Option<QualityMode>) -> bool {
    mode.is_some_and(|mode| mode != QualityMode::Resting)
}
