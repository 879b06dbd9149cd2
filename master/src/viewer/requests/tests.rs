//! Requests to a renderer that only records them.

use std::cell::RefCell;
use std::sync::Arc;

use rayfarm_farm::Assets;
use rayfarm_farm::testing::test_scene;
use rayfarm_tracer::scene::{FrameView, RenderScale};

use super::*;
use crate::viewer::quality_controller::{Ladder, Origin};

pub(super) const STILL: Animation = Animation { orbit: 0.0, spin: 0.0, frames: 1 };
pub(super) const SPINNING: Animation = Animation { spin: 1.0, ..STILL };

/// Requests, and the number of times that all were dropped.
#[derive(Default)]
pub(super) struct Recorder {
    pub(super) scenes: RefCell<Vec<(usize, rayfarm_protocol::AssetId)>>,
    pub(super) requests: RefCell<Vec<ViewRequest>>,
    pub(super) dropped: RefCell<usize>,
}

impl Renderer for Recorder {
    fn request(&self, request: ViewRequest) -> FrameId {
        self.requests.borrow_mut().push(request);
        FrameId(self.requests.borrow().len() as u64)
    }

    fn drop_requests(&self) {
        *self.dropped.borrow_mut() += 1;
    }

    fn replace_scene(&self, scene: Arc<Assets>) {
        let next = self.requests.borrow().len();
        self.scenes.borrow_mut().push((next, scene.scene()));
    }
}

/// Requests of a view, and their renderer.
pub(super) struct View {
    pub(super) requests: Requests,
    pub(super) recorder: Recorder,
    pub(super) state: ViewState,
}

impl View {
    pub(super) fn new(animation: Animation, continuous: bool, controller: Option<QualityController>) -> Self {
        Self::of(test_scene::view(), animation, continuous, controller)
    }

    pub(super) fn of(
        view: FrameView,
        animation: Animation,
        continuous: bool,
        controller: Option<QualityController>,
    ) -> Self {
        let request = ViewRequest { view, scale: RenderScale::Full };
        let policy = RequestPolicy { animation, limit: None, continuous };
        let requests = Requests::new(policy, controller);
        let state = ViewState { request, scene: 0, hidden: false, denoised: false };
        let mut view = Self { requests, recorder: Recorder::default(), state };
        view.requests.fill(&view.recorder, &view.state);
        view
    }

    pub(super) fn change(&mut self, change: impl Fn(&mut ViewState)) {
        change(&mut self.state);
        self.requests.replace(&self.recorder, &self.state);
    }

    /// Finishes the oldest frame and requests the next one.
    pub(super) fn finish(&mut self) -> Answered {
        let open = self.requests.open.front().expect("a frame is in flight");
        let frame = open.frame;
        let account = FrameAccount::default();
        let answered = self.requests.finished(frame, Duration::from_millis(1), &account);
        self.requests.after_finish(&self.recorder, &self.state);
        answered
    }

    pub(super) fn finish_all(&mut self) {
        while !self.requests.open.is_empty() {
            self.finish();
        }
    }

    /// Finishes all frames, waits until the camera is at rest, and finishes all that follow.
    pub(super) fn rest(&mut self) {
        self.finish_all();
        if let Some(rests_at) = self.requests.rests_at() {
            std::thread::sleep(rests_at.saturating_duration_since(Instant::now()));
        }
        self.requests.rest(&self.recorder, &self.state);
        self.finish_all();
    }

    pub(super) fn count(&self) -> usize {
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
    let state = ViewState { request, scene: 0, hidden: false, denoised: false };
    let requests = Requests::of_sequence(SPINNING, plan, None);
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

#[test]
fn each_frame_of_a_scene_with_keys_has_its_scene_and_camera() {
    let (keys, request) = crate::viewer::keyed_scene::tests::moving();
    let (plan, _sender, _sequence) = SequencePlan::new(&[3, 7, 30], &[rayfarm_tracer::scene::Shading::Depth]);
    let state = ViewState { request, scene: 0, hidden: false, denoised: false };
    let requests = Requests::of_sequence(STILL, plan, Some(keys.clone()));
    let mut view = View { requests, recorder: Recorder::default(), state };
    view.requests.fill(&view.recorder, &view.state);
    while !view.requests.open.is_empty() {
        view.finish();
        view.requests.fill(&view.recorder, &view.state);
    }
    let scene = |number| keys.assets(number).unwrap().unwrap().scene();
    // A scene is replaced before the request of its frame; the auxiliary picture has the same one.
    assert_eq!(*view.recorder.scenes.borrow(), [(0, scene(3)), (2, scene(7)), (4, scene(30))]);
    let cameras: Vec<f64> =
        view.recorder.requests.borrow().iter().map(|request| request.view.camera.position.x).collect();
    for (camera, expected) in cameras.iter().zip([0.3, 0.3, 0.7, 0.7, 3.0, 3.0]) {
        assert!((camera - expected).abs() < 1e-12, "{cameras:?}");
    }
}
