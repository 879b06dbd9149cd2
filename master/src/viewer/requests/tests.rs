//! Requests to a renderer that only records them.

use std::cell::RefCell;

use rayfarm_farm::testing::test_scene;
use rayfarm_tracer::scene::{FrameView, Integrator, PathSettings, PixelFormat, RenderScale};

use super::*;
use crate::viewer::quality_controller::{Ladder, Origin};

const STILL: Animation = Animation { orbit: 0.0, spin: 0.0, frames: 1 };
const SPINNING: Animation = Animation { spin: 1.0, ..STILL };

/// Requests, and the number of times that all were dropped.
#[derive(Default)]
struct Recorder {
    requests: RefCell<Vec<ViewRequest>>,
    dropped: RefCell<usize>,
}

impl Renderer for Recorder {
    fn request(&self, request: ViewRequest) -> FrameId {
        self.requests.borrow_mut().push(request);
        FrameId(self.requests.borrow().len() as u64)
    }

    fn drop_requests(&self) {
        *self.dropped.borrow_mut() += 1;
    }
}

/// Requests of a view, and their renderer.
struct View {
    requests: Requests,
    recorder: Recorder,
    state: ViewState,
}

impl View {
    fn new(animation: Animation, continuous: bool, controller: Option<QualityController>) -> Self {
        Self::of(test_scene::view(), animation, continuous, controller)
    }

    fn of(
        view: FrameView,
        animation: Animation,
        continuous: bool,
        controller: Option<QualityController>,
    ) -> Self {
        let request = ViewRequest { view, scale: RenderScale::Full };
        let policy = RequestPolicy { animation, limit: None, continuous };
        let requests = Requests::new(policy, controller);
        let state = ViewState { request, hidden: false };
        let mut view = Self { requests, recorder: Recorder::default(), state };
        view.requests.fill(&view.recorder, &view.state);
        view
    }

    fn change(&mut self, change: impl Fn(&mut ViewState)) {
        change(&mut self.state);
        self.requests.replace(&self.recorder, &self.state);
    }

    /// Finishes the oldest frame and requests the next one.
    fn finish(&mut self) -> Answered {
        let open = self.requests.open.front().expect("a frame is in flight");
        let frame = open.frame;
        let account = FrameAccount::default();
        let answered = self.requests.finished(frame, Duration::from_millis(1), &account);
        self.requests.after_finish(&self.recorder, &self.state);
        answered
    }

    fn finish_all(&mut self) {
        while !self.requests.open.is_empty() {
            self.finish();
        }
    }

    fn count(&self) -> usize {
        self.recorder.requests.borrow().len()
    }
}

#[test]
fn a_still_picture_is_requested_once() {
    let mut view = View::new(STILL, false, None);
    assert_eq!((view.count(), view.requests.at_rest()), (1, None));
    view.finish();
    assert_eq!((view.count(), view.requests.at_rest()), (1, Some(Vec::new())));
    let state = view.state;
    view.requests.fill(&view.recorder, &state);
    view.requests.rest(&view.recorder, &state);
    view.change(|_| ());
    assert_eq!(view.count(), 1, "nothing has changed");
}

#[test]
fn each_view_of_a_moving_camera_is_requested_once_and_the_last_one_is_the_current_view() {
    let mut view = View::new(STILL, false, None);
    for step in 1..=5 {
        view.change(|state| state.request.view.spin = f64::from(step));
        if step % 2 == 0 {
            view.finish();
        }
    }
    view.finish_all();
    assert_eq!(view.count(), 6);
    assert_eq!(view.recorder.requests.borrow().last(), Some(&view.state.request));
    assert!(view.requests.at_rest().is_some());
}

#[test]
fn an_animation_keeps_two_requests_open() {
    let mut view = View::new(SPINNING, false, None);
    for count in 2..20 {
        assert_eq!((view.requests.open.len(), view.count()), (2, count));
        view.finish();
    }
    assert_eq!(view.requests.at_rest(), None);
    let spins: Vec<f64> = view.recorder.requests.borrow().iter().map(|request| request.view.spin).collect();
    assert!(spins.windows(2).all(|pair| pair[1] == pair[0] + 1.0), "{spins:?}");
}

#[test]
fn a_measurement_goes_on_although_nothing_changes_and_the_display_is_hidden() {
    let mut view = View::new(STILL, true, None);
    view.change(|state| state.hidden = true);
    let before = view.count();
    (0..10).for_each(|_| drop(view.finish()));
    assert!(view.count() >= before + 9, "{} after {before}", view.count());
}

