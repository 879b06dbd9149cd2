use proptest::prelude::*;
use rayfarm_tracer::scene::{FovAxis, FrameView, Quality};

use super::*;

fn home() -> Camera {
    Camera {
        position: DVec3::new(1.0, 2.0, 6.0),
        look_at: DVec3::new(0.5, 1.0, 0.0),
        up: DVec3::Y,
        fov: 40.0,
        zoom: 1.0,
        kind: CameraKind::PINHOLE,
    }
}

fn control() -> CameraControl {
    CameraControl::new(home(), Some((DVec3::splat(-3.0), DVec3::splat(3.0))))
}

fn control_of(kind: CameraKind) -> CameraControl {
    CameraControl::new(Camera { kind, ..home() }, Some((DVec3::splat(-3.0), DVec3::splat(3.0))))
}

const ORTHOGRAPHIC: CameraKind = CameraKind::Orthographic { view_height: 4.0 };

/// One step of all movements at once, in the order in which a window sends them.
#[derive(Clone, Copy, Debug, Default)]
struct Step {
    reset: bool,
    /// Right, up and forward.
    direction: DVec3,
    /// Right and up.
    look: (f64, f64),
    /// Right and down.
    drag: (f64, f64),
    wheel: f64,
    /// To the right.
    roll: f64,
    /// Inwards.
    magnify: f64,
}

impl Step {
    fn apply(&self, control: &mut CameraControl, seconds: f64) {
        if self.reset {
            control.reset();
        }
        control.fly(self.direction, seconds);
        control.look(self.look.0, self.look.1, seconds);
        control.roll(self.roll, seconds);
        control.magnify(self.magnify, seconds);
        control.orbit(self.drag.0, self.drag.1);
        control.zoom(self.wheel);
    }
}

fn forward(camera: &Camera) -> DVec3 {
    (camera.look_at - camera.position).normalize()
}

#[test]
fn an_untouched_camera_is_the_scenes_own() {
    let mut control = control();
    Step::default().apply(&mut control, 0.02);
    assert_eq!(control.camera(), home());
}

#[test]
fn taking_over_does_not_jump() {
    let mut control = control();
    control.fly(DVec3::Z, 0.0);
    let camera = control.camera();
    assert!(camera.position.distance(home().position) < 1e-12);
    assert!(camera.look_at.distance(home().look_at) < 1e-12);
}

#[test]
fn each_direction_moves_the_camera_along_it() {
    let ahead = forward(&home());
    let right = ahead.cross(DVec3::Y).normalize();
    for (direction, expected) in [
        (DVec3::Z, ahead),
        (DVec3::NEG_Z, -ahead),
        (DVec3::X, right),
        (DVec3::NEG_X, -right),
        (DVec3::Y, DVec3::Y),
        (DVec3::NEG_Y, DVec3::NEG_Y),
    ] {
        let mut control = control();
        control.fly(direction, 0.05);
        let moved = control.camera().position - home().position;
        assert!(moved.length() > 0.01, "{expected}: moved by {moved}");
        assert!(moved.normalize().distance(expected) < 1e-9, "{expected}: moved by {moved}");
    }
}

#[test]
fn look_turns_the_view_and_keeps_the_position() {
    let ahead = forward(&home());
    let right = ahead.cross(DVec3::Y).normalize();
    let turned = |right: f64, up: f64| {
        let mut control = control();
        control.look(right, up, 0.05);
        assert_eq!(control.camera().position, home().position);
        forward(&control.camera())
    };
    assert!(turned(1.0, 0.0).dot(right) > 0.01);
    assert!(turned(-1.0, 0.0).dot(right) < -0.01);
    assert!(turned(0.0, 1.0).y > ahead.y + 0.01);
    assert!(turned(0.0, -1.0).y < ahead.y - 0.01);
}

#[test]
fn twice_the_time_is_twice_the_distance() {
    let way = |seconds: f64| {
        let mut control = control();
        control.fly(DVec3::X, seconds);
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
        control.fly(DVec3::Z, 0.05);
        control.camera().position.distance(camera.position)
    };
    assert!((way(1000.0) / way(1.0) - 1000.0).abs() < 1e-6);
}

