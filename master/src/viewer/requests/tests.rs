//! What is requested, by a renderer that only takes notes.

use std::cell::RefCell;

use rayfarm_tracer::scene::RenderScale;

use super::*;
use crate::test_scene;
use crate::viewer::quality_controller::{Ladder, Origin};

const STILL: Animation = Animation { orbit: 0.0, spin: 0.0, frames: 1 };
const SPINNING: Animation = Animation { spin: 1.0, ..STILL };

/// The views that were requested, and how often all were dropped.
#[derive(Default)]
struct Notes {
    views: RefCell<Vec<FrameView>>,
    dropped: RefCell<usize>,
}

impl Renderer for Notes {
    fn request(&self, view: FrameView) -> FrameId {
        self.views.borrow_mut().push(view);
        FrameId(self.views.borrow().len() as u64)
    }

    fn give_up(&self) {
        *self.dropped.borrow_mut() += 1;
    }
}

/// Requests and what became of them.
struct Window {
    requests: Requests,
    notes: Notes,
    state: WindowState,
}

impl Window {
    fn new(animation: Animation, continuous: bool, controller: Option<QualityController>) -> Self {
        let picture = ViewRequest { view: test_scene::view(), scale: RenderScale::Full };
        let requests = Requests::new(Pace { animation, limit: None, continuous }, controller);
        let mut window =
            Self { requests, notes: Notes::default(), state: WindowState { picture, hidden: false } };
        window.requests.fill(&window.notes, &window.state);
        window
    }

    fn change(&mut self, change: impl Fn(&mut WindowState)) {
        change(&mut self.state);
        self.requests.replace(&self.notes, &self.state);
    }

    /// The oldest frame comes, and the next is due.
    fn finish(&mut self) {
        let open = self.requests.open.front().expect("a frame is on the way");
        let frame = open.frame;
        self.requests.finished(frame, Duration::from_millis(1), &FrameAccount::default());
        self.requests.after_finish(&self.notes, &self.state);
    }

    fn finish_all(&mut self) {
        while !self.requests.open.is_empty() {
            self.finish();
        }
    }

    fn count(&self) -> usize {
        self.notes.views.borrow().len()
    }
}

#[test]
fn a_still_picture_is_requested_once() {
    let mut window = Window::new(STILL, false, None);
    assert_eq!((window.count(), window.requests.at_rest()), (1, None));
    window.finish();
    assert_eq!((window.count(), window.requests.at_rest()), (1, Some(Vec::new())));
    let state = window.state;
    window.requests.fill(&window.notes, &state);
    window.requests.rest(&window.notes, &state);
    window.change(|_| ());
    assert_eq!(window.count(), 1, "nothing has changed");
}

#[test]
fn each_view_of_a_moving_camera_is_requested_once_and_the_last_one_is_what_the_window_shows() {
    let mut window = Window::new(STILL, false, None);
    for step in 1..=5 {
        window.change(|state| state.picture.view.spin = f64::from(step));
        if step % 2 == 0 {
            window.finish();
        }
    }
    window.finish_all();
    assert_eq!(window.count(), 6);
    assert_eq!(window.notes.views.borrow().last(), Some(&window.state.picture.view));
    assert!(window.requests.at_rest().is_some());
}

#[test]
fn what_moves_by_itself_keeps_two_requests_open() {
    let mut window = Window::new(SPINNING, false, None);
    for count in 2..20 {
        assert_eq!((window.requests.open.len(), window.count()), (2, count));
        window.finish();
    }
    assert_eq!(window.requests.at_rest(), None);
    let spins: Vec<f64> = window.notes.views.borrow().iter().map(|view| view.spin).collect();
    assert!(spins.windows(2).all(|pair| pair[1] == pair[0] + 1.0), "{spins:?}");
}

#[test]
fn a_measurement_goes_on_although_nothing_changes_and_nobody_looks() {
    let mut window = Window::new(STILL, true, None);
    window.change(|state| state.hidden = true);
    let before = window.count();
    (0..10).for_each(|_| window.finish());
    assert!(window.count() >= before + 9, "{} after {before}", window.count());
}

#[test]
fn a_hidden_window_requests_nothing_and_goes_on_where_it_was() {
    let mut window = Window::new(SPINNING, false, None);
    window.change(|state| state.hidden = true);
    window.finish_all();
    let count = window.count();
    assert_eq!((count, window.requests.at_rest()), (2, Some(Vec::new())));
    window.change(|state| state.picture.view.width = 40);
    assert_eq!(window.count(), count);
    window.change(|state| state.hidden = false);
    let views = window.notes.views.borrow();
    assert_eq!(views[count].width, 40);
    let spins: Vec<f64> = views.iter().map(|view| view.spin).collect();
    assert_eq!(spins[..2], [0.0, 1.0]);
    assert_eq!(views.len(), count + 2, "two are open again");
}

#[test]
fn a_window_of_another_size_drops_what_is_on_the_way() {
    let mut window = Window::new(STILL, false, None);
    window.change(|state| state.picture.view.height += 1);
    assert_eq!((window.count(), *window.notes.dropped.borrow()), (2, 1));
    window.finish();
    // And back: the picture of that size is not on the screen any more.
    window.change(|state| state.picture.view.height -= 1);
    assert_eq!(window.count(), 3);
}

#[test]
fn with_a_dial_the_full_picture_at_rest_is_requested_once() {
    let ladder = Ladder::of([], Origin::General);
    let mut window = Window::new(STILL, false, Some(QualityController::new(ladder, 30.0, false)));
    window.finish();
    let told = window.requests.at_rest().unwrap();
    assert_eq!(told, ["at rest: all that was asked for"]);
    window.change(|state| state.picture.view.spin = 1.0);
    window.finish();
    assert_eq!(window.requests.at_rest(), None, "it has not rested long enough");
    let rests_at = window.requests.rests_at().unwrap();
    std::thread::sleep(rests_at.saturating_duration_since(Instant::now()));
    let state = window.state;
    window.requests.rest(&window.notes, &state);
    // The only rung is the full one: what moved is what rests.
    assert_eq!(window.count(), 2);
    assert_eq!(window.requests.at_rest().unwrap(), told);
}