#[test]
fn a_hidden_display_requests_nothing_and_goes_on_where_it_was() {
    let mut view = View::new(SPINNING, false, None);
    view.change(|state| state.hidden = true);
    view.finish_all();
    let count = view.count();
    assert_eq!((count, view.requests.at_rest()), (2, Some(Vec::new())));
    view.change(|state| state.request.view.width = 40);
    assert_eq!(view.count(), count);
    view.change(|state| state.hidden = false);
    let requests = view.recorder.requests.borrow();
    assert_eq!(requests[count].view.width, 40);
    let spins: Vec<f64> = requests.iter().map(|request| request.view.spin).collect();
    assert_eq!(spins[..2], [0.0, 1.0]);
    assert_eq!(requests.len(), count + 2, "two are open again");
}

#[test]
fn another_size_drops_frames_in_flight() {
    let mut view = View::new(STILL, false, None);
    view.change(|state| state.request.view.height += 1);
    assert_eq!((view.count(), *view.recorder.dropped.borrow()), (2, 1));
    view.finish();
    // And back: the display no longer shows the picture of that size.
    view.change(|state| state.request.view.height -= 1);
    assert_eq!(view.count(), 3);
}

#[test]
fn with_a_controller_the_full_picture_at_rest_is_requested_once() {
    let ladder = Ladder::of([], Origin::General);
    let mut view = View::new(STILL, false, Some(QualityController::new(ladder, 30.0, false)));
    view.finish();
    let lines = view.requests.at_rest().unwrap();
    assert_eq!(lines, ["at rest: full quality"]);
    view.change(|state| state.request.view.spin = 1.0);
    view.finish();
    assert_eq!(view.requests.at_rest(), None, "the camera has not rested long enough");
    let rests_at = view.requests.rests_at().unwrap();
    std::thread::sleep(rests_at.saturating_duration_since(Instant::now()));
    let state = view.state;
    view.requests.rest(&view.recorder, &state);
    // The only rung is the full one: the moving picture serves at rest.
    assert_eq!(view.count(), 2);
    assert_eq!(view.requests.at_rest().unwrap(), lines);
}

#[test]
fn the_farm_receives_the_request_with_its_scale_and_knobs() {
    for scale in RenderScale::ALL {
        let mut view = View::new(STILL, false, None);
        view.finish();
        view.change(|state| {
            state.request.scale = scale;
            state.request.view.quality.shadows = false;
        });
        assert_eq!(view.recorder.requests.borrow().last(), Some(&view.state.request));
    }
}

#[test]
fn a_sequence_requests_each_frame_of_its_plan_once_and_waits_for_slots() {
    let numbers: Vec<u64> = (0..20).map(|index| 2 * index + 1).collect();
    let (plan, _sender, _sequence) = SequencePlan::new(&numbers, &[]);
    let request = ViewRequest { view: test_scene::view(), scale: RenderScale::Full };
    let state = ViewState { request, hidden: false };
    let requests = Requests::of_sequence(SPINNING, plan);
    let mut view = View { requests, recorder: Recorder::default(), state };
    view.requests.fill(&view.recorder, &view.state);
    let mut held = VecDeque::new();
    let mut finished = Vec::new();
    while !view.requests.open.is_empty() {
        let answered = view.finish();
        finished.push(answered.number);
        held.push_back(answered.slot.expect("each frame of a sequence has a slot"));
        if view.requests.open.is_empty() {
            // No slot is free before the display drops a frame.
            held.pop_front();
            view.requests.fill(&view.recorder, &view.state);
        }
    }
    assert_eq!(finished, numbers);
    let spins: Vec<f64> = view.recorder.requests.borrow().iter().map(|request| request.view.spin).collect();
    assert_eq!(spins, numbers.iter().map(|&number| number as f64).collect::<Vec<_>>());
}

/// A view of the path integrator.
fn paths(samples: u32) -> FrameView {
    let integrator = Integrator::Path(PathSettings::default());
    FrameView { integrator, samples, ..test_scene::view() }
}

/// First sample and number of samples of the requests from one on.
fn ranges(view: &View, from: usize) -> Vec<(u32, u32)> {
    let requests = view.recorder.requests.borrow();
    requests[from..].iter().map(|request| (request.view.first_sample, request.view.samples)).collect()
}

const PASSES: [(u32, u32); 7] = [(0, 1), (1, 1), (2, 2), (4, 4), (8, 8), (16, 16), (32, 8)];