#[test]
fn zoom_moves_nearer_and_back() {
    let mut control = control();
    let before = home().position.distance(home().look_at);
    control.zoom(3.0);
    let near = control.camera();
    assert!(near.position.distance(near.look_at) < 0.8 * before);
    assert!(near.look_at.distance(home().look_at) < 1e-12);
    control.zoom(-3.0);
    assert!(control.camera().position.distance(home().position) < 1e-9);
}

#[test]
fn a_plan_view_can_be_orbited() {
    let plan =
        Camera { position: DVec3::new(0.0, 9.0, 0.0), look_at: DVec3::ZERO, up: DVec3::NEG_Z, ..home() };
    let mut control = CameraControl::new(plan, None);
    control.orbit(0.25, 0.1);
    let camera = control.camera();
    assert!((camera.position.length() - 9.0).abs() < 1e-9);
    assert!(camera.position.distance(plan.position) > 0.1);
}

/// Steps of 0.1 s that take `seconds`.
fn hold(seconds: u32, mut step: impl FnMut(f64)) {
    (0..10 * seconds).for_each(|_| step(0.1));
}

#[test]
fn a_roll_turns_up_about_the_view_direction() {
    let mut control = control();
    let (ahead, level) = (forward(&home()), forward(&home()).cross(DVec3::Y).normalize());
    control.roll(1.0, 0.1);
    let rolled = control.camera();
    assert_eq!(rolled.position, home().position);
    assert!(forward(&rolled).distance(ahead) < 1e-12);
    let up = |camera: &Camera| camera.up.reject_from_normalized(ahead).normalize();
    let expected = up(&home()) * libm::cos(0.1) + level * libm::sin(0.1);
    assert!(up(&rolled).distance(expected) < 1e-12, "{}", up(&rolled));
    control.roll(-1.0, 0.1);
    assert!(up(&control.camera()).distance(up(&home())) < 1e-12);
}

#[test]
fn movements_follow_a_rolled_picture() {
    let mut control = control();
    let quarter = std::f64::consts::FRAC_PI_2 / 0.1;
    (0..quarter as u32).for_each(|_| control.roll(1.0, 0.1));
    control.roll(1.0, quarter.fract() * 0.1);
    // Rolled by a quarter to the right, the top of the picture is on the right, and its right side is below.
    let level = forward(&home()).cross(DVec3::Y).normalize();
    control.fly(DVec3::Y, 0.05);
    let moved = (control.camera().position - home().position).normalize();
    assert!(moved.distance(level) < 1e-9, "{moved}");
    let before = forward(&control.camera());
    control.look(1.0, 0.0, 0.05);
    let turned = forward(&control.camera()) - before;
    assert!(turned.y < -0.01 && turned.dot(level).abs() < 1e-9, "{turned}");
}

#[test]
fn magnification_multiplies_the_zoom_within_bounds() {
    for kind in [CameraKind::PINHOLE, ORTHOGRAPHIC] {
        let mut control = control_of(kind);
        hold(1, |seconds| control.magnify(1.0, seconds));
        assert!((control.camera().zoom - MAGNIFIED_PER_SECOND).abs() < 1e-12);
        assert_eq!(control.camera().position, home().position);
        hold(100, |seconds| control.magnify(1.0, seconds));
        assert_eq!(control.camera().zoom, 4096.0);
        hold(100, |seconds| control.magnify(-1.0, seconds));
        assert_eq!(control.camera().zoom, 1.0 / 64.0);
        control.magnify(1.0, 0.1);
        assert!(control.camera().zoom > 1.0 / 64.0, "it turns back at once");
    }
}

#[test]
fn magnification_of_a_fisheye_camera_changes_its_angle_within_bounds() {
    let mut control = control_of(CameraKind::Fisheye);
    hold(1, |seconds| control.magnify(1.0, seconds));
    let camera = control.camera();
    assert!((camera.fov - home().fov / MAGNIFIED_PER_SECOND).abs() < 1e-12 && camera.zoom == home().zoom);
    hold(100, |seconds| control.magnify(1.0, seconds));
    assert!((control.camera().fov - 1.0).abs() < 1e-12);
    hold(100, |seconds| control.magnify(-1.0, seconds));
    assert!((control.camera().fov - 360.0).abs() < 1e-9 && control.camera().fov <= 360.0);
}

#[test]
fn the_wheel_magnifies_an_orthographic_picture() {
    let mut control = control_of(ORTHOGRAPHIC);
    control.zoom(3.0);
    let camera = control.camera();
    assert!((camera.zoom * libm::pow(WHEEL_FACTOR, 3.0) - 1.0).abs() < 1e-12);
    assert!(camera.position.distance(home().position) < 1e-12);
}

