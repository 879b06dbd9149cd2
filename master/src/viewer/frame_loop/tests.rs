//! The viewer over a farm with scripted workers.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use rayfarm_farm::accounting::FrameAccount;
use rayfarm_farm::testing::fake_worker::{self, Script, is_picture};
use rayfarm_farm::testing::test_scene::{scene, view};
use rayfarm_farm::{FarmOptions, FarmScene, FarmStatus};
use rayfarm_tracer::scene::{Camera, FrameView, RenderScale};
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use super::*;
use crate::viewer::quality_controller::{QualityMode, prior_ladder};

/// Far beyond what any of these tests takes.
const PATIENCE: Duration = Duration::from_secs(60);
/// A rate that no setting reaches, so that the cheapest one is chosen.
const TOO_FAST: f64 = 1e7;
pub(super) const STILL: Animation = Animation { orbit: 0.0, spin: 0.0, frames: 1 };

/// A running viewer and a display of it.
pub(super) struct Running {
    pub(super) handle: ViewerHandle,
    stop: CancellationToken,
    task: JoinHandle<Result<(), ViewerError>>,
}

async fn farm(script: Script) -> Farm {
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let options = FarmOptions { listen, ..FarmOptions::default() };
    let scene = FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() };
    let farm = Farm::start(options, scene).await.unwrap();
    fake_worker::start(farm.address(), script).await;
    farm
}

impl Running {
    async fn start(script: Script, animation: Animation, controller: Option<QualityController>) -> Self {
        let config = ViewerConfig {
            request: request(),
            camera: CameraControl::new(view().camera, None),
            policy: RequestPolicy { animation, limit: None, continuous: false },
            log: None,
            controller,
            denoised: false,
        };
        Self::of(farm(script).await, config)
    }

    pub(super) fn of(farm: Farm, config: ViewerConfig) -> Self {
        let (viewer, handle) = Viewer::interactive(farm, config);
        let stop = CancellationToken::new();
        Self { handle, stop: stop.clone(), task: spawn(viewer, stop) }
    }

    pub(super) fn send(&self, action: InputAction) {
        assert!(self.handle.send(vec![action]));
    }