#[test]
fn a_still_picture_of_paths_is_requested_in_passes_of_sums() {
    for controller in [None, Some(QualityController::new(Ladder::of([], Origin::General), 30.0, false))] {
        let mut view = View::of(paths(40), STILL, false, controller);
        assert_eq!(ranges(&view, 0), PASSES[..2], "two are in flight");
        let mut finished = Vec::new();
        while !view.requests.open.is_empty() {
            let pass = view.finish().pass.unwrap();
            assert!(view.requests.is_current(Some(pass)) && pass.whole == view.state.request);
            finished.push((pass.first, pass.samples));
            // Nothing has changed: the passes in flight are not replaced.
            view.change(|_| ());
        }
        assert_eq!((ranges(&view, 0), finished), (PASSES.to_vec(), PASSES.to_vec()));
        let format = |request: &ViewRequest| request.view.format;
        assert!(view.recorder.requests.borrow().iter().all(|request| format(request) == PixelFormat::Sums));
        assert!(view.requests.at_rest().is_some());
        view.change(|state| state.hidden = true);
        view.change(|state| state.hidden = false);
        assert_eq!(view.count(), PASSES.len(), "the picture is complete");
    }
}

#[test]
fn a_changed_view_starts_again_and_drops_later_passes() {
    let mut view = View::of(paths(40), STILL, false, None);
    // A first pass in flight shows that the camera moves.
    view.change(|state| state.request.view.spin = 1.0);
    assert_eq!(
        (view.count(), *view.recorder.dropped.borrow()),
        (4, 1),
        "pass 1..2 of the first view is dropped"
    );
    (0..3).for_each(|_| drop(view.finish()));
    let (count, old) = (view.count(), view.requests.open[0].answered.pass);
    assert!(old.is_some_and(|pass| pass.first > 0));
    view.change(|state| state.request.view.spin = 2.0);
    assert_eq!(*view.recorder.dropped.borrow(), 2);
    assert!(!view.requests.is_current(old));
    view.finish_all();
    assert_eq!(ranges(&view, count), PASSES);
    // And back: the film of the first view no longer exists.
    let count = view.count();
    view.change(|state| state.request.view.spin = 0.0);
    view.finish_all();
    assert_eq!(ranges(&view, count), PASSES);
}

#[test]
fn a_picture_that_has_lost_a_pass_starts_again() {
    let mut view = View::of(paths(4), STILL, false, None);
    let second = view.requests.open[1].frame;
    let answered = view.requests.finished(second, Duration::ZERO, &FrameAccount::default());
    assert!(!view.requests.is_current(answered.pass), "it goes into no film");
    view.requests.after_finish(&view.recorder, &view.state);
    view.finish_all();
    assert_eq!(ranges(&view, 2), PASSES[..3]);
}

#[test]
fn a_complete_picture_requests_no_pass_and_a_restarted_one_all() {
    let mut view = View::of(paths(40), STILL, false, None);
    (0..3).for_each(|_| drop(view.finish()));
    view.requests.complete_picture(&view.recorder);
    assert!(view.requests.at_rest().is_some() && *view.recorder.dropped.borrow() == 1);
    let count = view.count();
    view.requests.after_finish(&view.recorder, &view.state);
    view.change(|_| ());
    assert_eq!(view.count(), count);
    view.requests.restart_picture(&view.recorder, &view.state);
    view.finish_all();
    assert_eq!(ranges(&view, count), PASSES);
}

#[test]
fn moving_pictures_of_paths_have_one_sample_and_a_sequence_has_all() {
    let view = View::of(paths(40), SPINNING, false, None);
    let requests = view.recorder.requests.borrow();
    let kinds: Vec<_> = requests.iter().map(|it| (it.view.samples, it.view.format)).collect();
    assert_eq!(kinds, [(1, PixelFormat::Rgb8); 2]);

    let (plan, _sender, _sequence) = SequencePlan::new(&[0, 1], &[]);
    let requests = Requests::of_sequence(SPINNING, plan);
    let request = ViewRequest { view: paths(40), scale: RenderScale::Full };
    let state = ViewState { request, hidden: false };
    let mut view = View { requests, recorder: Recorder::default(), state };
    view.requests.fill(&view.recorder, &view.state);
    assert_eq!(ranges(&view, 0), [(0, 40), (0, 40)]);
}

#[test]
fn a_measurement_renders_a_picture_of_paths_again_and_again() {
    let mut view = View::of(paths(2), STILL, true, None);
    (0..6).for_each(|_| drop(view.finish()));
    let firsts: Vec<u32> = ranges(&view, 0).iter().map(|range| range.0).collect();
    assert_eq!(firsts[..6], [0, 1, 0, 1, 0, 1]);
}
