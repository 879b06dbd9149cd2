//! Pictures of a film with and without most of their noise.

use std::time::Duration;

use rayfarm_farm::ViewRequest;
use rayfarm_tracer::image::{self, LinearImage, RgbImage};
use rayfarm_tracer::scene::FrameView;
use rayfarm_tracer::{GUIDES, Guides, PixelFormat, PixelSums, develop_denoised};

use super::pass::{Part, Pass};
use super::still::{Added, StillFilm, alone};
use super::tests::{frame, rendered, view};
use super::*;

const SAMPLES: u32 = 16;

/// A pass of a film.
fn pass(film: u64, part: Part) -> Pass {
    Pass { film, whole: ViewRequest::from(view(SAMPLES)), part }
}

/// Adds a pass that a worker has rendered.
async fn add(still: &mut StillFilm, pass: Pass) -> Added {
    let number = still.frames().count() as u64;
    still.add(pass, frame(number, &pass.request().rendered())).await.unwrap()
}

async fn add_samples(still: &mut StillFilm, first: u32, samples: u32) -> Option<FinishedFrame> {
    match add(still, pass(1, Part::Samples { first, samples })).await {
        Added::Samples { frame, progress } => {
            assert!(progress.samples == first + samples && !progress.is_denoised);
            frame.map(|frame| *frame)
        }
        Added::Guide => panic!("samples are no guide"),
    }
}

async fn add_guides(still: &mut StillFilm) {
    for shading in GUIDES {
        assert!(matches!(add(still, pass(1, Part::Guide(shading))).await, Added::Guide));
    }
}

/// What one process shows after a number of samples, filtered.
fn denoised(samples: u32) -> Vec<u8> {
    let whole = ViewRequest::from(view(samples));
    let [albedo, normals, depth] = GUIDES.map(|shading| {
        let FrameView { width, height, .. } = whole.view;
        let bytes = rendered(&whole.auxiliary(shading).view);
        let numbers = bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
        LinearImage { width, height, pixels: numbers.collect() }
    });
    let bytes = rendered(&FrameView { format: PixelFormat::Sums, ..whole.view });
    let sums: Vec<PixelSums> = bytes.as_chunks().0.iter().map(PixelSums::from_bytes).collect();
    let guides = Guides::new(&albedo, &normals, &depth).unwrap();
    develop_denoised(&whole.view, samples, &sums, &guides).unwrap()
}

/// Pictures that follow until none is being developed: samples, whether they are denoised, and pixels.
async fn developed(still: &mut StillFilm) -> Vec<(u32, bool, Vec<u8>)> {
    let mut pictures = Vec::new();
    while still.is_developing() {
        // What a former film or setting leaves behind is no picture.
        let Ok(picture) = tokio::time::timeout(Duration::from_secs(1), still.developed()).await else {
            break;
        };
        let samples = picture.progress.samples;
        assert_eq!(picture.frame.view, view(samples));
        pictures.push((samples, picture.progress.is_denoised, picture.frame.pixels.to_vec()));
    }
    pictures
}

#[tokio::test]
async fn a_denoised_picture_is_that_of_all_samples_at_once_and_the_film_keeps_its_noise() {
    let mut still = StillFilm::new(true);
    let first = add_samples(&mut still, 0, 1).await.unwrap();
    assert_eq!(*first.pixels, *rendered(&view(1)), "one sample has no estimate of its noise");
    add_guides(&mut still).await;
    assert!(!still.is_developing());
    for (first, samples) in [(1, 1), (2, 2), (4, 4)] {
        assert!(add_samples(&mut still, first, samples).await.is_none(), "no pass waits for the filter");
        let end = first + samples;
        let picture = denoised(end);
        assert_ne!(picture, rendered(&view(end)));
        assert_eq!(developed(&mut still).await, [(end, true, picture)]);
    }
    assert_eq!(still.frames().count(), 4 + GUIDES.len());
    // Without the filter the picture is the film's.
    still.set_denoised(false);
    assert_eq!(developed(&mut still).await, [(8, false, rendered(&view(8)))]);
    let next = add_samples(&mut still, 8, 8).await.unwrap();
    assert_eq!(*next.pixels, *rendered(&view(16)));
    still.set_denoised(true);
    assert_eq!(developed(&mut still).await, [(16, true, denoised(16))]);
}

