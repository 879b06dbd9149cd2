//! The viewer over a farm with workers that render paths.

use std::net::SocketAddr;
use std::time::Duration;

use rayfarm_farm::testing::fake_worker::{self, Script};
use rayfarm_farm::{FarmOptions, FarmScene};
use rayfarm_tracer::scene::{FrameView, PixelFormat, RenderScale};

use super::tests::{Running, STILL, TURN, controller, is_reduced, turned_from};
use super::*;
use crate::test_worker;
use crate::viewer::film::tests::{rendered, scene, view};

const SAMPLES: u32 = 12;

/// A farm for the scene of paths, which verifies a share of the segments.
async fn farm(verify_percent: u8) -> Farm {
    let listen = Some(SocketAddr::from(([127, 0, 0, 1], 0)));
    let options = FarmOptions { listen, verify_percent, ..FarmOptions::default() };
    let scene = FarmScene { scene: scene(), meshes: Vec::new(), textures: Vec::new() };
    Farm::start(options, scene).await.unwrap()
}

fn config(controller: Option<QualityController>) -> ViewerConfig {
    ViewerConfig {
        request: ViewRequest { view: view(SAMPLES), scale: RenderScale::Full },
        camera: CameraControl::new(view(SAMPLES).camera, None),
        policy: RequestPolicy { animation: STILL, limit: None, continuous: false },
        log: None,
        controller,
        denoised: false,
    }
}

/// Samples of a picture in passes; 0 for another one.
fn samples(presented: &PresentedFrame) -> u32 {
    presented.film.map_or(0, |film| film.samples)
}

/// Whether a picture is that of all of its samples, rendered at once.
fn is_whole(presented: &PresentedFrame, camera: rayfarm_tracer::scene::Camera) -> bool {
    let whole = FrameView { camera, ..view(samples(presented).max(1)) };
    presented.frame.view == whole && *presented.frame.pixels == *rendered(&whole)
}

#[tokio::test]
async fn the_window_shows_after_n_samples_what_a_render_of_n_samples_shows() {
    let farm = farm(0).await;
    for _ in 0..2 {
        test_worker::start(farm.address());
    }
    let mut viewer = Running::of(farm, config(None));
    let mut shown = 0;
    while shown < SAMPLES {
        let frame = viewer.frame(|_| (), |_| true).await;
        assert_eq!(frame.frame.format(), PixelFormat::Rgb8);
        assert!(samples(&frame) > shown, "samples are only added");
        shown = samples(&frame);
        assert!(is_whole(&frame, view(SAMPLES).camera), "{shown} samples");
    }
    viewer.until(|_, figures| figures.resting).await;
    let film = viewer.handle.statistics().film.unwrap();
    assert!(film.is_complete() && film.error.is_some());
    assert_eq!(viewer.completed(), 5, "passes to 1, 2, 4, 8 and 12 samples");

    // A change starts again, and no pass of the former view is added. Without a controller too, a moving picture has one sample.
    let mut steps = 0;
    let turn = |handle: &ViewerHandle| steps += u32::from(handle.send(vec![TURN]));
    let moving = viewer.frame(turn, |it| it.film.is_none()).await;
    assert_eq!((moving.frame.view.samples, moving.frame.format()), (1, PixelFormat::Rgb8));
    let camera = turned_from(&view(SAMPLES), steps);
    let last = viewer.frame(|_| (), |it| samples(it) == SAMPLES && it.frame.view.camera == camera).await;
    assert!(is_whole(&last, camera));
    viewer.end().await;
}

#[tokio::test]
async fn a_moving_picture_of_paths_has_one_sample_and_comes_to_rest_on_the_whole_one() {
    let farm = farm(0).await;
    test_worker::start(farm.address());
    let mut viewer = Running::of(farm, config(Some(controller(false))));
    let mut steps = 0;
    let turn = |handle: &ViewerHandle| steps += u32::from(handle.send(vec![TURN]));
    let moving = viewer.frame(turn, is_reduced).await;
    assert_eq!((moving.frame.view.samples, samples(&moving)), (1, 0));
    let camera = turned_from(&view(SAMPLES), steps);
    let rests = viewer.frame(|_| (), |it| samples(it) == SAMPLES && it.frame.view.camera == camera).await;
    assert!(is_whole(&rests, camera));
    viewer.end().await;
}

#[tokio::test]
async fn a_denoised_picture_is_named_and_its_switch_shows_the_noise_again() {
    let farm = farm(0).await;
    test_worker::start(farm.address());
    let mut viewer = Running::of(farm, ViewerConfig { denoised: true, ..config(None) });
    let is_denoised = |it: &PresentedFrame| it.film.is_some_and(|film| film.is_denoised);
    let camera = view(SAMPLES).camera;
    let first = viewer.frame(|_| (), |it| it.film.is_some()).await;
    assert!(samples(&first) > 1 || !is_denoised(&first), "one sample has no estimate of its noise");
    let filtered = viewer.frame(|_| (), |it| samples(it) == SAMPLES && is_denoised(it)).await;
    assert_eq!(filtered.frame.view, view(SAMPLES));
    assert!(!is_whole(&filtered, camera), "most of the noise is gone");
    assert!(filtered.film.unwrap().text().ends_with(", denoised"));
    // At rest, without another frame of a worker.
    viewer.until(|_, figures| figures.resting).await;
    let completed = viewer.completed();
    viewer.send(InputAction::Denoise(false));
    let noisy = viewer.frame(|_| (), |it| !is_denoised(it)).await;
    assert!(samples(&noisy) == SAMPLES && is_whole(&noisy, camera));
    viewer.send(InputAction::Denoise(true));
    let again = viewer.frame(|_| (), is_denoised).await;
    assert_eq!(*again.frame.pixels, *filtered.frame.pixels);
    assert_eq!(viewer.completed(), completed);
    viewer.end().await;
}

#[tokio::test]
async fn a_film_with_wrong_pixels_starts_again() {
    let farm = farm(100).await;
    let address = farm.address();
    // Its pixels are not those of this scene.
    let wrong = fake_worker::start(address, Script::Correct).await;
    let mut viewer = Running::of(farm, config(None));
    tokio::time::timeout(Duration::from_secs(60), wrong).await.expect("it is never banned").unwrap();
    test_worker::start(address);
    let camera = view(SAMPLES).camera;
    let right = |it: &PresentedFrame| samples(it) == SAMPLES && is_whole(it, camera);
    viewer.frame(|_| (), right).await;
    viewer.end().await;
}
