use proptest::prelude::*;

use super::*;

fn home() -> Camera {
    Camera {
        position: DVec3::new(1.0, 2.0, 6.0),
        look_at: DVec3::new(0.5, 1.0, 0.0),
        up: DVec3::Y,
        fov: 40.0,
        zoom: 1.0,
    }
}

fn control() -> CameraControl {
    CameraControl::new(home(), Some((DVec3::splat(-3.0), DVec3::splat(3.0))))
}

fn held(set: impl FnOnce(&mut Held)) -> Input {
    let mut input = Input::default();
    set(&mut input.held);
    input
}

fn forward(camera: &Camera) -> DVec3 {
    (camera.look_at - camera.position).normalize()
}

#[test]
fn an_untouched_camera_is_the_scenes_own() {
    let mut control = control();
    control.step(&Input::default(), 0.02);
    assert_eq!(control.camera(), home());
}

#[test]
fn taking_over_does_not_jump() {
    let mut control = control();
    control.step(&held(|keys| keys.forward = true), 0.0);
    let camera = control.camera();
    assert!(camera.position.distance(home().position) < 1e-12);
    assert!(camera.look_at.distance(home().look_at) < 1e-12);
}

#[test]
fn each_key_moves_its_own_way() {
    let ahead = forward(&home());
    let right = ahead.cross(DVec3::Y).normalize();
    let moved = |input: Input| {
        let mut control = control();
        control.step(&input, 0.05);
        control.camera().position - home().position
    };
    for (way, wish) in [
        (moved(held(|keys| keys.forward = true)), ahead),
        (moved(held(|keys| keys.back = true)), -ahead),
        (moved(held(|keys| keys.right = true)), right),
        (moved(held(|keys| keys.left = true)), -right),
        (moved(held(|keys| keys.up = true)), DVec3::Y),
        (moved(held(|keys| keys.down = true)), DVec3::NEG_Y),
    ] {
        assert!(way.length() > 0.01, "{wish}: moved by {way}");
        assert!(way.normalize().distance(wish) < 1e-9, "{wish}: went {way}");
    }
}

#[test]
fn arrows_turn_the_view_and_not_the_place() {
    let ahead = forward(&home());
    let right = ahead.cross(DVec3::Y).normalize();
    let turned = |input: Input| {
        let mut control = control();
        control.step(&input, 0.05);
        assert_eq!(control.camera().position, home().position);
        forward(&control.camera())
    };
    assert!(turned(held(|keys| keys.look_right = true)).dot(right) > 0.01);
    assert!(turned(held(|keys| keys.look_left = true)).dot(right) < -0.01);
    assert!(turned(held(|keys| keys.look_up = true)).y > ahead.y + 0.01);
    assert!(turned(held(|keys| keys.look_down = true)).y < ahead.y - 0.01);
}

#[test]
fn twice_the_time_is_twice_the_way() {
    let way = |seconds: f64| {
        let mut control = control();
        control.step(&held(|keys| keys.right = true), seconds);
        control.camera().position.distance(home().position)
    };
    assert!((way(0.08) / way(0.04) - 2.0).abs() < 1e-9);
    assert!((way(60.0) / way(0.1) - 1.0).abs() < 1e-9, "a long pause counts as {LONGEST_STEP_SECONDS} s");
}

#[test]
fn a_bigger_scene_is_crossed_faster() {
    let way = |scale: f64| {
        let mut camera = home();
        camera.position *= scale;
        camera.look_at *= scale;
        let bounds = Some((DVec3::splat(-3.0 * scale), DVec3::splat(3.0 * scale)));
        let mut control = CameraControl::new(camera, bounds);
        control.step(&held(|keys| keys.forward = true), 0.05);
        control.camera().position.distance(camera.position)
    };
    assert!((way(1000.0) / way(1.0) - 1000.0).abs() < 1e-6);
}

#[test]
fn the_wheel_goes_nearer_and_back() {
    let mut control = control();
    let before = home().position.distance(home().look_at);
    control.step(&Input { wheel: 3.0, ..Input::default() }, 0.01);
    let near = control.camera();
    assert!(near.position.distance(near.look_at) < 0.8 * before);
    assert!(near.look_at.distance(home().look_at) < 1e-12);
    control.step(&Input { wheel: -3.0, ..Input::default() }, 0.01);
    assert!(control.camera().position.distance(home().position) < 1e-9);
}

#[test]
fn a_plan_view_can_be_steered() {
    let plan =
        Camera { position: DVec3::new(0.0, 9.0, 0.0), look_at: DVec3::ZERO, up: DVec3::NEG_Z, ..home() };
    let mut control = CameraControl::new(plan, None);
    control.step(&Input { drag: (0.25, 0.1), ..Input::default() }, 0.01);
    let camera = control.camera();
    assert!((camera.position.length() - 9.0).abs() < 1e-9);
    assert!(camera.position.distance(plan.position) > 0.1);
}

fn any_input() -> impl Strategy<Value = Input> {
    let keys = prop::array::uniform10(any::<bool>());
    (keys, (-2.0..2.0f64, -2.0..2.0f64), -8.0..8.0f64, prop::bool::weighted(0.02)).prop_map(
        |(keys, drag, wheel, reset)| {
            let [forward, back, left, right, up, down, look_left, look_right, look_up, look_down] = keys;
            let held =
                Held { forward, back, left, right, up, down, look_left, look_right, look_up, look_down };
            Input { held, drag, wheel, reset }
        },
    )
}

proptest! {
    #[test]
    fn orbits_keep_distance_and_centre(drags in prop::collection::vec((-3.0..3.0f64, -3.0..3.0f64), 1..50)) {
        let mut control = control();
        for drag in drags {
            control.step(&Input { drag, ..Input::default() }, 0.02);
        }
        let camera = control.camera();
        let distance = home().position.distance(home().look_at);
        prop_assert!((camera.position.distance(camera.look_at) / distance - 1.0).abs() < 1e-9);
        prop_assert!(camera.look_at.distance(home().look_at) < 1e-9 * distance);
    }

    #[test]
    fn any_storm_of_input_leaves_a_camera_that_can_render(storm in prop::collection::vec((any_input(), 0.0..3.0f64), 1..200)) {
        let mut control = control();
        for (input, seconds) in storm {
            control.step(&input, seconds);
            let camera = control.camera();
            prop_assert!(camera.position.is_finite() && camera.look_at.is_finite() && camera.up.is_finite());
            prop_assert!(camera.position.distance(camera.look_at) > 0.0);
            let steepness = forward(&camera).dot(camera.up.normalize()).abs();
            prop_assert!(steepness <= (89.0_f64).to_radians().sin() + 1e-6, "flips over the pole at {steepness}");
        }
    }

    #[test]
    fn reset_restores_the_scenes_camera(storm in prop::collection::vec((any_input(), 0.0..0.1f64), 1..50)) {
        let mut control = control();
        for (input, seconds) in storm {
            control.step(&input, seconds);
        }
        control.step(&Input { reset: true, ..Input::default() }, 0.02);
        prop_assert_eq!(control.camera(), home());
    }

    #[test]
    fn numbers_that_are_none_do_nothing_worse(bad in prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY])) {
        let mut control = control();
        let input = Input { held: Held { forward: true, ..Held::default() }, drag: (bad, bad), wheel: bad, reset: false };
        control.step(&input, bad);
        let camera = control.camera();
        prop_assert!(camera.position.is_finite() && camera.look_at.is_finite());
    }
}
