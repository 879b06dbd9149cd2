//! Requests for pictures of the path integrator: passes, guides, and frames of a moving camera.

use rayfarm_farm::testing::test_scene;
use rayfarm_tracer::GUIDES;
use rayfarm_tracer::scene::{FrameView, Integrator, PathSettings, PixelFormat, RenderScale, Shading};

use super::tests::{Recorder, SPINNING, STILL, View};
use super::*;
use crate::viewer::quality_controller::{Ladder, Origin};

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
            let Part::Samples { first, samples } = pass.part else { panic!("a guide of no denoiser") };
            finished.push((first, samples));
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

/// Samples and formats of the requests from one on.
fn kinds(view: &View, from: usize) -> Vec<(u32, PixelFormat)> {
    let requests = view.recorder.requests.borrow();
    requests[from..].iter().map(|request| (request.view.samples, request.view.format)).collect()
}

#[test]
fn a_changed_view_starts_again_and_drops_later_passes() {
    let mut view = View::of(paths(40), STILL, false, None);
    view.change(|state| state.request.view.spin = 1.0);
    assert_eq!(
        (kinds(&view, 2), *view.recorder.dropped.borrow()),
        (vec![(1, PixelFormat::Rgb8)], 1),
        "pass 1..2 of the first view is dropped"
    );
    let count = view.count();
    view.rest();
    assert_eq!(ranges(&view, count), PASSES);
    // And back: the film of the first view no longer exists.
    let count = view.count();
    view.change(|state| state.request.view.spin = 0.0);
    view.rest();
    assert_eq!(ranges(&view, count)[1..], PASSES);
}

#[test]
fn a_moving_camera_needs_no_controller_for_frames_in_the_bytes_of_the_display() {
    let mut view = View::of(paths(40), STILL, false, None);
    let count = view.count();
    for step in 1..=20 {
        view.change(|state| state.request.view.spin = f64::from(step));
        if step % 3 == 0 {
            view.finish();
        }
    }
    let moving = kinds(&view, count);
    assert!(moving.len() >= 20 && moving.iter().all(|kind| *kind == (1, PixelFormat::Rgb8)), "{moving:?}");
    let count = view.count();
    view.rest();
    assert_eq!(ranges(&view, count), PASSES);
    assert!(kinds(&view, count).iter().all(|kind| kind.1 == PixelFormat::Sums));
    assert!(view.requests.at_rest().is_some());
}

/// More samples change the picture at rest, and not that of a moving camera.
#[test]
fn a_change_that_no_moving_frame_shows_comes_to_rest_too() {
    for controller in [None, Some(QualityController::new(Ladder::of([], Origin::General), 30.0, false))] {
        let mut view = View::of(paths(4), STILL, false, controller);
        view.change(|state| state.request.view.spin = 1.0);
        view.change(|state| state.request.view.samples = 40);
        view.finish_all();
        let count = view.count();
        view.rest();
        assert_eq!(ranges(&view, count), PASSES);
        assert!(view.requests.at_rest().is_some());
    }
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
    let requests = Requests::of_sequence(SPINNING, plan, None);
    let request = ViewRequest { view: paths(40), scale: RenderScale::Full };
    let state = ViewState { request, scene: 0, hidden: false, denoised: false };
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

/// Shadings of the requests from one on; `None` for passes.
fn guides(view: &View, from: usize) -> Vec<Option<Shading>> {
    let requests = view.recorder.requests.borrow();
    let guide = |request: &ViewRequest| {
        (request.view.format == PixelFormat::Linear).then_some(request.view.quality.shading)
    };
    requests[from..].iter().map(guide).collect()
}

fn denoised(on: bool) -> impl Fn(&mut ViewState) {
    move |state| state.denoised = on
}

#[test]
fn a_denoised_picture_requests_each_guide_once_after_its_first_pass() {
    let all = GUIDES.map(Some);
    let mut view = View::of(paths(40), STILL, false, None);
    view.change(denoised(true));
    view.finish_all();
    // Two passes were in flight.
    assert_eq!(guides(&view, 0), [&[None; 2][..], &all, &[None; 5]].concat());
    assert_eq!(view.recorder.requests.borrow()[2], view.state.request.auxiliary(GUIDES[0]));
    let count = view.count();
    view.change(denoised(false));
    view.change(denoised(true));
    view.finish_all();
    assert_eq!(view.count(), count, "the picture has its guides");

    // Another view has its own, from the first pass on.
    view.change(|state| state.request.view.spin = 1.0);
    view.finish_all();
    let count = view.count();
    view.rest();
    assert_eq!(guides(&view, count), [&[None][..], &all, &[None; 6]].concat());
    assert!(view.requests.at_rest().is_some());
}

#[test]
fn guides_follow_a_complete_picture_and_are_requested_again_after_they_were_dropped() {
    let all = GUIDES.map(Some);
    let mut view = View::of(paths(2), STILL, false, None);
    view.finish_all();
    view.change(denoised(true));
    view.finish_all();
    assert_eq!(guides(&view, 2), all);

    let mut view = View::of(paths(40), STILL, false, None);
    view.change(denoised(true));
    // The first pass is finished, and the first guide in flight.
    view.finish();
    assert_eq!(guides(&view, 2), all[..1]);
    view.requests.complete_picture(&view.recorder);
    let state = view.state;
    view.requests.fill(&view.recorder, &state);
    view.finish_all();
    assert_eq!(guides(&view, 3), all, "no further pass");
    assert!(view.requests.at_rest().is_some());
}

#[test]
fn pictures_without_an_estimate_of_noise_request_no_guides() {
    for view in [paths(1), FrameView { samples: 16, ..test_scene::view() }] {
        let mut view = View::of(view, STILL, false, None);
        view.change(denoised(true));
        view.finish_all();
        assert_eq!(view.count(), 1);
    }
    let mut moving = View::of(paths(40), SPINNING, false, None);
    moving.change(denoised(true));
    (0..6).for_each(|_| drop(moving.finish()));
    assert!(guides(&moving, 0).iter().all(Option::is_none), "nothing is denoised while the camera moves");
}
