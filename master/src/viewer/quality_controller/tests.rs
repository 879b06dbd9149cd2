use rayfarm_tracer::scene::{ExponentPrecision, FrameView, RenderScale, Shading};

use super::setting::Setting;
use super::*;
use crate::test_scene;

const MS: Duration = Duration::from_millis(1);

fn wanted(samples: u32) -> WantedPicture {
    WantedPicture { view: FrameView { samples, ..test_scene::view() }, scale: RenderScale::Full }
}

fn dial(target_fps: f64) -> Dial {
    let rung =
        |cost, loss, scale| Rung { setting: Setting { scale, ..Setting::FULL }, cost, wire: cost, loss };
    let rungs = [rung(0.6, 0.03, RenderScale::ThreeQuarters), rung(0.3, 0.05, RenderScale::Half)];
    let ladder = Ladder::of(rungs, Origin::General);
    Dial::new(ladder, target_fps, false)
}

fn moving(rung: usize) -> Shown {
    Shown::Moving(Step { rung, ladder: 0 })
}

fn finish(dial: &mut Dial, now: Duration, elapsed: Duration, shown: Shown, asked_at: Duration) {
    dial.finished(now, elapsed, shown, asked_at, &FrameAccount::default());
}

/// Full frames of 20 ms, one after the other.
fn rest(dial: &mut Dial, frames: u32) {
    (1..=frames).for_each(|frame| finish(dial, MS * 20 * frame, MS * 20, Shown::Resting, Duration::ZERO));
}

#[test]
fn the_picture_at_rest_is_the_one_that_is_wanted() {
    let mut dial = dial(100.0);
    assert_eq!(dial.next(MS), Shown::Resting);
    assert_eq!(dial.picture(&wanted(4), Shown::Resting), wanted(4));
    assert_eq!(dial.picture(&wanted(4), moving(0)), wanted(4));
    assert_eq!(dial.told(Shown::Resting), ["at rest: all that was asked for"]);
}

#[test]
fn a_moving_one_is_at_the_rung_that_holds() {
    let mut dial = dial(100.0);
    rest(&mut dial, 5);
    dial.changed(MS * 101);
    let shown = dial.next(MS * 101);
    assert_eq!(shown, moving(2));
    assert_eq!(dial.picture(&wanted(1), shown).scale, RenderScale::Half);
    assert_eq!(
        dial.told(shown),
        ["moving: loses about FLIP 0.050", "by the general table", "waits for render threads"]
    );
}

#[test]
fn only_the_full_picture_of_an_older_camera_is_given_up() {
    let (full, reduced) = (moving(0), moving(2));
    assert!(Shown::Resting.gives_way_to(reduced) && !Shown::Resting.gives_way_to(full));
    assert!(!full.gives_way_to(reduced) && !reduced.gives_way_to(Shown::Resting));
}

#[test]
fn it_comes_to_rest_when_its_last_camera_has_been_shown() {
    let mut dial = dial(100.0);
    rest(&mut dial, 5);
    dial.changed(MS * 101);
    assert_eq!(dial.rests_at(), None);
    finish(&mut dial, MS * 107, MS * 6, moving(2), MS * 101);
    assert_eq!(dial.rests_at(), Some(MS * 201));
    assert_eq!((dial.next(MS * 200), dial.next(MS * 201)), (moving(2), Shown::Resting));
}

#[test]
fn a_rate_that_is_out_of_reach_is_told() {
    let mut dial = dial(1000.0);
    rest(&mut dial, 20);
    let told = [
        "moving: loses about FLIP 0.050",
        "by the general table",
        "1000 FPS: out of reach",
        "waits for render threads",
    ];
    assert_eq!(dial.told(moving(2)), told);
    assert_eq!(dial.told(Shown::Resting), ["at rest: all that was asked for"]);
}

#[test]
fn no_knob_is_turned_up() {
    let mut low = wanted(4);
    low.scale = RenderScale::Half;
    low.view.quality.shadows = false;
    low.view.quality.shading = Shading::Diffuse;
    low.view.quality.exponent = ExponentPrecision::Fast;
    assert_eq!(Setting::FULL.applied(&low), low);
    let lowest = Setting {
        samples: 1,
        scale: RenderScale::Half,
        shadows: false,
        shading: Shading::Diffuse,
        exponent: ExponentPrecision::Fast,
        ..Setting::FULL
    };
    assert_eq!(lowest.applied(&wanted(4)).view.samples, 1);
    assert_eq!(lowest.applied(&low), WantedPicture { view: FrameView { samples: 1, ..low.view }, ..low });
}

#[test]
fn knobs_that_make_no_difference_to_a_scene_are_not_on_its_ladder() {
    let mut scene = test_scene::scene();
    scene.materials[0].specular = glam::Vec3::ZERO;
    assert!(scene.lights.is_empty());
    let rungs = prior_ladder(&scene, &wanted(4));
    assert!(rungs.rungs().len() > 3);
    for rung in rungs.rungs() {
        let Setting { shadows, shading, exponent, .. } = rung.setting;
        assert_eq!((shadows, shading, exponent), (true, Shading::Full, ExponentPrecision::Exact));
    }
    assert_eq!(rungs.cheapest().scale, RenderScale::Quarter);
    let mut least = wanted(1);
    least.scale = RenderScale::Quarter;
    assert_eq!(prior_ladder(&scene, &least).rungs().len(), 1);
}