    /// The next frame that meets a condition; `meanwhile` runs again and again until it is there.
    pub(super) async fn frame(
        &mut self,
        mut meanwhile: impl FnMut(&ViewerHandle),
        condition: impl Fn(&PresentedFrame) -> bool,
    ) -> Arc<PresentedFrame> {
        let wait = async {
            loop {
                meanwhile(&self.handle);
                if let Some(frame) = self.handle.new_frame().filter(|frame| condition(frame)) {
                    return frame;
                }
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
        };
        tokio::time::timeout(PATIENCE, wait).await.expect("such a frame never arrives")
    }

    /// Waits until the farm has a certain status, or the view certain figures.
    pub(super) async fn until(&self, condition: impl Fn(&FarmStatus, &crate::viewer::Statistics) -> bool) {
        let wait = async {
            while !condition(&self.handle.status(), &self.handle.statistics()) {
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
        };
        tokio::time::timeout(PATIENCE, wait).await.expect("it never comes to that");
    }

    pub(super) fn completed(&self) -> u64 {
        self.handle.statistics().completed
    }

    pub(super) async fn end(self) {
        self.stop.cancel();
        self.task.await.unwrap().unwrap();
    }
}

fn spawn(viewer: Viewer, stop: CancellationToken) -> JoinHandle<Result<(), ViewerError>> {
    tokio::spawn(async move {
        let (farm, result) = viewer.run(&stop).await;
        farm.shut_down().await;
        result
    })
}

fn request() -> ViewRequest {
    ViewRequest { view: view(), scale: RenderScale::Full }
}

/// One step of a camera that turns about its look-at point.
pub(super) const TURN: InputAction = InputAction::Orbit { right: 0.01, down: 0.0 };

/// The camera of a view after a number of steps.
pub(super) fn turned_from(view: &FrameView, steps: u32) -> Camera {
    let mut control = CameraControl::new(view.camera, None);
    (0..steps).for_each(|_| control.orbit(0.01, 0.0));
    control.camera()
}

/// The camera of the scene after a number of steps.
fn turned(steps: u32) -> Camera {
    turned_from(&view(), steps)
}

/// The full view of a camera.
fn seen_by(camera: Camera) -> FrameView {
    FrameView { camera, ..view() }
}

/// A controller that has measured full pictures.
pub(super) fn controller(animated: bool) -> QualityController {
    let mut controller = QualityController::new(prior_ladder(&scene(), &request()), TOO_FAST, animated);
    let (ms, account) = (|ms| Duration::from_millis(ms), FrameAccount::default());
    for frame in 1..20 {
        controller.finished(ms(10 * frame), ms(10), QualityMode::Resting, Duration::ZERO, &account);
    }
    controller
}

fn is_at_rest(presented: &PresentedFrame) -> bool {
    presented.quality.first().is_some_and(|line| line.starts_with("at rest"))
}

pub(super) fn is_reduced(presented: &PresentedFrame) -> bool {
    presented.frame.view.width < view().width
}

#[tokio::test]
async fn a_moving_picture_is_reduced_and_the_picture_at_rest_is_full_to_the_last_bit() {
    let mut plain = Running::start(Script::Correct, STILL, None).await;
    let mut viewer = Running::start(Script::Busy, STILL, Some(controller(false))).await;
    let first = viewer.frame(|_| (), |_| true).await;
    assert!(is_at_rest(&first) && is_picture(&view(), &first.frame.pixels));

    let mut steps = 0;
    let turn = |handle: &ViewerHandle| steps += u32::from(handle.send(vec![TURN]));
    let moving = viewer.frame(turn, is_reduced).await;
    assert!(moving.quality[0].starts_with("moving: loses about FLIP 0."), "{:?}", moving.quality);
    assert!(is_picture(&moving.frame.view, &moving.frame.pixels));
    assert_eq!(moving.frame.request.rendered().width, moving.frame.view.width);

    let last = seen_by(turned(steps));
    let rests = viewer.frame(|_| (), |it| is_at_rest(it) && it.frame.view.camera == last.camera).await;
    assert_eq!(rests.frame.view, last);
    assert!(is_picture(&last, &rests.frame.pixels));
    for _ in 0..steps {
        while !plain.handle.send(vec![TURN]) {
            tokio::task::yield_now().await;
        }
    }
    let without = plain.frame(|_| (), |it| it.frame.view.camera == last.camera).await;
    assert_eq!(*rests.frame.pixels, *without.frame.pixels);
    assert!(without.quality.is_empty());
    viewer.end().await;
    plain.end().await;
}

#[tokio::test]
async fn a_full_picture_in_flight_gives_way_to_a_moving_one() {
    let script = Script::OnlyNarrowerThan(view().width);
    let mut viewer = Running::start(script, STILL, Some(controller(false))).await;
    // No worker finishes the full picture.
    viewer.until(|status, _| status.frame.is_some()).await;
    viewer.send(TURN);
    let moving = viewer.frame(|_| (), |_| true).await;
    assert!(is_reduced(&moving));
    assert_eq!(moving.frame.view.camera, turned(1));
    viewer.end().await;
}

#[tokio::test]
async fn an_animation_never_rests() {
    let spinning = Animation { spin: 1.0, ..STILL };
    let mut viewer = Running::start(Script::Busy, spinning, Some(controller(true))).await;
    for _ in 0..20 {
        let frame = viewer.frame(|_| (), |_| true).await;
        assert!(!is_at_rest(&frame) && is_reduced(&frame));
    }
    viewer.end().await;
}

/// Several times as long as it takes until a picture counts as being at rest.
const A_WHILE: Duration = Duration::from_millis(1500);

#[tokio::test]
async fn at_rest_one_full_picture_is_requested_and_then_none_until_something_changes() {
    for controller in [None, Some(controller(false))] {
        let mut viewer = Running::start(Script::Correct, STILL, controller).await;
        let first = viewer.frame(|_| (), |_| true).await;
        assert!(is_picture(&view(), &first.frame.pixels));
        tokio::time::sleep(A_WHILE).await;
        assert_eq!(viewer.completed(), 1, "one picture, and no other");
        assert!(viewer.handle.statistics().resting);
        assert!(viewer.handle.status().frame.is_none(), "no frame is in flight");

        viewer.send(TURN);
        let full = seen_by(turned(1));
        let second = viewer.frame(|_| (), |it| it.frame.view == full).await;
        assert!(is_picture(&full, &second.frame.pixels));
        let count = viewer.completed();
        tokio::time::sleep(A_WHILE).await;
        assert_eq!(viewer.completed(), count, "no further frame");
        assert!(count <= 3, "the moving picture once, and the full picture once: {count} in all");
        viewer.end().await;
    }
}

#[tokio::test]
async fn a_hidden_display_requests_nothing_and_is_current_when_it_is_visible_again() {
    for animation in [STILL, Animation { spin: 1.0, ..STILL }] {
        let mut viewer = Running::start(Script::Busy, animation, None).await;
        viewer.frame(|_| (), |_| true).await;
        viewer.send(InputAction::SetVisible(false));
        viewer.until(|_, figures| figures.resting).await;
        let count = viewer.completed();
        viewer.send(TURN);
        tokio::time::sleep(A_WHILE).await;
        assert_eq!(viewer.completed(), count, "a hidden picture is not rendered");
        viewer.send(InputAction::SetVisible(true));
        let back = viewer.frame(|_| (), |it| it.frame.view.camera == turned(1)).await;
        assert!(is_picture(&back.frame.view, &back.frame.pixels));
        viewer.end().await;
    }
}

#[tokio::test]
async fn a_display_resizes_the_picture_resets_the_camera_and_quits() {
    let mut viewer = Running::start(Script::Correct, STILL, None).await;
    viewer.send(TURN);
    viewer.frame(|_| (), |it| it.frame.view.camera == turned(1)).await;
    assert!(viewer.handle.send(vec![
        InputAction::ResetCamera,
        InputAction::Resize { width: 48, height: 0 },
        InputAction::Presented { latency: Duration::from_millis(7) },
    ]));
    let expected = FrameView { width: 48, height: 1, ..view() };
    viewer.frame(|_| (), |it| it.frame.view == expected).await;
    viewer.until(|_, figures| figures.latency == Some(Duration::from_millis(7))).await;
    viewer.send(InputAction::Quit);
    viewer.until(|_, _| !viewer.handle.is_running()).await;
    viewer.end().await;
}

#[tokio::test]
async fn a_viewer_ends_when_no_display_is_left() {
    let Running { handle, stop: _stop, task } = Running::start(Script::Correct, STILL, None).await;
    drop(handle);
    tokio::time::timeout(PATIENCE, task).await.expect("it goes on").unwrap().unwrap();
}

#[tokio::test]
async fn a_sequence_delivers_each_frame_of_its_plan_once_and_in_order() {
    let numbers: Vec<u64> = (3..40).chain(50..60).collect();
    let animation = Animation { spin: 1.0, ..STILL };
    let farm = farm(Script::Correct).await;
    let (viewer, handle, mut sequence) = Viewer::sequence(farm, request(), animation, &numbers, &[], None);
    let task = spawn(viewer, CancellationToken::new());
    let mut arrived = Vec::new();
    while let Some(frame) = sequence.next().await {
        let expected = animation.view(&view(), frame.number);
        assert_eq!(frame.presented.frame.view, expected);
        assert!(is_picture(&expected, &frame.presented.frame.pixels));
        arrived.push(frame.number);
        if arrived.len() % 10 == 0 {
            // A slow display: the viewer waits for it.
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }
    assert_eq!(arrived, numbers);
    assert_eq!(handle.statistics().completed, numbers.len() as u64);
    task.await.unwrap().unwrap();
}
