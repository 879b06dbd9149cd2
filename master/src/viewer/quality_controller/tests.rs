use rayfarm_farm::testing::test_scene;
use rayfarm_tracer::scene::{
    ExponentPrecision, FrameView, Integrator, Quality, RenderScale, Setting, Shading,
};

use super::*;

const MS: Duration = Duration::from_millis(1);

fn wanted(samples: u32) -> ViewRequest {
    ViewRequest { view: FrameView { samples, ..test_scene::view() }, scale: RenderScale::Full }
}

fn controller(target_fps: f64) -> QualityController {
    let rung =
        |cost, loss, scale| Rung { setting: Setting { scale, ..Setting::FULL }, cost, wire: cost, loss };
    let rungs = [rung(0.6, 0.03, RenderScale::ThreeQuarters), rung(0.3, 0.05, RenderScale::Half)];
    let ladder = Ladder::of(rungs, Origin::General);
    QualityController::new(ladder, target_fps, false)
}

fn moving(rung: usize) -> QualityMode {
    QualityMode::Moving(Step { rung, ladder: 0 })
}

fn finish(
    controller: &mut QualityController,
    now: Duration,
    elapsed: Duration,
    mode: QualityMode,
    requested_at: Duration,
) {
    controller.finished(now, elapsed, mode, requested_at, &FrameAccount::default());
}

/// Full frames of 20 ms, one after the other.
fn rest(controller: &mut QualityController, frames: u32) {
    (1..=frames)
        .for_each(|frame| finish(controller, MS * 20 * frame, MS * 20, QualityMode::Resting, Duration::ZERO));
}

#[test]
fn the_picture_at_rest_is_the_one_that_is_wanted() {
    let mut controller = controller(100.0);
    assert_eq!(controller.next(MS), QualityMode::Resting);
    assert_eq!(controller.apply(&wanted(4), QualityMode::Resting), wanted(4));
    assert_eq!(controller.apply(&wanted(4), moving(0)), wanted(4));
    assert_eq!(controller.lines(QualityMode::Resting), ["at rest: full quality"]);
}

#[test]
fn a_moving_picture_is_at_the_rung_that_holds() {
    let mut controller = controller(100.0);
    rest(&mut controller, 5);
    controller.changed(MS * 101);
    let mode = controller.next(MS * 101);
    assert_eq!(mode, moving(2));
    assert_eq!(controller.apply(&wanted(1), mode).scale, RenderScale::Half);
    assert_eq!(
        controller.lines(mode),
        ["moving: loses about FLIP 0.050", "by the general table", "waits for render threads"]
    );
}

#[test]
fn only_the_full_picture_of_an_older_camera_is_dropped() {
    let (full, reduced) = (moving(0), moving(2));
    assert!(QualityMode::Resting.gives_way_to(reduced) && !QualityMode::Resting.gives_way_to(full));
    assert!(!full.gives_way_to(reduced) && !reduced.gives_way_to(QualityMode::Resting));
}

#[test]
fn the_view_rests_when_its_last_camera_has_been_shown() {
    let mut controller = controller(100.0);
    rest(&mut controller, 5);
    controller.changed(MS * 101);
    assert_eq!(controller.rests_at(), None);
    finish(&mut controller, MS * 107, MS * 6, moving(2), MS * 101);
    assert_eq!(controller.rests_at(), Some(MS * 201));
    assert_eq!((controller.next(MS * 200), controller.next(MS * 201)), (moving(2), QualityMode::Resting));
}

#[test]
fn a_rate_that_is_out_of_reach_is_reported() {
    let mut controller = controller(1000.0);
    rest(&mut controller, 20);
    let lines = [
        "moving: loses about FLIP 0.050",
        "by the general table",
        "1000 FPS: out of reach",
        "waits for render threads",
    ];
    assert_eq!(controller.lines(moving(2)), lines);
    assert_eq!(controller.lines(QualityMode::Resting), ["at rest: full quality"]);
}

#[test]
fn no_knob_is_raised() {
    let mut low = wanted(4);
    low.scale = RenderScale::Half;
    low.view.quality.shadows = false;
    low.view.quality.shading = Shading::Diffuse;
    low.view.quality.exponent = ExponentPrecision::Fast;
    assert_eq!(low.at_most(&Setting::FULL), low);
    let lowest = Setting {
        integrator: Integrator::Direct,
        samples: 1,
        scale: RenderScale::Half,
        quality: Quality {
            shadows: false,
            shading: Shading::Diffuse,
            exponent: ExponentPrecision::Fast,
            ..Quality::default()
        },
    };
    assert_eq!(wanted(4).at_most(&lowest).view.samples, 1);
    assert_eq!(low.at_most(&lowest), ViewRequest { view: FrameView { samples: 1, ..low.view }, ..low });
}

#[test]
fn knobs_without_effect_on_a_scene_are_not_on_its_ladder() {
    let mut scene = test_scene::scene();
    scene.materials[0].specular = glam::Vec3::ZERO;
    assert!(scene.lights.is_empty());
    let rungs = prior_ladder(&scene, &wanted(4));
    assert!(rungs.rungs().len() > 3);
    for rung in rungs.rungs() {
        let Quality { shadows, shading, exponent, .. } = rung.setting.quality;
        assert_eq!((shadows, shading, exponent), (true, Shading::Full, ExponentPrecision::Exact));
    }
    assert_eq!(rungs.cheapest().scale, RenderScale::Quarter);
    let mut least = wanted(1);
    least.scale = RenderScale::Quarter;
    assert_eq!(prior_ladder(&scene, &least).rungs().len(), 1);
}