#[test]
fn extremes_of_a_scenes_own_lens_are_kept() {
    for (zoom, fov, kind) in [
        (1e30, 40.0, CameraKind::PINHOLE),
        (f64::MIN_POSITIVE, 40.0, ORTHOGRAPHIC),
        (1.0, 0.01, CameraKind::Fisheye),
        (1.0, 360.0, CameraKind::Fisheye),
    ] {
        let own = Camera { zoom, fov, kind, ..home() };
        let mut control = CameraControl::new(own, None);
        control.look(1.0, 0.0, 0.05);
        let turned = control.camera();
        assert_eq!((turned.zoom, turned.fov), (zoom, fov), "turning does not change the lens");
    }
}

fn any_kind() -> impl Strategy<Value = CameraKind> {
    let horizontal = CameraKind::Pinhole { fov_axis: FovAxis::Horizontal };
    prop::sample::select(vec![CameraKind::PINHOLE, horizontal, ORTHOGRAPHIC, CameraKind::Fisheye])
}

fn any_step() -> impl Strategy<Value = Step> {
    let axis = || prop::sample::select(vec![-1.0, 0.0, 1.0]);
    let direction = prop::array::uniform3(axis()).prop_map(DVec3::from_array);
    let drag = (-2.0..2.0f64, -2.0..2.0f64);
    (prop::bool::weighted(0.02), direction, (axis(), axis()), drag, -8.0..8.0f64, (axis(), axis())).prop_map(
        |(reset, direction, look, drag, wheel, (roll, magnify))| Step {
            reset,
            direction,
            look,
            drag,
            wheel,
            roll,
            magnify,
        },
    )
}

proptest! {
    #[test]
    fn orbits_keep_distance_and_centre(drags in prop::collection::vec((-3.0..3.0f64, -3.0..3.0f64), 1..50)) {
        let mut control = control();
        for (right, down) in drags {
            control.orbit(right, down);
        }
        let camera = control.camera();
        let distance = home().position.distance(home().look_at);
        prop_assert!((camera.position.distance(camera.look_at) / distance - 1.0).abs() < 1e-9);
        prop_assert!(camera.look_at.distance(home().look_at) < 1e-9 * distance);
    }

    #[test]
    fn any_steps_leave_a_camera_that_can_render(
        kind in any_kind(),
        steps in prop::collection::vec((any_step(), 0.0..3.0f64), 1..200),
    ) {
        let mut control = control_of(kind);
        for (step, seconds) in steps {
            step.apply(&mut control, seconds);
            let camera = control.camera();
            prop_assert!(camera.position.is_finite() && camera.look_at.is_finite() && camera.up.is_finite());
            prop_assert!(camera.position.distance(camera.look_at) > 0.0);
            let (width, height, samples, quality) = (64, 48, 1, Quality::default());
            let view = FrameView { camera, width, height, samples, spin: 0.0, quality, ..FrameView::default() };
            prop_assert!(view.validate().is_ok(), "{:?}", camera);
            let steepness = forward(&camera).dot(camera.up.normalize()).abs();
            prop_assert!(steepness <= (89.0_f64).to_radians().sin() + 1e-6, "flips over the pole at {steepness}");
        }
    }

    #[test]
    fn reset_restores_the_scenes_camera(
        kind in any_kind(),
        steps in prop::collection::vec((any_step(), 0.0..0.1f64), 1..50),
    ) {
        let mut control = control_of(kind);
        for (step, seconds) in steps {
            step.apply(&mut control, seconds);
        }
        control.reset();
        prop_assert_eq!(control.camera(), Camera { kind, ..home() });
    }

    #[test]
    fn numbers_that_are_not_finite_leave_a_finite_camera(bad in prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY])) {
        let mut control = control();
        control.fly(DVec3::Z, bad);
        control.fly(DVec3::splat(bad), 0.1);
        control.roll(1.0, bad);
        control.magnify(-1.0, bad);
        let step = Step { look: (bad, bad), drag: (bad, bad), wheel: bad, roll: bad, magnify: bad, ..Step::default() };
        step.apply(&mut control, bad);
        let camera = control.camera();
        prop_assert!(camera.position.is_finite() && camera.look_at.is_finite());
    }
}
