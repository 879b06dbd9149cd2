//! The feed with a quality controller, over a farm with workers that follow a script.

use std::net::SocketAddr;
use std::time::Duration;

use rayfarm_tracer::scene::{FrameView, RenderScale};
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tokio_util::sync::CancellationToken;

use super::{Arrival, NewsDesk, Orders, run};
use crate::accounting::FrameAccount;
use crate::app::error::CommandError;
use crate::fake_worker::{self, Script, is_picture};
use crate::farm::{Farm, FarmOptions, FarmScene};
use crate::test_scene::{scene, view};
use crate::viewer::orbit::Animation;
use crate::viewer::quality_controller::{QualityController, QualityMode, prior_ladder};
use crate::viewer::requests::{Pace, WindowState};
use crate::viewer::view_request::ViewRequest;

/// Far beyond what any of these tests takes.
const PATIENCE: Duration = Duration::from_secs(60);
/// A rate that no setting reaches, so that the cheapest one is chosen.
const TOO_FAST: f64 = 1e7;
const STILL: Animation = Animation { orbit: 0.0, spin: 0.0, frames: 1 };

struct Feed {
    wanted: watch::Sender<WindowState>,
    desk: NewsDesk,
    stop: CancellationToken,
    task: JoinHandle<Result<(), CommandError>>,
}

impl Feed {
    async fn start(script: Script, animation: Animation, controller: Option<QualityController>) -> Self {
        let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
        let options = FarmOptions { listen, ..FarmOptions::default() };
        let scene = FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() };
        let farm = Farm::start(options, scene).await.unwrap();
        fake_worker::start(farm.address(), script).await;
        let (wanted, wishes) = watch::channel(seen(0));
        let (desk, stop) = (NewsDesk::new(), CancellationToken::new());
        let pace = Pace { animation, limit: None, continuous: false };
        let orders = Orders { wanted: wishes, pace, log: None, controller };
        let task = tokio::spawn(run(farm, orders, desk.clone(), stop.clone()));
        Self { wanted, desk, stop, task }
    }

    /// The next picture that is like that, doing something meanwhile.
    async fn picture(&self, mut meanwhile: impl FnMut(), like: impl Fn(&Arrival) -> bool) -> Arrival {
        let wait = async {
            loop {
                meanwhile();
                if let Some(arrival) = self.desk.take_picture().filter(&like) {
                    return arrival;
                }
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
        };
        tokio::time::timeout(PATIENCE, wait).await.expect("such a picture never comes")
    }

    async fn end(self) {
        self.stop.cancel();
        self.task.await.unwrap().unwrap();
    }
}

fn turned(spin: u32) -> ViewRequest {
    ViewRequest { view: FrameView { spin: f64::from(spin), ..view() }, scale: RenderScale::Full }
}

fn seen(spin: u32) -> WindowState {
    WindowState { picture: turned(spin), hidden: false }
}

/// One that has seen what full pictures take.
fn controller(animated: bool) -> QualityController {
    let mut controller = QualityController::new(prior_ladder(&scene(), &turned(0)), TOO_FAST, animated);
    let (ms, account) = (|ms| Duration::from_millis(ms), FrameAccount::default());
    for frame in 1..20 {
        controller.finished(ms(10 * frame), ms(10), QualityMode::Resting, Duration::ZERO, &account);
    }
    controller
}

fn is_at_rest(arrival: &Arrival) -> bool {
    arrival.quality.first().is_some_and(|line| line.starts_with("at rest"))
}

fn is_reduced(arrival: &Arrival) -> bool {
    arrival.frame.view.width < view().width
}