#[tokio::test]
async fn passes_that_arrive_while_a_picture_is_filtered_share_the_next_one() {
    let mut still = StillFilm::new(true);
    add_samples(&mut still, 0, 1).await;
    add_guides(&mut still).await;
    for (first, samples) in [(1, 1), (2, 2), (4, 4), (8, 8)] {
        assert!(add_samples(&mut still, first, samples).await.is_none());
    }
    let pictures = developed(&mut still).await;
    assert_eq!(pictures, [(2, true, denoised(2)), (16, true, denoised(16))], "two filters for four passes");
}

#[tokio::test]
async fn guides_that_arrive_later_filter_the_newest_picture() {
    let mut still = StillFilm::new(false);
    for (first, samples) in [(0, 1), (1, 1), (2, 2)] {
        assert!(add_samples(&mut still, first, samples).await.is_some());
    }
    still.set_denoised(true);
    assert!(!still.is_developing(), "there are no guides");
    assert!(add_samples(&mut still, 4, 4).await.is_some());
    add_guides(&mut still).await;
    assert_eq!(developed(&mut still).await, [(8, true, denoised(8))]);
}

#[tokio::test]
async fn pictures_of_a_former_film_or_setting_are_dropped() {
    let filtering = || async {
        let mut still = StillFilm::new(true);
        add_samples(&mut still, 0, 1).await;
        add_guides(&mut still).await;
        add_samples(&mut still, 1, 1).await;
        assert!(still.is_developing());
        still
    };
    let mut still = filtering().await;
    still.clear();
    assert!(developed(&mut still).await.is_empty() && still.frames().next().is_none());

    let mut still = filtering().await;
    let other = add(&mut still, pass(2, Part::Samples { first: 0, samples: 1 })).await;
    assert!(matches!(other, Added::Samples { frame: Some(_), .. }));
    assert!(developed(&mut still).await.is_empty());

    let mut still = filtering().await;
    still.set_denoised(false);
    assert_eq!(developed(&mut still).await, [(2, false, rendered(&view(2)))]);
}

#[tokio::test]
async fn wrong_guides_are_refused() {
    for part in [Part::Guide(GUIDES[1]), Part::Samples { first: 2, samples: 2 }] {
        let mut still = StillFilm::new(true);
        add_samples(&mut still, 0, 1).await;
        let pass = pass(1, part);
        assert!(still.add(pass, frame(1, &pass.request().rendered())).await.is_err(), "{part:?} is not next");
        assert!(still.frames().next().is_none(), "the film is dropped");
    }
    let mut still = StillFilm::new(true);
    add_samples(&mut still, 0, 1).await;
    let albedo = pass(1, Part::Guide(GUIDES[0]));
    let moved = FrameView { spin: 1.0, ..albedo.request().view };
    assert!(still.add(albedo, frame(1, &moved)).await.is_err());
    assert!(alone(&albedo, frame(1, &albedo.request().view)).is_err(), "a guide is no picture");
}

#[test]
fn a_filter_brings_few_samples_nearer_to_many() {
    let picture = |pixels| RgbImage { width: view(1).width, height: view(1).height, pixels };
    let converged = picture(rendered(&view(1024)));
    let rmse = |pixels| image::compare(&converged, &picture(pixels)).unwrap().rmse;
    let (noisy, filtered) = (rmse(rendered(&view(4))), rmse(denoised(4)));
    assert!(filtered < noisy, "{filtered}, without the filter {noisy}");
}