#[tokio::test]
async fn what_moves_is_reduced_and_what_rests_is_the_full_picture_to_the_last_bit() {
    let plain = Feed::start(Script::Honest, STILL, None).await;
    let feed = Feed::start(Script::Busy, STILL, Some(controller(false))).await;
    let first = feed.picture(|| (), |_| true).await;
    assert!(is_at_rest(&first) && is_picture(&turned(0).view, &first.frame.pixels));

    let mut spin = 0;
    let turn = || {
        spin += 1;
        feed.wanted.send_replace(seen(spin));
    };
    let moving = feed.picture(turn, is_reduced).await;
    assert!(moving.quality[0].starts_with("moving: loses about FLIP 0."), "{:?}", moving.quality);
    assert!(is_picture(&moving.frame.view, &moving.frame.pixels));

    let last = turned(spin).view;
    let rests = feed.picture(|| (), |it| is_at_rest(it) && it.frame.view.spin == last.spin).await;
    assert_eq!(rests.frame.view, last);
    assert!(is_picture(&last, &rests.frame.pixels));
    plain.wanted.send_replace(seen(spin));
    let without = plain.picture(|| (), |arrival| arrival.frame.view.spin == last.spin).await;
    assert_eq!(*rests.frame.pixels, *without.frame.pixels);
    assert!(without.quality.is_empty());
    feed.end().await;
    plain.end().await;
}

#[tokio::test]
async fn a_full_picture_on_the_way_gives_way_to_a_moving_one() {
    let feed = Feed::start(Script::OnlyNarrowerThan(view().width), STILL, Some(controller(false))).await;
    // Nobody finishes the full one.
    tokio::time::timeout(PATIENCE, async {
        while feed.desk.status().frame.is_none() {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    })
    .await
    .unwrap();
    feed.wanted.send_replace(seen(1));
    let moving = feed.picture(|| (), |_| true).await;
    assert!(is_reduced(&moving));
    assert_eq!(moving.frame.view.spin, 1.0);
    feed.end().await;
}

#[tokio::test]
async fn an_animation_never_rests() {
    let spinning = Animation { spin: 1.0, ..STILL };
    let feed = Feed::start(Script::Busy, spinning, Some(controller(true))).await;
    for _ in 0..20 {
        let frame = feed.picture(|| (), |_| true).await;
        assert!(!is_at_rest(&frame) && is_reduced(&frame));
    }
    feed.end().await;
}

/// Longer than it takes until a picture is called at rest, several times.
const A_WHILE: Duration = Duration::from_millis(1500);

#[tokio::test]
async fn at_rest_there_is_one_full_picture_and_then_silence_until_something_changes() {
    for controller in [None, Some(controller(false))] {
        let feed = Feed::start(Script::Honest, STILL, controller).await;
        let first = feed.picture(|| (), |_| true).await;
        assert!(is_picture(&turned(0).view, &first.frame.pixels));
        tokio::time::sleep(A_WHILE).await;
        assert_eq!(feed.desk.completed(), 1, "one picture, and no other");
        assert!(feed.desk.resting().is_some());
        assert!(feed.desk.status().frame.is_none(), "nothing is on the way");

        feed.wanted.send_replace(seen(1));
        let full = |it: &Arrival| it.frame.view == turned(1).view;
        let second = feed.picture(|| (), full).await;
        assert!(is_picture(&turned(1).view, &second.frame.pixels));
        let count = feed.desk.completed();
        tokio::time::sleep(A_WHILE).await;
        assert_eq!(feed.desk.completed(), count, "silence again");
        assert!(count <= 3, "what moves is shown once, and the full picture once: {count} in all");
        feed.end().await;
    }
}

#[tokio::test]
async fn a_hidden_window_asks_for_nothing_and_is_right_when_it_is_back() {
    for animation in [STILL, Animation { spin: 1.0, ..STILL }] {
        let feed = Feed::start(Script::Busy, animation, None).await;
        feed.picture(|| (), |_| true).await;
        feed.wanted.send_replace(WindowState { hidden: true, ..seen(0) });
        tokio::time::timeout(PATIENCE, async {
            while feed.desk.resting().is_none() {
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
        })
        .await
        .unwrap();
        let count = feed.desk.completed();
        feed.wanted.send_replace(WindowState { hidden: true, ..seen(1000) });
        tokio::time::sleep(A_WHILE).await;
        assert_eq!(feed.desk.completed(), count, "a hidden picture is not rendered");
        feed.wanted.send_replace(seen(1000));
        let back = feed.picture(|| (), |it| it.frame.view.spin >= 1000.0).await;
        assert!(is_picture(&back.frame.view, &back.frame.pixels));
        feed.end().await;
    }
}
